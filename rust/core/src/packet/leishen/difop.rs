//! Packets that describe the unit (DIFOP), big endian: angles of older units, settings of the clock.

use crate::packet::unit::{UnitFile, find};

/// Byte ranges.
mod field {
    pub const ID: [u8; 4] = [0xA5, 0xFF, 0x00, 0x5A];
    pub const CLOCK: usize = 45;
    pub const ADJUST_FIRST: usize = 186; // i16, 0.01 deg
    pub const ADJUST_SECOND: usize = 190; // i16, 0.01 deg
    pub const PRISM: usize = 240; // i16: offset, then four angles, 0.01 deg
    pub const ELEVATIONS: usize = 245; // 32 x i16, 0.01 deg, version 3
    pub const SOLID_ELEVATIONS: usize = 680; // 16 x i16, 0.01 deg, MSC16
    pub const SOLID_AZIMUTHS: usize = 712; // 16 x i16, 0.01 deg, MSC16
    pub const VERSION: usize = 1196;
}

/// Bytes of the packet.
pub const LEN: usize = 1206;

/// Borrowed packet. The array type carries the length, so no accessor can fail.
#[derive(Debug, Clone, Copy)]
pub struct Difop<'a>(&'a [u8; LEN]);

impl<'a> Difop<'a> {
    /// Takes a payload with the right size and first bytes; `None` for any other.
    pub fn new(payload: &'a [u8]) -> Option<Self> {
        let bytes: &[u8; LEN] = payload.try_into().ok()?;
        bytes.starts_with(&field::ID).then_some(Self(bytes))
    }

    fn angle_deg(&self, at: usize) -> f64 {
        f64::from(i16::from_be_bytes([self.0[at], self.0[at + 1]])) * 0.01
    }

    fn angles_deg<const N: usize>(&self, start: usize) -> [f64; N] {
        std::array::from_fn(|place| self.angle_deg(start + 2 * place))
    }

    /// Whether it is of a unit of version 3.
    pub fn is_third(&self) -> bool {
        let [major, minor] = [self.0[field::VERSION], self.0[field::VERSION + 1]];
        major == 3 || major == 2 && minor >> 4 == 8
    }

    /// Measured elevations of version 3, degrees.
    pub fn elevations_deg(&self) -> [f64; 32] {
        self.angles_deg(field::ELEVATIONS)
    }

    /// What is added to the azimuths of a C32 of version 3, degrees: channels 2 and 3 of each four, and
    /// channels 0 and 1.
    pub fn adjust_deg(&self) -> [f64; 2] {
        [field::ADJUST_FIRST, field::ADJUST_SECOND].map(|at| {
            let angle_deg = self.angle_deg(at);
            // More than a few degrees is no adjustment.
            if angle_deg.abs() < 20.0 {
                angle_deg
            } else {
                0.0
            }
        })
    }

    /// Elevations and azimuths of an MSC16, degrees.
    pub fn solid_deg(&self) -> [[f64; 16]; 2] {
        [
            self.angles_deg(field::SOLID_ELEVATIONS),
            self.angles_deg(field::SOLID_AZIMUTHS),
        ]
    }

    /// Offset of the prism and angles of its four faces, degrees; `None` where all are 0.
    pub fn prism_deg(&self) -> Option<[f64; 5]> {
        let angles: [f64; 5] = self.angles_deg(field::PRISM);
        let is_told = angles.iter().any(|angle| *angle != 0.0);
        (is_told && angles.iter().all(|angle| angle.abs() < 10.0)).then_some(angles)
    }

    /// What the clock of version 4 follows.
    pub fn clock(&self) -> &'static str {
        match self.0[field::CLOCK] {
            0 => "GPS",
            1 => "PTP",
            2 => "NTP",
            _ => "unknown",
        }
    }
}

/// The packet in a file: the packet itself, or the first one of a capture.
pub fn packet(file: &UnitFile) -> Option<Vec<u8>> {
    find(file, |payload| {
        Difop::new(payload).map(|_| payload.to_vec())
    })
}

/// Writes a packet with angles in hundredths of a degree at their places.
pub fn encode(version: u8, angles: &[(usize, i16)]) -> [u8; LEN] {
    let mut bytes = [0; LEN];
    bytes[..4].copy_from_slice(&field::ID);
    bytes[field::VERSION] = version;
    for (at, angle) in angles {
        if let Some(place) = bytes.get_mut(*at..*at + 2) {
            place.copy_from_slice(&angle.to_be_bytes());
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_signed_hundredths() {
        let bytes = encode(
            3,
            &[(245, -1_590), (245 + 62, 1_503), (190, -40), (186, 31_000)],
        );
        let difop = Difop::new(&bytes).unwrap();
        assert!(difop.is_third());
        let elevations = difop.elevations_deg();
        assert!((elevations[0] + 15.9).abs() < 1e-9 && (elevations[31] - 15.03).abs() < 1e-9);
        assert_eq!(difop.adjust_deg(), [0.0, -0.4]);
        assert_eq!(difop.prism_deg(), None);
        assert!(Difop::new(&bytes[1..]).is_none());
        let file = UnitFile::new("difop", bytes);
        assert_eq!(packet(&file).unwrap(), file.content);
    }
}
