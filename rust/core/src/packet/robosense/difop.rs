//! Packets that describe the unit (DIFOP): angles, return mode, serial number, state of the clock.

use crate::packet::unit::UnitFile;
pub(super) use crate::packet::unit::find;

/// Byte ranges.
mod field {
    pub const ID: [u8; 8] = [0xA5, 0xFF, 0x00, 0x5A, 0x11, 0x11, 0x55, 0x55];
    pub const TAIL: [u8; 2] = [0x0F, 0xF0];
    pub const RPM: usize = 8; // u16
    pub const INSTALL: usize = 289;
    pub const SERIAL: usize = 292; // 6 bytes
    pub const RETURN_MODE: usize = 300;
    pub const SYNC_MODE: usize = 301;
    pub const SYNC_STATE: usize = 302;
    pub const REVERSED: usize = 337;
    pub const ELEVATIONS: usize = 468; // n x (sign, u16)
    pub const RS16_ELEVATIONS: usize = 1165; // 16 x u24
}

/// Bytes of the packet of a spinning sensor.
pub const LEN: usize = 1248;

/// Borrowed packet. The array type carries the length, so no accessor can fail.
#[derive(Debug, Clone, Copy)]
pub struct Difop<'a>(&'a [u8; LEN]);

/// Angles of the lasers, radians.
#[derive(Debug, Clone, PartialEq)]
pub struct Angles {
    /// Above the plane of rotation.
    pub elevation_rad: Vec<f64>,
    /// Added to the azimuth.
    pub azimuth_rad: Vec<f64>,
}

impl<'a> Difop<'a> {
    /// Takes a payload with the right size, first and last bytes; `None` for any other.
    pub fn new(payload: &'a [u8]) -> Option<Self> {
        let bytes: &[u8; LEN] = payload.try_into().ok()?;
        (bytes.starts_with(&field::ID) && bytes.ends_with(&field::TAIL)).then_some(Self(bytes))
    }

    /// Set speed, turns a minute.
    pub fn rpm(&self) -> u16 {
        u16::from_be_bytes([self.0[field::RPM], self.0[field::RPM + 1]])
    }

    /// How the unit is mounted.
    pub fn install(&self) -> u8 {
        self.0[field::INSTALL]
    }

    /// Return mode; its meaning differs from model to model.
    pub fn return_mode(&self) -> u8 {
        self.0[field::RETURN_MODE]
    }

    /// Whether the angles count in the other sense.
    pub fn is_reversed(&self) -> bool {
        self.0[field::REVERSED] == 1
    }

    /// Lasers of up to 32 whose elevations are programmed.
    pub fn lasers(&self) -> usize {
        const MOST: usize = 32;
        let bytes = &self.0[field::ELEVATIONS..field::ELEVATIONS + 3 * MOST];
        let is_blank = |bytes: &[u8]| bytes.iter().all(|byte| *byte == bytes[0]) && bytes[0] != 1;
        let told = bytes.chunks_exact(3).rposition(|angle| !is_blank(angle));
        told.map_or(0, |last| last + 1)
    }

    /// Serial number in hexadecimal.
    pub fn serial(&self) -> String {
        let bytes = &self.0[field::SERIAL..field::SERIAL + 6];
        bytes.iter().map(|byte| format!("{byte:02X}")).collect()
    }

    /// What the clock follows and whether it does.
    pub fn clock(&self) -> String {
        let mode = match self.0[field::SYNC_MODE] {
            0 => "GPS",
            1 => "PTP E2E",
            2 => "PTP P2P",
            3 => "gPTP",
            4 => "PTP E2E over Ethernet",
            _ => return "unknown".into(),
        };
        let state = match self.0[field::SYNC_STATE] {
            0 => "not synchronised",
            _ => "synchronised",
        };
        format!("{mode}, {state}")
    }

    /// Angles of `lasers` lasers, whose azimuths stand at `azimuths`; `None` where they are not
    /// programmed. `unit_deg` is the unit of the angles.
    pub fn angles(&self, lasers: usize, azimuths: usize, unit_deg: f64) -> Option<Angles> {
        let list = |start: usize| -> Option<Vec<f64>> {
            let bytes = self.0.get(start..start + 3 * lasers)?;
            let is_blank =
                bytes.iter().all(|byte| *byte == 0) || bytes.iter().all(|byte| *byte == 0xFF);
            let angle = |bytes: &[u8]| {
                let size = f64::from(u16::from_be_bytes([bytes[1], bytes[2]])) * unit_deg;
                let angle_deg = if bytes[0] == 0 { size } else { -size };
                angle_deg.to_radians()
            };
            (!is_blank).then(|| bytes.chunks_exact(3).map(angle).collect())
        };
        let elevation_rad = list(field::ELEVATIONS)?;
        let azimuth_rad = list(azimuths).unwrap_or_else(|| vec![0.0; lasers]);
        let is_sound = |angle: &f64| angle.abs() < std::f64::consts::PI;
        let all = elevation_rad.iter().chain(&azimuth_rad);
        all.into_iter().all(is_sound).then_some(Angles {
            elevation_rad,
            azimuth_rad,
        })
    }

    /// Elevations of an RS-16, whose first eight lasers look down.
    pub fn rs16_angles(&self) -> Option<Angles> {
        const LASERS: usize = 16;
        let bytes = &self.0[field::RS16_ELEVATIONS..field::RS16_ELEVATIONS + 3 * LASERS];
        if bytes.iter().all(|byte| *byte == 0) || bytes.iter().all(|byte| *byte == 0xFF) {
            return None;
        }
        let angle = |(laser, bytes): (usize, &[u8])| {
            let size = u32::from_be_bytes([0, bytes[0], bytes[1], bytes[2]]);
            let angle_rad = (f64::from(size) * 1e-4).to_radians();
            if laser < LASERS / 2 {
                -angle_rad
            } else {
                angle_rad
            }
        };
        let elevation_rad: Vec<f64> = bytes.chunks_exact(3).enumerate().map(angle).collect();
        let is_sound = elevation_rad.iter().all(|angle| angle.abs() < 1.6);
        is_sound.then(|| Angles {
            elevation_rad,
            azimuth_rad: vec![0.0; LASERS],
        })
    }
}

/// The packet in a file: the packet itself, or the first one of a capture.
pub fn packet(file: &UnitFile) -> Option<[u8; LEN]> {
    find(file, |payload| Difop::new(payload).map(|difop| *difop.0))
}

/// Writes a packet.
pub fn encode(
    rpm: u16,
    return_mode: u8,
    azimuths: usize,
    angles_centideg: &[(i32, i32)],
) -> [u8; LEN] {
    let mut bytes = [0; LEN];
    bytes[..8].copy_from_slice(&field::ID);
    bytes[LEN - 2..].copy_from_slice(&field::TAIL);
    bytes[field::RPM..field::RPM + 2].copy_from_slice(&rpm.to_be_bytes());
    bytes[field::RETURN_MODE] = return_mode;
    for (laser, (elevation, azimuth)) in angles_centideg.iter().enumerate() {
        for (start, angle) in [(field::ELEVATIONS, elevation), (azimuths, azimuth)] {
            let size = u16::try_from(angle.unsigned_abs()).unwrap_or(u16::MAX);
            if let Some(place) = bytes.get_mut(start + 3 * laser..start + 3 * laser + 3) {
                place[0] = u8::from(*angle < 0);
                place[1..].copy_from_slice(&size.to_be_bytes());
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_settings_come_back() {
        let written: Vec<(i32, i32)> = (0..32)
            .map(|laser| (1500 - 100 * laser, 405 - laser))
            .collect();
        let bytes = encode(600, 4, 564, &written);
        let difop = Difop::new(&bytes).unwrap();
        assert_eq!(
            (difop.rpm(), difop.return_mode(), difop.is_reversed()),
            (600, 4, false)
        );
        assert_eq!(difop.clock(), "GPS, not synchronised");
        let angles = difop.angles(32, 564, 0.01).unwrap();
        for (laser, (elevation, azimuth)) in written.iter().enumerate() {
            assert!(
                (angles.elevation_rad[laser].to_degrees() * 100.0 - f64::from(*elevation)).abs()
                    < 1e-9
            );
            assert!(
                (angles.azimuth_rad[laser].to_degrees() * 100.0 - f64::from(*azimuth)).abs() < 1e-9
            );
        }
        assert!(Difop::new(&bytes[1..]).is_none());
    }

    #[test]
    fn blank_angles_are_none() {
        let bytes = encode(600, 4, 564, &[]);
        assert!(Difop::new(&bytes).unwrap().angles(32, 564, 0.01).is_none());
        assert!(Difop::new(&bytes).unwrap().rs16_angles().is_none());
    }

    #[test]
    fn a_capture_that_has_one_will_do() {
        let bytes = encode(600, 4, 564, &[(1, 1); 32]);
        let mut content = Vec::new();
        let mut writer = crate::capture::PcapWriter::new(&mut content).unwrap();
        let ends = ["10.0.0.1:7788", "10.0.0.2:7788"].map(|text| text.parse().unwrap());
        let time = crate::time::Timestamp(5);
        writer.write_udp(time, ends[0], ends[1], &[1; 100]).unwrap();
        writer.write_udp(time, ends[0], ends[1], &bytes).unwrap();
        drop(writer);
        assert_eq!(packet(&UnitFile::new("a.pcap", content)), Some(bytes));
        assert_eq!(packet(&UnitFile::new("a", [0; 40])), None);
    }
}
