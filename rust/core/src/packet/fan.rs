//! Shots that leave one behind the other while a rotor turns, worked out side by side: chunks of fixed size
//! without branches, so that the compiler makes vectors of them.
//!
//! A [`Fan`] tells where each shot leaves and where it goes in the frame that turns with the rotor; a [`Row`]
//! how that frame stands at one firing; a [`Desk`] takes the echoes and appends the returns, shot by shot.

mod desk;
mod known;

use super::aim::{within_half_turn, wrapped};
use super::echoes::MOST;
use crate::simd::{Kernel, vectorized};
pub use desk::{Desk, single_kind};
pub use known::Known;

/// Shots of a chunk.
const LANES: usize = 16;

type Lane<T> = [T; LANES];

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
    ring: Vec<u16>,
    chunks: Vec<Chunk>,
}

#[derive(Debug, Clone, Copy, Default)]
struct Chunk {
    delay_ns: Lane<i64>,
    turned_rad: Lane<f64>,
    azimuth_rad: Lane<f64>,
    direction: [Lane<f64>; 3],
    origin_m: [Lane<f64>; 3],
}

impl Fan {
    /// Takes the place of the shots that were there.
    pub fn set(&mut self, beams: impl IntoIterator<Item = Beam>) {
        self.ring.clear();
        self.chunks.clear();
        for (lane, beam) in (0..LANES).cycle().zip(beams) {
            if lane == 0 {
                self.chunks.push(Chunk::default());
            }
            self.ring.push(beam.ring);
            if let Some(chunk) = self.chunks.last_mut() {
                chunk.set(lane, &beam);
            }
        }
    }

    /// Number of shots.
    pub fn len(&self) -> usize {
        self.ring.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.ring.is_empty()
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

/// The shots of a chunk, placed as if all of them had hit.
#[derive(Debug, Clone, Copy)]
struct Placed {
    encoder_rad: Lane<f32>,
    azimuth_rad: Lane<f32>,
    range_m: Lane<f32>,
    xyz_m: Lane<[f32; 3]>,
    time_ns: Lane<i64>,
}

/// The same of all chunks and returns, one return behind the other.
#[derive(Debug, Default)]
struct Spots {
    encoder_rad: Vec<Lane<f32>>,
    azimuth_rad: Vec<Lane<f32>>,
    range_m: Vec<Lane<f32>>,
    xyz_m: Vec<Lane<[f32; 3]>>,
    time_ns: Vec<Lane<i64>>,
}

impl Spots {
    fn resize(&mut self, chunks: usize) {
        self.encoder_rad.resize(chunks, [0.0; LANES]);
        self.azimuth_rad.resize(chunks, [0.0; LANES]);
        self.range_m.resize(chunks, [0.0; LANES]);
        self.xyz_m.resize(chunks, [[0.0; 3]; LANES]);
        self.time_ns.resize(chunks, [0; LANES]);
    }

    #[inline(always)]
    fn put(&mut self, chunk: usize, placed: &Placed) {
        self.encoder_rad[chunk] = placed.encoder_rad;
        self.azimuth_rad[chunk] = placed.azimuth_rad;
        self.range_m[chunk] = placed.range_m;
        self.xyz_m[chunk] = placed.xyz_m;
        self.time_ns[chunk] = placed.time_ns;
    }

    fn copy(&mut self, from: &Self, entry: usize) {
        let (chunk, lane) = (entry / LANES, entry % LANES);
        self.azimuth_rad[chunk][lane] = from.azimuth_rad[chunk][lane];
        self.xyz_m[chunk][lane] = from.xyz_m[chunk][lane];
        self.time_ns[chunk][lane] = from.time_ns[chunk][lane];
    }
}

/// Places all chunks of all returns.
struct Place<'a> {
    fan: &'a Fan,
    row: &'a Row,
    ranges: &'a [Lane<i32>],
    spots: &'a mut Spots,
}

impl Kernel for Place<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let chunks = self.fan.chunks.iter().cycle();
        for (number, (range, chunk)) in self.ranges.iter().zip(chunks).enumerate() {
            self.spots.put(number, &placed(self.row, chunk, range));
        }
    }
}

#[inline(always)]
fn placed(row: &Row, chunk: &Chunk, ranges: &Lane<i32>) -> Placed {
    let mut placed = Placed {
        encoder_rad: [0.0; LANES],
        azimuth_rad: [0.0; LANES],
        range_m: [0.0; LANES],
        xyz_m: [[0.0; 3]; LANES],
        time_ns: chunk.delay_ns.map(|delay| row.time_ns.wrapping_add(delay)),
    };
    for k in 0..LANES {
        placed.encoder_rad[k] = wrapped(row.encoder_rad + chunk.turned_rad[k]);
        placed.azimuth_rad[k] = wrapped(row.azimuth_rad + chunk.azimuth_rad[k]);
    }
    let [x, y, z] = row.axes;
    for (k, range) in ranges.iter().enumerate() {
        let range_m = f64::from(*range) * row.unit_m;
        let at = |axis: usize| range_m * chunk.direction[axis][k] + chunk.origin_m[axis][k];
        let (ahead, aside, up) = (at(0), at(1), at(2));
        let along = |axis: [f64; 3]| axis[0] * ahead + axis[1] * aside + axis[2] * up;
        placed.range_m[k] = range_m as f32;
        placed.xyz_m[k] = [
            (along(x) + row.origin_m[0]) as f32,
            (along(y) + row.origin_m[1]) as f32,
            (along(z) + row.origin_m[2]) as f32,
        ];
    }
    placed
}

fn place(fan: &Fan, row: &Row, ranges: &[Lane<i32>], spots: &mut Spots) {
    spots.resize(ranges.len());
    vectorized(Place {
        fan,
        row,
        ranges,
        spots,
    });
}
