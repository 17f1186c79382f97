//! The shots of a packet, worked out side by side: fixed arrays and no branches,
//! so that the compiler makes vectors of them. The numbers are those of [`Shots`] to the bit.
//!
//! [`Shots`]: super::rows::Shots

use super::rows::Channel;
use super::{BLOCKS, CHANNELS, Packet};
use crate::packet::aim::{small_turn, wrapped};
use crate::simd::{Kernel, vectorized};

/// One number per shot of a block.
pub type Lane<T> = [T; CHANNELS];
/// Blocks of a packet, and a power of two, so that no place needs a check.
pub const ROOM: usize = BLOCKS.next_power_of_two();
/// Shots that there is room for.
pub const SHOTS: usize = ROOM * CHANNELS;
/// One number per shot of a packet.
pub type Column<T> = [Lane<T>; ROOM];

/// What decoding needs of the shots of a row, quantity by quantity.
pub struct Lanes {
    /// When each shot is fired, after the first of its row.
    pub delay_ns: Lane<u32>,
    /// Number of each shot's beam.
    pub ring: Lane<u16>,
    azimuth_offset_rad: Lane<f64>,
    cos_elevation: Lane<f64>,
    sin_elevation: Lane<f64>,
    vertical_offset_m: Lane<f64>,
    range_offset_m: Lane<f64>,
    range_unit_m: f64,
    /// All shots point where the encoder does.
    is_straight: bool,
    turn: Turned,
}

/// How far the head turns from the start of a row to each shot, at one rate.
struct Turned {
    rate_rad_per_ns: f64,
    turned_rad: Lane<f64>,
    sin: Lane<f64>,
    cos: Lane<f64>,
}

/// What is the same for all shots of a row.
#[derive(Debug, Clone, Copy, Default)]
pub struct Row {
    /// Encoder azimuth at its start.
    pub azimuth_rad: f64,
    /// Instant of its start, nanoseconds since 1970 UTC.
    pub time_ns: i64,
    /// Block of the packet, the first of two returns.
    pub block: usize,
    /// Bank of lasers that the row is of.
    pub bank: usize,
}

/// The shots of some rows of a packet, placed as if all of them had hit: block by block, without gaps. Meant to be
/// used again and again.
#[derive(Default)]
pub struct Placed {
    /// Blocks that are there.
    pub blocks: usize,
    /// Which shots of each hit: a bit for each.
    pub hits: [u32; ROOM],
    /// Ranges in the model's unit; 0 = no return.
    pub raw_range: Column<u16>,
    /// Brightness.
    pub intensity: Column<u16>,
    /// Number of each block.
    pub block: [u16; ROOM],
    /// Bank of lasers that each block is of.
    pub bank: [usize; ROOM],
    /// When the row of each block begins, nanoseconds since 1970 UTC.
    pub start_ns: [i64; ROOM],
    /// Encoder azimuths, [0, 2 pi).
    pub encoder_rad: Column<f32>,
    /// Azimuths, [0, 2 pi).
    pub azimuth_rad: Column<f32>,
    /// Ranges, metres.
    pub range_m: Column<f32>,
    /// Positions, metres, axis by axis.
    pub xyz_m: [Column<f32>; 3],
}

impl Lanes {
    /// For a sensor with these shots in a row.
    pub fn new(channels: &[Channel; CHANNELS], range_unit_m: f64) -> Self {
        let lane = |quantity: fn(&Channel) -> f64| std::array::from_fn(|k| quantity(&channels[k]));
        let mut lanes = Self {
            delay_ns: std::array::from_fn(|k| {
                u32::try_from(channels[k].delay_ns).expect("the tables of models are in order")
            }),
            ring: std::array::from_fn(|k| channels[k].ring),
            azimuth_offset_rad: lane(|c| c.azimuth_offset_rad),
            cos_elevation: lane(|c| c.cos_elevation),
            sin_elevation: lane(|c| c.sin_elevation),
            vertical_offset_m: lane(|c| c.vertical_offset_m),
            range_offset_m: lane(|c| c.range_offset_m),
            range_unit_m,
            is_straight: channels.iter().all(|c| c.azimuth_offset_rad == 0.0),
            turn: Turned {
                rate_rad_per_ns: 0.0,
                turned_rad: [0.0; CHANNELS],
                sin: [0.0; CHANNELS],
                cos: [0.0; CHANNELS],
            },
        };
        lanes.turn_by(0.0);
        lanes
    }

    /// Takes the rate of rotation of the packet.
    pub fn set_rate(&mut self, rate_rad_per_ns: f64) {
        if rate_rad_per_ns.to_bits() != self.turn.rate_rad_per_ns.to_bits() {
            self.turn_by(rate_rad_per_ns);
        }
    }

    fn turn_by(&mut self, rate_rad_per_ns: f64) {
        self.turn.rate_rad_per_ns = rate_rad_per_ns;
        for k in 0..CHANNELS {
            let turned_rad = rate_rad_per_ns * f64::from(self.delay_ns[k]);
            self.turn.turned_rad[k] = turned_rad;
            (self.turn.sin[k], self.turn.cos[k]) =
                small_turn(turned_rad + self.azimuth_offset_rad[k]);
        }
    }
}

/// Places all shots of some rows.
struct Place<'a> {
    banks: &'a [Lanes],
    packet: &'a Packet<'a>,
    rows: &'a [Row],
    returns: usize,
    placed: &'a mut Placed,
}

impl Kernel for Place<'_> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let placed = self.placed;
        placed.blocks = 0;
        for row in self.rows {
            let lanes = &self.banks[row.bank];
            let sin_cos = row.azimuth_rad.sin_cos();
            for block in row.block..row.block + self.returns {
                let place = placed.blocks % ROOM;
                placed.block[place] = block as u16;
                placed.bank[place] = row.bank;
                placed.start_ns[place] = row.time_ns;
                placed.read(place, self.packet.returns_of(block));
                placed.aim(place, lanes, row);
                placed.reach(place, lanes, sin_cos);
                placed.blocks += 1;
            }
        }
    }
}

impl Placed {
    /// Places the shots of some rows of a packet; each row names its bank among `banks`.
    pub fn fill(&mut self, banks: &[Lanes], packet: &Packet<'_>, rows: &[Row], returns: usize) {
        vectorized(Place {
            banks,
            packet,
            rows,
            returns,
            placed: self,
        });
    }

    /// Instant of a shot, nanoseconds since 1970 UTC.
    #[inline]
    pub fn time_ns(&self, banks: &[Lanes], block: usize, shot: usize) -> i64 {
        self.start_ns[block].wrapping_add(banks[self.bank[block]].delay_ns[shot].into())
    }

    /// Takes the echoes of a block.
    #[inline(always)]
    fn read(&mut self, place: usize, bytes: &[u8; 3 * CHANNELS]) {
        let (range, intensity) = (&mut self.raw_range[place], &mut self.intensity[place]);
        let mut hits = 0;
        for k in 0..CHANNELS {
            range[k] = u16::from(bytes[3 * k]) | u16::from(bytes[3 * k + 1]) << 8;
            intensity[k] = u16::from(bytes[3 * k + 2]);
            hits |= u32::from(range[k] != 0) << k;
        }
        self.hits[place] = hits;
    }

    /// Where a block's shots are fired to.
    #[inline(always)]
    fn aim(&mut self, place: usize, lanes: &Lanes, row: &Row) {
        let encoder_rad = &mut self.encoder_rad[place];
        for (encoder_rad, turned_rad) in encoder_rad.iter_mut().zip(&lanes.turn.turned_rad) {
            *encoder_rad = wrapped(row.azimuth_rad + turned_rad);
        }
        if lanes.is_straight {
            self.azimuth_rad[place] = self.encoder_rad[place];
            return;
        }
        let shots = lanes.turn.turned_rad.iter().zip(&lanes.azimuth_offset_rad);
        for (azimuth_rad, (turned_rad, offset_rad)) in self.azimuth_rad[place].iter_mut().zip(shots)
        {
            *azimuth_rad = wrapped(row.azimuth_rad + turned_rad + offset_rad);
        }
    }

    /// How far they reach.
    #[inline(always)]
    fn reach(&mut self, place: usize, lanes: &Lanes, (row_sin, row_cos): (f64, f64)) {
        let raw_range = self.raw_range[place];
        let mut ranges_m = [0.0; CHANNELS];
        let [mut x_m, mut y_m, mut z_m] = [[0.0; CHANNELS]; 3];
        for k in 0..CHANNELS {
            let (sin_by, cos_by) = (lanes.turn.sin[k], lanes.turn.cos[k]);
            let sin = row_sin * cos_by + row_cos * sin_by;
            let cos = row_cos * cos_by - row_sin * sin_by;
            let range_m = f64::from(raw_range[k]) * lanes.range_unit_m + lanes.range_offset_m[k];
            let level_m = range_m * lanes.cos_elevation[k];
            let height_m = range_m * lanes.sin_elevation[k] + lanes.vertical_offset_m[k];
            ranges_m[k] = range_m as f32;
            x_m[k] = (level_m * cos) as f32;
            y_m[k] = (-level_m * sin) as f32;
            z_m[k] = height_m as f32;
        }
        self.range_m[place] = ranges_m;
        for (axis, lane) in self.xyz_m.iter_mut().zip([x_m, y_m, z_m]) {
            axis[place] = lane;
        }
    }
}
