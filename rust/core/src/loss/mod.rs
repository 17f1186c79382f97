//! What did not arrive, what arrived twice or late, and what a limited field of view never sent.

pub mod cycle;
pub mod order;
pub mod view;

/// Packets counted over some time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Data packets that were taken.
    pub packets: u64,
    /// Packets that were sent and never arrived.
    pub lost: u64,
    /// Packets that arrived a second time.
    pub duplicated: u64,
    /// Packets that arrived out of order, whether they were put back in place or came too late.
    pub late: u64,
    /// Of those the ones that came too late to be put back.
    pub too_late: u64,
}

impl Counts {
    /// Share of the sent packets that arrived; 1 where none was sent.
    pub fn coverage(&self) -> f64 {
        let sent = self.packets.saturating_add(self.lost);
        if sent == 0 {
            1.0
        } else {
            self.packets as f64 / sent as f64
        }
    }
}
