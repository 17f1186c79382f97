//! Echoes side by side on their way into the columns of a cloud, quantity by quantity: all shots are placed
//! as if they had hit, and each column is filled once.

use std::ops::Range;

use super::echoes::{MOST, RawEcho, judge};
use super::{Decoded, ReturnMode};
use crate::cloud::ReturnKind;

/// Echoes of a chunk, which are placed without branches.
pub const LANES: usize = 16;

/// A quantity of a chunk.
pub type Lane<T> = [T; LANES];

/// The chunk of a sheet's column that begins at an echo.
///
/// # Panics
/// Where the column ends before.
#[inline(always)]
pub fn lane<T>(column: &[T], at: usize) -> &Lane<T> {
    column[at..].first_chunk().expect(ROOM)
}

/// The same, to be filled in.
///
/// # Panics
/// Where the column ends before.
#[inline(always)]
pub fn lane_mut<T>(column: &mut [T], at: usize) -> &mut Lane<T> {
    column[at..].first_chunk_mut().expect(ROOM)
}

const ROOM: &str = "a sheet has room for a chunk at every echo";

/// Echoes of one packet or firing. Meant to be used again and again; every column has room for a chunk that
/// begins at any echo, and what lies behind the last one means nothing.
#[derive(Debug, Default)]
pub struct Sheet {
    /// First echo of the last firing, its shots, all echoes.
    first: usize,
    shots: usize,
    len: usize,
    /// Ranges in the model's unit; 0 = no return.
    pub range: Vec<i32>,
    /// Brightness.
    pub intensity: Vec<u16>,
    /// Blocks of the packet.
    pub block: Vec<u16>,
    /// Numbers of the beams.
    pub ring: Vec<u16>,
    /// Azimuths on the scale on which sweeps are cut.
    pub encoder_rad: Vec<f32>,
    /// Azimuths of the shots.
    pub azimuth_rad: Vec<f32>,
    /// Ranges, metres.
    pub range_m: Vec<f32>,
    /// Positions, metres.
    pub xyz_m: Vec<[f32; 3]>,
    /// Instants of the shots.
    pub time_ns: Vec<i64>,
    hits: Vec<Hit>,
}

/// An echo that is a return.
#[derive(Debug, Clone, Copy)]
struct Hit {
    entry: u16,
    /// Among the returns of the shot.
    echo: u8,
    kind: ReturnKind,
}

const NO_HIT: Hit = Hit::new(0, 0, ReturnKind::Strongest);

impl Hit {
    #[inline(always)]
    const fn new(entry: usize, echo: usize, kind: ReturnKind) -> Self {
        Self {
            entry: entry as u16,
            echo: echo as u8,
            kind,
        }
    }
}

impl Sheet {
    /// Makes room for the echoes of so many shots, one return behind the other; there are none yet, and no others.
    pub fn open(&mut self, shots: usize, returns: usize) {
        self.clear();
        self.add(shots, returns);
    }

    /// Removes all echoes.
    pub fn clear(&mut self) {
        self.len = 0;
        self.hits.clear();
    }

    /// Makes room for the echoes of a further firing.
    pub fn add(&mut self, shots: usize, returns: usize) {
        (self.first, self.shots) = (self.len, shots);
        self.len += shots * returns;
        let room = self.len + LANES;
        if self.range.len() < room {
            self.grow(room);
        }
        self.range[self.first..room].fill(0);
    }

    /// Removes the last firing.
    pub fn remove_last(&mut self) {
        self.len = self.first;
    }

    fn grow(&mut self, room: usize) {
        self.range.resize(room, 0);
        self.intensity.resize(room, 0);
        self.block.resize(room, 0);
        self.ring.resize(room, 0);
        self.encoder_rad.resize(room, 0.0);
        self.azimuth_rad.resize(room, 0.0);
        self.range_m.resize(room, 0.0);
        self.xyz_m.resize(room, [0.0; 3]);
        self.time_ns.resize(room, 0);
    }

    /// Number of echoes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is room for none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// All echoes of the last firing.
    pub fn firing(&self) -> Range<usize> {
        self.first..self.len
    }

    /// Those of one return.
    #[inline(always)]
    pub fn echoes(&self, echo: usize) -> Range<usize> {
        let first = self.first + echo * self.shots;
        first..first + self.shots
    }

    /// What is known of the first return of all shots is the same for the others: beam, block, azimuths and time.
    pub fn repeat(&mut self) {
        let first = self.echoes(0);
        for at in self.firing().step_by(self.shots.max(1)).skip(1) {
            self.ring.copy_within(first.clone(), at);
            self.block.copy_within(first.clone(), at);
            self.encoder_rad.copy_within(first.clone(), at);
            self.azimuth_rad.copy_within(first.clone(), at);
            self.time_ns.copy_within(first.clone(), at);
        }
    }

    /// Tells what an echo is, and which of the returns of its shot. Returns come in their order.
    #[inline(always)]
    pub fn hit(&mut self, entry: usize, echo: usize, kind: ReturnKind) {
        self.hits.push(Hit::new(entry, echo, kind));
    }

    /// Finds what the echoes of the last firing are; gives how many were merged into others.
    pub fn judge(&mut self, mode: ReturnMode) -> u64 {
        let (shots, returns) = (self.shots, mode.returns());
        let (mut count, mut merged) = (self.hits.len(), 0);
        self.hits.resize(count + shots * returns, NO_HIT);
        for shot in self.echoes(0) {
            let mut echoes = [RawEcho::default(); MOST];
            for (echo, raw) in echoes.iter_mut().enumerate().take(returns) {
                raw.range = self.range[echo * shots + shot] as u16;
                raw.intensity = self.intensity[echo * shots + shot] as u8;
            }
            let (kinds, same) = judge(mode, &echoes[..returns]);
            merged += u64::from(same);
            for (echo, kind) in kinds.into_iter().enumerate().take(returns) {
                if let Some(kind) = kind {
                    self.hits[count] = Hit::new(echo * shots + shot, echo, kind);
                    count += 1;
                }
            }
        }
        self.hits.truncate(count);
        merged
    }

    /// Whether any shot of the last firing hit.
    pub fn has_ranges(&self) -> bool {
        self.range[self.firing()].iter().any(|range| *range != 0)
    }

    /// Appends all echoes with a range, which are the only ones of their shots and of one kind.
    pub fn flush_singles(&mut self, kind: ReturnKind, packet: u32, out: &mut Decoded) {
        let ranges = &self.range[..self.len];
        let is_whole = ranges.iter().fold(true, |all, range| all & (*range != 0));
        if !is_whole {
            let hits = (0..).zip(ranges).filter(|(_, range)| **range != 0);
            let hit = |(entry, _)| Hit::new(entry, 0, kind);
            self.hits.extend(hits.map(hit));
        }
        self.append(is_whole, out);
        if !out.is_slim {
            let cloud = &mut out.cloud;
            let len = cloud.xyz_m.len();
            cloud.return_index.resize(len, 0);
            cloud.return_kind.resize(len, kind);
            cloud.packet.resize(len, packet);
        }
        self.clear();
    }

    /// Appends what [`Sheet::hit`] told; `packets` hold the returns of a shot.
    pub fn flush(&mut self, packets: [u32; MOST], out: &mut Decoded) {
        let mut hits = (0..).zip(&self.hits);
        let is_whole = self.hits.len() == self.len && hits.all(|(entry, hit)| hit.entry == entry);
        self.append(is_whole, out);
        if out.is_slim {
            return self.clear();
        }
        let (cloud, hits) = (&mut out.cloud, self.hits.iter());
        cloud.return_index.extend(hits.clone().map(|hit| hit.echo));
        cloud.return_kind.extend(hits.clone().map(|hit| hit.kind));
        let packet = |hit: &Hit| packets[usize::from(hit.echo)];
        cloud.packet.extend(hits.map(packet));
        self.clear();
    }

    /// Appends the quantities of all echoes or of the hits.
    fn append(&self, is_whole: bool, out: &mut Decoded) {
        let picked = Picked {
            len: self.len,
            hits: (!is_whole).then_some(&self.hits),
        };
        let cloud = &mut out.cloud;
        picked.append(&self.encoder_rad, &mut out.encoder_rad);
        picked.append(&self.xyz_m, &mut cloud.xyz_m);
        picked.append(&self.time_ns, &mut cloud.time_ns);
        picked.append(&self.azimuth_rad, &mut cloud.azimuth_rad);
        picked.append(&self.ring, &mut cloud.ring);
        if !out.is_slim {
            picked.append(&self.range_m, &mut cloud.range_m);
            picked.append(&self.intensity, &mut cloud.intensity);
            picked.append(&self.block, &mut cloud.block);
        }
    }
}

/// What of a sheet is appended: all, or the hits.
struct Picked<'a> {
    len: usize,
    hits: Option<&'a [Hit]>,
}

impl Picked<'_> {
    #[inline(always)]
    fn append<T: Copy>(&self, column: &[T], to: &mut Vec<T>) {
        let column = &column[..self.len];
        match self.hits {
            None => to.extend_from_slice(column),
            Some(hits) => to.extend(hits.iter().map(|hit| column[usize::from(hit.entry)])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Return;
    use crate::time::Timestamp;

    /// An echo by its number; every seventh is none.
    fn filled(shots: usize, returns: usize) -> Sheet {
        let mut sheet = Sheet::default();
        for _ in 0..2 {
            sheet.open(shots, returns);
            for at in 0..shots * returns {
                sheet.range[at] = i32::from(!at.is_multiple_of(7));
                (sheet.intensity[at], sheet.block[at]) = (40 + at as u16, 60 + at as u16);
                (sheet.ring[at], sheet.time_ns[at]) = (30 + at as u16, 10 + at as i64);
                (sheet.encoder_rad[at], sheet.azimuth_rad[at]) =
                    (0.01 * at as f32, 0.1 * at as f32);
                (sheet.range_m[at], sheet.xyz_m[at]) = (20.0 + at as f32, [at as f32, 1.0, 2.0]);
            }
        }
        sheet
    }

    fn echo(at: usize, return_index: u8, return_kind: ReturnKind) -> Return {
        Return {
            xyz_m: [at as f32, 1.0, 2.0],
            time: Timestamp(10 + at as i64),
            range_m: 20.0 + at as f32,
            azimuth_rad: 0.1 * at as f32,
            ring: 30 + at as u16,
            intensity: 40 + at as u16,
            return_index,
            return_kind,
            packet: 50 + u32::from(return_index),
            block: 60 + at as u16,
        }
    }

    #[test]
    fn every_column_of_every_return_is_kept() {
        let mut out = Decoded::default();
        filled(40, 1).flush_singles(ReturnKind::Last, 50, &mut out);
        let some = out.cloud.len();
        let mut whole = filled(40, 1);
        whole.range.fill(1);
        whole.flush_singles(ReturnKind::First, 50, &mut out);
        let hits = (0..40).filter(|at: &usize| !at.is_multiple_of(7));
        let expected = hits.map(|at| echo(at, 0, ReturnKind::Last));
        let expected = expected.chain((0..40).map(|at| echo(at, 0, ReturnKind::First)));
        assert!(out.cloud.iter().eq(expected) && some == 34);
        assert_eq!(out.encoder_rad[some + 39], 0.01 * 39.0);
    }

    #[test]
    fn returns_of_firings_come_shot_by_shot() {
        let (mut sheet, mut out) = (filled(20, 2), Decoded::default());
        sheet.hit(3, 0, ReturnKind::First);
        sheet.hit(23, 1, ReturnKind::Last);
        sheet.add(5, 1);
        assert_eq!((sheet.len(), sheet.firing()), (45, 40..45));
        assert!(!sheet.has_ranges());
        sheet.remove_last();
        sheet.flush([50, 51, 51], &mut out);
        let expected = [echo(3, 0, ReturnKind::First), echo(23, 1, ReturnKind::Last)];
        assert!(out.cloud.iter().eq(expected) && sheet.is_empty());
    }

    #[test]
    fn a_slim_cloud_has_the_columns_that_are_looked_at() {
        let mut out = Decoded {
            is_slim: true,
            ..Decoded::default()
        };
        filled(20, 1).flush_singles(ReturnKind::Last, 50, &mut out);
        assert_eq!(out.cloud.len(), 17);
        assert_eq!((out.cloud.ring.len(), out.encoder_rad.len()), (17, 17));
        assert!(out.cloud.range_m.is_empty() && out.cloud.packet.is_empty());
    }
}
