//! Packets that describe a unit: the pitch of the rows (DIFOP2), and serial number and clock of an E1.

use super::super::difop;
use super::columns::{Columns, RowAngles};
use super::header::{u8_at, u16_at};
use crate::packet::unit::UnitFile;
use crate::packet::{PacketKind, UnitFacts};

/// First bytes of a packet that describes a unit.
const ID: [u8; 3] = [0xA5, 0xFF, 0x00];
/// First bytes of one of the M series and of an E1.
const LONG_ID: [u8; 8] = [0xA5, 0xFF, 0x00, 0x5A, 0x11, 0x11, 0x55, 0x55];
/// Bytes of a packet with the state of a unit.
const STATE_LENS: [usize; 2] = [256, 512];
/// Bytes of the packets that tell the pitch of the rows of an EMX, by firmware, and where they stand.
const EMX_PITCHES: [(usize, usize); 4] = [(500, 94), (654, 140), (740, 334), (756, 350)];
/// One unit of their pitches.
const EMX_PITCH_DEG: f64 = 0.005;
/// Bytes of the packet of an EM4.
const EM4_LEN: usize = 1162;
const EM4_ZONES: std::ops::Range<usize> = 70..96; // i8, 0.01 degree
const EM4_PITCHES: usize = 96; // i16, 0.01 degree
const EM4_SURFACES: std::ops::Range<usize> = 1136..1144; // i16, 0.01 degree
/// Pitch of the lowest row of an EMX, and the step between rows, where the unit does not tell.
const EMX_NOMINAL_DEG: (f64, f64) = (-12.08, 0.105);

/// Bytes of the packet of an E1.
mod e1 {
    use std::ops::Range;

    pub const SERIAL: Range<usize> = 20..26;
    pub const RETURN_MODE: usize = 100;
    pub const SYNC_MODE: usize = 101;
    pub const SYNC_STATE: usize = 102;
}

/// Angles of a unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Angles {
    /// Sine and cosine of the pitch of each row.
    pub pitch: Vec<(f64, f64)>,
    /// Added to the yaw of each zone, with sine and cosine.
    zones: Vec<(f64, (f64, f64))>,
    /// Added to the pitch on each surface of the mirror.
    pub surface_rad: Vec<f64>,
}

fn centidegrees(raw: f64) -> f64 {
    (raw / 100.0).to_radians()
}

fn i16_at(bytes: &[u8], at: usize) -> f64 {
    f64::from(u16_at(bytes, at) as i16)
}

impl Angles {
    /// Those of an EMX whose packets do not tell them.
    pub fn nominal_emx() -> Self {
        let (start_deg, step_deg) = EMX_NOMINAL_DEG;
        let rows = 0..Columns::Emx.rows();
        let pitch_deg = rows.map(|row| start_deg + step_deg * row as f64);
        Self::rows(pitch_deg)
    }

    fn rows(pitch_deg: impl Iterator<Item = f64>) -> Self {
        Self {
            pitch: pitch_deg.map(|deg| deg.to_radians().sin_cos()).collect(),
            zones: Vec::new(),
            surface_rad: Vec::new(),
        }
    }

    /// Those that a packet of an EMX tells. Its offsets of zones and surfaces are left alone, as in the
    /// maker's driver: the header of each column has one.
    pub fn of_emx(bytes: &[u8]) -> Option<Self> {
        let (_, start) = EMX_PITCHES.iter().find(|(len, _)| *len == bytes.len())?;
        let rows = 0..Columns::Emx.rows();
        let raw = |row: usize| i16_at(bytes, start + 2 * row);
        let is_told = bytes.starts_with(&ID) && rows.clone().any(|row| raw(row) != 0.0);
        is_told.then(|| Self::rows(rows.map(|row| raw(row) * EMX_PITCH_DEG)))
    }

    /// Those that a packet of an EM4 tells.
    pub fn of_em4(bytes: &[u8]) -> Option<Self> {
        if bytes.len() != EM4_LEN || !bytes.starts_with(&ID) {
            return None;
        }
        let rows = 0..Columns::Em4.rows();
        let raw = |row: usize| i16_at(bytes, EM4_PITCHES + 2 * row);
        let is_told = rows.clone().any(|row| raw(row) != 0.0);
        let mut angles = Self::rows(rows.map(|row| raw(row) / 100.0));
        let zones = bytes[EM4_ZONES]
            .iter()
            .map(|raw| centidegrees(f64::from(*raw as i8)));
        angles.zones = zones.map(|offset| (offset, offset.sin_cos())).collect();
        let surfaces = EM4_SURFACES
            .step_by(2)
            .map(|at| centidegrees(i16_at(bytes, at)));
        angles.surface_rad = surfaces.collect();
        is_told.then_some(angles)
    }

    /// Those of a row.
    pub fn row(&self, columns: Columns, row: usize) -> RowAngles {
        // Counted from 0 here, from 1 by the maker.
        let zone = row / columns.zone_rows();
        let told = self.zones.get(zone).copied();
        let (offset_rad, offset) = told.unwrap_or((0.0, (0.0, 1.0)));
        RowAngles {
            pitch: self.pitch.get(row).copied().unwrap_or((0.0, 1.0)),
            offset_rad,
            offset,
            is_late: !zone.is_multiple_of(2),
        }
    }

    /// Those that a file tells, if it tells those of this model.
    pub fn of_file(columns: Columns, file: &UnitFile) -> Option<Self> {
        difop::find(file, |payload| match columns {
            Columns::Emx => Self::of_emx(payload),
            Columns::Em4 => Self::of_em4(payload),
        })
    }
}

/// What a payload is, if it describes a unit.
pub fn kind(payload: &[u8]) -> Option<PacketKind> {
    let len = payload.len();
    if STATE_LENS.contains(&len) && payload.starts_with(&LONG_ID) {
        return Some(PacketKind::Metadata);
    }
    if STATE_LENS.contains(&len) && payload.starts_with(&ID) {
        return Some(PacketKind::Status);
    }
    let is_angles = len == EM4_LEN || EMX_PITCHES.iter().any(|(other, _)| *other == len);
    (is_angles && payload.starts_with(&ID)).then_some(PacketKind::Metadata)
}

/// Whether a file has a packet of an E1.
pub fn is_e1(file: &UnitFile) -> bool {
    file.content.len() == STATE_LENS[0] && file.content.starts_with(&LONG_ID)
}

/// What a packet of an E1 tells.
pub fn of_e1(files: &[UnitFile]) -> UnitFacts {
    let Some(bytes) = files
        .iter()
        .find(|file| is_e1(file))
        .map(|file| &file.content)
    else {
        return UnitFacts::default();
    };
    let serial: String = bytes[e1::SERIAL]
        .iter()
        .map(|b| format!("{b:02X}"))
        .collect();
    let clock = match u8_at(bytes, e1::SYNC_MODE) {
        0 => "its own clock",
        2 => "PTP",
        3 => "gPTP",
        _ => "unknown",
    };
    let state = match u8_at(bytes, e1::SYNC_STATE) {
        0 => "not synchronised",
        _ => "synchronised",
    };
    UnitFacts {
        return_mode: (bytes[e1::RETURN_MODE] == 4).then_some("strongest"),
        notes: vec![format!(
            "serial number {serial}, clock source: {clock}, {state}"
        )],
    }
}

/// Writes the packet of an EM4: pitches, offsets of zones and of surfaces in hundredths of a degree.
pub fn encode_em4(pitches: &[i16], zones: &[i8], surfaces: &[i16]) -> Vec<u8> {
    let mut bytes = vec![0; EM4_LEN];
    bytes[..3].copy_from_slice(&ID);
    bytes[3] = 0xAE;
    for (place, zone) in bytes[EM4_ZONES].iter_mut().zip(zones) {
        *place = *zone as u8;
    }
    write(&mut bytes[EM4_PITCHES..EM4_SURFACES.start], pitches);
    write(&mut bytes[EM4_SURFACES], surfaces);
    bytes
}

/// Writes a packet of an EMX of one of its lengths: pitches in 0.005 degree.
pub fn encode_emx(len: usize, pitches: &[i16]) -> Vec<u8> {
    let mut bytes = vec![0; len];
    bytes[..3].copy_from_slice(&ID);
    bytes[3] = 0xAE;
    if let Some((_, start)) = EMX_PITCHES.iter().find(|(other, _)| *other == len) {
        write(&mut bytes[*start..], pitches);
    }
    bytes
}

fn write(bytes: &mut [u8], numbers: &[i16]) {
    for (place, number) in bytes.chunks_exact_mut(2).zip(numbers) {
        place.copy_from_slice(&number.to_be_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_packet_of_an_emx_tells_the_same_pitches() {
        let pitches: Vec<i16> = (0..192).map(|row| -2416 + 21 * row).collect();
        for (len, _) in EMX_PITCHES {
            let bytes = encode_emx(len, &pitches);
            assert_eq!(kind(&bytes), Some(PacketKind::Metadata));
            let told = Angles::of_file(Columns::Emx, &UnitFile::new("difop2", bytes)).unwrap();
            for (one, other) in told.pitch.iter().zip(&Angles::nominal_emx().pitch) {
                assert!((one.0 - other.0).abs() < 1e-12);
            }
        }
        assert!(Angles::of_emx(&encode_emx(500, &[])).is_none());
        assert!(Angles::of_em4(&encode_em4(&[], &[], &[])).is_none());
    }

    #[test]
    fn an_e1_tells_its_serial_number_and_clock() {
        let mut bytes = vec![0; 256];
        bytes[..8].copy_from_slice(&LONG_ID);
        bytes[20..26].copy_from_slice(&[1, 2, 3, 0xAB, 0xCD, 0xEF]);
        bytes[100..103].copy_from_slice(&[4, 3, 1]);
        assert_eq!(kind(&bytes), Some(PacketKind::Metadata));
        let facts = of_e1(&[UnitFile::new("difop", bytes)]);
        assert_eq!(
            facts.notes,
            ["serial number 010203ABCDEF, clock source: gPTP, synchronised"]
        );
        let mut state = vec![0; 256];
        state[..4].copy_from_slice(&[0xA5, 0xFF, 0, 0x5A]);
        assert_eq!(kind(&state), Some(PacketKind::Status));
    }
}
