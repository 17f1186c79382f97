//! Shots that leave one behind the other while a rotor turns, worked out side by side: chunks of fixed size
//! without branches, so that the compiler makes vectors of them.
//!
//! A [`Fan`] tells where each shot leaves and where it goes in the frame that turns with the rotor; a [`Row`]
//! how that frame stands at one firing; a [`Desk`] takes the echoes and appends the returns, shot by shot.

mod desk;
mod known;

use super::aim::{within_half_turn, wrapped};
use super::echoes::MOST;
use super::sheet::{LANES, Lane, Sheet, lane, lane_mut};
use crate::simd::{Kernel, vectorized};
pub use desk::Desk;
pub use known::Known;

/// One shot, in the frame of the rotor.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Beam {
    /// Number of the beam in results.
    pub ring: u16,
    /// After the firing.
    pub delay_ns: i64,
    /// What the encoder turns until the shot, where it is told shot by shot.
    pub turned_rad: f64,
    /// Added to the row's azimuth.
    pub azimuth_rad: f64,
    /// Where it goes.
    pub direction: [f64; 3],
    /// Where ranges count from, metres.
    pub origin_m: [f64; 3],
}

/// The shots of a firing, quantity by quantity.
#[derive(Debug, Clone, Default)]
pub struct Fan {
    len: usize,
    chunks: Vec<Chunk>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Chunk {
    ring: Lane<u16>,
    delay_ns: Lane<i64>,
    turned_rad: Lane<f64>,
    azimuth_rad: Lane<f64>,
    direction: [Lane<f64>; 3],
    origin_m: [Lane<f64>; 3],
}

impl Fan {
    /// Takes the place of the shots that were there.
    pub fn set(&mut self, beams: impl IntoIterator<Item = Beam>) {
        self.len = 0;
        self.chunks.clear();
        for (lane, beam) in (0..LANES).cycle().zip(beams) {
            if lane == 0 {
                self.chunks.push(Chunk::default());
            }
            self.len += 1;
            if let Some(chunk) = self.chunks.last_mut() {
                chunk.set(lane, &beam);
            }
        }
    }

    /// Number of shots.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

impl FromIterator<Beam> for Fan {
    fn from_iter<I: IntoIterator<Item = Beam>>(beams: I) -> Self {
        let mut fan = Self::default();
        fan.set(beams);
        fan
    }
}

impl Chunk {
    fn set(&mut self, lane: usize, beam: &Beam) {
        self.ring[lane] = beam.ring;
        self.delay_ns[lane] = beam.delay_ns;
        self.turned_rad[lane] = within_half_turn(beam.turned_rad);
        self.azimuth_rad[lane] = within_half_turn(beam.azimuth_rad);
        for axis in 0..3 {
            self.direction[axis][lane] = beam.direction[axis];
            self.origin_m[axis][lane] = beam.origin_m[axis];
        }
    }
}

/// One firing.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Azimuth on the scale on which sweeps are cut, [0, 2 pi).
    pub encoder_rad: f64,
    /// Azimuth of the rotor, [0, 2 pi).
    pub azimuth_rad: f64,
    /// Sensor frame from that of the rotor.
    pub axes: [[f64; 3]; 3],
    /// Where the rotor's frame has its origin, metres.
    pub origin_m: [f64; 3],
    /// Metres of one unit of range.
    pub unit_m: f64,
    /// When it began, nanoseconds since 1970 UTC.
    pub time_ns: i64,
    /// Number of the packet that holds each return.
    pub packets: [u32; MOST],
}

/// Axes of a rotor whose azimuth counts from y towards x.
pub fn from_y((sin, cos): (f64, f64)) -> [[f64; 3]; 3] {
    [[sin, cos, 0.0], [cos, -sin, 0.0], [0.0, 0.0, 1.0]]
}

/// Axes of a rotor whose azimuth counts from x away from y.
pub fn from_x((sin, cos): (f64, f64)) -> [[f64; 3]; 3] {
    [[cos, -sin, 0.0], [-sin, -cos, 0.0], [0.0, 0.0, 1.0]]
}

/// Places all chunks of all returns of a firing.
struct Place<'a> {
    fan: &'a Fan,
    row: &'a Row,
    sheet: &'a mut Sheet,
}

impl Kernel for Place<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Self { fan, row, sheet } = self;
        for first in sheet.firing().step_by(fan.len().max(1)) {
            for (chunk, at) in fan.chunks.iter().zip((first..).step_by(LANES)) {
                place_chunk(row, chunk, at, sheet);
            }
        }
    }
}

/// Places the shots of a chunk as if all of them had hit.
#[inline(always)]
fn place_chunk(row: &Row, chunk: &Chunk, at: usize, sheet: &mut Sheet) {
    *lane_mut(&mut sheet.ring, at) = chunk.ring;
    let time_ns = lane_mut(&mut sheet.time_ns, at);
    let encoder_rad = lane_mut(&mut sheet.encoder_rad, at);
    let azimuth_rad = lane_mut(&mut sheet.azimuth_rad, at);
    for k in 0..LANES {
        time_ns[k] = row.time_ns.wrapping_add(chunk.delay_ns[k]);
        encoder_rad[k] = wrapped(row.encoder_rad + chunk.turned_rad[k]);
        azimuth_rad[k] = wrapped(row.azimuth_rad + chunk.azimuth_rad[k]);
    }
    let ranges = lane(&sheet.range, at);
    let ranges_m = lane_mut(&mut sheet.range_m, at);
    let xyz_m = lane_mut(&mut sheet.xyz_m, at);
    let [x, y, z] = row.axes;
    for k in 0..LANES {
        let range_m = f64::from(ranges[k]) * row.unit_m;
        let at = |axis: usize| range_m * chunk.direction[axis][k] + chunk.origin_m[axis][k];
        let (ahead, aside, up) = (at(0), at(1), at(2));
        let along = |axis: [f64; 3]| axis[0] * ahead + axis[1] * aside + axis[2] * up;
        ranges_m[k] = range_m as f32;
        xyz_m[k] = [
            (along(x) + row.origin_m[0]) as f32,
            (along(y) + row.origin_m[1]) as f32,
            (along(z) + row.origin_m[2]) as f32,
        ];
    }
}

fn place(fan: &Fan, row: &Row, sheet: &mut Sheet) {
    vectorized(Place { fan, row, sheet });
}
