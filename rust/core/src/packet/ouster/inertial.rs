//! Packets of Ouster sensors beside data: accelerations and turn rates, and zones.

use super::super::PacketKind;

/// Bytes of the older packet, which has nothing that identifies it.
const LEGACY_LEN: usize = 48;
/// Bytes of the newer packet around its measurements, and of one of those.
const AROUND_LEN: usize = 132 + 32;
const MEASUREMENT_LEN: usize = 36;
const ZONE_LEN: usize = 680;
/// The three stamps of one packet are this near to each other, ns.
const WITHIN_NS: u64 = 1_000_000_000;

/// What a payload is, if it is one of them.
pub fn kind(payload: &[u8]) -> Option<PacketKind> {
    let first = payload.first_chunk::<4>()?;
    // The newer packets count their kinds in the first byte or two.
    let is_kind = |kind: u8| first[0] == kind;
    if payload.len() == LEGACY_LEN {
        return is_legacy(payload).then_some(PacketKind::Inertial);
    }
    if payload.len() == ZONE_LEN && is_kind(3) {
        return Some(PacketKind::Status);
    }
    let measurements = payload.len().checked_sub(AROUND_LEN)?;
    let is_whole = measurements > 0
        && measurements.is_multiple_of(MEASUREMENT_LEN)
        && measurements / MEASUREMENT_LEN <= 64;
    (is_kind(2) && is_whole && is_stamped(payload)).then_some(PacketKind::Inertial)
}

/// Three stamps near each other, then six finite numbers of sound size.
fn is_legacy(payload: &[u8]) -> bool {
    let stamp = |place: usize| {
        payload
            .get(8 * place..8 * place + 8)
            .and_then(|b| b.try_into().ok())
            .map(u64::from_le_bytes)
    };
    let (Some(system), Some(accelerometer), Some(gyroscope)) = (stamp(0), stamp(1), stamp(2))
    else {
        return false;
    };
    let is_near = |other: u64| other == 0 || system.abs_diff(other) < WITHIN_NS;
    let values = payload[24..]
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    system > 0
        && is_near(accelerometer)
        && is_near(gyroscope)
        && values.into_iter().all(|value| value.abs() < 10_000.0)
}

/// Measurements of the newer packet have stamps that do not go back.
fn is_stamped(payload: &[u8]) -> bool {
    let measurements = payload.get(132..payload.len() - 32).unwrap_or(&[]);
    let stamps = measurements
        .chunks_exact(MEASUREMENT_LEN)
        .map(|m| u64::from_le_bytes([m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7]]));
    let stamps: Vec<u64> = stamps.collect();
    stamps
        .windows(2)
        .all(|pair| pair[1] >= pair[0] && pair[1] - pair[0] < WITHIN_NS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accelerations_are_told_from_other_packets_of_the_size() {
        let mut bytes = Vec::new();
        for stamp in [5_000_000_000_u64, 5_000_100_000, 5_000_200_000] {
            bytes.extend(stamp.to_le_bytes());
        }
        for value in [0.01_f32, -0.02, 1.0, 0.3, -0.1, 4.0] {
            bytes.extend(value.to_le_bytes());
        }
        assert_eq!(kind(&bytes), Some(PacketKind::Inertial));
        bytes[47] = 0x7F;
        assert_eq!(kind(&bytes), None);
        assert_eq!(kind(&[0; 48]), None);
    }

    #[test]
    fn newer_packets_count_their_kinds() {
        let mut bytes = vec![0; 452];
        bytes[0] = 2;
        assert_eq!(kind(&bytes), Some(PacketKind::Inertial));
        bytes[0] = 1;
        assert_eq!(kind(&bytes), None);
        let mut zone = vec![0; 680];
        zone[0] = 3;
        assert_eq!(kind(&zone), Some(PacketKind::Status));
    }
}
