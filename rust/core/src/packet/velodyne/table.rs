//! What the library must know of a model with 16 or 32 lasers follows from its table: how it fires, where its
//! beams point, which product bytes it writes.

use std::fmt::Debug;

use super::rows::{self, Firing};
use super::tally::tally;
use super::{Packet, calibration};
use crate::error::UnitError;
use crate::packet::beams::Beams;
use crate::packet::unit::{Fitted, UnitFile};
use crate::packet::{Head, Misfit, Model, PacketKind, ReturnMode, Tally};

/// What the models with 16 or 32 lasers differ in.
pub trait Table: Sync + Debug {
    /// Product name in lower case without the vendor.
    fn id(&self) -> &'static str;

    /// Name with vendor, for people.
    fn title(&self) -> &'static str;

    /// Ids of models whose packets cannot be told from this one's.
    fn candidates(&self) -> &'static [&'static str] {
        &[]
    }

    /// Product bytes that it writes.
    fn products(&self) -> &'static [u8];

    /// Whether it sends a packet with another product byte.
    fn sends(&self, _packet: &Packet<'_>) -> bool {
        false
    }

    /// Whether a product byte is this model's alone.
    fn is_sure(&self, _product: u8) -> bool {
        true
    }

    /// How it fires.
    fn firing(&self) -> &'static Firing;

    /// Beams of a unit without a calibration file.
    fn beams(&self) -> Beams;
}

impl<T: Table> Model for T {
    fn id(&self) -> &'static str {
        Table::id(self)
    }

    fn title(&self) -> &'static str {
        Table::title(self)
    }

    fn candidates(&self) -> &'static [&'static str] {
        Table::candidates(self)
    }

    fn recognise(&self, payload: &[u8]) -> Option<PacketKind> {
        let is_own = Packet::new(payload).is_some_and(|packet| self.sends(&packet));
        let data = is_own.then_some(PacketKind::Data);
        data.or_else(|| rows::recognise(payload, self.products()))
    }

    fn is_sure(&self, payload: &[u8]) -> bool {
        Packet::new(payload).is_some_and(|packet| Table::is_sure(self, packet.product()))
    }

    fn fits(&self, payload: &[u8]) -> bool {
        Packet::new(payload).is_some()
    }

    fn misfit(&self, payload: &[u8]) -> Misfit {
        super::misfit(payload, Table::id(self))
    }

    fn head(&self, payload: &[u8]) -> Option<Head> {
        self.firing().head(payload)
    }

    fn tally(&self, payload: &[u8]) -> Tally {
        tally(payload)
    }

    fn period_ns(&self, mode: ReturnMode) -> i64 {
        self.firing().period_ns(mode)
    }

    fn takes(&self, file: &UnitFile) -> bool {
        calibration::takes(file, &self.beams())
    }

    fn fit(&self, files: &[UnitFile]) -> Result<Fitted, UnitError> {
        calibration::fit(files, &self.beams(), |beams| self.firing().decoder(beams))
    }
}
