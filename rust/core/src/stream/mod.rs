//! From the datagrams of a capture to streams, health counts and sweeps.
//!
//! A capture is read twice: [`Scan`] finds the lidars by the content of their packets, counts what
//! arrived and judges their clocks; [`SweepReader`] then turns the same datagrams into sweeps.

mod abreast;
mod arrivals;
mod beside;
mod both;
mod cut;
mod hold;
mod intake;
mod keys;
mod lidar;
mod points;
mod probe;
mod reader;
mod report;
mod scan;
mod sweeps;
mod undecoded;
mod workshop;

use std::fmt;
use std::net::{IpAddr, SocketAddr};

use crate::capture::Datagram;
use crate::error::InvalidValue;
use crate::packet::unit::UnitFile;
use crate::packet::{ModelRef, PacketKind, pieces, unit_models};

pub use abreast::Abreast;
pub use beside::{Beside, Reading, Taker, Taking};
pub use both::{Both, Pair};
pub use cut::CaptureCut;
pub use hold::HoldEchoes;
pub use points::{PointBlock, PointReader, PointTagger};
pub use reader::{Reader, Sink, SweepOptions, SweepReader};
pub use report::{Health, OtherStream, Pause, PositionFacts, ScanReport, StreamInfo};
pub use scan::Scan;
pub use sweeps::{Sweeps, sweeps};

/// A source address and a destination port; with a source port where two sensors share them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StreamKey {
    /// Sender.
    pub address: IpAddr,
    /// Port at the receiver.
    pub port: u16,
    /// Port at the sender, only where the content needs it.
    pub source_port: Option<u16>,
}

impl fmt::Display for StreamKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        SocketAddr::new(self.address, self.port).fmt(f)?;
        match self.source_port {
            Some(port) => write!(f, "@{port}"),
            None => Ok(()),
        }
    }
}

/// How a user names one stream or several: `address`, `address:port` or `address:port@source_port`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Source {
    address: IpAddr,
    port: Option<u16>,
    source_port: Option<u16>,
}

impl Source {
    /// Reads a name.
    ///
    /// # Errors
    /// [`InvalidValue`] where it is none of the three forms; an IPv6 address with a port stands in brackets.
    pub fn parse(text: &str) -> Result<Self, InvalidValue> {
        let refuse = || InvalidValue {
            name: "source",
            expected: "an address, address:port or address:port@source_port".into(),
            found: text.into(),
        };
        let (place, source_port) = match text.split_once('@') {
            Some((place, port)) => (place, Some(port.parse().map_err(|_| refuse())?)),
            None => (text, None),
        };
        let whole = place.parse::<SocketAddr>();
        let (address, port) = match whole {
            Ok(socket) => (socket.ip(), Some(socket.port())),
            Err(_) => (place.parse().map_err(|_| refuse())?, None),
        };
        Ok(Self {
            address,
            port,
            source_port,
        })
    }

    /// Whether it names this stream.
    pub fn matches(&self, key: &StreamKey) -> bool {
        let is_port = self.port.is_none_or(|port| port == key.port);
        let is_source_port = self.source_port.is_none() || self.source_port == key.source_port;
        self.address == key.address && is_port && is_source_port
    }
}

/// A file of a unit.
#[derive(Debug, Clone)]
pub struct Given {
    /// Whose it is; `None`: of any lidar that takes it.
    pub source: Option<Source>,
    /// It.
    pub file: UnitFile,
    /// The user named it, so that it has to be of use.
    pub is_named: bool,
}

impl Given {
    fn is_for(&self, key: &StreamKey) -> bool {
        self.source.is_none_or(|source| source.matches(key))
    }
}

/// What the user told beforehand, and what an earlier scan found out.
#[derive(Debug, Clone, Default)]
pub struct ScanOptions {
    /// Models by source, which then need only the right size of packets.
    pub models: Vec<(Source, ModelRef)>,
    /// Files of single units, those that count most first.
    pub units: Vec<Given>,
    /// Streams that the source port splits.
    pub split: Vec<(IpAddr, u16)>,
}

impl ScanOptions {
    /// The stream that a datagram belongs to.
    pub fn key(&self, datagram: &Datagram<'_>) -> StreamKey {
        let address = datagram.source.ip();
        let port = datagram.destination.port();
        let is_split = self.split.contains(&(address, port));
        StreamKey {
            address,
            port,
            source_port: is_split.then(|| datagram.source.port()),
        }
    }

    /// The files that may describe the unit of a stream.
    pub fn unit_files(&self, key: &StreamKey) -> Vec<UnitFile> {
        let files = self.units.iter().filter(|given| given.is_for(key));
        files.map(|given| given.file.clone()).collect()
    }

    /// What tells the model of a stream.
    fn probe(&self, key: &StreamKey) -> probe::Probe {
        let units = unit_models(&self.unit_files(key));
        probe::Probe::new(self.named_model(key), units)
    }

    /// The model that the user named for a stream.
    pub fn named_model(&self, key: &StreamKey) -> Option<ModelRef> {
        let named = self.models.iter().find(|(source, _)| source.matches(key));
        named.map(|(_, model)| *model)
    }
}

/// Whether a payload is a data packet of a stream's model: told by its size alone where the user named the model.
fn is_data(model: ModelRef, is_named: bool, payload: &[u8]) -> bool {
    if is_named {
        model.fits(payload)
    } else {
        model.recognise(payload) == Some(PacketKind::Data)
    }
}

/// A datagram's packets: itself, but for one that joins several.
fn packets<'a>(datagram: &Datagram<'a>) -> impl Iterator<Item = Datagram<'a>> {
    let (pieces, whole) = match pieces(datagram.payload) {
        Some(pieces) => (Some(pieces), None),
        None => (None, Some(datagram.payload)),
    };
    let payloads = pieces.into_iter().flatten().chain(whole);
    let datagram = *datagram;
    payloads.map(move |payload| Datagram {
        payload,
        ..datagram
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_named_in_three_forms() {
        let key = StreamKey {
            address: "192.168.1.201".parse().unwrap(),
            port: 2368,
            source_port: Some(7),
        };
        assert_eq!(key.to_string(), "192.168.1.201:2368@7");
        for name in [
            "192.168.1.201",
            "192.168.1.201:2368",
            "192.168.1.201:2368@7",
        ] {
            assert!(Source::parse(name).unwrap().matches(&key), "{name}");
        }
        for name in [
            "192.168.1.202",
            "192.168.1.201:2369",
            "192.168.1.201:2368@8",
        ] {
            assert!(!Source::parse(name).unwrap().matches(&key), "{name}");
        }
        let six = StreamKey {
            address: "fe80::1".parse().unwrap(),
            port: 2368,
            source_port: None,
        };
        assert_eq!(six.to_string(), "[fe80::1]:2368");
        assert!(Source::parse("[fe80::1]:2368").unwrap().matches(&six));
        assert!(Source::parse("fe80::1").unwrap().matches(&six));
        assert!(Source::parse("192.168.1.201:").is_err() && Source::parse("tower").is_err());
    }
}
