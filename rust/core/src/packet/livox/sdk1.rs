//! Data packets of the first development kit: a header of 18 bytes, then as many points as fit.
//!
//! Source: "Livox SDK Communication Protocol", section 3; `livox_def.h` of the maker's kit. The maker's
//! first driver states 9 bytes for points of type 3, which are 10.

use std::ops::Range;

use super::points::{Coordinates, Form, RawPoint, put, time_at};
use super::shots::{Packet, Step, Sync};
use crate::packet::hesai::date;
use crate::time::Timestamp;

/// Byte ranges of the header.
mod field {
    use std::ops::Range;

    pub const VERSION: usize = 0;
    pub const TIME_TYPE: usize = 8;
    pub const DATA_TYPE: usize = 9;
    pub const TIME: Range<usize> = 10..18; // u64 ns; or year, month, day, hour, u32 us of the hour
}

/// Bytes of the header.
pub const HEADER_LEN: usize = 18;
const VERSION: u8 = 5;
/// Type of packets with accelerations and turn rates, and their length.
const INERTIAL: (u8, usize) = (6, 42);
/// First bytes of a command or its answer: start, version, length.
const COMMAND: [u8; 2] = [0xAA, 1];
const COMMAND_LEN: Range<usize> = 2..4;

/// Points of a packet of each data type, and their layout.
pub const fn form(data_type: u8) -> Option<(usize, Form)> {
    use Coordinates::{Spherical, Wide};
    Some(match data_type {
        0 => (100, Form::new(Wide, 1, false)),
        1 => (100, Form::new(Spherical, 1, false)),
        2 => (96, Form::new(Wide, 1, true)),
        3 => (96, Form::new(Spherical, 1, true)),
        4 => (48, Form::new(Wide, 2, true)),
        5 => (48, Form::new(Spherical, 2, true)),
        7 => (30, Form::new(Wide, 3, true)),
        8 => (30, Form::new(Spherical, 3, true)),
        _ => return None,
    })
}

/// Data type of a packet.
pub fn data_type(payload: &[u8]) -> Option<u8> {
    payload.get(field::DATA_TYPE).copied()
}

fn sync(payload: &[u8]) -> Option<Sync> {
    Some(match payload.get(field::TIME_TYPE)? {
        0 => Sync::Free,
        1 => Sync::Ptp,
        3 => Sync::Gnss,
        4 => Sync::Pulse,
        _ => return None,
    })
}

/// Reads a data packet; `step` is the model's. `None` for anything else.
pub fn read(payload: &[u8], step: Step) -> Option<Packet<'_>> {
    let (shots, form) = form(data_type(payload)?)?;
    let is_own = payload.get(field::VERSION) == Some(&VERSION)
        && payload.len() == HEADER_LEN + shots * form.len();
    let sync = sync(payload).filter(|_| is_own)?;
    Some(Packet {
        form,
        body: payload.get(HEADER_LEN..)?,
        device_ns: device_ns(payload, sync),
        sync,
        sequence: None,
        step,
    })
}

fn device_ns(payload: &[u8], sync: Sync) -> i64 {
    let told_ns = time_at(payload, field::TIME.start);
    let Some([year, month, day, hour, micros @ ..]) = payload.get(field::TIME) else {
        return 0;
    };
    match sync {
        Sync::Gnss => {
            let micros = micros.first_chunk().map_or(0, |m| u32::from_le_bytes(*m));
            let hour_ns = date::calendar_ns(2000 + i64::from(*year), &[*month, *day, *hour]);
            hour_ns.saturating_add(i64::from(micros) * 1000)
        }
        _ => sync.device_ns(told_ns),
    }
}

/// Whether a payload has accelerations and turn rates.
pub fn is_inertial(payload: &[u8]) -> bool {
    let (kind, len) = INERTIAL;
    payload.len() == len
        && payload.first() == Some(&VERSION)
        && data_type(payload) == Some(kind)
        && sync(payload).is_some()
}

/// Whether a payload is a command or the answer to one.
pub fn is_command(payload: &[u8]) -> bool {
    let len = payload
        .get(COMMAND_LEN)
        .map(|b| usize::from(b[0]) | usize::from(b[1]) << 8);
    payload.starts_with(&COMMAND) && payload.len() >= 13 && len == Some(payload.len())
}

/// A packet to write.
#[derive(Debug, Clone, PartialEq)]
pub struct RawPacket {
    /// Data type.
    pub data_type: u8,
    /// What the clock follows.
    pub sync: Sync,
    /// Device time of the first shot; since the last pulse where that is all that is known.
    pub time_ns: i64,
    /// Points of the shots.
    pub shots: Vec<Vec<RawPoint>>,
}

/// Writes a data packet; what is too much is left out, a type that is none gives no byte.
pub fn encode(packet: &RawPacket) -> Vec<u8> {
    let Some((shots, form)) = form(packet.data_type) else {
        return Vec::new();
    };
    let mut bytes = vec![0; HEADER_LEN + shots * form.len()];
    bytes[field::VERSION] = VERSION;
    bytes[field::DATA_TYPE] = packet.data_type;
    bytes[field::TIME_TYPE] = match packet.sync {
        Sync::Free => 0,
        Sync::Ptp => 1,
        Sync::Gnss => 3,
        Sync::Pulse => 4,
    };
    put(&mut bytes, field::TIME.start, &stamp(packet));
    let places = bytes[HEADER_LEN..].chunks_exact_mut(form.len());
    for (place, points) in places.zip(&packet.shots) {
        for (echo, point) in points.iter().enumerate().take(form.echoes) {
            form.write(place, echo, point);
        }
    }
    bytes
}

fn stamp(packet: &RawPacket) -> [u8; 8] {
    let mut bytes = packet.time_ns.to_le_bytes();
    if packet.sync == Sync::Gnss {
        let ([year, month, day, hour, minute, second], micros) =
            date::bytes(Timestamp(packet.time_ns));
        let of_hour = u32::from(minute) * 60 + u32::from(second);
        bytes[..4].copy_from_slice(&[year.wrapping_sub(100), month, day, hour]);
        bytes[4..].copy_from_slice(&(of_hour * 1_000_000 + micros).to_le_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::SINCE_PULSE;

    const STEP: Step = Step::new(10_000, 1);

    #[test]
    fn lengths_are_those_of_the_protocol() {
        let len = |kind| form(kind).map(|(shots, form)| HEADER_LEN + shots * form.len());
        let found: Vec<_> = (0..=9).map(len).collect();
        let expected = [1318, 918, 1362, 978, 1362, 786, 0, 1278, 678, 0];
        let expected = expected.map(|len| (len > 0).then_some(len));
        assert_eq!(found, expected);
    }

    #[test]
    fn every_kind_of_clock_comes_back() {
        // 2024-02-29 23:59:59.999999
        let date_ns = 1_709_251_199_999_999_000;
        for (sync, time_ns) in [
            (Sync::Free, 123_456_789_012),
            (Sync::Ptp, date_ns),
            (Sync::Gnss, date_ns),
            (Sync::Pulse, 999_999_999),
        ] {
            let packet = RawPacket {
                data_type: 2,
                sync,
                time_ns,
                shots: Vec::new(),
            };
            let bytes = encode(&packet);
            let found = read(&bytes, STEP).unwrap();
            let base = if sync == Sync::Pulse { SINCE_PULSE } else { 0 };
            assert_eq!((found.sync, found.device_ns - base), (sync, time_ns));
            assert_eq!((found.count(), found.duration_ns()), (96, 960_000));
        }
    }

    #[test]
    fn other_packets_of_the_sensor_are_told_from_data() {
        let mut inertial = vec![0; 42];
        inertial[..2].copy_from_slice(&[5, 1]);
        inertial[9] = 6;
        assert!(is_inertial(&inertial) && read(&inertial, STEP).is_none());
        let mut command = vec![0xAA, 1, 24, 0];
        command.resize(24, 0);
        assert!(is_command(&command) && !is_command(&command[..23]));
    }
}
