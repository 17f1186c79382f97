//! The echoes of one firing, and what is made of them.

use super::{Fan, LANES, Lane, Row, Spots, place};
use crate::cloud::ReturnKind;
use crate::packet::echoes::{MOST, RawEcho, judge};
use crate::packet::{Decoded, ReturnMode};

/// A shot that hit.
#[derive(Debug, Clone, Copy)]
struct Hit {
    /// Among the echoes of the desk.
    entry: u16,
    lane: u16,
    /// Among the returns of the shot.
    echo: u8,
    return_kind: ReturnKind,
}

const NO_HIT: Hit = Hit {
    entry: 0,
    lane: 0,
    echo: 0,
    return_kind: ReturnKind::Strongest,
};

/// The echoes of a firing, and what is made of them. Meant to be used again and again.
#[derive(Debug, Default)]
pub struct Desk {
    lanes: usize,
    chunks: usize, // of one return
    range: Vec<Lane<i32>>,
    intensity: Vec<Lane<u16>>,
    block: Vec<Lane<u16>>,
    spots: Spots,
    near: Spots,
    hits: Vec<Hit>,
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
    /// Makes room for the echoes of `lanes` shots; there are none yet.
    pub fn open(&mut self, lanes: usize, returns: usize) {
        self.lanes = lanes;
        self.chunks = lanes.div_ceil(LANES);
        let chunks = self.chunks * returns;
        self.range.clear();
        self.range.resize(chunks, [0; LANES]);
        self.intensity.resize(chunks, [0; LANES]);
        self.block.resize(chunks, [0; LANES]);
        self.hits.clear();
    }

    /// Echoes of the return with this number.
    pub fn echoes(&mut self, echo: usize) -> Echoes<'_> {
        let range = echo * self.chunks * LANES..echo * self.chunks * LANES + self.lanes;
        Echoes {
            range: &mut self.range.as_flattened_mut()[range.clone()],
            intensity: &mut self.intensity.as_flattened_mut()[range.clone()],
            block: &mut self.block.as_flattened_mut()[range],
        }
    }

    /// Range of an echo.
    #[inline]
    pub fn range(&self, lane: usize, echo: usize) -> i32 {
        self.range.as_flattened()[echo * self.chunks * LANES + lane]
    }

    /// Appends the returns of a firing.
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
        out.merged += self.judge(mode);
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
        let ranges = &self.range.as_flattened()[..self.lanes];
        if ranges.iter().all(|range| *range != 0) {
            self.place(fan, near, row);
            return self.keep_all(fan, row, return_kind, out);
        }
        let hits = (0..).zip(ranges).filter(|(_, range)| **range != 0);
        self.hits.extend(hits.map(|(lane, _)| Hit {
            entry: lane,
            lane,
            echo: 0,
            return_kind,
        }));
        self.finish(fan, near, row, out);
    }

    /// Appends the returns that were told by [`Desk::hit`].
    pub fn finish(&mut self, fan: &Fan, near: Option<(&Fan, f64)>, row: &Row, out: &mut Decoded) {
        if !self.hits.is_empty() {
            self.place(fan, near, row);
            self.keep(fan, row, out);
        }
    }

    /// Tells what an echo is. Shots come in their order.
    #[inline]
    pub fn hit(&mut self, lane: usize, echo: usize, return_kind: ReturnKind) {
        self.hits.push(Hit {
            entry: (echo * self.chunks * LANES + lane) as u16,
            lane: lane as u16,
            echo: echo as u8,
            return_kind,
        });
    }

    /// Finds what the echoes are; gives how many were merged into others.
    fn judge(&mut self, mode: ReturnMode) -> u64 {
        let returns = mode.returns();
        let step = self.chunks * LANES;
        self.hits.resize(self.lanes * returns, NO_HIT);
        let ranges = self.range.as_flattened();
        let intensities = self.intensity.as_flattened();
        let (mut count, mut merged) = (0, 0);
        for lane in 0..self.lanes {
            let mut echoes = [RawEcho::default(); MOST];
            for (echo, raw) in echoes.iter_mut().enumerate().take(returns) {
                raw.range = ranges[echo * step + lane] as u16;
                raw.intensity = intensities[echo * step + lane] as u8;
            }
            let (kinds, same) = judge(mode, &echoes[..returns]);
            merged += u64::from(same);
            for (echo, kind) in kinds.into_iter().enumerate().take(returns) {
                let Some(return_kind) = kind else { continue };
                self.hits[count] = Hit {
                    entry: (echo * step + lane) as u16,
                    lane: lane as u16,
                    echo: echo as u8,
                    return_kind,
                };
                count += 1;
            }
        }
        self.hits.truncate(count);
        merged
    }

    fn place(&mut self, fan: &Fan, near: Option<(&Fan, f64)>, row: &Row) {
        place(fan, row, &self.range, &mut self.spots);
        let Some((near_fan, near_m)) = near else {
            return;
        };
        let is_near = |range: &i32| *range != 0 && f64::from(*range) * row.unit_m < near_m;
        let ranges = self.range.as_flattened();
        if !ranges.iter().any(is_near) {
            return;
        }
        place(near_fan, row, &self.range, &mut self.near);
        let entries = ranges.iter().enumerate();
        for (entry, _) in entries.filter(|(_, range)| is_near(range)) {
            self.spots.copy(&self.near, entry);
        }
    }

    /// Appends a firing in which all shots hit.
    fn keep_all(&self, fan: &Fan, row: &Row, return_kind: ReturnKind, out: &mut Decoded) {
        let (spots, lanes) = (&self.spots, self.lanes);
        fn all<T>(column: &[Lane<T>], lanes: usize) -> &[T] {
            &column.as_flattened()[..lanes]
        }
        let cloud = &mut out.cloud;
        out.encoder_rad
            .extend_from_slice(all(&spots.encoder_rad, lanes));
        cloud.xyz_m.extend_from_slice(all(&spots.xyz_m, lanes));
        cloud.time_ns.extend_from_slice(all(&spots.time_ns, lanes));
        cloud.range_m.extend_from_slice(all(&spots.range_m, lanes));
        cloud
            .azimuth_rad
            .extend_from_slice(all(&spots.azimuth_rad, lanes));
        cloud.ring.extend_from_slice(&fan.ring[..lanes]);
        cloud
            .intensity
            .extend_from_slice(all(&self.intensity, lanes));
        cloud.block.extend_from_slice(all(&self.block, lanes));
        let len = cloud.xyz_m.len();
        cloud.return_index.resize(len, 0);
        cloud.return_kind.resize(len, return_kind);
        cloud.packet.resize(len, row.packets[0]);
    }

    /// Appends the hits of a firing.
    fn keep(&self, fan: &Fan, row: &Row, out: &mut Decoded) {
        fn of<T: Copy>(column: &[Lane<T>], hits: &[Hit]) -> impl ExactSizeIterator<Item = T> {
            let column = column.as_flattened();
            hits.iter().map(|hit| column[usize::from(hit.entry)])
        }
        let (spots, hits) = (&self.spots, self.hits.as_slice());
        let cloud = &mut out.cloud;
        out.encoder_rad.extend(of(&spots.encoder_rad, hits));
        cloud.xyz_m.extend(of(&spots.xyz_m, hits));
        cloud.time_ns.extend(of(&spots.time_ns, hits));
        cloud.range_m.extend(of(&spots.range_m, hits));
        cloud.azimuth_rad.extend(of(&spots.azimuth_rad, hits));
        cloud.intensity.extend(of(&self.intensity, hits));
        cloud.block.extend(of(&self.block, hits));
        let rings = hits.iter().map(|hit| fan.ring[usize::from(hit.lane)]);
        cloud.ring.extend(rings);
        cloud.return_index.extend(hits.iter().map(|hit| hit.echo));
        let kinds = hits.iter().map(|hit| hit.return_kind);
        cloud.return_kind.extend(kinds);
        let packets = hits.iter().map(|hit| row.packets[usize::from(hit.echo)]);
        cloud.packet.extend(packets);
    }
}

/// Meaning of the only echo of a setting for single returns.
pub fn single_kind(mode: ReturnMode) -> ReturnKind {
    let echo = RawEcho {
        range: 1,
        intensity: 0,
    };
    judge(mode, &[echo]).0[0].unwrap_or(ReturnKind::Strongest)
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
