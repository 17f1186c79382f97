//! RoboSense Airy, a hemisphere with 96 lasers in two blocks, and Fairy with 48 in one.
//!
//! Source: manuals of both and the maker's driver. Firing times of the Airy are those of upright mounting;
//! the manual has others for mounting on the side, up to 12 us apart.

use std::sync::LazyLock;

use super::difop::{Angles, Difop};
use super::layout::{ID, Layout, Stamp, View, type_of};
use super::rotating::{Family, Lens, Rotating, Slot};
use super::table::Table;
use crate::packet::ReturnMode;

const CHANNELS: usize = 48;

static AIRY_TABLE: LazyLock<Table> =
    LazyLock::new(|| Table::built_in(include_str!("tables/airy.csv")));
static AIRY_FIRE: LazyLock<Vec<i64>> =
    LazyLock::new(|| AIRY_TABLE.nanos("fire_us").unwrap_or_default());
static FAIRY_FIRE: LazyLock<Vec<i64>> = LazyLock::new(|| {
    let table = Table::built_in(include_str!("tables/fairy.csv"));
    table.nanos("fire_us").unwrap_or_default()
});

/// Which one it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// Airy, 96 lasers.
    Airy,
    /// Fairy, 48 lasers.
    Fairy,
}

/// Airy.
pub static AIRY: Rotating<Model> = Rotating(Model::Airy);
/// Fairy.
pub static FAIRY: Rotating<Model> = Rotating(Model::Fairy);

impl Model {
    fn fire_ns(self) -> &'static [i64] {
        match self {
            Self::Airy => &AIRY_FIRE,
            Self::Fairy => &FAIRY_FIRE,
        }
    }

    /// Blocks that hold one return of all lasers.
    fn blocks_of_return(self) -> usize {
        match self {
            Self::Airy => 2,
            Self::Fairy => 1,
        }
    }
}

impl Family for Model {
    fn id(&self) -> &'static str {
        match self {
            Self::Airy => "airy",
            Self::Fairy => "fairy",
        }
    }

    fn title(&self) -> &'static str {
        match self {
            Self::Airy => "RoboSense Airy",
            Self::Fairy => "RoboSense Fairy",
        }
    }

    fn layout(&self) -> Layout {
        Layout {
            blocks: 8,
            channels: CHANNELS,
            range_mask: match self {
                Self::Airy => 0x3FFF,
                Self::Fairy => 0x7FFF,
            },
            ..Layout::of_32(&ID, Stamp::Seconds, true)
        }
    }

    fn is_own(&self, payload: &[u8]) -> bool {
        let own = match self {
            Self::Airy => 0x31,
            Self::Fairy => 0x0A,
        };
        type_of(payload) == own
    }

    fn lasers(&self) -> usize {
        CHANNELS * self.blocks_of_return()
    }

    /// Blocks of two returns share an azimuth.
    fn returns(&self, view: &View<'_>) -> usize {
        let size = 2 * self.blocks_of_return();
        let firings = view.blocks() / size;
        let is_one = |firing: usize| {
            let first = firing * size;
            (1..size).all(|block| view.azimuth(first + block) == view.azimuth(first))
        };
        1 + usize::from(firings > 0 && (0..firings).all(is_one))
    }

    fn blocks_of_firing(&self, returns: usize) -> usize {
        returns * self.blocks_of_return()
    }

    fn firing_ns(&self, _returns: usize) -> f64 {
        match self {
            Self::Airy => 111_080.0,
            Self::Fairy => 69_460.0,
        }
    }

    fn slot(&self, _returns: usize, place: usize, channel: usize) -> Slot {
        let blocks = self.blocks_of_return();
        let laser = channel + CHANNELS * (place % blocks);
        Slot {
            laser,
            shot: 0,
            echo: place / blocks,
            delay_ns: self.fire_ns().get(laser).copied().unwrap_or(0),
        }
    }

    fn unit_m(&self, _view: &View<'_>) -> f64 {
        0.005
    }

    /// The driver takes the distance of the lens from the axis in whatever direction it lies.
    fn lens(&self) -> Lens {
        let (ahead_m, aside_m, up_m) = match self {
            Self::Airy => (0.0075_f64, 0.006_64, 0.045_32),
            Self::Fairy => (0.019_52_f64, -0.0095, 0.045),
        };
        Lens {
            out_m: ahead_m.hypot(aside_m),
            up_m,
        }
    }

    fn limits_m(&self) -> (f64, f64) {
        match self {
            Self::Airy => (0.1, 60.0),
            Self::Fairy => (0.1, 150.0),
        }
    }

    /// No manual prints the angles of the Fairy.
    fn nominal(&self) -> Option<Angles> {
        match self {
            Self::Airy => Some(Angles {
                elevation_rad: AIRY_TABLE.radians("elevation_deg")?,
                azimuth_rad: AIRY_TABLE.radians("azimuth_deg")?,
            }),
            Self::Fairy => None,
        }
    }

    fn told(&self, difop: &Difop<'_>) -> Option<Angles> {
        difop.angles(self.lasers(), 756, 0.01)
    }

    fn mode(&self, byte: u8) -> Option<ReturnMode> {
        match byte {
            0 => Some(ReturnMode::Strongest),
            1 => Some(ReturnMode::First),
            2 => Some(ReturnMode::Last),
            3 => Some(ReturnMode::Dual),
            _ => None,
        }
    }

    /// The manuals let the counter start again after 65 535.
    fn counter_bits(&self) -> Option<u32> {
        Some(16)
    }
}
