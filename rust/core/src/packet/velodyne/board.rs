//! Rows of shots on their way into the columns of a cloud, whatever bank of lasers each is of.

use super::lanes::{Lanes, Placed, Row};
use super::pairs::Pairs;
use super::squeeze::Squeezed;
use super::{BLOCKS, Packet};
use crate::packet::echoes::single_kind;
use crate::packet::{Decoded, ReturnMode};

/// The rows of one packet at a time. Meant to be used again and again.
pub struct Board {
    banks: Vec<Lanes>,
    rate_rad_per_ns: f64,
    rows: [Row; BLOCKS],
    count: usize,
    placed: Placed,
    squeezed: Squeezed,
    pairs: Pairs,
}

impl Board {
    /// For a sensor with these banks of lasers.
    pub fn new(banks: Vec<Lanes>) -> Self {
        Self {
            banks,
            rate_rad_per_ns: 0.0,
            rows: [Row::default(); BLOCKS],
            count: 0,
            placed: Placed::default(),
            squeezed: Squeezed::default(),
            pairs: Pairs::default(),
        }
    }

    /// The banks have changed.
    pub fn set_banks(&mut self, banks: Vec<Lanes>) {
        self.banks = banks;
    }

    /// Begins a packet in which the head turns at this rate.
    pub fn open(&mut self, rate_rad_per_ns: f64) {
        self.count = 0;
        self.rate_rad_per_ns = rate_rad_per_ns;
    }

    /// Adds a row.
    pub fn add(&mut self, row: Row) {
        self.rows[self.count] = row;
        self.count += 1;
    }

    /// Appends the returns of all rows of the packet with the number `number`.
    pub fn push(&mut self, packet: &Packet<'_>, mode: ReturnMode, number: u32, out: &mut Decoded) {
        let rows = &self.rows[..self.count];
        for bank in &mut self.banks {
            bank.set_rate(self.rate_rad_per_ns);
        }
        self.placed.fill(&self.banks, packet, rows, mode.returns());
        if mode.returns() == 1 {
            let kind = single_kind(mode);
            self.squeezed
                .push(&self.placed, &self.banks, number, kind, out);
        } else {
            self.pairs.push(&self.placed, &self.banks, number, out);
        }
    }
}
