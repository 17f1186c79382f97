//! Static surfaces watched: echoes added up by cells of beam and azimuth, and how high they lie.
//!
//! Sums go in the order of the echoes, one cell as any other.

mod abreast;
pub mod adjust;

use std::ops::Range;

use crate::cloud::PointCloud;
use crate::frame::Sensor;
use crate::stream::Taker;
use crate::sweep::{Gathered, Kept, Sweep};

/// How echoes fall into cells: so many steps of azimuth to a turn, and the turns of all beams in a row.
#[derive(Debug, Clone, Copy)]
pub struct CellGrid {
    /// Step of azimuth, degrees.
    pub step_deg: f32,
    /// Steps to a turn.
    pub steps: u32,
    /// Beams beyond share the cells of this one.
    pub last_ring: u16,
}

impl CellGrid {
    /// Number of the cell of an echo; a beam without azimuth counts as at zero.
    pub fn cell(&self, ring: u16, azimuth_deg: f32) -> u32 {
        let azimuth_deg = if azimuth_deg.is_nan() {
            0.0
        } else {
            azimuth_deg
        };
        let turn = i64::from(self.steps);
        let step = ((azimuth_deg / self.step_deg).floor() as i64).rem_euclid(turn);
        u32::from(ring.min(self.last_ring)) * self.steps + step as u32
    }

    /// Cells of echoes, by columns of one length.
    pub fn cells(&self, rings: &[u16], azimuths_deg: &[f32]) -> Vec<u32> {
        let echoes = rings.iter().zip(azimuths_deg);
        let cell = |(ring, azimuth_deg): (&u16, &f32)| self.cell(*ring, *azimuth_deg);
        echoes.map(cell).collect()
    }
}

/// Numbers of echoes by cell, and the sums of their positions by axis.
pub fn positions(cells: &[u32], xyz_m: &[[f32; 3]], size: usize) -> (Vec<i64>, [Vec<f64>; 3]) {
    let mut count = vec![0; size];
    let mut sums = [vec![0.0; size], vec![0.0; size], vec![0.0; size]];
    for (cell, xyz) in cells.iter().zip(xyz_m) {
        let Some(place) = place(*cell, size) else {
            continue;
        };
        count[place] += 1;
        for (sum, x) in sums.iter_mut().zip(xyz) {
            sum[place] += f64::from(*x);
        }
    }
    (count, sums)
}

/// A plane as a lidar sees it.
#[derive(Debug, Clone, Copy)]
pub struct SeenPlane {
    /// Its normal, sensor axes.
    pub along: [f64; 3],
    /// How far along the normal it lies from the lidar, metres.
    pub beneath_m: f64,
}

/// What a watched cell looks like in the reference, columns by cell.
#[derive(Debug, Clone, Copy)]
pub struct Reference<'a> {
    /// Number of the plane that the cell lies on; negative for cells that are not watched.
    pub plane: &'a [i64],
    /// Height above the plane, metres.
    pub height_m: &'a [f64],
    /// Echoes farther from that height are something else.
    pub gate_m: &'a [f64],
}

/// Heights above the reference by cell: numbers of echoes, sums, and sums of squares.
#[derive(Debug, Clone)]
pub struct Heights {
    /// Echoes within the gate.
    pub count: Vec<i64>,
    /// Sums of their heights, metres.
    pub sum_m: Vec<f64>,
    /// Sums of the squares.
    pub squares_m2: Vec<f64>,
}

/// What the echoes of one cell are held against, in one place of memory.
#[derive(Clone, Copy)]
struct Surface {
    plane: usize,
    height_m: f64,
    gate_m: f64,
}

/// Heights of one cell, in one place of memory.
#[derive(Clone, Copy, Default)]
struct Sum {
    count: i64,
    sum_m: f64,
    squares_m2: f64,
}

/// Adds up the heights of echoes on watched cells.
pub fn heights(
    cells: &[u32],
    xyz_m: &[[f32; 3]],
    reference: &Reference<'_>,
    planes: &[SeenPlane],
) -> Heights {
    let columns = reference.plane.iter().zip(reference.height_m);
    let surface = |((plane, height_m), gate_m): ((&i64, &f64), &f64)| Surface {
        plane: usize::try_from(*plane).unwrap_or(usize::MAX),
        height_m: *height_m,
        gate_m: *gate_m,
    };
    let surfaces: Vec<Surface> = columns.zip(reference.gate_m).map(surface).collect();
    let mut sums = vec![Sum::default(); surfaces.len()];
    for (cell, xyz) in cells.iter().zip(xyz_m) {
        let Some(place) = place(*cell, surfaces.len()) else {
            continue;
        };
        let surface = &surfaces[place];
        let Some(plane) = planes.get(surface.plane) else {
            continue;
        };
        let [x, y, z] = xyz.map(f64::from);
        let height = x * plane.along[0] + y * plane.along[1] + z * plane.along[2] - plane.beneath_m;
        let away = height - surface.height_m;
        if away.abs() < surface.gate_m {
            let sum = &mut sums[place];
            sum.count += 1;
            sum.sum_m += away;
            sum.squares_m2 += away * away;
        }
    }
    Heights {
        count: sums.iter().map(|sum| sum.count).collect(),
        sum_m: sums.iter().map(|sum| sum.sum_m).collect(),
        squares_m2: sums.iter().map(|sum| sum.squares_m2).collect(),
    }
}

fn place(cell: u32, size: usize) -> Option<usize> {
    Some(cell as usize).filter(|place| *place < size)
}

/// Echoes on watched cells in one window of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Number of the window, of the length that was asked for.
    number: i64,
    /// Cells of the echoes.
    pub cell: Vec<u32>,
    /// Their places in the sensor frame, metres.
    pub xyz_m: Vec<[f32; 3]>,
    /// Start of the first sweep and end of the last, nanoseconds.
    pub from_ns: i64,
    /// See `from_ns`.
    pub to_ns: i64,
}

/// Gathers one lidar's windows.
#[derive(Debug)]
pub struct WindowTaker {
    grid: CellGrid,
    is_watched: Vec<bool>,
    start_ns: i64,
    length_ns: i64,
    open: Option<Window>,
    ready: Vec<Window>,
    usual: usize, // echoes of the last window: as much room is made for the next
}

impl WindowTaker {
    /// Windows of `length_ns` from `start_ns` on, of the cells that are watched.
    /// About `usual` echoes are expected in each.
    pub fn new(
        grid: CellGrid,
        is_watched: Vec<bool>,
        start_ns: i64,
        length_ns: i64,
        usual: usize,
    ) -> Self {
        Self {
            grid,
            is_watched,
            start_ns,
            length_ns: length_ns.max(1),
            open: None,
            ready: Vec::new(),
            usual,
        }
    }

    /// Of a lidar that is not watched: no echo falls into a window.
    pub fn idle(grid: CellGrid) -> Self {
        Self::new(grid, Vec::new(), 0, i64::MAX, 0)
    }

    /// The windows that are over since the last call; with `is_last` also the one that lasts.
    pub fn ready(&mut self, is_last: bool) -> Vec<Window> {
        if is_last {
            self.ready.extend(self.open.take());
        }
        std::mem::take(&mut self.ready)
    }

    fn window(&mut self, sweep: &Sweep<CellEchoes>) -> &mut Window {
        let number = (sweep.start.0 - self.start_ns).div_euclid(self.length_ns);
        if let Some(over) = self.open.take_if(|open| open.number != number) {
            self.usual = over.cell.len();
            self.ready.push(over);
        }
        let room = self.usual + self.usual / 16;
        self.open.get_or_insert_with(|| Window {
            number,
            cell: Vec::with_capacity(room),
            xyz_m: Vec::with_capacity(room),
            from_ns: sweep.start.0,
            to_ns: sweep.end.0,
        })
    }
}

impl Taker for WindowTaker {
    type Kept = CellEchoes;

    fn take(&mut self, sweep: &Sweep<CellEchoes>) {
        let (grid, is_watched) = (self.grid, std::mem::take(&mut self.is_watched));
        let window = self.window(sweep);
        window.from_ns = window.from_ns.min(sweep.start.0);
        window.to_ns = window.to_ns.max(sweep.end.0);
        let echoes = &sweep.cloud;
        abreast::each(&grid, &echoes.ring, &echoes.azimuth_rad, |echo, cell| {
            if is_watched.get(cell as usize).is_some_and(|is| *is) {
                window.cell.push(cell);
                window.xyz_m.push(echoes.xyz_m[echo]);
            }
        });
        self.is_watched = is_watched;
    }
}

/// Echoes of a sweep in the columns that tell their cells and heights.
#[derive(Debug, Clone, Default)]
pub struct CellEchoes {
    xyz_m: Vec<[f32; 3]>,
    ring: Vec<u16>,
    azimuth_rad: Vec<f32>,
}

impl Kept for CellEchoes {
    const IS_SLIM: bool = true;

    fn take(&mut self, from: &PointCloud<Sensor>, places: Range<usize>) {
        self.xyz_m.extend_from_slice(&from.xyz_m[places.clone()]);
        self.ring.extend_from_slice(&from.ring[places.clone()]);
        self.azimuth_rad
            .extend_from_slice(&from.azimuth_rad[places]);
    }
}

impl Gathered for CellEchoes {
    fn count(&self) -> usize {
        self.xyz_m.len()
    }

    fn make_room(&mut self, additional: usize) {
        self.xyz_m.reserve(additional);
        self.ring.reserve(additional);
        self.azimuth_rad.reserve(additional);
    }

    fn empty(&mut self) {
        self.xyz_m.clear();
        self.ring.clear();
        self.azimuth_rad.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::Return;
    use crate::time::Timestamp;

    const GRID: CellGrid = CellGrid {
        step_deg: 0.5,
        steps: 720,
        last_ring: 3,
    };

    #[test]
    fn cells_go_by_beam_then_azimuth() {
        assert_eq!(GRID.cell(0, 0.49), 0);
        assert_eq!(GRID.cell(0, 0.5), 1);
        assert_eq!(GRID.cell(2, 359.9), 2 * 720 + 719);
        assert_eq!(GRID.cell(2, 360.0), 2 * 720); // a whole turn begins anew
        assert_eq!(GRID.cell(2, -0.1), 2 * 720 + 719);
        assert_eq!(GRID.cell(200, f32::NAN), 3 * 720);
    }

    #[test]
    fn heights_count_within_the_gate_of_watched_cells() {
        let planes = [SeenPlane {
            along: [0.0, 1.0, 0.0],
            beneath_m: -2.0,
        }];
        let reference = Reference {
            plane: &[0, -1, 0],
            height_m: &[0.25, 0.0, 0.0],
            gate_m: &[0.5, 0.5, 0.5],
        };
        // Cell 0 lies 0.25 m up: -1.5 m is 0.5 m above the plane and 0.25 m above that.
        let xyz = [
            [9.0, -1.5, 0.0],
            [9.0, -1.0, 0.0],
            [9.0, -2.0, 0.0],
            [0.0; 3],
        ];
        let found = heights(&[0, 0, 1, 7], &xyz, &reference, &planes);
        assert_eq!(found.count, [1, 0, 0]);
        assert_eq!(found.sum_m, [0.25, 0.0, 0.0]);
        assert_eq!(found.squares_m2, [0.0625, 0.0, 0.0]);
        let (count, [x, y, _]) = positions(&[0, 0, 1, 7], &xyz, 2);
        assert_eq!(
            (count, x, y),
            (vec![2, 1], vec![18.0, 9.0], vec![-2.5, -2.0])
        );
    }

    fn sweep(start_ns: i64, azimuths_deg: &[f32]) -> Sweep<CellEchoes> {
        let mut cloud = PointCloud::default();
        for azimuth_deg in azimuths_deg {
            cloud.push(&Return {
                azimuth_rad: azimuth_deg.to_radians(),
                ..Return::made_up([*azimuth_deg, 0.0, 0.0], Timestamp(start_ns))
            });
        }
        let mut kept = CellEchoes::default();
        kept.take(&cloud, 0..cloud.len());
        Sweep {
            lidar: 0,
            index: 0,
            cloud: kept,
            start: Timestamp(start_ns),
            end: Timestamp(start_ns + 10),
            coverage: 1.0,
            packets: 1,
            lost: 0,
            gaps: Vec::new(),
        }
    }

    #[test]
    fn windows_hold_what_began_in_them_and_was_watched() {
        let mut taker = WindowTaker::new(GRID, vec![false, true], 100, 50, 0);
        for (start_ns, azimuths_deg) in [(100, [0.2, 0.7]), (140, [0.8, 9.0]), (150, [0.6, 0.1])] {
            taker.take(&sweep(start_ns, &azimuths_deg));
        }
        let first = taker.ready(false);
        assert_eq!(first.len(), 1);
        assert_eq!(first[0].cell, [1, 1]);
        assert_eq!(first[0].xyz_m, [[0.7, 0.0, 0.0], [0.8, 0.0, 0.0]]);
        assert_eq!((first[0].from_ns, first[0].to_ns), (100, 150));
        let last = taker.ready(true);
        assert_eq!((last[0].from_ns, last[0].to_ns), (150, 160));
        assert!(taker.ready(true).is_empty());
    }
}
