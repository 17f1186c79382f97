//! The echoes of one firing, and what is made of them.

use super::{Fan, Row, place};
use crate::cloud::ReturnKind;
use crate::packet::echoes::{MOST, single_kind};
use crate::packet::sheet::Sheet;
use crate::packet::{Decoded, ReturnMode};

/// Echoes beyond which they are appended without waiting for the next firing, so that they stay in the fastest memory.
const ENOUGH: usize = 256;

/// The echoes of firings, and what is made of them. Meant to be used again and again.
#[derive(Debug, Default)]
pub struct Desk {
    /// Those that are not appended yet, one firing and one return behind the other.
    sheet: Sheet,
    near: Sheet,
    /// Numbers of the packets that hold their returns.
    packets: [u32; MOST],
    /// What they are where shots have one return.
    single: Option<ReturnKind>,
}

/// Echoes of one return of all shots, to be filled in.
pub struct Echoes<'a> {
    /// Ranges in the model's unit; 0 = no return.
    pub range: &'a mut [i32],
    /// Brightness.
    pub intensity: &'a mut [u16],
    /// Blocks of the packet.
    pub block: &'a mut [u16],
}

impl Desk {
    /// Makes room for the echoes of a firing of `lanes` shots; there are none yet.
    pub fn open(&mut self, lanes: usize, returns: usize) {
        self.sheet.add(lanes, returns);
    }

    /// Echoes of the return with this number.
    pub fn echoes(&mut self, echo: usize) -> Echoes<'_> {
        let range = self.sheet.echoes(echo);
        Echoes {
            range: &mut self.sheet.range[range.clone()],
            intensity: &mut self.sheet.intensity[range.clone()],
            block: &mut self.sheet.block[range],
        }
    }

    /// Range of an echo.
    #[inline]
    pub fn range(&self, lane: usize, echo: usize) -> i32 {
        self.sheet.range[self.sheet.echoes(echo).start + lane]
    }

    /// Places the echoes of a firing; their returns are appended when there are enough of them, or by [`Desk::flush`].
    /// Those of one packet alone wait together.
    ///
    /// Targets nearer than so many metres are shot by the second fan, which has the same beams at other times.
    pub fn push(
        &mut self,
        fan: &Fan,
        near: Option<(&Fan, f64)>,
        row: &Row,
        mode: ReturnMode,
        out: &mut Decoded,
    ) {
        if mode.returns() == 1 {
            return self.push_single(fan, near, row, single_kind(mode), out);
        }
        out.merged += self.sheet.judge(mode);
        self.finish(fan, near, row, out);
    }

    /// The same where shots have one return of one kind.
    pub fn push_single(
        &mut self,
        fan: &Fan,
        near: Option<(&Fan, f64)>,
        row: &Row,
        return_kind: ReturnKind,
        out: &mut Decoded,
    ) {
        self.single = Some(return_kind);
        self.hold(fan, near, row, out);
    }

    /// The same where [`Desk::hit`] told the returns.
    pub fn finish(&mut self, fan: &Fan, near: Option<(&Fan, f64)>, row: &Row, out: &mut Decoded) {
        self.single = None;
        self.hold(fan, near, row, out);
    }

    /// Tells what an echo is. Shots come in their order.
    #[inline]
    pub fn hit(&mut self, lane: usize, echo: usize, return_kind: ReturnKind) {
        let entry = self.sheet.echoes(echo).start + lane;
        self.sheet.hit(entry, echo, return_kind);
    }

    /// Appends the returns of all firings that wait.
    pub fn flush(&mut self, out: &mut Decoded) {
        match self.single {
            Some(kind) => self.sheet.flush_singles(kind, self.packets[0], out),
            None => self.sheet.flush(self.packets, out),
        }
    }

    fn hold(&mut self, fan: &Fan, near: Option<(&Fan, f64)>, row: &Row, out: &mut Decoded) {
        self.packets = row.packets;
        if !self.sheet.has_ranges() {
            return self.sheet.remove_last();
        }
        self.place(fan, near, row);
        if self.sheet.len() >= ENOUGH {
            self.flush(out);
        }
    }

    fn place(&mut self, fan: &Fan, near: Option<(&Fan, f64)>, row: &Row) {
        place(fan, row, &mut self.sheet);
        let Some((near_fan, near_m)) = near else {
            return;
        };
        let (sheet, near) = (&mut self.sheet, &mut self.near);
        let firing = sheet.firing();
        let is_near = |range: &i32| *range != 0 && f64::from(*range) * row.unit_m < near_m;
        let ranges = &sheet.range[firing.clone()];
        if !ranges.iter().any(is_near) {
            return;
        }
        near.open(firing.len(), 1);
        near.range[..firing.len()].copy_from_slice(ranges);
        place(near_fan, row, near);
        for (from, at) in firing.enumerate() {
            if is_near(&near.range[from]) {
                sheet.azimuth_rad[at] = near.azimuth_rad[from];
                sheet.xyz_m[at] = near.xyz_m[from];
                sheet.time_ns[at] = near.time_ns[from];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::fan::Beam;

    const ROW: Row = Row {
        encoder_rad: 1.0,
        azimuth_rad: 6.0,
        axes: [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        origin_m: [0.0, 0.0, 10.0],
        unit_m: 0.5,
        time_ns: 1000,
        packets: [7, 8, 8],
    };

    fn fan(lanes: usize, delay_ns: i64) -> Fan {
        let beam = |lane: usize| Beam {
            ring: lane as u16,
            delay_ns: delay_ns + lane as i64,
            turned_rad: 0.0,
            azimuth_rad: 0.5,
            direction: [1.0, 0.0, 0.0],
            origin_m: [0.0, 0.25, 0.0],
        };
        (0..lanes).map(beam).collect()
    }

    /// Two echoes of 20 shots: the first shot missed, the second saw one thing.
    fn dual(desk: &mut Desk) {
        desk.open(20, 2);
        for echo in 0..2 {
            let echoes = desk.echoes(echo);
            for (lane, range) in echoes.range.iter_mut().enumerate() {
                *range = [0, 40, 40 + 60 * (1 - echo as i32)][lane.min(2)];
            }
            echoes.block.fill(echo as u16);
        }
    }

    #[test]
    fn shots_keep_their_order_and_echoes_their_places() {
        let (mut desk, mut out) = (Desk::default(), Decoded::default());
        dual(&mut desk);
        desk.push(&fan(20, 0), None, &ROW, ReturnMode::Dual, &mut out);
        desk.flush(&mut out);
        let cloud = &out.cloud;
        assert_eq!((cloud.len(), out.merged), (1 + 2 * 18, 1));
        assert_eq!(
            (cloud.ring[0], cloud.return_kind[0]),
            (1, ReturnKind::Merged)
        );
        let pair = [cloud.get(1), cloud.get(2)];
        assert_eq!(pair.map(|echo| echo.ring), [2, 2]);
        assert_eq!(pair.map(|echo| (echo.packet, echo.block)), [(7, 0), (8, 1)]);
        // 100 and 40 units of half a metre along the rotor's first axis, which is the sensor's second.
        assert_eq!(pair[0].xyz_m, [0.25, 50.0, 10.0]);
        assert_eq!(pair[1].xyz_m, [0.25, 20.0, 10.0]);
        assert_eq!(pair.map(|echo| echo.time.0), [1002, 1002]);
        let azimuth_rad = (6.5 - std::f64::consts::TAU) as f32;
        assert_eq!(pair[0].azimuth_rad, azimuth_rad);
    }

    #[test]
    fn near_echoes_are_of_the_other_fan() {
        let (mut desk, mut out) = (Desk::default(), Decoded::default());
        let (far, near) = (fan(20, 0), fan(20, 500));
        dual(&mut desk);
        desk.push(&far, Some((&near, 30.0)), &ROW, ReturnMode::Dual, &mut out);
        desk.flush(&mut out);
        assert_eq!(out.cloud.time_ns[..3], [1501, 1002, 1502]);
    }

    #[test]
    fn a_full_firing_gives_what_a_firing_with_a_gap_gives() {
        let pushed = |first: i32| {
            let (mut desk, mut out) = (Desk::default(), Decoded::default());
            desk.open(33, 1);
            let ranges = desk.echoes(0).range;
            for (range, value) in ranges.iter_mut().zip(first..) {
                *range = value;
            }
            desk.push(&fan(33, 0), None, &ROW, ReturnMode::Last, &mut out);
            desk.flush(&mut out);
            out.cloud.iter().collect::<Vec<_>>()
        };
        let (full, gap) = (pushed(1), pushed(-5));
        assert_eq!((full.len(), gap.len()), (33, 32));
        // Range 1 of lane 0 there is range 1 of lane 6 here.
        let moved = crate::cloud::Return {
            ring: 6,
            time: full[0].time + 6,
            ..full[0]
        };
        assert_eq!(gap[5], moved);
    }
}
