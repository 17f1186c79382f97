//! ATX: a mirror scans the field of view frame by frame (protocol 4.7).
//!
//! Even and odd frames have azimuths and firing times of their own. One sweep is an even and an odd frame.
//!
//! Source: the maker's development kit; the packet's fine azimuth byte is there or not by its size.

use std::f64::consts::PI;
use std::sync::LazyLock;

use super::dat::{self, Cursor};
use super::layout::{self, Header, Layout, Tail, View, flag};
use super::rotating::{Family, Firing, Rotating, firings, ray};
use super::unit::{FireTimes, OBTAIN, Unit};
use crate::error::UnitError;
use crate::packet::fan::{Beam, Desk, Fan};
use crate::packet::unit::{Calibration, Fitted, UnitFile};
use crate::packet::{Decoded, Decoder, Place, ReturnMode};

/// Channels of the model.
const CHANNELS: usize = 100;
const ECHO_LEN: usize = 4;
const FRAME_ID: usize = 10;
const SPEED: usize = 18;
/// Blocks are taken to follow each other like this: 0.1 degree of 120 at ten frames a second.
const FIRING_NS: i64 = 83_333;
/// Radians of one unit of the azimuth.
const RAD_PER_UNIT: f64 = PI / 180.0 / 256.0;

/// Packets without the fine part of the azimuth.
const FRAME: layout::Frame = layout::Frame {
    block_head: 2,
    crc_len: 4,
    tail_len: 32,
    fields: Tail {
        azimuth_state: None,
        operation: Some(FRAME_ID),
        return_mode: 24,
        speed: SPEED,
        speed_rpm: 1.0,
        date: Some(26),
        micros: 20,
        sequence: 32,
        sequence_len: 4,
    },
};
/// Packets with it.
const FINE: layout::Frame = layout::Frame {
    block_head: 3,
    ..FRAME
};

/// Elevation, azimuth of even frames, azimuth of odd frames and their firing times.
static NOMINAL: LazyLock<Unit> =
    LazyLock::new(|| Unit::built_in("atx", include_str!("tables/atx.csv")));

/// ATX.
pub static ATX: Rotating<Atx> = Rotating(Atx);

/// The model.
#[derive(Debug, Clone, Copy)]
pub struct Atx;

fn is_odd(view: &View<'_>) -> bool {
    view.operation() & 1 == 1
}

impl Family for Atx {
    fn id(&self) -> &'static str {
        "atx"
    }

    fn title(&self) -> &'static str {
        "Hesai ATX"
    }

    fn layout(&self, payload: &[u8]) -> Option<Layout> {
        let header = Header::new(payload).filter(|header| header.protocol == (4, 7))?;
        let sizes = [FRAME, FINE].map(|frame| frame.layout(&header, ECHO_LEN));
        let is_own = header.blocks > 0 && header.lasers == CHANNELS;
        let found = sizes.into_iter().find(|layout| layout.len == payload.len());
        found.filter(|_| is_own)
    }

    fn nominal(&self) -> &'static Unit {
        &NOMINAL
    }

    fn block_ns(&self, view: &View<'_>, block: usize) -> i64 {
        FIRING_NS * (block / view.return_mode().returns()) as i64
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        (2 / mode.returns().min(2)) as i64 * FIRING_NS
    }

    fn duration_ns(&self, view: &View<'_>) -> i64 {
        (view.layout().blocks / view.return_mode().returns()) as i64 * FIRING_NS
    }

    fn azimuth_rad(&self, view: &View<'_>, block: usize) -> Option<f64> {
        Some(f64::from(view.azimuth(block)) * RAD_PER_UNIT)
    }

    /// Even frames are the first half of a turn, odd ones the second.
    fn encoder_rad(&self, view: &View<'_>, block: usize) -> Option<f64> {
        let share = f64::from(view.azimuth(block)) / 65_536.0;
        Some((f64::from(u8::from(is_odd(view))) + share) * PI)
    }

    fn rate_rad_per_ns(&self, _view: &View<'_>) -> f64 {
        0.0
    }

    /// Starts again after 256 frames.
    fn frame_id(&self, view: &View<'_>) -> Option<u32> {
        Some(view.operation().into())
    }

    /// Even and odd frames have angles of their own, for which the text files have no room.
    fn takes_angle_text(&self) -> bool {
        false
    }

    fn takes_binary(&self, file: &UnitFile) -> bool {
        matches!(dat::version(file), Some((4, 1..=3)))
    }

    fn fit_binary(&self, files: &[UnitFile]) -> Option<Result<Fitted, UnitError>> {
        let file = files.iter().find(|file| self.takes_binary(file));
        let fit = || {
            let angles = file.map_or_else(|| Ok(Angles::nominal()), Angles::read)?;
            let used: Vec<&UnitFile> = file.into_iter().collect();
            let nominal = Calibration::Nominal { obtain: OBTAIN };
            let (unit, _) = NOMINAL.clone().with(files)?;
            let times = ["even", "odd"].map(|name| unit.fire(name).cloned().unwrap_or_default());
            Ok(Fitted {
                decoder: Box::new(AtxDecoder::new(angles, times)),
                calibration: Calibration::of(&used, nominal),
            })
        };
        Some(fit())
    }

    fn template(&self) -> Vec<u8> {
        let header = Header {
            protocol: (4, 7),
            version: 0,
            lasers: CHANNELS,
            blocks: 2,
            unit_mm: 4,
            returns: 1,
            flags: flag::SEQUENCE,
        };
        FRAME.template(&header, ECHO_LEN)
    }
}

/// Angles of one unit, radians.
#[derive(Debug, Clone, PartialEq)]
struct Angles {
    elevation: Vec<(f64, f64)>,
    /// Of even and of odd frames.
    azimuth_rad: [Vec<f64>; 2],
}

impl Angles {
    fn nominal() -> Self {
        let odd = NOMINAL.fire("azimuthodd").cloned().unwrap_or_default();
        let odd_deg = odd.iter().map(|value| value.unwrap_or(0.0) / 1000.0);
        Self {
            elevation: NOMINAL
                .elevation_rad
                .iter()
                .map(|angle| angle.sin_cos())
                .collect(),
            azimuth_rad: [
                NOMINAL.azimuth_rad.clone(),
                odd_deg.map(f64::to_radians).collect(),
            ],
        }
    }

    fn read(file: &UnitFile) -> Result<Self, UnitError> {
        let mut bytes = Cursor::new(file, 3);
        let minor = bytes.u8()?;
        if minor == 3 {
            return Err(file.refuse(
                None,
                "version 4.1 or 4.2",
                "4.3, whose corrections are not known",
            ));
        }
        bytes.u16()?; // reserved
        let channels = usize::from(bytes.u8()?);
        let division = f64::from(bytes.u16()?);
        if channels != CHANNELS || division == 0.0 {
            let expected = format!("{CHANNELS} channels and a division of angles");
            return Err(file.refuse(None, expected, format!("{channels} and {division}")));
        }
        let mut angles = || -> Result<Vec<f64>, UnitError> {
            let raw = bytes.i16s(channels)?;
            Ok(raw
                .iter()
                .map(|raw| (raw / division).to_radians())
                .collect())
        };
        let even = angles()?;
        let odd = if minor == 1 { even.clone() } else { angles()? };
        let elevation = angles()?.iter().map(|angle| angle.sin_cos()).collect();
        Ok(Self {
            elevation,
            azimuth_rad: [even, odd],
        })
    }

    /// Beams of the channels, azimuths after the block's.
    fn beams(&self, scan: &Scan, times: &FireTimes) -> impl Iterator<Item = Beam> {
        let azimuths = &self.azimuth_rad[usize::from(scan.is_odd)];
        let angles = azimuths.iter().zip(&self.elevation).zip(times);
        let shift_rad_per_ns = scan.shift_rad_per_ns;
        angles
            .enumerate()
            .map(move |(channel, ((azimuth_rad, elevation), delay_ns))| {
                let delay_ns = delay_ns.unwrap_or(0.0);
                let azimuth_rad = azimuth_rad + delay_ns * shift_rad_per_ns;
                ray(channel, azimuth_rad, *elevation, delay_ns)
            })
    }
}

/// What the frames differ in.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Scan {
    is_odd: bool,
    /// Turn of the mirror while a channel waits.
    shift_rad_per_ns: f64,
}

impl Scan {
    fn of(view: &View<'_>) -> Self {
        let is_odd = is_odd(view);
        // Degrees are nanoseconds x speed x 1e-9 / 8, forth in even frames and back in odd ones.
        let shift_rad_per_ns = (view.rpm().abs() * 1e-9 / 8.0).to_radians();
        Self {
            is_odd,
            shift_rad_per_ns: if is_odd {
                -shift_rad_per_ns
            } else {
                shift_rad_per_ns
            },
        }
    }
}

struct AtxDecoder {
    angles: Angles,
    /// Of even and of odd frames.
    times: [FireTimes; 2],
    /// The beams of both as they were last.
    fans: [(Option<Scan>, Fan); 2],
    desk: Desk,
}

impl AtxDecoder {
    fn new(angles: Angles, times: [FireTimes; 2]) -> Self {
        Self {
            angles,
            times,
            fans: Default::default(),
            desk: Desk::default(),
        }
    }

    /// Brings the beams of even or of odd frames to a speed.
    fn aim(&mut self, scan: Scan) {
        let (known, fan) = &mut self.fans[usize::from(scan.is_odd)];
        if *known != Some(scan) {
            let times = &self.times[usize::from(scan.is_odd)];
            fan.set(self.angles.beams(&scan, times));
            *known = Some(scan);
        }
    }
}

impl Decoder for AtxDecoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let view = Atx
            .layout(payload)
            .and_then(|layout| View::new(payload, layout));
        let Some(view) = view else {
            return out.drops.add("packet_size", 1);
        };
        let scan = Scan::of(&view);
        self.aim(scan);
        let (_, fan) = &self.fans[usize::from(scan.is_odd)];
        let left_over = view.layout().blocks % view.return_mode().returns();
        out.drops.add("block_invalid", left_over as u64);
        for first in firings(&view) {
            let firing = Firing {
                first,
                encoder_rad: Atx.encoder_rad(&view, first).unwrap_or_default(),
                azimuth_rad: f64::from(view.azimuth(first)) * RAD_PER_UNIT,
                time: place.time + Atx.block_ns(&view, first),
                least_range: 1,
                packet: place.packet,
            };
            firing.place(&view, fan, None, &mut self.desk, out);
        }
        self.desk.flush(out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_of_both_minors_is_read() {
        for minor in [1_u8, 2] {
            let mut bytes = vec![0xEE, 0xFF, 4, minor, 0, 0, 100];
            bytes.extend(256_u16.to_le_bytes());
            let rows = if minor == 1 { 2 } else { 3 };
            for row in 0..rows {
                (0..100_i16).for_each(|channel| bytes.extend((256 * row + channel).to_le_bytes()));
            }
            bytes.extend([0; 32]);
            let angles = Angles::read(&UnitFile::new("atx.dat", bytes)).unwrap();
            let odd_deg = if minor == 1 { 0.0 } else { 1.0 };
            assert!((angles.azimuth_rad[1][0].to_degrees() - odd_deg).abs() < 1e-12);
            let elevation_rad = angles.elevation[0].0.asin();
            assert!((elevation_rad.to_degrees() - f64::from(rows - 1)).abs() < 1e-9);
        }
    }

    #[test]
    fn corrections_that_are_not_known_are_refused() {
        let mut bytes = vec![0xEE, 0xFF, 4, 3];
        bytes.extend([0; 100]);
        assert!(Angles::read(&UnitFile::new("atx.dat", bytes)).is_err());
    }

    #[test]
    fn firing_times_of_a_file_are_taken_in_nanoseconds() {
        let rows: String = (1..=CHANNELS)
            .map(|n| format!("{n},{n},{}\n", 2 * n))
            .collect();
        let text = format!("Channel,Even_fire time(ns),Odd_fire time(ns)\n{rows}");
        let file = UnitFile::new("times", text);
        assert!(crate::packet::Model::takes(&ATX, &file));
        let (unit, _) = NOMINAL.clone().with(&[file]).unwrap();
        assert_eq!(unit.fire("odd").unwrap()[2], Some(6.0));
        assert_eq!(unit.fire("azimuthodd"), NOMINAL.fire("azimuthodd"));
    }
}
