//! What it takes to decode one lidar's turns, wherever that happens.

use std::sync::{Mutex, PoisonError};

use super::report::StreamInfo;
use super::undecoded::Undecoded;
use crate::packet::unit::UnitFile;
use crate::packet::{Decoded, Decoder, ModelRef};
use crate::sweep::{Gathered, Kept, Sweep};

/// A turn, and the second returns in it that were merged into the first.
pub type Done<K> = (Sweep<K>, u64);

/// Decoders and memory of one lidar, as many as there are turns at a time.
pub struct Workshop<K> {
    model: ModelRef,
    unit: Vec<UnitFile>,
    spare: Mutex<Spare<K>>,
}

/// What is not in use.
#[derive(Default)]
struct Spare<K> {
    tools: Vec<Tools>,
    undecoded: Vec<Undecoded>,
    kept: Vec<K>,
    usual: usize, // echoes of the last sweep: as much room is made for the next
}

struct Tools {
    decoder: Box<dyn Decoder>,
    decoded: Decoded,
}

impl<K: Kept> Workshop<K> {
    /// For a lidar whose unit was found to be one that can be decoded.
    pub fn new(info: &StreamInfo) -> Self {
        Self {
            model: info.model,
            unit: info.unit.clone(),
            spare: Mutex::new(Spare::default()),
        }
    }

    /// Decodes a turn.
    pub fn decode(&self, turn: Sweep<Undecoded>) -> Done<K> {
        let (tools, kept) = self.with_spare(Spare::take);
        let mut tools = tools.unwrap_or_else(|| self.tools());
        let (mut sweep, mut undecoded) = turn.exchanged(kept);
        tools.decoded.merged = 0;
        undecoded.decode(&mut *tools.decoder, &mut tools.decoded, &mut sweep.cloud);
        undecoded.empty();
        let (merged, usual) = (tools.decoded.merged, sweep.cloud.count());
        self.with_spare(|spare| {
            spare.tools.push(tools);
            spare.undecoded.push(undecoded);
            spare.usual = usual;
        });
        (sweep, merged)
    }

    /// Gives the memory of a sweep back.
    pub fn recycle(&self, mut kept: K) {
        kept.empty();
        self.with_spare(|spare| spare.kept.push(kept));
    }

    /// Memory of turns that are decoded.
    pub fn take_undecoded(&self) -> Vec<Undecoded> {
        self.with_spare(|spare| std::mem::take(&mut spare.undecoded))
    }

    fn tools(&self) -> Tools {
        let fitted = self.model.fit(&self.unit);
        Tools {
            decoder: fitted.expect("the same files were taken before").decoder,
            decoded: Decoded::with_columns(K::IS_SLIM),
        }
    }

    fn with_spare<T>(&self, look: impl FnOnce(&mut Spare<K>) -> T) -> T {
        look(&mut self.spare.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<K: Kept> Spare<K> {
    fn take(&mut self) -> (Option<Tools>, K) {
        let mut kept = self.kept.pop().unwrap_or_default();
        kept.make_room(self.usual + self.usual / 16);
        (self.tools.pop(), kept)
    }
}
