//! Where the rotor is, counted on over all turns since the first packet.

use std::f64::consts::TAU;

use super::Placed;
use crate::angle::{wrap_half_turn, wrap_turn};
use crate::time::Timestamp;

/// Follows the rotor of one lidar from packet to packet, over gaps as well.
#[derive(Debug)]
pub struct Turns {
    cut_rad: f64,
    end: Option<End>,
}

/// Where a packet ended.
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// Azimuth after the cut, counted on over all turns.
    pub turned_rad: f64,
    /// UTC.
    pub time: Timestamp,
}

impl Turns {
    /// Counts turns from encoder azimuth `cut_rad`.
    pub fn new(cut_rad: f64) -> Self {
        Self {
            cut_rad: wrap_turn(cut_rad),
            end: None,
        }
    }

    /// Number of the turn in which an azimuth lies.
    pub fn turn_of(turned_rad: f64) -> u32 {
        (turned_rad / TAU).floor().max(0.0) as u32
    }

    /// Azimuth at which a turn ends.
    pub fn cut_after(turn: u32) -> f64 {
        (f64::from(turn) + 1.0) * TAU
    }

    /// Where the last packet ended.
    pub fn end(&self) -> Option<End> {
        self.end
    }

    /// Azimuth of the packet's start after the cut, counted on over all turns since the first packet:
    /// the one nearest to where time says that the rotor must be.
    pub fn place(&self, packet: &Placed) -> f64 {
        let after_cut_rad = wrap_turn(packet.head.azimuth_rad - self.cut_rad);
        let Some(end) = self.end else {
            return after_cut_rad;
        };
        if packet.is_jump {
            return Self::cut_after(Self::turn_of(end.turned_rad)) + after_cut_rad;
        }
        let paused_ns = (packet.time - end.time).max(0) as f64;
        let expected_rad = end.turned_rad + paused_ns * packet.head.rate_rad_per_ns.max(0.0);
        expected_rad + wrap_half_turn(after_cut_rad - wrap_turn(expected_rad))
    }

    /// Takes a packet that begins at `start_rad` as the last one.
    pub fn follow(&mut self, packet: &Placed, start_rad: f64) {
        self.end = Some(End {
            turned_rad: start_rad + packet.head.turned_rad.max(0.0),
            time: packet.time + packet.head.duration_ns,
        });
    }
}
