//! RoboSense RS-LiDAR-16 and RS-LiDAR-32.
//!
//! Source: the maker's driver. Older firmware measures in units of 1 cm, which is told by version bytes of the
//! unit's description; the current 5 mm are taken.

use std::sync::LazyLock;

use super::difop::{Angles, Difop};
use super::helios::{half_slot, halves_agree, returns_in_halves, returns_in_pairs};
use super::layout::{CLASSIC_ID, Layout, Stamp, View, field, type_of};
use super::rotating::{Family, Lens, Rotating, Slot};
use super::table::Table;
use crate::packet::ReturnMode;

static TABLE_16: LazyLock<Table> =
    LazyLock::new(|| Table::built_in(include_str!("tables/rs16.csv")));
static TABLE_32: LazyLock<Table> =
    LazyLock::new(|| Table::built_in(include_str!("tables/rs32.csv")));
static FIRE_32: LazyLock<Vec<i64>> =
    LazyLock::new(|| TABLE_32.nanos("fire_us").unwrap_or_default());

/// Which one it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rs {
    /// 16 lasers.
    Sixteen,
    /// 32 lasers.
    ThirtyTwo,
}

/// RS-LiDAR-16.
pub static RS_16: Rotating<Rs> = Rotating(Rs::Sixteen);
/// RS-LiDAR-32.
pub static RS_32: Rotating<Rs> = Rotating(Rs::ThirtyTwo);

impl Family for Rs {
    fn id(&self) -> &'static str {
        match self {
            Self::Sixteen => "rs16",
            Self::ThirtyTwo => "rs32",
        }
    }

    fn title(&self) -> &'static str {
        match self {
            Self::Sixteen => "RoboSense RS-LiDAR-16",
            Self::ThirtyTwo => "RoboSense RS-LiDAR-32",
        }
    }

    fn layout(&self) -> Layout {
        Layout::of_32(&CLASSIC_ID, Stamp::Calendar, false)
    }

    /// The first firmwares have no type.
    fn is_own(&self, payload: &[u8]) -> bool {
        let own = match self {
            Self::Sixteen => 1,
            Self::ThirtyTwo => 2,
        };
        matches!(type_of(payload), 0) || type_of(payload) == own
    }

    fn suits(&self, packets: &[&[u8]]) -> bool {
        let is_told = packets.iter().any(|payload| type_of(payload) != 0);
        let agree = halves_agree(self.layout(), packets);
        is_told || agree != Some(*self == Self::ThirtyTwo)
    }

    fn header(&self) -> Vec<(usize, u8)> {
        let own = match self {
            Self::Sixteen => 1,
            Self::ThirtyTwo => 2,
        };
        vec![(field::TYPE.start, own)]
    }

    fn lasers(&self) -> usize {
        match self {
            Self::Sixteen => 16,
            Self::ThirtyTwo => 32,
        }
    }

    fn returns(&self, view: &View<'_>) -> usize {
        match self {
            Self::Sixteen => returns_in_halves(view),
            Self::ThirtyTwo => returns_in_pairs(view),
        }
    }

    fn blocks_of_firing(&self, returns: usize) -> usize {
        match self {
            Self::Sixteen => 1,
            Self::ThirtyTwo => returns,
        }
    }

    fn firing_ns(&self, returns: usize) -> f64 {
        match self {
            Self::Sixteen if returns == 1 => 111_000.0,
            Self::Sixteen => 55_500.0,
            Self::ThirtyTwo => 55_520.0,
        }
    }

    fn slot(&self, returns: usize, place: usize, channel: usize) -> Slot {
        let delay = |channel: usize| channel as i64 % 16 * 2800 + channel as i64 / 16 * 55_500;
        match self {
            Self::Sixteen => half_slot(returns, channel, delay),
            Self::ThirtyTwo => Slot {
                laser: channel,
                shot: 0,
                echo: place,
                delay_ns: FIRE_32.get(channel).copied().unwrap_or(0),
            },
        }
    }

    fn unit_m(&self, _view: &View<'_>) -> f64 {
        0.005
    }

    fn lens(&self) -> Lens {
        let out_m = match self {
            Self::Sixteen => 0.038_25,
            Self::ThirtyTwo => 0.039_97,
        };
        Lens { out_m, up_m: 0.0 }
    }

    fn limits_m(&self) -> (f64, f64) {
        (0.4, 230.0)
    }

    fn nominal(&self) -> Option<Angles> {
        let table = match self {
            Self::Sixteen => &TABLE_16,
            Self::ThirtyTwo => &TABLE_32,
        };
        Some(Angles {
            elevation_rad: table.radians("elevation_deg")?,
            azimuth_rad: table.radians("azimuth_deg")?,
        })
    }

    fn told(&self, difop: &Difop<'_>) -> Option<Angles> {
        match self {
            Self::Sixteen => difop.rs16_angles(),
            Self::ThirtyTwo => difop.angles(32, 564, 0.001),
        }
    }

    fn mode(&self, byte: u8) -> Option<ReturnMode> {
        match byte {
            0 => Some(ReturnMode::Dual),
            1 => Some(ReturnMode::Strongest),
            2 => Some(ReturnMode::Last),
            _ => None,
        }
    }
}
