//! Data packets of simulated sensors with single returns.

use super::layout::{RawPacket, View};
use super::rotating::{Family, Rotating};
use crate::packet::writer::{Pace, Row, Shots, Writer, centideg};
use crate::packet::{ModelRef, ReturnMode};

impl<F: Family> Rotating<F> {
    fn packet(&self, blocks: Vec<(u16, Vec<crate::packet::echoes::RawEcho>)>) -> RawPacket {
        RawPacket {
            time_ns: 0,
            counter: 0,
            header: self.0.header(),
            blocks,
        }
    }

    /// Metres of one unit of range.
    fn unit_m(&self) -> f64 {
        let blocks = vec![(0, Vec::new()); self.0.layout().blocks];
        let payload = self.encode(&self.packet(blocks));
        View::new(&payload, self.0.layout()).map_or(f64::NAN, |view| self.0.unit_m(&view))
    }
}

impl<F: Family> Writer for Rotating<F> {
    fn model(&self) -> ModelRef {
        let id = self.0.id();
        let known = crate::packet::MODELS.iter().find(|model| model.id() == id);
        *known.expect("each writer's model is listed")
    }

    fn rows(&self) -> usize {
        self.0.layout().blocks
    }

    fn channels(&self) -> usize {
        self.0.layout().channels
    }

    fn pace(&self) -> Pace {
        Pace::Clock(self.0.firing_ns(ReturnMode::Strongest.returns()))
    }

    fn write(&self, shots: &Shots) -> Vec<u8> {
        let unit_m = self.unit_m();
        let block = |row: &Row| {
            let echoes = row.echoes.iter().map(|echo| echo.raw(unit_m));
            (centideg(row.azimuth_rad), echoes.collect())
        };
        self.encode(&RawPacket {
            time_ns: shots.time.0 + 500, // whole microseconds are written
            counter: shots.sequence,
            ..self.packet(shots.rows.iter().map(block).collect())
        })
    }
}
