//! Which datagrams of a capture belong to a shorter one.

use std::collections::HashMap;
use std::net::IpAddr;

use super::arrivals::{Arrivals, mark};
use super::reader::SweepOptions;
use super::report::ScanReport;
use super::{ScanOptions, StreamKey, packets};
use crate::capture::Datagram;
use crate::clock::ClockModel;
use crate::packet::ModelRef;
use crate::time::Timestamp;

/// Chooses datagrams by lidar and time: data packets by their own time, what else comes from a
/// lidar's address by its arrival, and nothing of other senders.
pub struct CaptureCut {
    options: ScanOptions,
    lanes: HashMap<StreamKey, Lane>,
    addresses: Vec<IpAddr>,
    start: Timestamp,
    stop: Timestamp,
}

struct Lane {
    model: ModelRef,
    arrivals: Arrivals<()>,
    clock: ClockModel,
}

impl CaptureCut {
    /// Takes lidars, start and stop from `options`.
    pub fn new(report: &ScanReport, options: &SweepOptions) -> Self {
        let is_wanted = |number: &usize| options.lidars.as_ref().is_none_or(|l| l.contains(number));
        let wanted: Vec<_> = report
            .lidars
            .iter()
            .enumerate()
            .filter(|(number, _)| is_wanted(number))
            .map(|(_, info)| info)
            .collect();
        let lane = |info: &&super::StreamInfo| Lane {
            model: info.model,
            arrivals: Arrivals::new(info.model),
            clock: info.clock.clone(),
        };
        Self {
            options: report.options.clone(),
            addresses: wanted.iter().map(|info| info.key.address).collect(),
            lanes: wanted.iter().map(|info| (info.key, lane(info))).collect(),
            start: options.start.unwrap_or(Timestamp(i64::MIN)),
            stop: options.stop.unwrap_or(Timestamp(i64::MAX)),
        }
    }

    /// Whether the next datagram of the capture belongs to the cut; one that joins packets by its first.
    pub fn wants(&mut self, datagram: &Datagram<'_>) -> bool {
        let whole = datagram;
        let first = packets(whole).next();
        let datagram = first.as_ref().unwrap_or(whole);
        let time = match self.lanes.get_mut(&self.options.key(datagram)) {
            Some(lane) => lane.time(datagram),
            None if self.addresses.contains(&datagram.source.ip()) => datagram.time,
            None => return false,
        };
        (self.start..self.stop).contains(&time)
    }
}

impl Lane {
    /// UTC of a data packet; of anything else the time of arrival.
    fn time(&mut self, datagram: &Datagram<'_>) -> Timestamp {
        let Some(head) = self.model.head(datagram.payload) else {
            return datagram.time;
        };
        let mark = mark(datagram.payload);
        let (ticket, _) = self.arrivals.offer(datagram.time, &head, mark, || ());
        while self.arrivals.pop().is_some() {}
        self.clock.utc(self.arrivals.segment(), ticket.device)
    }
}
