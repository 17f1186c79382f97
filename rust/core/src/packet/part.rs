//! Parts of a packet that belong to different turns.

use std::ops::Range;

use super::{Decoded, Head};

/// What lies between two cuts, as angles turned since the packet's first shot.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Part {
    /// `None`: from its first shot on.
    pub since_rad: Option<f64>,
    /// `None`: to its last shot.
    pub until_rad: Option<f64>,
}

impl Part {
    /// Whether no cut lies in the packet.
    pub fn is_whole(&self) -> bool {
        *self == Self::default()
    }
}

impl Decoded {
    /// Which returns of the packet with this head belong to a part of it.
    pub fn places(&self, head: &Head, part: Part) -> Range<usize> {
        let from = part
            .since_rad
            .map_or(0, |turned_rad| self.before(0, head, turned_rad));
        let to = part.until_rad.map_or(self.cloud.len(), |turned_rad| {
            self.before(from, head, turned_rad)
        });
        from..to
    }
}
