//! FT120: a flash sensor of 160 columns and 120 channels, one column or a part of it a packet (7.2).
//!
//! There is no rotor: the column stands for the azimuth, so that one frame is one sweep. All channels of
//! a column share its time.
//!
//! Source: the maker's development kit.

use std::f64::consts::TAU;

use super::dat::{self, Cursor};
use super::layout::{Layout, MAGIC, NOWHERE, RawPacket, Tail, View, write};
use super::rotating::ray;
use super::unit::OBTAIN;
use crate::error::UnitError;
use crate::packet::aim::{within_half_turn, wrapped};
use crate::packet::echoes::single_kind;
use crate::packet::rays::Rays;
use crate::packet::sheet::Sheet;
use crate::packet::unit::{Calibration, Fitted, UnitFile};
use crate::packet::{
    Counting, Decoded, Decoder, Head, Misfit, Model, PacketKind, Place, ReturnMode, Tally,
};

/// Byte ranges; the tail's count from its start.
mod field {
    pub const PROTOCOL: (u8, u8) = (7, 2);
    pub const COLUMNS: usize = 6; // u16
    pub const ROWS: usize = 8; // u16
    pub const UNIT_MM: usize = 13;
    pub const PART: usize = 14;
    pub const CHANNELS: usize = 15; // u16
    pub const BODY: usize = 25;
    pub const ECHO_LEN: usize = 5; // u16 range, brightness, background, confidence
    pub const COLUMN: usize = 7; // u16, in the tail
    pub const TAIL_LEN: usize = 29;
}

/// A checksum may follow the tail.
const CRC_LEN: usize = 4;
/// Ten frames a second.
const FRAME_NS: i64 = 100_000_000;
/// Columns and channels of the sensor.
const COLUMNS: usize = 160;
const ROWS: usize = 120;
/// Nominal grid, degrees: first column, lowest channel, step.
const GRID_DEG: (f64, f64, f64) = (40.0, -37.5, 0.625);

const TAIL: Tail = Tail {
    azimuth_state: None,
    operation: None,
    return_mode: 11,
    speed: NOWHERE,
    speed_rpm: 1.0,
    date: Some(14),
    micros: 20,
    sequence: 25,
    sequence_len: 4,
};

/// FT120.
pub static FT120: Ft120 = Ft120;

/// The model.
#[derive(Debug)]
pub struct Ft120;

fn u16_at(bytes: &[u8], place: usize) -> usize {
    usize::from(u16::from_le_bytes([bytes[place], bytes[place + 1]]))
}

/// Layout of a packet as one block whose azimuth is not used.
fn layout(payload: &[u8]) -> Option<Layout> {
    let header = payload.get(..field::BODY)?;
    let is_own = header.starts_with(&MAGIC) && (header[2], header[3]) == field::PROTOCOL;
    let channels = u16_at(header, field::CHANNELS);
    let is_size = u16_at(header, field::COLUMNS) == COLUMNS
        && u16_at(header, field::ROWS) == ROWS
        && (1..=ROWS).contains(&channels);
    let tail = field::BODY + channels * field::ECHO_LEN;
    let len = tail + field::TAIL_LEN;
    let is_len = payload.len() == len || payload.len() == len + CRC_LEN;
    (is_own && is_size && is_len).then(|| Layout {
        blocks: 1,
        channels,
        body: field::BODY,
        block_len: channels * field::ECHO_LEN,
        azimuth: NOWHERE,
        echoes: 0,
        echo_len: field::ECHO_LEN,
        unit_m: f64::from(header[field::UNIT_MM]) * 1e-3,
        tail,
        fields: TAIL,
        has_sequence: true,
        len: payload.len(),
    })
}

/// A packet of the model.
struct Packet<'a> {
    view: View<'a>,
    column: usize,
    /// Channel of the first echo.
    first: usize,
}

impl<'a> Packet<'a> {
    fn new(payload: &'a [u8]) -> Option<Self> {
        let layout = layout(payload)?;
        let column = u16_at(payload, layout.tail + field::COLUMN);
        let first = usize::from(payload[field::PART]) * layout.channels;
        (column < COLUMNS && first + layout.channels <= ROWS).then_some(Self {
            view: View::new(payload, layout)?,
            column,
            first,
        })
    }

    fn azimuth_rad(&self) -> f64 {
        TAU * self.column as f64 / COLUMNS as f64
    }
}

/// Writes a packet of a whole column; the one block's azimuth is the column's number.
pub fn encode(packet: &RawPacket) -> Vec<u8> {
    let mut bytes = vec![0; field::BODY + ROWS * field::ECHO_LEN + field::TAIL_LEN];
    bytes[..2].copy_from_slice(&MAGIC);
    (bytes[2], bytes[3]) = field::PROTOCOL;
    bytes[field::COLUMNS] = COLUMNS as u8;
    bytes[field::ROWS] = ROWS as u8;
    bytes[field::UNIT_MM] = 4;
    bytes[field::CHANNELS] = ROWS as u8;
    if let Some(layout) = layout(&bytes) {
        write(&mut bytes, &layout, packet);
        let column = packet.blocks.first().map_or(0, |block| block.azimuth);
        bytes[layout.tail + field::COLUMN..][..2].copy_from_slice(&column.to_le_bytes());
    }
    bytes
}

impl Model for Ft120 {
    fn id(&self) -> &'static str {
        "ft120"
    }

    fn title(&self) -> &'static str {
        "Hesai FT120"
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        Packet::new(payload).map(|_| PacketKind::Data)
    }

    fn fits(&self, payload: &[u8]) -> bool {
        Packet::new(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        let why = format!("{} bytes do not fit {}", payload.len(), self.title());
        Misfit { why, may_be: None }
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let packet = Packet::new(payload)?;
        let parts = ROWS / packet.view.layout().channels;
        let duration_ns = self.period_ns(ReturnMode::Strongest) / parts as i64;
        let rate_rad_per_ns = TAU / FRAME_NS as f64;
        Some(Head {
            device_ns: packet.view.time().0,
            sequence: packet.view.sequence(),
            azimuth_rad: packet.azimuth_rad(),
            turned_rad: rate_rad_per_ns * duration_ns as f64,
            rate_rad_per_ns,
            duration_ns,
            left_out: None,
            return_mode: packet.view.return_mode(),
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let echoes = Packet::new(payload).map(|packet| {
            let hits = packet.view.echoes(0).filter(|echo| echo.range != 0);
            hits.count() as u32
        });
        Tally {
            points: echoes.unwrap_or(0),
            merged: 0,
        }
    }

    fn period_ns(&self, _mode: ReturnMode) -> i64 {
        FRAME_NS / COLUMNS as i64
    }

    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: None,
            sequence_bits: Some(32),
        }
    }

    fn takes(&self, file: &UnitFile) -> bool {
        dat::version(file).is_some_and(|(major, minor)| major != 1 && major != 4 && minor <= 2)
            && Grid::read(file).is_ok()
    }

    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError> {
        let file = files.iter().find(|file| self.takes(file));
        let grid = file.map_or_else(|| Ok(Grid::nominal()), Grid::read)?;
        let used: Vec<&UnitFile> = file.into_iter().collect();
        Ok(Fitted {
            decoder: Box::new(Ft120Decoder::new(&grid)),
            calibration: Calibration::of(&used, Calibration::Nominal { obtain: OBTAIN }),
        })
    }
}

/// Azimuth and elevation of each pixel, radians, column by column.
#[derive(Debug, Clone, PartialEq)]
struct Grid(Vec<(f64, f64)>);

impl Grid {
    fn nominal() -> Self {
        let (azimuth, elevation, step) = GRID_DEG;
        let pixels = (0..COLUMNS).flat_map(|column| (0..ROWS).map(move |row| (column, row)));
        let angles = pixels.map(|(column, row)| {
            let azimuth_deg = azimuth + step * column as f64;
            let elevation_deg = elevation + step * row as f64;
            (azimuth_deg.to_radians(), elevation_deg.to_radians())
        });
        Self(angles.collect())
    }

    fn read(file: &UnitFile) -> Result<Self, UnitError> {
        let mut bytes = Cursor::new(file, 3);
        let minor = bytes.u8()?;
        let mut count = || -> Result<usize, UnitError> {
            Ok(if minor == 2 {
                bytes.u16()?.into()
            } else {
                bytes.u8()?.into()
            })
        };
        let (columns, channels) = (count()?, count()?);
        if (columns, channels) != (COLUMNS, ROWS) {
            let found = format!("{columns} columns and {channels} channels");
            return Err(file.refuse(None, format!("{COLUMNS} and {ROWS}"), found));
        }
        let resolution = f64::from(bytes.u8()?);
        let mut angles = || -> Result<Vec<f64>, UnitError> {
            let raw = match minor {
                0 => bytes.i16s(COLUMNS * ROWS)?,
                _ => bytes.i32s(COLUMNS * ROWS)?,
            };
            Ok(raw
                .iter()
                .map(|raw| (raw * resolution * 0.01).to_radians())
                .collect())
        };
        let (azimuth, elevation) = (angles()?, angles()?);
        Ok(Self(azimuth.into_iter().zip(elevation).collect()))
    }
}

struct Ft120Decoder {
    /// Directions of the pixels, column by column, and their azimuths.
    rays: Rays,
    azimuth_rad: Vec<f32>,
    sheet: Sheet,
}

impl Ft120Decoder {
    fn new(grid: &Grid) -> Self {
        let pixels = || grid.0.iter();
        let beam = |(azimuth_rad, elevation_rad): &(f64, f64)| {
            ray(0, *azimuth_rad, elevation_rad.sin_cos(), 0.0)
        };
        // x right, y forward, azimuth from y towards x.
        let direction = |[ahead, aside, up]: [f64; 3]| [aside, ahead, up].map(|part| part + 0.0);
        Self {
            rays: pixels()
                .map(|pixel| direction(beam(pixel).direction))
                .collect(),
            azimuth_rad: pixels()
                .map(|pixel| wrapped(within_half_turn(pixel.0)))
                .collect(),
            sheet: Sheet::default(),
        }
    }
}

impl Decoder for Ft120Decoder {
    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(packet) = Packet::new(payload) else {
            return out.drops.add("packet_size", 1);
        };
        let (view, sheet) = (&packet.view, &mut self.sheet);
        let (shots, unit_m) = (view.layout().channels, view.layout().unit_m);
        sheet.open(shots, 1);
        view.read(0, 1, &mut sheet.range[..shots], &mut sheet.intensity);
        let first = packet.column * ROWS + packet.first;
        self.rays.place(first, unit_m, 0..shots, sheet);
        let azimuths = &self.azimuth_rad[first..first + shots];
        sheet.azimuth_rad[..shots].copy_from_slice(azimuths);
        sheet.encoder_rad[..shots].fill(wrapped(packet.azimuth_rad()));
        sheet.time_ns[..shots].fill(place.time.0);
        sheet.block[..shots].fill(packet.column as u16);
        let rings = (packet.first as u16..).zip(&mut sheet.ring[..shots]);
        rings.for_each(|(number, ring)| *ring = number);
        let kind = single_kind(view.return_mode());
        sheet.flush_singles(kind, place.packet, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_all_minors_are_read() {
        for minor in [0_u8, 1, 2] {
            let mut bytes = vec![0xEE, 0xFF, 2, minor];
            match minor {
                2 => [160_u16, 120]
                    .iter()
                    .for_each(|n| bytes.extend(n.to_le_bytes())),
                _ => bytes.extend([160, 120]),
            }
            bytes.push(2);
            for raw in (0..2 * COLUMNS * ROWS).map(|n| (n % 19_200) as i32) {
                match minor {
                    0 => bytes.extend((raw as i16).to_le_bytes()),
                    _ => bytes.extend(raw.to_le_bytes()),
                }
            }
            bytes.extend([0; 32]);
            let file = UnitFile::new("ft.dat", bytes);
            assert!(FT120.takes(&file), "minor {minor}");
            let (azimuth_rad, elevation_rad) = Grid::read(&file).unwrap().0[121];
            assert!((azimuth_rad.to_degrees() - 2.42).abs() < 1e-9);
            assert!((elevation_rad.to_degrees() - 2.42).abs() < 1e-9);
        }
    }
}
