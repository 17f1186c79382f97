//! Which rays met which surface: near it, facing it, along it, and no other surface near.

use nalgebra::Vector3;

use super::hold::{Beam, Hold};
use super::rows::raised;
use super::state::{LidarState, State};
use super::surface::{Surface, SurfaceFrame};

/// Rays flatter than this against a surface are left out: roughness hides the ground behind itself.
const LEAST_COSINE: f64 = 0.05;
/// Neighbours on the same scan line this far away show how the surface runs, metres.
const NEIGHBOUR_M: f64 = 0.25;
/// The scan line may leave the surface by this share of the way to the neighbour, and by this, metres.
const SLANT: f64 = 0.15;
const SLANT_M: f64 = 0.03;
/// Neighbours are looked for over so many azimuth cells.
const NEIGHBOUR_CELLS: usize = 200;
/// Nearer to the sensor than this are its own tripod and housing, metres.
const LEAST_RANGE_M: f64 = 0.5;

/// A ray that met a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Met {
    /// Which lidar.
    pub lidar: usize,
    /// Which of its mean rays.
    pub beam: usize,
    /// Which surface.
    pub surface: usize,
}

/// How near is near.
#[derive(Debug, Clone, Copy)]
pub struct Gate {
    /// At the sensor, metres.
    pub near_m: f64,
    /// More per metre of range: what a rotation may still be off, radians.
    pub turn_rad: f64,
}

/// The rays of one lidar that met a surface within the gate.
pub fn met(state: &State, hold: &Hold, lidar: usize, gate: &Gate) -> Vec<Met> {
    let points: Vec<_> = hold
        .beams
        .iter()
        .map(|b| world(&state.lidars[lidar], b))
        .collect();
    (0..hold.beams.len())
        .filter_map(|beam| {
            let surface = surface_of(state, hold, lidar, beam, &points, gate)?;
            Some(Met {
                lidar,
                beam,
                surface,
            })
        })
        .collect()
}

/// Where a mean ray ended, world frame, metres.
pub fn world(lidar: &LidarState, beam: &Beam) -> Vector3<f64> {
    let offset = lidar
        .offsets_m
        .get(usize::from(beam.ring))
        .copied()
        .unwrap_or(0.0);
    let range_m = beam.range_m * (1.0 + lidar.scale) + offset;
    lidar.position_m + lidar.rotation * raised(&beam.direction, lidar.elevation_rad).0 * range_m
}

fn surface_of(
    state: &State,
    hold: &Hold,
    lidar: usize,
    beam: usize,
    points: &[Vector3<f64>],
    gate: &Gate,
) -> Option<usize> {
    let range_m = hold.beams[beam].range_m;
    if range_m < LEAST_RANGE_M {
        return None;
    }
    let limit_m = gate.near_m + gate.turn_rad * range_m;
    let near = |s: &&usize| {
        let surface = &state.surfaces[**s];
        reaches(&surface.frame, &points[beam]) && surface.above(&points[beam]).0.abs() < limit_m
    };
    let all: Vec<usize> = (0..state.surfaces.len()).collect();
    let mut candidates = all.iter().filter(near);
    let surface = *candidates.next()?;
    if candidates.next().is_some() {
        return None; // where ground and wall meet
    }
    let ray = (points[beam] - state.lidars[lidar].position_m) / range_m;
    let (_, gradient, _) = state.surfaces[surface].above(&points[beam]);
    let faces = gradient.dot(&ray).abs() / gradient.norm() > LEAST_COSINE;
    (faces && runs_along(&state.surfaces[surface], hold, beam, points)).then_some(surface)
}

/// Whether a place lies within what is taken to belong to the surface.
fn reaches(frame: &SurfaceFrame, point_m: &Vector3<f64>) -> bool {
    let [u, v, _] = frame.local(point_m);
    u.abs() <= frame.half_m[0] && v.abs() <= frame.half_m[1]
}

/// Whether the scan line follows the surface on both sides: an edge, a pole or a box does not.
fn runs_along(surface: &Surface, hold: &Hold, beam: usize, points: &[Vector3<f64>]) -> bool {
    let above = |k: usize| surface.above(&points[k]).0;
    let here = above(beam);
    let sides = [true, false].map(|forward| neighbour(hold, beam, points, forward));
    let mut seen = sides.iter().flatten().peekable();
    if seen.peek().is_none() {
        return false;
    }
    seen.all(|k| {
        let way_m = (points[*k] - points[beam]).norm();
        (above(*k) - here).abs() < SLANT_M + SLANT * way_m
    })
}

fn neighbour(hold: &Hold, beam: usize, points: &[Vector3<f64>], forward: bool) -> Option<usize> {
    let own = hold.beams[beam];
    let step = |k: usize| match forward {
        true => Some(beam + k).filter(|at| *at < hold.beams.len()),
        false => beam.checked_sub(k),
    };
    (1..=NEIGHBOUR_CELLS)
        .map_while(step)
        .take_while(|k| hold.beams[*k].ring == own.ring)
        .take_while(|k| hold.beams[*k].cell.abs_diff(own.cell) as usize <= NEIGHBOUR_CELLS)
        .find(|k| (points[*k] - points[beam]).norm() > NEIGHBOUR_M)
}
