//! Decoding and encoding of all models whose packets are blocks of channels, each at one azimuth.
//!
//! A point's azimuth is the block's, plus the channel's own, plus what the rotor turns until the channel
//! fires. Blocks of one firing share an azimuth; which of them holds the nearer return differs from
//! model to model.

mod decoder;

use std::f64::consts::TAU;
use std::fmt::Debug;

use super::channels::Channels;
use super::layout::{Layout, RawPacket, View, write};
use super::unit::{self, Kind, Unit};
use crate::error::UnitError;
use crate::packet::aim::RAD_PER_CENTIDEG;
use crate::packet::echoes::{MOST, RawEcho, judge};
use crate::packet::unit::{Fitted, UnitFile};
use crate::packet::{Counting, Head, Misfit, Model, PacketKind, ReturnMode, Tally};

use decoder::RotatingDecoder;
pub use decoder::{Firing, ray};

/// What the models with blocks differ in.
pub trait Family: Send + Sync + Debug + Copy + 'static {
    /// Product name in lower case without the vendor.
    fn id(&self) -> &'static str;

    /// Name with vendor, for people.
    fn title(&self) -> &'static str;

    /// Layout of a data packet of this model; `None` for any other payload.
    fn layout(&self, payload: &[u8]) -> Option<Layout>;

    /// Angles and firing times of a unit that is not known.
    fn nominal(&self) -> &'static Unit;

    /// Time of a block after the packet's.
    fn block_ns(&self, view: &View<'_>, block: usize) -> i64;

    /// Time from one packet to the next, as a rule.
    fn period_ns(&self, mode: ReturnMode) -> i64;

    /// Time from this packet to the next.
    fn duration_ns(&self, view: &View<'_>) -> i64 {
        self.period_ns(view.return_mode())
    }

    /// Numbers of the firing times of a block, for far and for near targets.
    fn fire_times(&self, _view: &View<'_>, _block: usize) -> (usize, usize) {
        (0, 0)
    }

    /// Number of the loop of a block whose channels are those of the unit's file of channels, where it has one.
    fn chosen_loop(&self, _view: &View<'_>, _block: usize) -> Option<usize> {
        None
    }

    /// What a data packet tells beside its points that a user should know.
    fn remarks(&self, _view: &View<'_>) -> Vec<String> {
        Vec::new()
    }

    /// Targets nearer than this have the firing times for near ones.
    fn near_m(&self) -> f64 {
        0.0
    }

    /// Least value of a range that is an echo.
    fn least_range(&self) -> u16 {
        1
    }

    /// Azimuth of a block; `None` where it is none.
    fn azimuth_rad(&self, view: &View<'_>, block: usize) -> Option<f64> {
        let raw = view.azimuth(block);
        (raw < 36_000).then(|| f64::from(raw) * RAD_PER_CENTIDEG)
    }

    /// How the sensor numbers and stamps its packets.
    fn counting(&self) -> Counting {
        Counting {
            clock_wrap_ns: None,
            sequence_bits: Some(32),
        }
    }

    /// What a payload that is no data packet is to the model.
    fn companion(&self, _payload: &[u8]) -> Option<PacketKind> {
        None
    }

    /// Rotation rate; 0 where a packet does not tell it.
    fn rate_rad_per_ns(&self, view: &View<'_>) -> f64 {
        (view.rpm() * TAU / 60e9).max(0.0)
    }

    /// Azimuth of a block on the scale on which sweeps are cut.
    fn encoder_rad(&self, view: &View<'_>, block: usize) -> Option<f64> {
        self.azimuth_rad(view, block)
    }

    /// Number of the frame, where the sensor counts them.
    fn frame_id(&self, _view: &View<'_>) -> Option<u32> {
        None
    }

    /// Whether the maker's text files of angles are for it.
    fn takes_angle_text(&self) -> bool {
        true
    }

    /// Whether a file describes a unit, where it is not the maker's text files that do.
    fn takes_binary(&self, _file: &UnitFile) -> bool {
        false
    }

    /// A decoder for the unit of such a file; `None`: the one that all models with blocks share.
    fn fit_binary(&self, _files: &[UnitFile]) -> Option<Result<Fitted, UnitError>> {
        None
    }

    /// Bytes of an empty packet with its header.
    fn template(&self) -> Vec<u8>;
}

/// A model with blocks.
#[derive(Debug)]
pub struct Rotating<F>(pub F);

impl<F: Family> Rotating<F> {
    fn view<'a>(&self, payload: &'a [u8]) -> Option<View<'a>> {
        View::new(payload, self.0.layout(payload)?)
    }

    /// Writes a data packet.
    pub fn encode(&self, packet: &RawPacket) -> Vec<u8> {
        let mut bytes = self.0.template();
        if let Some(layout) = self.0.layout(&bytes) {
            write(&mut bytes, &layout, packet);
        }
        bytes
    }
}

impl<F: Family> Model for Rotating<F> {
    fn id(&self) -> &'static str {
        self.0.id()
    }

    fn title(&self) -> &'static str {
        self.0.title()
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        let data = self.view(payload).map(|_| PacketKind::Data);
        data.or_else(|| self.0.companion(payload))
    }

    fn fits(&self, payload: &[u8]) -> bool {
        self.view(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        let why = format!("{} bytes do not fit {}", payload.len(), self.title());
        Misfit { why, may_be: None }
    }

    fn remarks(&self, payload: &[u8]) -> Vec<String> {
        let view = self.view(payload);
        view.map_or_else(Vec::new, |view| self.0.remarks(&view))
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        let view = self.view(payload)?;
        let rate_rad_per_ns = self.0.rate_rad_per_ns(&view);
        let duration_ns = self.0.duration_ns(&view);
        Some(Head {
            device_ns: (view.time() + self.0.block_ns(&view, 0)).0,
            sequence: view.sequence(),
            azimuth_rad: self.0.encoder_rad(&view, 0)?,
            turned_rad: rate_rad_per_ns * duration_ns as f64,
            rate_rad_per_ns,
            duration_ns,
            left_out: None,
            return_mode: view.return_mode(),
        })
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        let mut tally = Tally::default();
        let Some(view) = self.view(payload) else {
            return tally;
        };
        let mode = view.return_mode();
        for first in firings(&view).filter(|first| self.0.azimuth_rad(&view, *first).is_some()) {
            for echoes in shots(&view, first, self.0.least_range()) {
                let (kinds, merged) = judge(mode, &echoes[..mode.returns()]);
                tally.points += kinds.iter().flatten().count() as u32;
                tally.merged += merged;
            }
        }
        tally
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        self.0.period_ns(mode)
    }

    fn counting(&self) -> Counting {
        self.0.counting()
    }

    fn frame_id(&self, payload: &[u8]) -> Option<u32> {
        self.0.frame_id(&self.view(payload)?)
    }

    fn takes(&self, file: &UnitFile) -> bool {
        match unit::kind(file) {
            Some(Kind::Angles) => self.0.takes_angle_text() && unit::is_of(file, self.0.nominal()),
            Some(Kind::FireTimes) => self
                .0
                .nominal()
                .clone()
                .with(std::slice::from_ref(file))
                .is_ok(),
            Some(Kind::Channels) => self.0.nominal().fire("loop2").is_some(),
            None => self.0.takes_binary(file),
        }
    }

    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError> {
        if let Some(fitted) = self.0.fit_binary(files) {
            return fitted;
        }
        let (unit, calibration) = self.0.nominal().clone().with(files)?;
        let channels = Channels::find(files, unit.elevation_rad.len())?;
        Ok(Fitted {
            decoder: Box::new(RotatingDecoder::new(self.0, &unit, channels)),
            calibration,
        })
    }
}

/// First blocks of the firings; blocks behind the last whole firing are left over.
pub fn firings(view: &View<'_>) -> impl Iterator<Item = usize> + use<> {
    let returns = view.return_mode().returns();
    (0..view.layout().blocks / returns).map(move |firing| firing * returns)
}

/// Echoes of the shots of a firing, by channel; ranges below the least are no echo.
fn shots<'a>(
    view: &View<'a>,
    first: usize,
    least: u16,
) -> impl Iterator<Item = [RawEcho; MOST]> + 'a {
    let returns = view.return_mode().returns();
    let mut blocks = [0, 1, 2].map(|place: usize| view.echoes(first + place.min(returns - 1)));
    std::iter::from_fn(move || {
        let [one, two, three] = &mut blocks;
        Some([one.next()?, two.next()?, three.next()?])
    })
    .map(move |mut echoes| {
        for echo in echoes.iter_mut().filter(|echo| echo.range < least) {
            echo.range = 0;
        }
        echoes
    })
}
