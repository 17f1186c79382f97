//! Data packets of simulated sensors with single returns.

use super::{BLOCKS, CHANNELS, RawBlock, RawReturn, encode, hdl32e, puck, vlp32, vls128};
use crate::packet::writer::{Pace, Shots, Writer, centideg};
use crate::packet::{ModelRef, ReturnMode};
use crate::time::NANOS_PER_HOUR;

/// The VLP-16.
pub static VLP16: Velodyne = Velodyne {
    model: &puck::VLP16,
    product: puck::PRODUCT_VLP16,
    ..HDL32E
};
/// The Puck Hi-Res.
pub static VLP16_HIRES: Velodyne = Velodyne {
    model: &puck::VLP16_HIRES,
    product: puck::PRODUCT_HIRES,
    ..HDL32E
};
/// The HDL-32E.
pub static HDL32E: Velodyne = Velodyne {
    model: &hdl32e::HDL32E,
    product: puck::PRODUCT_HDL32E,
    banks: 1,
    unit_m: puck::RANGE_UNIT_M,
    azimuth_ns: 0,
};
/// The VLP-32C.
pub static VLP32C: Velodyne = Velodyne {
    model: &vlp32::VLP32C,
    product: vlp32::PRODUCT_VLP32C,
    banks: 1,
    unit_m: vlp32::RANGE_UNIT_M,
    azimuth_ns: 0,
};
/// The VLS-128.
pub static VLS128: Velodyne = Velodyne {
    model: &vls128::VLS128,
    product: vls128::PRODUCT,
    banks: vls128::LASERS / CHANNELS,
    unit_m: vls128::RANGE_UNIT_M,
    azimuth_ns: -vls128::LEAD_NS,
};

/// One model.
#[derive(Debug, Clone, Copy)]
pub struct Velodyne {
    model: ModelRef,
    product: u8,
    /// Blocks of a row.
    banks: usize,
    /// Metres of one unit of range.
    unit_m: f64,
    /// When a row's azimuth holds, after its time.
    azimuth_ns: i64,
}

impl Writer for Velodyne {
    fn model(&self) -> ModelRef {
        self.model
    }

    fn rows(&self) -> usize {
        BLOCKS / self.banks
    }

    fn channels(&self) -> usize {
        self.banks * CHANNELS
    }

    fn pace(&self) -> Pace {
        let period_ns = self.model.period_ns(ReturnMode::Strongest);
        Pace::Clock(period_ns as f64 / self.rows() as f64)
    }

    fn azimuth_ns(&self) -> i64 {
        self.azimuth_ns
    }

    fn has_position(&self) -> bool {
        true
    }

    fn write(&self, shots: &Shots) -> Vec<u8> {
        let mut blocks = [RawBlock::default(); BLOCKS];
        for (number, block) in blocks.iter_mut().enumerate() {
            let (row, bank) = (number / self.banks, number % self.banks);
            let Some(row) = shots.rows.get(row) else {
                continue;
            };
            block.bank = bank as u8;
            block.azimuth_centideg = centideg(row.azimuth_rad);
            let echo = |channel: usize| row.echoes.get(bank * CHANNELS + channel);
            block.returns = std::array::from_fn(|channel| {
                echo(channel).map_or(RawReturn::default(), |echo| echo.raw(self.unit_m))
            });
        }
        let stamp_us = shots.time.0.rem_euclid(NANOS_PER_HOUR) / 1000;
        encode(
            &blocks,
            stamp_us as u32,
            ReturnMode::Strongest,
            self.product,
        )
        .to_vec()
    }
}
