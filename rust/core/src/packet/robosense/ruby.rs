//! RoboSense Ruby and Ruby Plus with 128, 80 or 48 lasers.
//!
//! With 128 lasers three blocks make a packet, so that the two blocks of a firing in dual return may lie in two
//! packets; they are judged as a pair all the same, unless one of the packets is lost.
//!
//! Source: manual of the Ruby Plus and the maker's driver. Which of the two returns comes first, the sources
//! do not agree on; distance tells.

use std::sync::LazyLock;

use super::difop::{Angles, Difop};
use super::layout::{ID, Layout, Stamp, View, type_of};
use super::rotating::{Family, Lens, Rotating, Slot};
use super::table::Table;
use crate::packet::ReturnMode;

/// Where horizontal offsets stand in the unit's description; there is room for 128 lasers in all models.
const AZIMUTHS: usize = 852;
const RUBY_TYPE: u8 = 4;
const PLUS_TYPE: u8 = 5;

/// One of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ruby {
    lasers: usize,
    is_plus: bool,
}

const fn ruby(lasers: usize, is_plus: bool) -> Rotating<Ruby> {
    Rotating(Ruby { lasers, is_plus })
}

/// RS-Ruby, 128 lasers.
pub static RUBY_128: Rotating<Ruby> = ruby(128, false);
/// RS-Ruby Lite, 80 lasers.
pub static RUBY_80: Rotating<Ruby> = ruby(80, false);
/// RS-Ruby, 48 lasers.
pub static RUBY_48: Rotating<Ruby> = ruby(48, false);
/// RS-Ruby Plus, 128 lasers.
pub static PLUS_128: Rotating<Ruby> = ruby(128, true);
/// RS-Ruby Plus, 80 lasers.
pub static PLUS_80: Rotating<Ruby> = ruby(80, true);
/// RS-Ruby Plus, 48 lasers.
pub static PLUS_48: Rotating<Ruby> = ruby(48, true);

struct Times {
    lasers: usize,
    is_plus: bool,
    table: Table,
    fire_ns: Vec<i64>,
}

static TIMES: LazyLock<Vec<Times>> = LazyLock::new(|| {
    let tables = [
        (128, false, include_str!("tables/ruby128.csv")),
        (80, false, include_str!("tables/ruby80.csv")),
        (48, false, include_str!("tables/ruby48.csv")),
        (128, true, include_str!("tables/plus128.csv")),
        (80, true, include_str!("tables/plus80.csv")),
        (48, true, include_str!("tables/plus48.csv")),
    ];
    let times = tables.map(|(lasers, is_plus, text)| {
        let table = Table::built_in(text);
        Times {
            lasers,
            is_plus,
            fire_ns: table.nanos("fire_us").unwrap_or_default(),
            table,
        }
    });
    times.into()
});

impl Ruby {
    fn times(self) -> Option<&'static Times> {
        TIMES
            .iter()
            .find(|times| (times.lasers, times.is_plus) == (self.lasers, self.is_plus))
    }
}

impl Family for Ruby {
    fn id(&self) -> &'static str {
        match (self.lasers, self.is_plus) {
            (128, false) => "ruby-128",
            (80, false) => "ruby-80",
            (_, false) => "ruby-48",
            (128, true) => "ruby-plus-128",
            (80, true) => "ruby-plus-80",
            (_, true) => "ruby-plus-48",
        }
    }

    fn title(&self) -> &'static str {
        match (self.lasers, self.is_plus) {
            (128, false) => "RoboSense Ruby 128",
            (80, false) => "RoboSense Ruby Lite 80",
            (_, false) => "RoboSense Ruby 48",
            (128, true) => "RoboSense Ruby Plus 128",
            (80, true) => "RoboSense Ruby Plus 80",
            (_, true) => "RoboSense Ruby Plus 48",
        }
    }

    /// The Lite has the type of the Plus.
    fn candidates(&self) -> &'static [&'static str] {
        match (self.lasers, self.is_plus) {
            (80, true) => &["ruby-80"],
            (48, true) => &["ruby-48"],
            _ => &[],
        }
    }

    fn layout(&self) -> Layout {
        let blocks = match self.lasers {
            128 => 3,
            80 => 4,
            _ => 8,
        };
        Layout {
            len: if self.lasers == 48 { 1268 } else { 1248 },
            id: &ID,
            body: 80,
            blocks,
            channels: self.lasers,
            mark: &[0xFE],
            stamp: Stamp::Seconds,
            time: 10,
            counter: self
                .is_plus
                .then_some(if self.lasers == 48 { 1264 } else { 1244 }),
            range_mask: u16::MAX,
        }
    }

    fn is_own(&self, payload: &[u8]) -> bool {
        let own = if self.is_plus { PLUS_TYPE } else { RUBY_TYPE };
        let is_whole = View::new(payload, self.layout())
            .is_some_and(|view| view.blocks() == self.layout().blocks);
        is_whole && type_of(payload) == own
    }

    fn lasers(&self) -> usize {
        self.lasers
    }

    fn returns(&self, view: &View<'_>) -> usize {
        1 + usize::from(view.mode_byte() == 3)
    }

    fn blocks_of_firing(&self, returns: usize) -> usize {
        returns
    }

    fn firing_ns(&self, _returns: usize) -> f64 {
        match (self.lasers, self.is_plus) {
            (_, true) => 55_560.0,
            (128, false) => 55_550.0,
            (_, false) => 55_552.0,
        }
    }

    fn slot(&self, _returns: usize, place: usize, channel: usize) -> Slot {
        let fire = self.times().and_then(|times| times.fire_ns.get(channel));
        Slot {
            laser: channel,
            shot: 0,
            echo: place,
            delay_ns: fire.copied().unwrap_or(0),
        }
    }

    fn unit_m(&self, _view: &View<'_>) -> f64 {
        0.005
    }

    fn lens(&self) -> Lens {
        Lens {
            out_m: if self.is_plus { 0.028_92 } else { 0.036_15 },
            up_m: 0.0,
        }
    }

    fn limits_m(&self) -> (f64, f64) {
        (0.4, 250.0)
    }

    /// Only the manual of the Ruby Plus 128 prints angles.
    fn nominal(&self) -> Option<Angles> {
        let table = &self.times()?.table;
        Some(Angles {
            elevation_rad: table.radians("elevation_deg")?,
            azimuth_rad: table.radians("azimuth_deg")?,
        })
    }

    fn told(&self, difop: &Difop<'_>) -> Option<Angles> {
        difop.angles(self.lasers, AZIMUTHS, 0.01)
    }

    fn mode(&self, byte: u8) -> Option<ReturnMode> {
        if !self.is_plus {
            return (byte == 3).then_some(ReturnMode::Dual);
        }
        match byte {
            0 => Some(ReturnMode::Strongest),
            1 => Some(ReturnMode::Last),
            2 => Some(ReturnMode::First),
            3 => Some(ReturnMode::Dual),
            4 => Some(ReturnMode::FirstStrongest),
            5 => Some(ReturnMode::FirstLast),
            _ => None,
        }
    }
}
