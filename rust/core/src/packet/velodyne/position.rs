//! Velodyne position packets: what a GNSS receiver at the sensor says, 512 bytes, usually to port 8308.
//!
//! Source: VLP-16 manual 63-9243, section 9.3.

/// Bytes of a position packet.
pub const LEN: usize = 512;

/// Byte ranges; names follow the manual.
mod field {
    use std::ops::Range;

    pub const TIMESTAMP: Range<usize> = 198..202; // u32, microseconds past the hour
    pub const PPS: usize = 202;
    pub const NMEA: Range<usize> = 206..334;
}

/// State of the pulse per second that locks the device clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pps {
    /// No pulse is seen.
    Absent,
    /// The clock is being pulled in.
    Synchronising,
    /// The clock follows UTC.
    Locked,
    /// The pulses do not fit.
    Error,
}

impl Pps {
    /// Word for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Absent => "absent",
            Self::Synchronising => "synchronising",
            Self::Locked => "locked",
            Self::Error => "error",
        }
    }
}

/// Borrowed position packet. The array type carries the length, so no accessor can fail.
#[derive(Debug, Clone, Copy)]
pub struct Position<'a>(&'a [u8; LEN]);

impl<'a> Position<'a> {
    /// Takes a payload of the right size whose first bytes are unused; `None` for any other.
    pub fn new(payload: &'a [u8]) -> Option<Self> {
        let position = Self(payload.try_into().ok()?);
        let is_sentence = matches!(position.sentence_bytes(), [] | [b'$', ..]);
        let is_pps = position.0[field::PPS] <= 3;
        (is_sentence && is_pps && payload[..14].iter().all(|byte| *byte == 0)).then_some(position)
    }

    /// Device time, microseconds past the hour.
    pub fn timestamp_us(&self) -> u32 {
        let bytes = &self.0[field::TIMESTAMP];
        u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
    }

    /// State of the pulse per second.
    pub fn pps(&self) -> Pps {
        match self.0[field::PPS] {
            0 => Pps::Absent,
            1 => Pps::Synchronising,
            2 => Pps::Locked,
            _ => Pps::Error,
        }
    }

    fn sentence_bytes(&self) -> &'a [u8] {
        let room = &self.0[field::NMEA];
        let end = room.iter().position(|byte| *byte == 0);
        &room[..end.unwrap_or(room.len())]
    }

    /// The NMEA sentence, which describes the pulse before; `None` where there is none in ASCII.
    pub fn sentence(&self) -> Option<&'a str> {
        let text = str::from_utf8(self.sentence_bytes()).ok()?.trim_end();
        (!text.is_empty() && text.is_ascii()).then_some(text)
    }

    /// Whether the sentence says that the receiver has a fix: `A` in `$GPRMC`, a quality above 0 in `$GPGGA`.
    pub fn has_fix(&self) -> bool {
        let sentence = self.sentence().unwrap_or_default();
        let field = |place: usize| sentence.split(',').nth(place).unwrap_or_default();
        match field(0) {
            "$GPRMC" => field(2) == "A",
            "$GPGGA" => !matches!(field(6), "" | "0"),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(pps: u8, sentence: &str) -> [u8; LEN] {
        let mut bytes = [0; LEN];
        bytes[198..202].copy_from_slice(&3_000_000_001_u32.to_le_bytes());
        bytes[202] = pps;
        bytes[206..206 + sentence.len()].copy_from_slice(sentence.as_bytes());
        bytes
    }

    #[test]
    fn a_sentence_tells_whether_there_is_a_fix() {
        let bytes = packet(
            2,
            "$GPRMC,220512,A,3712.7340,N,12159.5,W,000.1,334.6,160223\r\n",
        );
        let position = Position::new(&bytes).unwrap();
        assert_eq!(
            (position.timestamp_us(), position.pps()),
            (3_000_000_001, Pps::Locked)
        );
        assert!(position.has_fix());
        assert!(
            !Position::new(&packet(0, "$GPRMC,220512,V,,,,,,,"))
                .unwrap()
                .has_fix()
        );
        assert!(
            Position::new(&packet(0, "$GPGGA,1,2,N,3,E,1,08"))
                .unwrap()
                .has_fix()
        );
        assert_eq!(Position::new(&packet(0, "")).unwrap().sentence(), None);
    }

    #[test]
    fn other_packets_of_the_size_are_refused() {
        assert!(Position::new(&packet(9, "")).is_none());
        assert!(Position::new(&packet(0, "hello")).is_none());
        assert!(Position::new(&[0; LEN - 1]).is_none());
    }
}
