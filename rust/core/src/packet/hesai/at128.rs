//! AT128: three mirrors scan one field of view in turn (protocol 4.1 and 4.3).
//!
//! The azimuth of a packet is that of the mirrors' encoder; the unit's binary file tells where each
//! mirror's field begins and ends, and corrects each channel along the field. One sweep is one field.
//!
//! Source: the maker's development kit. The channels' firing times shift their time, not their azimuth.

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

use super::dat::{self, Cursor};
use super::layout::{Frame, Header, Layout, Tail, View, flag};
use super::rotating::{Family, Firing, Rotating, firings, ray};
use super::unit::{FireTimes, Unit};
use crate::error::UnitError;
use crate::packet::fan::{Beam, Desk, Fan};
use crate::packet::unit::{Calibration, Fitted, UnitFile};
use crate::packet::{Decoded, Decoder, Place, ReturnMode};

const CHANNELS: usize = 128;
const BLOCKS: usize = 2;
const ECHO_LEN: usize = 4;
const FIRING_NS: i64 = 41_666;
/// Mirrors of the unit, and as many sweeps a turn of the encoder.
const MIRRORS: f64 = 3.0;
/// Where the first mirror's field begins, as a rule, degrees of the encoder.
const FIRST_FIELD_DEG: f64 = 23.07;
/// Corrections stand every two degrees of the encoder.
const ADJUSTS: usize = 180;
/// One degree of the file's angles.
const DEGREE: f64 = 25_600.0;
/// One degree of the file's corrections.
const ADJUST_DEGREE: f64 = 100.0;
const RAD_PER_FINE: f64 = PI / 18_000.0 / 256.0;

const FRAME: Frame = Frame {
    block_head: 3,
    crc_len: 4,
    tail_len: 32,
    fields: Tail {
        azimuth_state: None,
        operation: None,
        return_mode: 24,
        speed: 18,
        speed_rpm: 1.0,
        date: Some(26),
        micros: 20,
        sequence: 32,
        sequence_len: 4,
    },
};

static NOMINAL: LazyLock<Unit> =
    LazyLock::new(|| Unit::built_in("at128", include_str!("tables/at128.csv")));

/// AT128.
pub static AT128: Rotating<At128> = Rotating(At128);

/// The model.
#[derive(Debug, Clone, Copy)]
pub struct At128;

impl Family for At128 {
    fn id(&self) -> &'static str {
        "at128"
    }

    fn title(&self) -> &'static str {
        "Hesai AT128"
    }

    fn layout(&self, payload: &[u8]) -> Option<Layout> {
        let header = Header::new(payload)?;
        let is_own = matches!(header.protocol, (4, 1 | 3))
            && (header.lasers, header.blocks) == (CHANNELS, BLOCKS);
        let layout = FRAME.layout(&header, ECHO_LEN);
        (is_own && payload.len() == layout.len).then_some(layout)
    }

    fn nominal(&self) -> &'static Unit {
        &NOMINAL
    }

    fn block_ns(&self, view: &View<'_>, block: usize) -> i64 {
        let behind = match view.return_mode().returns() {
            1 => BLOCKS.saturating_sub(block),
            _ => 1,
        };
        -9_249 - FIRING_NS * behind as i64
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        (BLOCKS / mode.returns().min(BLOCKS)) as i64 * FIRING_NS
    }

    fn azimuth_rad(&self, view: &View<'_>, block: usize) -> Option<f64> {
        let fine = u32::from(view.azimuth(block)) << 8 | u32::from(view.fine_azimuth(block));
        (view.azimuth(block) < 36_000).then(|| f64::from(fine) * RAD_PER_FINE)
    }

    /// One field of a mirror is one turn.
    fn encoder_rad(&self, view: &View<'_>, block: usize) -> Option<f64> {
        let since_rad = self.azimuth_rad(view, block)? - FIRST_FIELD_DEG.to_radians();
        Some((since_rad * MIRRORS).rem_euclid(TAU)).filter(|turned| *turned < TAU)
    }

    /// The unit of the motor's speed differs between firmwares; the encoder tells it.
    fn rate_rad_per_ns(&self, _view: &View<'_>) -> f64 {
        0.0
    }

    fn takes_binary(&self, file: &UnitFile) -> bool {
        matches!(dat::version(file), Some((1, 3 | 5)))
    }

    fn fit_binary(&self, files: &[UnitFile]) -> Option<Result<Fitted, UnitError>> {
        let file = files.iter().find(|file| self.takes_binary(file));
        let fit = || {
            let (unit, calibration) = NOMINAL.clone().with(files)?;
            let (fields, calibration) = match file {
                Some(file) => (Fields::read(file)?, Calibration::of(&[file], calibration)),
                None => (Fields::of(&unit), calibration),
            };
            let times = unit.fire("fire").cloned().unwrap_or_default();
            Ok(Fitted {
                decoder: Box::new(At128Decoder::new(fields, times)),
                calibration,
            })
        };
        Some(fit())
    }

    fn template(&self) -> Vec<u8> {
        let header = Header {
            protocol: (4, 3),
            version: 0,
            lasers: CHANNELS,
            blocks: BLOCKS,
            unit_mm: 4,
            returns: 1,
            flags: flag::SEQUENCE | flag::SAFETY,
        };
        FRAME.template(&header, ECHO_LEN)
    }
}

/// What a unit's file says, radians.
#[derive(Debug, Clone, PartialEq)]
struct Fields {
    /// Start and end of each mirror's field, angles of the encoder.
    fields_rad: Vec<(f64, f64)>,
    azimuth_rad: Vec<f64>,
    elevation_rad: Vec<f64>,
    /// By channel, every two degrees of the encoder; empty: none.
    azimuth_adjust_rad: Vec<f64>,
    elevation_adjust_rad: Vec<f64>,
}

impl Fields {
    /// The usual fields with the angles of a unit.
    fn of(unit: &Unit) -> Self {
        let degrees = [23.075, 143.440, 263.133, 23.075].map(f64::to_radians);
        Self {
            fields_rad: degrees.windows(2).map(|pair| (pair[0], pair[1])).collect(),
            azimuth_rad: unit.azimuth_rad.clone(),
            elevation_rad: unit.elevation_rad.clone(),
            azimuth_adjust_rad: Vec::new(),
            elevation_adjust_rad: Vec::new(),
        }
    }

    fn read(file: &UnitFile) -> Result<Self, UnitError> {
        let mut bytes = Cursor::new(file, 3);
        let minor = bytes.u8()?;
        let channels = usize::from(bytes.u8()?);
        if channels != CHANNELS {
            return Err(file.refuse(None, format!("{CHANNELS} channels"), channels.to_string()));
        }
        let _mirrors = bytes.u8()?;
        let frames = usize::from(bytes.u8()?);
        for _ in 0..8 {
            bytes.u8()?; // settings that decoding does not need
        }
        let resolution = if minor == 5 {
            f64::from(bytes.u8()?)
        } else {
            1.0
        };
        let radians = |values: Vec<f64>, degree: f64| -> Vec<f64> {
            let angles = values.iter().map(|value| value * resolution / degree);
            angles.map(f64::to_radians).collect()
        };
        let starts = radians(bytes.u32s(frames)?, DEGREE);
        let ends = radians(bytes.u32s(frames)?, DEGREE);
        Ok(Self {
            fields_rad: starts.into_iter().zip(ends).collect(),
            azimuth_rad: radians(bytes.i32s(CHANNELS)?, DEGREE),
            elevation_rad: radians(bytes.i32s(CHANNELS)?, DEGREE),
            azimuth_adjust_rad: radians(bytes.i8s(CHANNELS * ADJUSTS)?, ADJUST_DEGREE),
            elevation_adjust_rad: radians(bytes.i8s(CHANNELS * ADJUSTS)?, ADJUST_DEGREE),
        })
    }

    /// How far the encoder is in its mirror's field.
    fn since_start(&self, encoder_rad: f64) -> Option<f64> {
        let within = |(start, end): &(f64, f64)| {
            let since_rad = (encoder_rad - start).rem_euclid(TAU);
            (since_rad <= (end - start).rem_euclid(TAU)).then_some(since_rad)
        };
        self.fields_rad.iter().find_map(within)
    }

    /// Beams of the channels, azimuths after twice the way since the field's start.
    fn beams(&self, encoder_rad: f64, times: &FireTimes) -> impl Iterator<Item = Beam> {
        let between = Between::at(encoder_rad);
        let angles = self.azimuth_rad.iter().zip(&self.elevation_rad).zip(times);
        angles
            .enumerate()
            .map(move |(channel, ((azimuth_rad, elevation_rad), delay_ns))| {
                let azimuth_rad = between.of(&self.azimuth_adjust_rad, channel) - azimuth_rad;
                let elevation_rad = elevation_rad + between.of(&self.elevation_adjust_rad, channel);
                let elevation = elevation_rad.sin_cos();
                ray(channel, azimuth_rad, elevation, delay_ns.unwrap_or(0.0))
            })
    }

    fn is_adjusted(&self) -> bool {
        !(self.azimuth_adjust_rad.is_empty() && self.elevation_adjust_rad.is_empty())
    }
}

/// Between which of the corrections an angle of the encoder lies.
#[derive(Debug, Clone, Copy)]
struct Between {
    below: usize,
    share: f64,
}

impl Between {
    fn at(encoder_rad: f64) -> Self {
        let place = (encoder_rad / TAU).rem_euclid(1.0) * ADJUSTS as f64;
        Self {
            below: place as usize % ADJUSTS,
            share: place.fract(),
        }
    }

    /// A channel's correction.
    fn of(self, table: &[f64], channel: usize) -> f64 {
        let Some(row) = table.chunks_exact(ADJUSTS).nth(channel) else {
            return 0.0;
        };
        let above = row[(self.below + 1) % ADJUSTS];
        row[self.below] * (1.0 - self.share) + above * self.share
    }
}

struct At128Decoder {
    fields: Fields,
    times: FireTimes,
    fan: Fan,
    desk: Desk,
}

impl At128Decoder {
    fn new(fields: Fields, times: FireTimes) -> Self {
        Self {
            fan: fields.beams(0.0, &times).collect(),
            fields,
            times,
            desk: Desk::default(),
        }
    }
}

impl Decoder for At128Decoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let view = At128
            .layout(payload)
            .and_then(|layout| View::new(payload, layout));
        let Some(view) = view else {
            return out.drops.add("packet_size", 1);
        };
        let returns = view.return_mode().returns();
        out.drops.add("block_invalid", (BLOCKS % returns) as u64);
        for first in firings(&view) {
            let encoder_rad = At128.azimuth_rad(&view, first);
            let found =
                encoder_rad.and_then(|angle| Some((angle, self.fields.since_start(angle)?)));
            let Some((encoder_rad, since_rad)) = found else {
                out.drops.add("block_invalid", returns as u64);
                continue;
            };
            if self.fields.is_adjusted() {
                self.fan.set(self.fields.beams(encoder_rad, &self.times));
            }
            let firing = Firing {
                first,
                encoder_rad: At128.encoder_rad(&view, first).unwrap_or_default(),
                azimuth_rad: (2.0 * since_rad).rem_euclid(TAU),
                time: place.time + (At128.block_ns(&view, first) - At128.block_ns(&view, 0)),
                least_range: 1,
                packet: place.packet,
            };
            firing.place(&view, &self.fan, None, &mut self.desk, out);
        }
        self.desk.flush(out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of minor 5 with resolution 2, as the maker writes it.
    fn file() -> UnitFile {
        let mut bytes = vec![0xEE, 0xFF, 1, 5, 128, 3, 3];
        bytes.extend([0; 8]);
        bytes.push(2);
        let starts = [295_356_u32, 1_836_038, 3_368_105];
        let ends = [1_836_038_u32, 3_368_105, 295_356];
        starts
            .iter()
            .chain(&ends)
            .for_each(|raw| bytes.extend(raw.to_le_bytes()));
        let angles = NOMINAL.azimuth_rad.iter().chain(&NOMINAL.elevation_rad);
        for angle in angles {
            bytes.extend(((angle.to_degrees() * DEGREE / 2.0).round() as i32).to_le_bytes());
        }
        let mut adjusts = vec![0_i8; 2 * CHANNELS * ADJUSTS];
        adjusts[ADJUSTS + 20..ADJUSTS + 22].copy_from_slice(&[10, 20]); // channel 1, 40 and 42 degrees
        bytes.extend(adjusts.iter().map(|value| *value as u8));
        bytes.extend([7; 32]);
        UnitFile::new("unit.dat", bytes)
    }

    #[test]
    fn the_file_says_what_the_nominal_table_says() {
        assert!(At128.takes_binary(&file()));
        let (read, nominal) = (Fields::read(&file()).unwrap(), Fields::of(&NOMINAL));
        for ((start, end), (other, last)) in read.fields_rad.iter().zip(&nominal.fields_rad) {
            assert!((start - other).abs() < 1e-4 && (end - last).abs() < 1e-4);
        }
        assert!((read.elevation_rad[3] - nominal.elevation_rad[3]).abs() < 1e-6);
        let short = UnitFile::new("cut.dat", &file().content[..1000]);
        assert!(
            Fields::read(&short)
                .unwrap_err()
                .to_string()
                .contains("at least")
        );
    }

    #[test]
    fn a_channel_points_twice_as_far_as_the_mirror_turns_and_is_corrected() {
        let fields = Fields::read(&file()).unwrap();
        let encoder_rad = 41.0_f64.to_radians();
        let since_rad = fields.since_start(encoder_rad).unwrap();
        let times = vec![None; CHANNELS];
        let beam = fields.beams(encoder_rad, &times).nth(1).unwrap();
        // 2 x (41 - 23.0747) - 0.65 + half way between 0.2 and 0.4 degrees.
        let expected_deg = 2.0 * (41.0 - 295_356.0 / 12_800.0) - 0.65 + 0.3;
        let azimuth_rad = 2.0 * since_rad + beam.azimuth_rad;
        assert!((azimuth_rad.to_degrees() - expected_deg).abs() < 1e-4);
        // The last field runs over the seam.
        let over_seam = fields.since_start(5.0_f64.to_radians()).unwrap();
        assert!((over_seam.to_degrees() - (365.0 - 3_368_105.0 / 12_800.0)).abs() < 1e-6);
    }
}
