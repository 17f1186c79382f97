//! Does every Velodyne and Hesai model give back what was written into its packets, and survive any
//! bytes?

#[path = "support/families.rs"]
mod families;

use families::{Writer, packet, unit_files, writers};
use lidar_deflect_core::cloud::{Return, ReturnKind};
use lidar_deflect_core::packet::echoes::RawEcho;
use lidar_deflect_core::packet::hesai::qt128;
use lidar_deflect_core::packet::unit::UnitFile;
use lidar_deflect_core::packet::{Decoded, MODELS, Model, Place, ReturnMode, claimants};
use lidar_deflect_core::time::Timestamp;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MUTATIONS: usize = 100_000;

fn decode(writer: &Writer, payload: &[u8], out: &mut Decoded) {
    let head = writer.model.head(payload).unwrap();
    let place = Place {
        time: Timestamp(head.device_ns),
        packet: 7,
        mean_rate_rad_per_ns: 0.0,
    };
    let files = unit_files(writer.model.id());
    let mut decoder = writer.model.fit(&files).unwrap().decoder;
    decoder.decode(payload, place, out);
}

/// Metres of one unit of range.
fn unit_m(id: &str) -> f64 {
    match id {
        "vlp16" | "vlp16-hires" | "hdl32e" | "hdl64e-s2" | "hdl64e" => 0.002,
        "xt32m2x" => 0.005,
        _ => 0.004,
    }
}

/// Whether a point lies where its own range and azimuth say: level and height make up the range.
fn assert_consistent(id: &str, echo: &Return) {
    let [x, y, z] = echo.xyz_m.map(f64::from);
    let range_m = f64::from(echo.range_m);
    // Velodyne beams start up to 35 mm above or below the origin.
    let found_m = (x * x + y * y + z * z).sqrt();
    assert!((found_m - range_m).abs() < 0.04, "{id}: {echo:?}");
    let azimuth_rad = f64::from(echo.azimuth_rad);
    let is_velodyne = id.starts_with("vl") || id.starts_with("hdl");
    let stated = if is_velodyne {
        (-y).atan2(x)
    } else {
        x.atan2(y)
    };
    let off_rad = (stated - azimuth_rad).rem_euclid(std::f64::consts::TAU);
    let off_rad = off_rad.min(std::f64::consts::TAU - off_rad);
    assert!(off_rad < 1e-5, "{id}: off by {off_rad} rad: {echo:?}");
}

fn raw() -> impl Strategy<Value = RawEcho> {
    let range = prop_oneof![1 => Just(0), 4 => 100..60_000_u16];
    (range, any::<u8>()).prop_map(|(range, intensity)| RawEcho { range, intensity })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn what_is_written_comes_back(echoes in prop::collection::vec(raw(), 1300), number in 1..1_000_000_u32) {
        for writer in writers() {
            for mode in writer.modes {
                check(&writer, *mode, number, &echoes);
            }
        }
    }
}

fn check(writer: &Writer, mode: ReturnMode, number: u32, echoes: &[RawEcho]) {
    let id = writer.model.id();
    let (blocks, channels) = writer.size;
    let echo = |block: usize, channel: usize| {
        // Two of three second returns differ from the first.
        let block = if channel.is_multiple_of(3) {
            block / mode.returns() * mode.returns()
        } else {
            block
        };
        echoes[(block * channels + channel) % echoes.len()]
    };
    let sent = packet(writer, mode, number, echo);
    let payload = (writer.encode)(&sent);
    assert!(
        claimants(&payload).any(|model| model.id() == id),
        "{id} does not claim its packet"
    );
    let head = writer.model.head(&payload).unwrap();
    assert_eq!(head.return_mode, mode, "{id}");
    if let (Some(found), Some(bits)) = (head.sequence, writer.model.counting().sequence_bits) {
        assert_eq!(
            u64::from(found),
            u64::from(sent.sequence) % (1 << bits),
            "{id}"
        );
    }
    let wrap_ns = writer.model.counting().clock_wrap_ns.unwrap_or(i64::MAX);
    let off_ns = (head.device_ns - sent.time.0 % wrap_ns).abs();
    assert!(off_ns < 2_300_000, "{id}: {off_ns} ns off");

    let mut out = Decoded::default();
    decode(writer, &payload, &mut out);
    let tally = writer.model.tally(&payload);
    assert_eq!(
        (out.cloud.len(), out.merged),
        (tally.points as usize, u64::from(tally.merged)),
        "{id}"
    );
    let used = if id == "vls128" && mode == ReturnMode::Dual {
        8
    } else {
        blocks
    };
    let used = used / mode.returns() * mode.returns();
    let all = (0..used).flat_map(|block| (0..channels).map(move |channel| (block, channel)));
    let written = all
        .filter(|(block, channel)| echo(*block, *channel).range != 0)
        .count() as u64;
    assert_eq!(
        out.cloud.len() as u64 + out.merged,
        written,
        "{id} {mode:?}"
    );
    for found in out.cloud.iter() {
        assert_consistent(id, &found);
        let units = f64::from(found.range_m) / unit_m(id);
        let block = if id == "ft120" {
            0
        } else {
            usize::from(found.block)
        };
        let wanted = |channel: usize| {
            let sent = echo(block, channel);
            (f64::from(sent.range) - units).abs() < 0.01
                && (id.starts_with("hdl64e") || u16::from(sent.intensity) == found.intensity)
        };
        // Hesai rings are the channels; Velodyne's count from the lowest.
        let ring = usize::from(found.ring);
        let is_there = if id.starts_with("vl") || id.starts_with("hdl") {
            (0..channels).any(wanted)
        } else {
            wanted(ring)
        };
        assert!(is_there, "{id} {mode:?}: {found:?}");
    }
}

#[test]
fn the_meaning_of_two_returns_does_not_depend_on_their_order() {
    for writer in writers()
        .iter()
        .filter(|writer| writer.modes.contains(&ReturnMode::Dual))
    {
        for is_far_first in [true, false] {
            let echo = |block: usize, _| RawEcho {
                range: if block.is_multiple_of(2) == is_far_first {
                    9_000
                } else {
                    4_000
                },
                intensity: 30,
            };
            let payload = (writer.encode)(&packet(writer, ReturnMode::Dual, 3, echo));
            let mut out = Decoded::default();
            decode(writer, &payload, &mut out);
            for found in out.cloud.iter() {
                let is_far = f64::from(found.range_m) > 6_000.0 * unit_m(writer.model.id());
                let kind = if is_far {
                    ReturnKind::Last
                } else {
                    ReturnKind::Strongest
                };
                assert_eq!(found.return_kind, kind, "{}", writer.model.id());
            }
            assert!(!out.cloud.is_empty());
        }
    }
}

/// Everything that may be asked of a payload.
fn ask_everything(
    writer: &Writer,
    decoder: &mut dyn lidar_deflect_core::packet::Decoder,
    payload: &[u8],
    out: &mut Decoded,
) {
    let model = writer.model;
    let _ = (
        model.recognise(payload),
        model.fits(payload),
        model.misfit(payload),
        model.is_sure(payload),
    );
    if let Some(mut gather) = model.gather() {
        gather.take(payload);
        assert!(gather.file().is_none());
    }
    if let Some(head) = model.head(payload) {
        let _ = (
            head.paced(1e-8),
            head.arcs().count(),
            head.next_azimuth_rad(),
        );
    }
    out.clear();
    let merged = out.merged;
    let place = Place {
        time: Timestamp(i64::MAX - 5),
        packet: u32::MAX,
        mean_rate_rad_per_ns: 1e-8,
    };
    decoder.decode(payload, place, out);
    let tally = model.tally(payload);
    if !matches!(model.id(), "at128") {
        // An encoder outside of all fields of the AT128 is known to its decoder alone.
        assert_eq!(out.cloud.len(), tally.points as usize, "{}", model.id());
        assert_eq!(out.merged - merged, u64::from(tally.merged));
    }
    for echo in out.cloud.iter() {
        assert!(
            echo.xyz_m.iter().all(|metres| metres.is_finite()),
            "{echo:?}"
        );
    }
}

fn sample(writer: &Writer, mode: ReturnMode) -> Vec<u8> {
    let echo = |block: usize, channel: usize| RawEcho {
        range: (1_000 + 37 * block + 11 * channel) as u16,
        intensity: channel as u8,
    };
    (writer.encode)(&packet(writer, mode, 9, echo))
}

#[test]
fn every_prefix_of_every_packet_is_survived() {
    let mut out = Decoded::default();
    for writer in writers() {
        let files = unit_files(writer.model.id());
        let mut decoder = writer.model.fit(&files).unwrap().decoder;
        for mode in writer.modes {
            let whole = sample(&writer, *mode);
            for length in 0..whole.len() {
                ask_everything(&writer, &mut *decoder, &whole[..length], &mut out);
                let known = MODELS
                    .iter()
                    .find(|model| model.recognise(&whole[..length]).is_some());
                // Without its sequence number a packet of the old models is another packet of them.
                let is_shorter =
                    writer.model.id().starts_with("pandar") && whole.len() - length <= 10;
                assert!(
                    known.is_none() || is_shorter,
                    "{length} bytes are {known:?}"
                );
            }
        }
    }
}

fn survive(family: &str, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut out = Decoded::default();
    let is_velodyne = |writer: &Writer| writer.model.title().starts_with("Velodyne");
    let own: Vec<Writer> = writers()
        .into_iter()
        .filter(|w| is_velodyne(w) == (family == "velodyne"))
        .collect();
    let mut decoders: Vec<_> = own
        .iter()
        .map(|writer| {
            writer
                .model
                .fit(&unit_files(writer.model.id()))
                .unwrap()
                .decoder
        })
        .collect();
    let samples: Vec<Vec<Vec<u8>>> = own
        .iter()
        .map(|writer| {
            writer
                .modes
                .iter()
                .map(|mode| sample(writer, *mode))
                .collect()
        })
        .collect();
    for round in 0..MUTATIONS {
        let place = round % own.len();
        let modes = &samples[place];
        let mut payload = modes[round / own.len() % modes.len()].clone();
        for _ in 0..random.random_range(1..40) {
            // Headers and tails matter more than echoes.
            let at = match random.random_range(0..3) {
                0 => random.random_range(0..26),
                1 => payload.len() - 1 - random.random_range(0..60),
                _ => random.random_range(0..payload.len()),
            };
            payload[at] = random.random();
        }
        ask_everything(&own[place], &mut *decoders[place], &payload, &mut out);
    }
}

#[test]
fn changed_bytes_of_velodyne_are_survived() {
    survive("velodyne", 1);
}

#[test]
fn changed_bytes_of_hesai_are_survived() {
    survive("hesai", 2);
}

#[test]
fn only_an_atx_numbers_its_frames() {
    for writer in writers() {
        let mut sent = packet(&writer, writer.modes[0], 3, |_, _| RawEcho::default());
        sent.operation = 201;
        let wanted = (writer.model.id() == "atx").then_some(201);
        let payload = (writer.encode)(&sent);
        assert_eq!(writer.model.frame_id(&payload), wanted);
    }
}

/// A firing a block; block 0 is of the first loop, block 1 of the second.
fn qt128_single(channels: usize, echo: impl Fn(usize, usize) -> RawEcho) -> Vec<u8> {
    let writer = writers().into_iter().find(|w| w.model.id() == "qt128");
    let writer = Writer {
        size: (2, channels),
        ..writer.unwrap()
    };
    qt128::writer(channels).encode(&packet(&writer, ReturnMode::Last, 5, echo))
}

fn qt128_returns(payload: &[u8], files: &[UnitFile]) -> (Vec<Return>, Decoded) {
    let mut out = Decoded::default();
    let place = Place {
        time: Timestamp(qt128::QT128.head(payload).unwrap().device_ns),
        packet: 0,
        mean_rate_rad_per_ns: 0.0,
    };
    let mut decoder = qt128::QT128.fit(files).unwrap().decoder;
    decoder.decode(payload, place, &mut out);
    (out.cloud.iter().collect(), out)
}

/// Laser of a channel of each loop.
fn chosen(block: usize, channel: usize) -> usize {
    if block == 0 { 127 - channel } else { channel }
}

fn chosen_file() -> UnitFile {
    let row = |channel| format!("{},{}\n", chosen(0, channel) + 1, chosen(1, channel) + 1);
    let rows: String = (0..80).map(row).collect();
    let head = "EEFF,1,1\nLaserNum,80,BlockNum,2\nLoop1,Loop2\n";
    UnitFile::new("channels.csv", format!("{head}{rows}3142432,,,\n"))
}

#[test]
fn a_choice_of_lasers_gives_the_points_that_all_lasers_give() {
    let echo = |block: usize, laser: usize| RawEcho {
        range: (2_000 + 300 * block + laser) as u16,
        intensity: laser as u8,
    };
    let (all, _) = qt128_returns(&qt128_single(128, echo), &[]);
    let payload = qt128_single(80, |block, channel| echo(block, chosen(block, channel)));
    assert!(claimants(&payload).any(|model| model.id() == "qt128"));
    let (found, _) = qt128_returns(&payload, &[chosen_file()]);
    assert_eq!(found.len(), 160);
    for (place, point) in found.iter().enumerate() {
        let (block, laser) = (place / 80, chosen(place / 80, place % 80));
        assert_eq!(*point, all[128 * block + laser]);
        assert_eq!(usize::from(point.ring), laser);
    }
}

#[test]
fn a_choice_that_nothing_tells_gives_no_points_and_says_so() {
    let echo = |_, _| RawEcho {
        range: 2_000,
        intensity: 1,
    };
    let payload = qt128_single(80, echo);
    let (found, out) = qt128_returns(&payload, &[]);
    assert_eq!((found.len(), out.drops.count("channels_unknown")), (0, 2));
    assert!(qt128::QT128.remarks(&payload)[0].contains("80 channels"));
    assert!(qt128::QT128.remarks(&qt128_single(128, echo)).is_empty());
    let (found, _) = qt128_returns(&qt128_single(79, echo), &[chosen_file()]);
    assert!(found.is_empty());
}
