//! Data packets of simulated sensors with single returns.

use std::f64::consts::TAU;

use super::layout::{RawBlock, RawPacket, View};
use super::rotating::{Family, Rotating};
use crate::packet::writer::{Pace, Row, Shots, Writer, centideg};
use crate::packet::{ModelRef, ReturnMode};

impl<F: Family> Rotating<F> {
    /// Blocks, channels, unit of range and time of the first block after the packet's.
    fn shape(&self) -> Option<(usize, usize, f64, i64)> {
        let template = self.encode(&packet(Vec::new(), 0.0));
        let view = View::new(&template, self.0.layout(&template)?)?;
        let layout = view.layout();
        let first_ns = self.0.block_ns(&view, 0);
        Some((layout.blocks, layout.channels, layout.unit_m, first_ns))
    }
}

fn packet(blocks: Vec<RawBlock>, rpm: f64) -> RawPacket {
    RawPacket {
        time: crate::time::Timestamp(0),
        sequence: 0,
        return_mode: ReturnMode::Strongest,
        rpm,
        operation: 0,
        azimuth_state: 0,
        blocks,
    }
}

impl<F: Family> Writer for Rotating<F> {
    fn model(&self) -> ModelRef {
        let id = self.0.id();
        let known = crate::packet::MODELS.iter().find(|model| model.id() == id);
        *known.expect("each writer's model is listed")
    }

    fn rows(&self) -> usize {
        self.shape().map_or(0, |(blocks, ..)| blocks)
    }

    fn channels(&self) -> usize {
        self.shape().map_or(0, |(_, channels, ..)| channels)
    }

    fn pace(&self) -> Pace {
        let period_ns = self.0.period_ns(ReturnMode::Strongest);
        Pace::Clock(period_ns as f64 / self.rows().max(1) as f64)
    }

    fn write(&self, shots: &Shots) -> Vec<u8> {
        let Some((_, _, unit_m, first_ns)) = self.shape() else {
            return Vec::new();
        };
        let block = |row: &Row| RawBlock {
            azimuth: centideg(row.azimuth_rad),
            fine: 0,
            echoes: row.echoes.iter().map(|echo| echo.raw(unit_m)).collect(),
        };
        let rpm = shots.rate_rad_per_ns * 60e9 / TAU;
        self.encode(&RawPacket {
            // The tail has whole microseconds.
            time: shots.time + (500 - first_ns),
            sequence: shots.sequence,
            ..packet(shots.rows.iter().map(block).collect(), rpm)
        })
    }
}
