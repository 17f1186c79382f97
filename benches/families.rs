//! How fast do the packets of every family become points, against those of a VLP-16?
//!
//! `cargo bench --bench families [-- NAME]`: packets in memory, every shot with all its echoes, one thread, all columns.
//! The jobs take turns; of each the fastest run counts, which is short enough to be undisturbed now and then even
//! on a busy machine.

#[path = "../rust/core/tests/support/families.rs"]
mod families;
#[path = "../rust/core/tests/support/leishen.rs"]
mod leishen;
#[path = "../rust/core/tests/support/still.rs"]
mod still;

use std::hint::black_box;
use std::time::Instant;

use lidar_deflect_core::packet::echoes::RawEcho;
use lidar_deflect_core::packet::leishen::{mirror, products};
use lidar_deflect_core::packet::unit::UnitFile;
use lidar_deflect_core::packet::writer::{Echo, Pace, Row, Shots, WRITERS, WriterRef};
use lidar_deflect_core::packet::{Decoded, Decoder, Model, ModelRef, Place, ReturnMode};
use lidar_deflect_core::time::Timestamp;

const PACKETS: usize = 100;
const ROUNDS: usize = 60;
/// What the others are held against.
const YARDSTICK: &str = "vlp16";
/// Ten turns a second, radians per nanosecond.
const RATE: f64 = std::f64::consts::TAU * 1e-8;
const START: Timestamp = Timestamp(1_718_000_000_000_000_000);

/// One job: packets of a model.
struct Job {
    name: String,
    model: ModelRef,
    files: Vec<UnitFile>,
    sent: Vec<Vec<u8>>,
}

impl Job {
    fn points(&self) -> u64 {
        let points = |payload: &Vec<u8>| u64::from(self.model.tally(payload).points);
        self.sent.iter().map(points).sum()
    }
}

/// A job and its fastest run.
struct Timed {
    job: Job,
    decoder: Box<dyn Decoder>,
    points: u64,
    best_s: f64,
}

impl Timed {
    fn new(job: Job) -> Self {
        Self {
            decoder: job.model.fit(&job.files).expect("a unit").decoder,
            points: job.points(),
            best_s: f64::INFINITY,
            job,
        }
    }

    fn run(&mut self, out: &mut Decoded) {
        let begun = Instant::now();
        for (packet, payload) in (0..).zip(&self.job.sent) {
            out.clear();
            let place = Place {
                time: START,
                packet,
                mean_rate_rad_per_ns: RATE,
            };
            self.decoder.decode(black_box(payload), place, out);
        }
        self.best_s = self.best_s.min(begun.elapsed().as_secs_f64());
    }

    fn ns_per_point(&self) -> f64 {
        1e9 * self.best_s / self.points as f64
    }
}

fn echo(shot: usize) -> Echo {
    Echo {
        range_m: 5.0 + 0.03 * (shot % 997) as f64,
        intensity: (shot % 251) as u8,
    }
}

/// Packets with single returns, as the simulator writes them.
fn simulated(writer: WriterRef) -> Job {
    let step_ns = match writer.pace() {
        Pace::Clock(step_ns) => step_ns,
        Pace::Encoder(rows) => 1e8 / f64::from(rows),
    };
    let row = |packet: usize, row: usize| {
        let after_ns = (row as f64 * step_ns) as i64;
        let turned = RATE * step_ns * (packet * writer.rows() + row) as f64;
        Row {
            after_ns,
            azimuth_rad: turned % std::f64::consts::TAU,
            echoes: (0..writer.channels()).map(|k| echo(k + 61 * row)).collect(),
        }
    };
    let shots = |packet: usize| Shots {
        time: START + (packet as f64 * writer.rows() as f64 * step_ns) as i64,
        sequence: packet as u32,
        rate_rad_per_ns: RATE,
        rows: (0..writer.rows())
            .map(|number| row(packet, number))
            .collect(),
    };
    Job {
        name: writer.id().to_owned(),
        model: writer.model(),
        files: writer.files(),
        sent: (0..PACKETS)
            .map(|packet| writer.write(&shots(packet)))
            .collect(),
    }
}

/// One and two returns of every shot, of the models whose packets tests write in all modes.
fn in_modes() -> impl Iterator<Item = Job> {
    families::writers().into_iter().flat_map(|writer| {
        let modes = [ReturnMode::Strongest, ReturnMode::Dual].into_iter();
        let able = modes.filter(|mode| writer.modes.contains(mode));
        able.map(|mode| written(&writer, mode)).collect::<Vec<_>>()
    })
}

fn written(writer: &families::Writer, mode: ReturnMode) -> Job {
    let echo = |block: usize, channel: usize| RawEcho {
        range: (2_000 + 800 * (block % 2) + 7 * channel) as u16,
        intensity: channel as u8,
    };
    let packet = |number| (writer.encode)(&families::packet(writer, mode, number, echo));
    let id = writer.model.id();
    Job {
        name: format!("{id}{}", if mode.returns() > 1 { " dual" } else { "" }),
        model: writer.model,
        files: families::unit_files(id),
        sent: (0..PACKETS as u32).map(packet).collect(),
    }
}

/// Sensors without a rotor.
fn without_rotor() -> impl Iterator<Item = Job> {
    still::writers().into_iter().flat_map(|writer| {
        let seen = |shot: usize, echo: usize| still::Seen {
            range_m: (5 + shot + 20 * echo) as f64,
            yaw_rad: 0.01 * shot as f64,
            pitch_rad: 0.02,
            brightness: 7,
        };
        let job = |setting: &still::Setting| Job {
            name: setting.name.to_owned(),
            model: writer.model,
            files: writer.files.clone(),
            sent: (0..PACKETS as u32)
                .map(|number| (setting.encode)(number, &seen))
                .collect(),
        };
        writer.settings.iter().map(job).collect::<Vec<_>>()
    })
}

fn leishen() -> Vec<Job> {
    let c16 = products::MODELS.iter().find(|model| model.id() == "c16");
    let ch128 = mirror::MODELS.iter().find(|model| model.id() == "ch128x1");
    let (c16, ch128) = c16.zip(ch128).expect("models of the lists");
    let cx = |number| leishen::cx_packet(c16, ReturnMode::Strongest, number, 1_200_000);
    let ch = |number| leishen::ch_packet(ch128, 128, false, number);
    let job = |model: ModelRef, sent: Vec<Vec<u8>>| Job {
        name: model.id().to_owned(),
        model,
        files: Vec::new(),
        sent,
    };
    vec![
        job(c16, (0..PACKETS as i64).map(cx).collect()),
        job(ch128, (0..PACKETS).map(ch).collect()),
    ]
}

fn jobs() -> Vec<Job> {
    let mut jobs: Vec<Job> = in_modes().collect();
    let is_new = |writer: &&WriterRef| !jobs.iter().any(|job| job.name == writer.id());
    let simulated = WRITERS
        .iter()
        .filter(is_new)
        .map(|writer| simulated(*writer));
    let others: Vec<Job> = simulated.chain(leishen()).chain(without_rotor()).collect();
    jobs.extend(others);
    jobs
}

fn main() {
    let wanted = std::env::args()
        .skip(1)
        .find(|given| !given.starts_with("--"));
    let is_wanted = |name: &str| wanted.as_ref().is_none_or(|wanted| name.contains(wanted));
    let chosen = jobs()
        .into_iter()
        .filter(|job| job.name == YARDSTICK || is_wanted(&job.name));
    let mut timed: Vec<Timed> = chosen.map(Timed::new).collect();
    let mut out = Decoded::default();
    for _ in 0..ROUNDS {
        timed.iter_mut().for_each(|job| job.run(&mut out));
    }
    let yardstick = timed.iter().find(|timed| timed.job.name == YARDSTICK);
    let yardstick = yardstick.map_or(f64::NAN, Timed::ns_per_point);
    println!(
        "{:<20}{:>16}{:>12}",
        "packets", "million points/s", "x VLP-16"
    );
    for timed in &timed {
        let ns = timed.ns_per_point();
        println!(
            "{:<20}{:>16.1}{:>12.2}",
            timed.job.name,
            1e3 / ns,
            ns / yardstick
        );
    }
}
