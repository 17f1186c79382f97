//! Which model a stream's packets are of: by their identifying bytes, and by the packet period where
//! those are not believed.

use crate::packet::{Head, ModelRef, claimants};
use crate::time::Timestamp;

/// Packets after which a stream is decided.
const ENOUGH: usize = 32;
/// The packet period of the data may differ from the model's by this share.
const PERIOD_TOLERANCE: f64 = 0.25;

/// Data packets of a stream that is not decided yet.
#[derive(Debug, Default)]
pub struct Probe {
    packets: Vec<(Timestamp, Vec<u8>)>,
    named: Option<ModelRef>,
}

impl Probe {
    /// `named` is the model that the user gave.
    pub fn new(named: Option<ModelRef>) -> Self {
        Self {
            packets: Vec::new(),
            named,
        }
    }

    /// Whether the user named the model.
    pub fn is_named(&self) -> bool {
        self.named.is_some()
    }

    /// Takes a datagram if it may be a data packet of some lidar.
    pub fn offer(&mut self, arrival: Timestamp, payload: &[u8]) -> bool {
        let is_claimed = match self.named {
            Some(model) => model.fits(payload),
            None => claimants(payload).next().is_some(),
        };
        if is_claimed {
            self.packets.push((arrival, payload.to_vec()));
        }
        is_claimed
    }

    /// Whether there is enough to decide.
    pub fn is_enough(&self) -> bool {
        self.packets.len() >= ENOUGH
    }

    /// The model; `None` where no packet came or none of the models fits.
    pub fn decide(&self) -> Option<ModelRef> {
        if self.packets.is_empty() || self.named.is_some() {
            return self.named.filter(|_| !self.packets.is_empty());
        }
        let (_, first) = self.packets.first()?;
        claimants(first).find(|model| {
            let is_sure = self.packets.iter().all(|(_, p)| model.is_sure(p));
            is_sure || self.has_period_of(*model)
        })
    }

    /// Why nothing was decided although packets were claimed.
    pub fn doubt(&self) -> Option<String> {
        let (_, first) = self.packets.first()?;
        let model = claimants(first).next()?;
        let found_us = self.period_ns(model)? / 1000.0;
        let title = model.title();
        let why = format!("the bytes fit {title}, the packet period of {found_us:.0} us does not");
        Some(why)
    }

    /// The packets taken so far, in the order of arrival.
    pub fn into_packets(self) -> Vec<(Timestamp, Vec<u8>)> {
        self.packets
    }

    fn has_period_of(&self, model: ModelRef) -> bool {
        let head = self.packets.iter().find_map(|(_, p)| model.head(p));
        let (Some(found_ns), Some(head)) = (self.period_ns(model), head) else {
            return true; // too few packets to tell
        };
        let period_ns = model.period_ns(head.return_mode) as f64;
        (found_ns / period_ns - 1.0).abs() < PERIOD_TOLERANCE
    }

    /// Median step of device time; `None` for fewer than three steps.
    fn period_ns(&self, model: ModelRef) -> Option<f64> {
        let heads: Vec<Head> = self
            .packets
            .iter()
            .filter_map(|(_, p)| model.head(p))
            .collect();
        let steps = heads
            .windows(2)
            .map(|pair| pair[1].device_ns - pair[0].device_ns);
        let mut steps: Vec<i64> = steps.filter(|step| *step > 0).collect();
        steps.sort_unstable();
        (steps.len() >= 3).then(|| steps[steps.len() / 2] as f64)
    }
}
