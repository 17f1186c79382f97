//! Static surfaces watched: echoes added up by cells of beam and azimuth, and how high they lie.
//!
//! Sums go in the order of the echoes, one cell as any other.

use crate::stream::Taker;
use crate::sweep::Sweep;

/// How echoes fall into cells: so many steps of azimuth to a turn, and the turns of all beams in a row.
#[derive(Debug, Clone, Copy)]
pub struct CellGrid {
    /// Step of azimuth, degrees.
    pub step_deg: f32,
    /// Steps to a turn.
    pub steps: i64,
    /// Beams beyond share the cells of this one.
    pub last_ring: u16,
}

impl CellGrid {
    /// Number of the cell of an echo; a beam without azimuth counts as at zero.
    pub fn cell(&self, ring: u16, azimuth_deg: f32) -> i64 {
        let azimuth_deg = if azimuth_deg.is_nan() {
            0.0
        } else {
            azimuth_deg
        };
        let steps = azimuth_deg / self.step_deg;
        let step = steps as i64;
        let step = if steps >= 0.0 && step < self.steps {
            step // nearly all, without a division
        } else {
            (steps.floor() as i64).rem_euclid(self.steps)
        };
        i64::from(ring.min(self.last_ring)) * self.steps + step
    }

    /// Cells of echoes, by columns of one length.
    pub fn cells(&self, rings: &[u16], azimuths_deg: &[f32]) -> Vec<i64> {
        let echoes = rings.iter().zip(azimuths_deg);
        let cell = |(ring, azimuth_deg): (&u16, &f32)| self.cell(*ring, *azimuth_deg);
        echoes.map(cell).collect()
    }
}

/// Numbers of echoes by cell, and the sums of their positions by axis.
pub fn positions(cells: &[i64], xyz_m: &[[f32; 3]], size: usize) -> (Vec<i64>, [Vec<f64>; 3]) {
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

/// Adds up the heights of echoes on watched cells.
pub fn heights(
    cells: &[i64],
    xyz_m: &[[f32; 3]],
    reference: &Reference<'_>,
    planes: &[SeenPlane],
) -> Heights {
    let size = reference.plane.len();
    let mut found = Heights {
        count: vec![0; size],
        sum_m: vec![0.0; size],
        squares_m2: vec![0.0; size],
    };
    for (cell, xyz) in cells.iter().zip(xyz_m) {
        let Some(place) = place(*cell, size) else {
            continue;
        };
        let plane = usize::try_from(reference.plane[place]);
        let Some(plane) = plane.ok().and_then(|plane| planes.get(plane)) else {
            continue;
        };
        let [x, y, z] = xyz.map(f64::from);
        let height = x * plane.along[0] + y * plane.along[1] + z * plane.along[2] - plane.beneath_m;
        let away = height - reference.height_m[place];
        if away.abs() < reference.gate_m[place] {
            found.count[place] += 1;
            found.sum_m[place] += away;
            found.squares_m2[place] += away * away;
        }
    }
    found
}

fn place(cell: i64, size: usize) -> Option<usize> {
    usize::try_from(cell).ok().filter(|place| *place < size)
}

/// Echoes on watched cells in one window of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// Number of the window, of the length that was asked for.
    number: i64,
    /// Cells of the echoes.
    pub cell: Vec<i64>,
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
    pub fn new(grid: CellGrid, is_watched: Vec<bool>, start_ns: i64, length_ns: i64) -> Self {
        Self {
            grid,
            is_watched,
            start_ns,
            length_ns: length_ns.max(1),
            open: None,
            ready: Vec::new(),
            usual: 0,
        }
    }

    /// The windows that are over since the last call; with `is_last` also the one that lasts.
    pub fn ready(&mut self, is_last: bool) -> Vec<Window> {
        if is_last {
            self.ready.extend(self.open.take());
        }
        std::mem::take(&mut self.ready)
    }

    fn window(&mut self, sweep: &Sweep) -> &mut Window {
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
    fn take(&mut self, sweep: &Sweep) {
        let (grid, is_watched) = (self.grid, std::mem::take(&mut self.is_watched));
        let window = self.window(sweep);
        window.from_ns = window.from_ns.min(sweep.start.0);
        window.to_ns = window.to_ns.max(sweep.end.0);
        let beams = sweep.cloud.ring.iter().zip(sweep.cloud.azimuths_deg());
        for ((ring, azimuth_deg), xyz_m) in beams.zip(&sweep.cloud.xyz_m) {
            let cell = grid.cell(*ring, azimuth_deg);
            if place(cell, is_watched.len()).is_some_and(|place| is_watched[place]) {
                window.cell.push(cell);
                window.xyz_m.push(*xyz_m);
            }
        }
        self.is_watched = is_watched;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::{PointCloud, Return};
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

    fn sweep(start_ns: i64, azimuths_deg: &[f32]) -> Sweep {
        let mut cloud = PointCloud::default();
        for azimuth_deg in azimuths_deg {
            cloud.push(&Return {
                azimuth_rad: azimuth_deg.to_radians(),
                ..Return::made_up([*azimuth_deg, 0.0, 0.0], Timestamp(start_ns))
            });
        }
        Sweep {
            lidar: 0,
            index: 0,
            cloud,
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
        let mut taker = WindowTaker::new(GRID, vec![false, true], 100, 50);
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
