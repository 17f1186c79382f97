//! VLS-128, later called Alpha Prime: four blocks hold one sequence of all 128 lasers.
//!
//! Groups of eight lasers fire together, one group a slot; 20 slots make a sequence. The slot's length
//! depends on the firmware and follows from the packet period. In dual return a packet holds one
//! sequence: last and strongest of each bank.
//!
//! Source: VLS-128 manual 63-9480. Where it contradicts the maker's viewer on the two empty slots between
//! the groups 7 and 8 and on the start of the first slot, the viewer is followed; that is 2.8 us at most.

use std::f64::consts::PI;
use std::sync::LazyLock;

use super::board::Board;
use super::lanes::{Lanes, Row};
use super::rows::{self, Channel};
use super::{BLOCKS, CHANNELS, Packet, TURN_CENTIDEG, calibration};
use crate::angle::{wrap_half_turn, wrap_turn};
use crate::error::{InvalidValue, UnitError};
use crate::packet::aim::RAD_PER_CENTIDEG;
use crate::packet::beams::{Beam, Beams};
use crate::packet::unit::{Fitted, UnitFile};
use crate::packet::{Decoded, Decoder, Head, Misfit, Model, PacketKind, Place, ReturnMode, Tally};
use crate::time::Timestamp;

/// Lasers of one unit.
pub const LASERS: usize = 128;
const BANKS: usize = LASERS / CHANNELS;
/// Product byte.
pub const PRODUCT: u8 = 0xA1;
/// Metres of one unit of range.
pub const RANGE_UNIT_M: f64 = 0.004;
/// Slots of one sequence.
const SLOTS: i64 = 20;
/// Slots by firmware: 5.1.7, one seen in the field, 5.2.3 and later.
const SLOT_NS: [i64; 3] = [2_665, 2_764, 2_890];
/// The middle one.
const USUAL_SLOT_NS: i64 = SLOT_NS[1];
/// The first group fires so long before the packet's time.
pub const LEAD_NS: i64 = 7_000;
/// Distance from the spin axis to where the beams cross.
const FOCAL_DISTANCE_M: f64 = 0.058_63;
/// No rotor turns faster; 30 turns a second.
const MOST_RAD_PER_NS: f64 = 30.0 * 2.0 * PI * 1e-9;

/// Elevation and rotation of each laser, degrees.
static TABLE: LazyLock<Vec<(f64, f64)>> = LazyLock::new(|| {
    let rows = include_str!("vls128.csv").lines().skip(1);
    let number = |cell: Option<&str>| cell.and_then(|text| text.parse().ok()).unwrap_or(f64::NAN);
    rows.map(|row| {
        let mut cells = row.split(',').skip(1);
        (number(cells.next()), number(cells.next()))
    })
    .collect()
});

/// The VLS-128.
pub static VLS128: Vls128 = Vls128;

/// The model.
#[derive(Debug)]
pub struct Vls128;

impl Vls128 {
    /// Beams of the manual; delays in slots of 2.764 us.
    pub fn beams() -> Beams {
        let beam = |laser: usize| {
            let (elevation_deg, rotation_deg) = TABLE[laser];
            let lower = TABLE.iter().filter(|(other, _)| *other < elevation_deg);
            let elevation_rad = elevation_deg.to_radians();
            Beam {
                ring: lower.count() as u16,
                elevation_rad,
                azimuth_offset_rad: -rotation_deg.to_radians(),
                vertical_offset_m: -FOCAL_DISTANCE_M * elevation_rad.tan(),
                range_offset_m: 0.0,
                delay_ns: slot(laser) * USUAL_SLOT_NS,
            }
        };
        Beams::new((0..LASERS).map(beam).collect()).expect("the embedded table is finite")
    }

    fn decoder(beams: &Beams) -> Result<Box<dyn Decoder>, InvalidValue> {
        beams.expect(LASERS)?;
        Ok(Box::new(Vls128Decoder::new(beams)))
    }
}

/// Slot of a laser within its sequence.
fn slot(laser: usize) -> i64 {
    (laser / 8 + 2 * (laser / 64)) as i64
}

fn channel(beams: &Beams, laser: usize, slot_ns: i64) -> Channel {
    let delay_ns = slot(laser) * slot_ns;
    let beam = beams.channels()[laser];
    Channel::new(&Beam { delay_ns, ..beam }, 0)
}

fn banks(beams: &Beams, slot_ns: i64) -> Vec<Lanes> {
    let of_bank = |bank: usize| {
        let channels = std::array::from_fn(|k| channel(beams, bank * CHANNELS + k, slot_ns));
        Lanes::new(&channels, RANGE_UNIT_M)
    };
    (0..BANKS).map(of_bank).collect()
}

/// Sequences of a packet.
fn sequences(mode: ReturnMode) -> usize {
    if mode == ReturnMode::Dual {
        1
    } else {
        BLOCKS / BANKS
    }
}

/// First block of a bank in a sequence.
fn block_of(mode: ReturnMode, sequence: usize, bank: usize) -> usize {
    (sequence * BANKS + bank) * mode.returns()
}

/// Rate within a packet from its first and last sequence; `None` where there is one alone or the field
/// of view has a gap between them.
fn rate_within(packet: &Packet<'_>) -> Option<f64> {
    let mode = packet.return_mode();
    let last = sequences(mode).checked_sub(1).filter(|last| *last > 0)?;
    let step = azimuth(packet, block_of(mode, last, 0))? - azimuth(packet, 0)?;
    let rate = wrap_half_turn(step) / (last as i64 * SLOTS * USUAL_SLOT_NS) as f64;
    is_possible(rate).then_some(rate)
}

fn is_possible(rate_rad_per_ns: f64) -> bool {
    (0.0..MOST_RAD_PER_NS).contains(&rate_rad_per_ns)
}

fn azimuth(packet: &Packet<'_>, block: usize) -> Option<f64> {
    let raw = packet.azimuth_centideg(block);
    (raw < TURN_CENTIDEG).then(|| f64::from(raw) * RAD_PER_CENTIDEG)
}

impl Model for Vls128 {
    fn id(&self) -> &'static str {
        "vls128"
    }

    fn title(&self) -> &'static str {
        "Velodyne VLS-128 (Alpha Prime)"
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        rows::recognise_product(payload, &[PRODUCT])
    }

    fn fits(&self, payload: &[u8]) -> bool {
        Packet::new(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        super::misfit(payload, self.id())
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let packet = Packet::new(payload)?;
        let mode = packet.return_mode();
        let rate_rad_per_ns = rate_within(&packet).unwrap_or(0.0);
        let duration_ns = self.period_ns(mode);
        Some(Head {
            device_ns: i64::from(packet.timestamp_us()) * 1000,
            sequence: None,
            azimuth_rad: azimuth(&packet, 0)?,
            turned_rad: rate_rad_per_ns * duration_ns as f64,
            rate_rad_per_ns,
            duration_ns,
            left_out: None,
            return_mode: mode,
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let mut tally = Tally::default();
        let Some(packet) = Packet::new(payload) else {
            return tally;
        };
        let mode = packet.return_mode();
        for (_, block) in usable(&packet) {
            if mode.returns() == 1 {
                let hits = packet.returns(block).filter(|echo| echo.range != 0);
                tally.points += hits.count() as u32;
            } else {
                for (one, other) in packet.returns(block).zip(packet.returns(block + 1)) {
                    tally.add_pair(one.range, other.range);
                }
            }
        }
        tally
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        sequences(mode) as i64 * SLOTS * USUAL_SLOT_NS
    }

    fn takes(&self, file: &UnitFile) -> bool {
        calibration::takes(file, &Self::beams())
    }

    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError> {
        calibration::fit(files, &Self::beams(), Self::decoder)
    }
}

/// Sequence and first block of each bank whose blocks have the right flag and an azimuth.
fn usable<'a>(packet: &'a Packet<'a>) -> impl Iterator<Item = (usize, usize)> + 'a {
    let mode = packet.return_mode();
    let banks = (0..sequences(mode)).flat_map(|s| (0..BANKS).map(move |bank| (s, bank)));
    banks.filter_map(move |(sequence, bank)| {
        let first = block_of(mode, sequence, bank);
        let mut blocks = first..first + mode.returns();
        let is_bank = blocks.all(|block| packet.bank(block) == Some(bank));
        (is_bank && azimuth(packet, first).is_some()).then_some((sequence, first))
    })
}

struct Vls128Decoder {
    beams: Beams,
    board: Board,
    slot_ns: i64,
    last: Option<(Timestamp, f64)>,
    rate_rad_per_ns: f64,
}

impl Vls128Decoder {
    fn new(beams: &Beams) -> Self {
        Self {
            beams: beams.clone(),
            board: Board::new(banks(beams, USUAL_SLOT_NS)),
            slot_ns: USUAL_SLOT_NS,
            last: None,
            rate_rad_per_ns: 0.0,
        }
    }

    /// Learns slot and rate from the packet before, where that one is the neighbour.
    fn follow(&mut self, packet: &Packet<'_>, time: Timestamp) {
        let Some(azimuth_rad) = azimuth(packet, 0) else {
            return;
        };
        let slots = sequences(packet.return_mode()) as i64 * SLOTS;
        let found = self.last.and_then(|(last, last_rad)| {
            let elapsed_ns = time - last;
            let slot_ns = SLOT_NS
                .into_iter()
                .min_by_key(|slot| (slots * slot).abs_diff(elapsed_ns))?;
            let is_next = (slots * slot_ns).abs_diff(elapsed_ns) < (slots * 40) as u64;
            let rate = wrap_turn(azimuth_rad - last_rad) / elapsed_ns.max(1) as f64;
            (is_next && is_possible(rate)).then_some((slot_ns, rate))
        });
        if let Some((slot_ns, rate)) = found {
            self.rate_rad_per_ns = rate;
            if slot_ns != self.slot_ns {
                self.slot_ns = slot_ns;
                self.board.set_banks(banks(&self.beams, slot_ns));
            }
        } else if let Some(rate) = rate_within(packet) {
            self.rate_rad_per_ns = rate;
        }
        self.last = Some((time, azimuth_rad));
    }
}

impl Decoder for Vls128Decoder {
    fn is_following(&self) -> bool {
        true
    }

    fn decode(&mut self, payload: &[u8], place: Place, out: &mut Decoded) {
        let Some(packet) = Packet::new(payload) else {
            return out.drops.add("packet_size", 1);
        };
        self.follow(&packet, place.time);
        let mode = packet.return_mode();
        let expected = sequences(mode) * BANKS;
        out.drops
            .add("block_invalid", (expected - usable(&packet).count()) as u64);
        self.board.open(self.rate_rad_per_ns);
        for (sequence, block) in usable(&packet) {
            if packet.any_has_echoes(block, mode.returns()) {
                let after_ns = sequence as i64 * SLOTS * self.slot_ns - LEAD_NS;
                self.board.add(Row {
                    azimuth_rad: azimuth(&packet, block).unwrap_or_default(),
                    time_ns: (place.time + after_ns).0,
                    block,
                    bank: packet.bank(block).unwrap_or_default(),
                });
            }
        }
        self.board.push(&packet, mode, place.packet, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::velodyne::plain::{Shots, random_packet};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// Banks of the packets whose flag or azimuth is broken.
    const BROKEN: u64 = 2;

    /// A packet shot by shot, at the slot and rate that a decoder has learnt.
    fn one_by_one(known: &Vls128Decoder, payload: &[u8], place: Place, out: &mut Decoded) {
        let packet = Packet::new(payload).unwrap();
        let mode = packet.return_mode();
        for (sequence, block) in usable(&packet) {
            let after_ns = sequence as i64 * SLOTS * known.slot_ns - LEAD_NS;
            let time = place.time + after_ns;
            let place = Place { time, ..place };
            let azimuth_rad = azimuth(&packet, block).unwrap();
            let mut shots = Shots::new(azimuth_rad, known.rate_rad_per_ns, place, RANGE_UNIT_M);
            let second = packet.returns(block + mode.returns() - 1);
            for (k, echoes) in packet.returns(block).zip(second).enumerate() {
                let laser = packet.bank(block).unwrap() * CHANNELS + k;
                let channel = channel(&known.beams, laser, known.slot_ns);
                shots.shot(&channel, echoes, mode, block, out);
            }
        }
    }

    #[test]
    fn shots_side_by_side_are_those_one_by_one() {
        let mut rng = ChaCha8Rng::seed_from_u64(128);
        for mode in [ReturnMode::Strongest, ReturnMode::Last, ReturnMode::Dual] {
            let mut decoder = Vls128Decoder::new(&Vls128::beams());
            let mut time = Timestamp(1_718_000_000_000_000_000);
            // The slot becomes another from packet to packet, and with it the rate.
            for (slot_ns, share) in SLOT_NS.into_iter().cycle().zip([0.6, 0.0, 0.05, 0.6, 1.0]) {
                let mut payload = random_packet(&mut rng, mode, share, 4);
                // The flag of block 4 and the azimuth of block 6, each of a bank of its own.
                payload[401] = 0;
                payload[603] = 0xFF;
                time = time + sequences(mode) as i64 * SLOTS * slot_ns;
                let place = Place {
                    time,
                    packet: 7,
                    mean_rate_rad_per_ns: 0.0,
                };
                let (mut found, mut expected) = (Decoded::default(), Decoded::default());
                decoder.decode(&payload, place, &mut found);
                one_by_one(&decoder, &payload, place, &mut expected);
                expected.drops.add("block_invalid", BROKEN);
                assert!(decoder.rate_rad_per_ns >= 0.0);
                assert_eq!(expected.cloud.is_empty(), share == 0.0);
                let (found, expected) = (format!("{found:?}"), format!("{expected:?}"));
                assert_eq!(found, expected, "{mode:?}, {share}");
            }
        }
    }
}
