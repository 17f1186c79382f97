//! Shots that hit, moved together eight at a time.

use super::lanes::{Lane, Lanes, Placed, ROOM, SHOTS};
use crate::cloud::ReturnKind;
use crate::packet::Decoded;
use crate::simd::{Moves, MovingKernel, moving};

/// Shots that are moved at once.
const OCTET: usize = 8;

/// For each choice of eight shots: where those that are chosen stand, in order.
static ORDERS: [[u32; OCTET]; 256] = orders();

const fn orders() -> [[u32; OCTET]; 256] {
    let mut orders = [[0; OCTET]; 256];
    let mut hits = 0;
    while hits < orders.len() {
        let (mut shot, mut count) = (0, 0);
        while shot < OCTET {
            if hits >> shot & 1 == 1 {
                orders[hits][count] = shot as u32;
                count += 1;
            }
            shot += 1;
        }
        hits += 1;
    }
    orders
}

/// Room for a quantity of all hits: eight are written where fewer are kept.
type Room<T> = [T; SHOTS + OCTET];

/// The hits of a packet of single returns, in the order of its shots. Meant to be used again and again.
pub struct Squeezed {
    count: usize,
    encoder_rad: Room<f32>,
    azimuth_rad: Room<f32>,
    range_m: Room<f32>,
    xyz_m: Room<[f32; 3]>,
    time_ns: Room<i64>,
    ring: Room<u16>,
    intensity: Room<u16>,
    block: Room<u16>,
}

impl Default for Squeezed {
    fn default() -> Self {
        Self {
            count: 0,
            encoder_rad: [0.0; SHOTS + OCTET],
            azimuth_rad: [0.0; SHOTS + OCTET],
            range_m: [0.0; SHOTS + OCTET],
            xyz_m: [[0.0; 3]; SHOTS + OCTET],
            time_ns: [0; SHOTS + OCTET],
            ring: [0; SHOTS + OCTET],
            intensity: [0; SHOTS + OCTET],
            block: [0; SHOTS + OCTET],
        }
    }
}

impl Squeezed {
    /// Appends the returns of a packet; echoes without range are none.
    pub fn push(
        &mut self,
        placed: &Placed,
        banks: &[Lanes],
        packet: u32,
        return_kind: ReturnKind,
        out: &mut Decoded,
    ) {
        moving(Squeeze {
            placed,
            banks,
            into: self,
        });
        self.append(packet, return_kind, out);
    }

    fn append(&self, packet: u32, return_kind: ReturnKind, out: &mut Decoded) {
        let count = self.count.min(SHOTS);
        let cloud = &mut out.cloud;
        out.encoder_rad
            .extend_from_slice(&self.encoder_rad[..count]);
        cloud.xyz_m.extend_from_slice(&self.xyz_m[..count]);
        cloud.time_ns.extend_from_slice(&self.time_ns[..count]);
        cloud
            .azimuth_rad
            .extend_from_slice(&self.azimuth_rad[..count]);
        cloud.ring.extend_from_slice(&self.ring[..count]);
        if out.is_slim {
            return;
        }
        cloud.range_m.extend_from_slice(&self.range_m[..count]);
        cloud.intensity.extend_from_slice(&self.intensity[..count]);
        cloud.block.extend_from_slice(&self.block[..count]);
        let len = cloud.xyz_m.len();
        cloud.packet.resize(len, packet);
        cloud.return_index.resize(len, 0);
        cloud.return_kind.resize(len, return_kind);
    }
}

struct Squeeze<'a> {
    placed: &'a Placed,
    banks: &'a [Lanes],
    into: &'a mut Squeezed,
}

impl MovingKernel for Squeeze<'_> {
    type Out = ();

    #[inline(always)]
    fn run<M: Moves>(self, moves: M) {
        let mut count = 0;
        for block in 0..self.placed.blocks.min(ROOM) {
            let lanes = &self.banks[self.placed.bank[block]];
            for (octet, hits) in self.placed.hits[block]
                .to_le_bytes()
                .into_iter()
                .enumerate()
            {
                let octet = Octet {
                    moves,
                    order: &ORDERS[usize::from(hits)],
                    from: octet * OCTET,
                    to: count % SHOTS,
                };
                octet.squeeze(self.placed, block, lanes, self.into);
                count += hits.count_ones() as usize;
            }
        }
        self.into.count = count;
    }
}

/// Eight shots of a block, and where those that hit go.
struct Octet<M> {
    moves: M,
    order: &'static [u32; OCTET],
    from: usize,
    to: usize,
}

// Loops and not closures of arrays: those are not always made part of the code for wide vectors.
impl<M: Moves> Octet<M> {
    #[inline(always)]
    fn squeeze(&self, placed: &Placed, block: usize, lanes: &Lanes, into: &mut Squeezed) {
        self.reals(&placed.encoder_rad[block], &mut into.encoder_rad);
        self.reals(&placed.azimuth_rad[block], &mut into.azimuth_rad);
        self.reals(&placed.range_m[block], &mut into.range_m);
        self.places(placed, block, &mut into.xyz_m);
        self.times(placed.start_ns[block], &lanes.delay_ns, &mut into.time_ns);
        let intensity = &placed.intensity[block];
        self.numbers(
            [&lanes.ring, intensity],
            [&mut into.ring, &mut into.intensity],
        );
        self.put([placed.block[block]; OCTET], &mut into.block);
    }

    #[inline(always)]
    fn reals(&self, lane: &Lane<f32>, room: &mut Room<f32>) {
        let ordered = self.ordered(lane);
        let mut kept = [0.0; OCTET];
        for k in 0..OCTET {
            kept[k] = f32::from_bits(ordered[k]);
        }
        self.put(kept, room);
    }

    #[inline(always)]
    fn places(&self, placed: &Placed, block: usize, room: &mut Room<[f32; 3]>) {
        let [x_m, y_m, z_m] = &placed.xyz_m;
        let x_m = self.ordered(&x_m[block]);
        let y_m = self.ordered(&y_m[block]);
        let z_m = self.ordered(&z_m[block]);
        let mut kept = [[0.0; 3]; OCTET];
        for k in 0..OCTET {
            kept[k][0] = f32::from_bits(x_m[k]);
            kept[k][1] = f32::from_bits(y_m[k]);
            kept[k][2] = f32::from_bits(z_m[k]);
        }
        self.put(kept, room);
    }

    #[inline(always)]
    fn times(&self, start_ns: i64, delay_ns: &Lane<u32>, room: &mut Room<i64>) {
        let mut values = [0; OCTET];
        values.copy_from_slice(&delay_ns[self.from..self.from + OCTET]);
        let after_ns = self.moves.ordered(values, self.order);
        let mut kept = [0; OCTET];
        for k in 0..OCTET {
            kept[k] = start_ns.wrapping_add(i64::from(after_ns[k]));
        }
        self.put(kept, room);
    }

    /// Two numbers of 16 bits travel as one of 32.
    #[inline(always)]
    fn numbers(&self, lanes: [&Lane<u16>; 2], rooms: [&mut Room<u16>; 2]) {
        let shots = self.from..self.from + OCTET;
        let numbers = lanes[0][shots.clone()].iter().zip(&lanes[1][shots]);
        let mut values = [0; OCTET];
        for (value, (low, high)) in values.iter_mut().zip(numbers) {
            *value = u32::from(*low) | u32::from(*high) << 16;
        }
        let both = self.moves.ordered(values, self.order);
        let [mut low, mut high] = [[0; OCTET]; 2];
        for k in 0..OCTET {
            low[k] = both[k] as u16;
            high[k] = (both[k] >> 16) as u16;
        }
        let [first, second] = rooms;
        self.put(low, first);
        self.put(high, second);
    }

    #[inline(always)]
    fn ordered(&self, lane: &Lane<f32>) -> [u32; OCTET] {
        let mut values = [0; OCTET];
        for (value, shot) in values.iter_mut().zip(&lane[self.from..self.from + OCTET]) {
            *value = shot.to_bits();
        }
        self.moves.ordered(values, self.order)
    }

    #[inline(always)]
    fn put<T: Copy>(&self, values: [T; OCTET], room: &mut Room<T>) {
        room[self.to..self.to + OCTET].copy_from_slice(&values);
    }
}
