//! What a scan found out.

use std::net::IpAddr;

use super::{ScanOptions, StreamKey};
use crate::clock::ClockModel;
use crate::drops::Drops;
use crate::error::UnitError;
use crate::loss::Counts;
use crate::loss::view::FieldOfView;
use crate::packet::unit::{Calibration, UnitFile};
use crate::packet::velodyne::position::Pps;
use crate::packet::{Misfit, ModelRef};
use crate::time::Timestamp;

/// One lidar of a capture.
#[derive(Debug, Clone)]
pub struct StreamInfo {
    /// Where it sends from and to.
    pub key: StreamKey,
    /// What it is.
    pub model: ModelRef,
    /// Whether the user said so.
    pub is_named: bool,
    /// Ids of models that the packets cannot tell from this one.
    pub candidates: Vec<&'static str>,
    /// What is known of the unit: files that were given, else what its packets say.
    pub unit: Vec<UnitFile>,
    /// Where its angles come from, or why there are none.
    pub calibration: Result<Calibration, UnitError>,
    /// Word for its return mode.
    pub return_mode: &'static str,
    /// Turns a minute, in the mean; frames a minute of sensors without a rotor.
    pub rpm: f64,
    /// Packets over the whole capture.
    pub counts: Counts,
    /// Points and merged second returns.
    pub points: u64,
    /// Second returns that repeat the first.
    pub merged: u64,
    /// Datagrams of the stream that are not the lidar's.
    pub foreign: u64,
    /// UTC of the first shot.
    pub first: Timestamp,
    /// UTC of the end of the last packet.
    pub last: Timestamp,
    /// How device time becomes UTC.
    pub clock: ClockModel,
    /// Position packets of the same address.
    pub position: Option<PositionFacts>,
    /// What of the turn it sends.
    pub view: FieldOfView,
    /// Set where two sensors send from this address to this port, so that sweeps would mix them.
    pub conflict: Option<String>,
    /// What else a user should know.
    pub notes: Vec<String>,
    /// Counts of each second since [`ScanReport::origin`].
    pub(super) seconds: Vec<Second>,
    /// Source ports with their packets, the first few.
    pub(super) source_ports: Vec<(u16, u64)>,
}

/// Sums over one second of one lidar.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Second {
    pub counts: Counts,
    pub foreign: u64,
    pub points: u64,
    pub turned_rad: f64,
    pub turned_ns: i64,
    /// Smallest offset of host from device, less the time a packet takes to fill.
    pub offset_ns: Option<i64>,
}

/// One second of one lidar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Health {
    /// Start of the second.
    pub time: Timestamp,
    /// Number of the lidar in the report.
    pub lidar: usize,
    /// Packets.
    pub counts: Counts,
    /// Datagrams of the stream that are not the lidar's.
    pub foreign: u64,
    /// Points.
    pub points: u64,
    /// Turns a minute; `None` where nothing arrived, and for sensors without a rotor.
    pub rpm: Option<f64>,
    /// Host minus device time; `None` where nothing arrived.
    pub clock_offset_s: Option<f64>,
    /// Share of the packets sent that arrived; 0 for a silent second.
    pub coverage: f64,
}

/// What the position packets of a sensor say.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionFacts {
    /// Packets.
    pub packets: u64,
    /// Port they are sent to.
    pub port: u16,
    /// State of the pulse per second in the last one.
    pub pps: Pps,
    /// Packets with a locked clock and a receiver that has a fix.
    pub locked: u64,
    /// NMEA sentence of the last one.
    pub sentence: Option<String>,
}

impl PositionFacts {
    /// Whether the sensor says that its clock follows UTC, in most of the packets.
    pub fn is_locked(&self) -> bool {
        self.locked * 2 > self.packets
    }
}

/// A stream without a lidar.
#[derive(Debug, Clone, PartialEq)]
pub struct OtherStream {
    /// Where it comes from and goes to.
    pub key: StreamKey,
    /// Datagrams.
    pub packets: u64,
    /// Of those position packets of a lidar.
    pub positions: u64,
    /// Of those packets that describe a unit, its motion or its state.
    pub companions: u64,
    /// Size of the first datagram's payload.
    pub payload_len: usize,
    /// Datagrams a second.
    pub rate_hz: f64,
    /// The sensor that it comes closest to, and what speaks against it.
    pub closest: Option<Misfit>,
}

/// A stretch in which nothing at all was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pause {
    /// Host time of the last datagram before.
    pub from: Timestamp,
    /// Host time of the first datagram after.
    pub to: Timestamp,
}

/// What a scan found in a capture.
#[derive(Debug, Clone)]
pub struct ScanReport {
    /// Lidars, ordered by address and port.
    pub lidars: Vec<StreamInfo>,
    /// Streams without a lidar, the busiest first.
    pub others: Vec<OtherStream>,
    /// UDP datagrams read.
    pub datagrams: u64,
    /// Datagrams that gave no points, by reason.
    pub drops: Drops,
    /// Stretches in which nothing was recorded.
    pub pauses: Vec<Pause>,
    /// UTC of the first accepted lidar packet.
    pub first: Option<Timestamp>,
    /// UTC of the end of the last one.
    pub last: Option<Timestamp>,
    /// How the datagrams were sorted into streams.
    pub options: ScanOptions,
}

impl ScanReport {
    /// Options for another scan, where source ports tell sensors apart that share an address.
    pub fn split(&self) -> Option<ScanOptions> {
        let splits = self.lidars.iter().filter(|lidar| lidar.is_splittable());
        let places: Vec<(IpAddr, u16)> = splits.map(|l| (l.key.address, l.key.port)).collect();
        (!places.is_empty()).then(|| {
            let mut options = self.options.clone();
            options.split.extend(places);
            options
        })
    }

    /// Whether each file that the user named is of use to a lidar.
    ///
    /// # Errors
    /// [`UnitError`] for the first one that is not.
    pub fn check_units(&self) -> Result<(), UnitError> {
        let named = self.options.units.iter().filter(|given| given.is_named);
        for given in named {
            let lidars = || self.lidars.iter().filter(|lidar| given.is_for(&lidar.key));
            if !lidars().any(|lidar| lidar.model.takes(&given.file)) {
                let mut models: Vec<&str> = lidars().map(|lidar| lidar.model.title()).collect();
                if models.is_empty() {
                    models.push("a lidar that is in the capture");
                }
                return Err(UnitError::NotTaken {
                    file: given.file.name.clone(),
                    models: models.join(", "),
                    found: given.file.first_line(),
                });
            }
        }
        Ok(())
    }

    /// Files that lay beside the capture and that no lidar takes.
    pub fn unused_units(&self) -> impl Iterator<Item = &UnitFile> {
        let beside = self.options.units.iter().filter(|given| !given.is_named);
        let is_taken = |given: &&super::Given| {
            let mut lidars = self.lidars.iter();
            lidars.any(|lidar| given.is_for(&lidar.key) && lidar.model.takes(&given.file))
        };
        beside
            .filter(move |given| !is_taken(given))
            .map(|given| &given.file)
    }

    /// Counts of every second from the first packet on, by second and lidar.
    pub fn health(&self) -> impl Iterator<Item = Health> + '_ {
        let seconds = self.lidars.iter().map(|lidar| lidar.seconds.len()).max();
        let first = self.first.unwrap_or_default();
        (0..seconds.unwrap_or(0)).flat_map(move |number| {
            let time = first + number as i64 * crate::time::NANOS_PER_SECOND;
            let lidars = self.lidars.iter().enumerate();
            lidars.map(move |(place, lidar)| {
                let second = lidar.seconds.get(number).copied().unwrap_or_default();
                let mut health = second.health(time, place);
                health.rpm = health.rpm.filter(|_| lidar.model.has_rotor());
                health
            })
        })
    }
}

impl StreamInfo {
    /// About how many points it has in a stretch of time, if they are spread evenly.
    pub fn points_within(&self, length_ns: i64) -> f64 {
        let whole_ns = (self.last - self.first).max(1) as f64;
        self.points as f64 * (length_ns as f64 / whole_ns).clamp(0.0, 1.0)
    }

    /// Angle of the turn that it sends.
    pub fn visible_rad(&self) -> f64 {
        std::f64::consts::TAU - self.view.blind_rad()
    }

    fn is_splittable(&self) -> bool {
        let busy = self
            .source_ports
            .iter()
            .filter(|(_, packets)| *packets >= 32);
        self.conflict.is_some() && self.key.source_port.is_none() && busy.count() > 1
    }
}

impl Second {
    fn health(&self, time: Timestamp, lidar: usize) -> Health {
        let turns = self.turned_rad / std::f64::consts::TAU;
        let minutes = self.turned_ns as f64 / 60e9;
        Health {
            time,
            lidar,
            counts: self.counts,
            foreign: self.foreign,
            points: self.points,
            rpm: (self.turned_ns > 0).then(|| turns / minutes),
            clock_offset_s: self.offset_ns.map(|offset_ns| offset_ns as f64 / 1e9),
            coverage: if self.counts.packets == 0 {
                0.0
            } else {
                self.counts.coverage()
            },
        }
    }
}
