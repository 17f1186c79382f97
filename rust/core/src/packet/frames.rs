//! Sensors without a rotor: their frames take the place of turns, so that what is cut at an azimuth
//! elsewhere is cut between frames here.

use std::f64::consts::TAU;

use super::Head;
use crate::angle::wrap_turn;

/// Frames of sensors that scan on and on without any are so long: 0.1 s, the rate of the makers' drivers.
pub const FRAME_NS: i64 = 100_000_000;

/// Share of a turn that stands for one nanosecond of a frame of [`FRAME_NS`].
pub const RAD_PER_NS: f64 = TAU / FRAME_NS as f64;

/// Angle that stands for an instant of the sensor's clock, [0, 2 pi).
pub fn phase_rad(device_ns: i64) -> f64 {
    device_ns.rem_euclid(FRAME_NS) as f64 * RAD_PER_NS
}

/// Angles that stand for a packet, the one numbered `place` of `len` in its frame: where it is, and how
/// far it is to the next. It stands in the middle of its share, so that frames end between packets.
pub fn place_rad(place: i64, len: i64) -> (f64, f64) {
    let len = len.max(1);
    let share_rad = TAU / len as f64;
    let middle = place.rem_euclid(len) as f64 + 0.5;
    (wrap_turn(middle * share_rad), share_rad)
}

impl Head {
    /// Packets of a frame, for sensors that number the packets of each.
    pub fn frame_len(&self) -> i64 {
        let len = (TAU / self.turned_rad.max(1e-6)).round();
        (len as i64).max(1)
    }

    /// Number of the first packet of a frame, where this one has `number`.
    pub fn first_number(&self, number: u32) -> u32 {
        let place = (self.azimuth_rad / self.turned_rad.max(1e-6)).floor();
        number.saturating_sub(place as u32)
    }

    /// The same in another place of a frame of another length.
    pub fn in_frame(mut self, place: i64, len: i64) -> Self {
        (self.azimuth_rad, self.turned_rad) = place_rad(place, len);
        self.rate_rad_per_ns = self.turned_rad / self.duration_ns.max(1) as f64;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::ReturnMode;

    #[test]
    fn places_in_frames_come_back() {
        for (place, len) in [(0, 630), (629, 630), (287, 288), (4799, 4800)] {
            let head = Head {
                device_ns: 0,
                sequence: None,
                azimuth_rad: 0.0,
                turned_rad: 0.0,
                rate_rad_per_ns: 0.0,
                duration_ns: 158_730,
                left_out: None,
                return_mode: ReturnMode::Strongest,
            };
            let head = head.in_frame(place, len);
            assert_eq!(
                (head.frame_len(), head.first_number(place as u32 + 1)),
                (len, 1)
            );
            assert!((0.0..TAU).contains(&head.azimuth_rad));
        }
    }

    #[test]
    fn frames_in_time_begin_with_tenths_of_seconds() {
        assert_eq!(phase_rad(1_718_000_000_500_000_000), 0.0);
        assert!((phase_rad(1_718_000_000_525_000_000) - TAU / 4.0).abs() < 1e-12);
        assert!((0.0..TAU).contains(&phase_rad(-1)));
    }
}
