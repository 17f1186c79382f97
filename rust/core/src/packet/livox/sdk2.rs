//! Data packets of the second development kit: a header of 36 bytes, then as many points as it says.
//!
//! Source: the maker's communication protocols of Mid-360 and HAP; `livox_lidar_def.h` of its kit. The
//! checksum is left alone: a Mid-360 writes none in packets of points. Time from shot to shot is the interval
//! over one less than the points, as measured on a Mid-360, not over the points as the maker's driver has it.

use super::points::{Coordinates, Form, RawPoint, put, time_at, u16_at};
use super::shots::{Packet, Step, Sync};

/// Places in the header.
mod field {
    pub const VERSION: usize = 0;
    pub const LEN: usize = 1; // u16
    pub const INTERVAL: usize = 3; // u16, 0.1 us, from the first point to the last
    pub const POINTS: usize = 5; // u16
    pub const COUNTER: usize = 7; // u16
    pub const FRAME: usize = 9;
    pub const DATA_TYPE: usize = 10;
    pub const TIME_TYPE: usize = 11;
    pub const TIME: usize = 28; // u64 ns
}

/// Bytes of the header.
pub const HEADER_LEN: usize = 36;
/// Points of a packet of the sensors so far.
pub const POINTS: usize = 96;
/// Data type of accelerations and turn rates, and bytes of the packet.
const INERTIAL: (u8, usize) = (0, 60);
/// Nanoseconds of one unit of the interval.
const INTERVAL_NS: i64 = 100;
/// First bytes of a command or its answer: start, version.
const COMMAND: [u8; 2] = [0xAA, 0];

/// Layout of each data type; that of two returns is not in the protocols, only its name and size are.
pub const fn form(data_type: u8) -> Option<Form> {
    Some(match data_type {
        1 => Form::new(Coordinates::Wide, 1, true),
        2 => Form::new(Coordinates::Narrow, 1, true),
        3 => Form::new(Coordinates::Spherical, 1, true),
        0x11 => Form::new(Coordinates::Wide, 2, true),
        _ => return None,
    })
}

fn is_framed(payload: &[u8]) -> bool {
    payload.len() >= HEADER_LEN
        && payload[field::VERSION] == 0
        && usize::from(u16_at(payload, field::LEN)) == payload.len()
}

fn sync(payload: &[u8]) -> Option<Sync> {
    Some(match payload.get(field::TIME_TYPE)? {
        0 => Sync::Free,
        1 => Sync::Ptp,
        2 => Sync::Gnss,
        _ => return None,
    })
}

/// Time from shot to shot that a packet tells; `None` where it does not.
pub fn told_step(payload: &[u8]) -> Option<Step> {
    let points = i64::from(u16_at(payload, field::POINTS));
    let interval = i64::from(u16_at(payload, field::INTERVAL));
    (interval > 0 && points > 1).then(|| Step::new(interval * INTERVAL_NS, points - 1))
}

/// Number of the frame; starts again after 256 of them.
pub fn frame(payload: &[u8]) -> Option<u8> {
    payload.get(field::FRAME).copied()
}

/// Reads a data packet; `step` is the model's, for packets that do not tell theirs. `None` for anything else.
pub fn read(payload: &[u8], step: Step) -> Option<Packet<'_>> {
    let data_type = *payload.get(field::DATA_TYPE)?;
    let form = form(data_type)?;
    let points = usize::from(u16_at(payload, field::POINTS));
    let is_own =
        is_framed(payload) && points > 0 && payload.len() == HEADER_LEN + points * form.len();
    let sync = sync(payload).filter(|_| is_own)?;
    Some(Packet {
        form,
        body: payload.get(HEADER_LEN..)?,
        device_ns: sync.device_ns(time_at(payload, field::TIME)),
        sync,
        sequence: Some(u16_at(payload, field::COUNTER).into()),
        step: told_step(payload).unwrap_or(step),
    })
}

/// Whether a payload has accelerations and turn rates.
pub fn is_inertial(payload: &[u8]) -> bool {
    let (kind, len) = INERTIAL;
    payload.len() == len && is_framed(payload) && payload[field::DATA_TYPE] == kind
}

/// Whether a payload is a command, its answer, or the state of the sensor.
pub fn is_command(payload: &[u8]) -> bool {
    let len = usize::from(u16_at(payload, 2));
    payload.starts_with(&COMMAND) && payload.len() >= 24 && len == payload.len()
}

/// A packet to write.
#[derive(Debug, Clone, PartialEq)]
pub struct RawPacket {
    /// Data type.
    pub data_type: u8,
    /// What the clock follows.
    pub sync: Sync,
    /// Device time of the first shot.
    pub time_ns: i64,
    /// Time from the first shot to the last, written to a tenth of a microsecond.
    pub interval_ns: i64,
    /// Number of the packet.
    pub counter: u16,
    /// Number of the frame.
    pub frame: u8,
    /// Points of the shots.
    pub shots: Vec<Vec<RawPoint>>,
}

/// Writes a data packet; a type that is none gives no byte.
pub fn encode(packet: &RawPacket) -> Vec<u8> {
    let Some(form) = form(packet.data_type) else {
        return Vec::new();
    };
    let mut bytes = vec![0; HEADER_LEN + packet.shots.len() * form.len()];
    let len = bytes.len() as u16;
    let points = packet.shots.len() as u16;
    let interval = (packet.interval_ns / INTERVAL_NS).clamp(0, 0xFFFF) as u16;
    put(&mut bytes, field::LEN, &len.to_le_bytes());
    put(&mut bytes, field::INTERVAL, &interval.to_le_bytes());
    put(&mut bytes, field::POINTS, &points.to_le_bytes());
    put(&mut bytes, field::COUNTER, &packet.counter.to_le_bytes());
    bytes[field::FRAME] = packet.frame;
    bytes[field::DATA_TYPE] = packet.data_type;
    bytes[field::TIME_TYPE] = match packet.sync {
        Sync::Ptp => 1,
        Sync::Gnss => 2,
        Sync::Free | Sync::Pulse => 0,
    };
    put(&mut bytes, field::TIME, &packet.time_ns.to_le_bytes());
    let places = bytes[HEADER_LEN..].chunks_exact_mut(form.len());
    for (place, points) in places.zip(&packet.shots) {
        for (echo, point) in points.iter().enumerate().take(form.echoes) {
            form.write(place, echo, point);
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: Step = Step::new(5_000, 1);

    #[test]
    fn header_and_steps_come_back() {
        for (data_type, len) in [(1, 1380), (2, 804), (3, 996), (0x11, 36 + 28 * 96)] {
            let packet = RawPacket {
                data_type,
                sync: Sync::Ptp,
                time_ns: 1_718_000_000_500_000_123,
                interval_ns: 475_000,
                counter: 65_535,
                frame: 0,
                shots: vec![Vec::new(); POINTS],
            };
            let bytes = encode(&packet);
            assert_eq!(bytes.len(), len);
            let found = read(&bytes, Step::new(1, 1)).unwrap();
            assert_eq!(
                (found.device_ns, found.sequence),
                (packet.time_ns, Some(65_535))
            );
            // 4750 tenths of a microsecond over 95 steps.
            assert_eq!(
                (found.step.until(1), found.step.until(95)),
                (5_000, 475_000)
            );
            assert_eq!((found.count(), found.duration_ns()), (96, 480_000));
        }
    }

    #[test]
    fn a_packet_without_an_interval_has_the_models_step() {
        let packet = RawPacket {
            data_type: 2,
            sync: Sync::Free,
            time_ns: 5,
            interval_ns: 0,
            counter: 0,
            frame: 0,
            shots: vec![Vec::new(); 7],
        };
        let bytes = encode(&packet);
        assert_eq!(read(&bytes, STEP).unwrap().duration_ns(), 35_000);
        assert!(read(&bytes[..bytes.len() - 1], STEP).is_none());
    }

    #[test]
    fn other_packets_of_the_sensor_are_told_from_data() {
        let mut inertial = vec![0; 60];
        inertial[1] = 60;
        assert!(is_inertial(&inertial) && read(&inertial, STEP).is_none());
        let mut command = vec![0xAA, 0, 30, 0];
        command.resize(30, 0);
        assert!(is_command(&command) && !is_command(&command[..29]));
    }
}
