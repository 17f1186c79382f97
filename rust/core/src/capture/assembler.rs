//! From records to UDP datagrams: link layer, IP, fragments, UDP; each drop counted by its reason.

use std::net::{IpAddr, SocketAddr};

use super::assembly::Added;
use super::facts::FragmentFacts;
use super::fragments::{FragmentPool, Key};
use super::ip::{self, Fragment, IpPacket};
use super::link;
use super::udp::{self, UDP};
use super::{Datagram, Record};
use crate::drops::Drops;

/// Finds the UDP datagrams of records and puts fragments together.
///
/// One assembler may serve several captures that are parts of one recording: fragments of one
/// datagram may lie in two files.
///
/// Reasons of [`Assembler::drops`]: `truncated_record` (cut by the recording, or shorter than its UDP
/// length), `not_ip`, `not_udp`, `unknown_linktype`, `damaged_headers`, `damaged_block` and
/// `unknown_interface` (pcapng), `fragment_damaged` (fragments that contradict one another),
/// `fragment_duplicate`; all count records. `fragment_incomplete` counts datagrams whose parts did
/// not all come within 2 s.
#[derive(Debug, Default)]
pub struct Assembler {
    pool: FragmentPool,
    drops: Drops,
    incomplete_told: u64,
}

/// A datagram that a record completed, by the place of its payload.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    source: SocketAddr,
    destination: SocketAddr,
    place: Place,
    len: usize,
}

#[derive(Debug, Clone, Copy)]
enum Place {
    /// Bytes of the record from here.
    Record(usize),
    /// Bytes of the datagram that the pool completed, from here.
    Pool(usize),
}

impl Assembler {
    /// Takes one record; what it completes is read by [`Assembler::datagram`].
    #[inline]
    pub fn push(&mut self, record: &Record<'_>) -> Option<Found> {
        match self.find(record) {
            Ok(found) => found,
            Err(reason) => {
                self.drops.add(reason, 1);
                None
            }
        }
    }

    /// The datagram that `record` completed. Call it with the record that was pushed last.
    #[inline]
    pub fn datagram<'a>(&'a self, found: &Found, record: &Record<'a>) -> Datagram<'a> {
        let (bytes, start) = match found.place {
            Place::Record(start) => (record.data, start),
            Place::Pool(start) => (self.pool.completed().0, start),
        };
        Datagram {
            time: record.time,
            source: found.source,
            destination: found.destination,
            // Empty where it is called with another record than the one that was pushed.
            payload: bytes.get(start..start + found.len).unwrap_or_default(),
            record: record.number,
            offset: record.offset,
        }
    }

    /// Counts the fragments that still wait as incomplete; for the end of a recording.
    pub fn finish(&mut self) {
        self.pool.give_up();
        self.tell_incomplete();
    }

    /// What was left out so far, by reason.
    pub fn drops(&self) -> &Drops {
        &self.drops
    }

    /// What became of fragments so far.
    pub fn fragments(&self) -> FragmentFacts {
        self.pool.facts()
    }

    fn find(&mut self, record: &Record<'_>) -> Result<Option<Found>, &'static str> {
        if let Some(reason) = record.defect {
            return Err(reason);
        }
        if record.data.len() < record.original_len as usize {
            return Err("truncated_record");
        }
        let link = link::parse(record.linktype, record.data)?;
        let data = &record.data[link.len..];
        let packet = ip::parse(link.version, data)?;
        if let Some(part) = packet.fragment {
            return self.collect(record, &packet, part, link.vlan, &data[packet.body.clone()]);
        }
        let start = link.len + packet.body.start;
        let segment = &data[packet.body.clone()];
        in_segment(&packet, packet.protocol, segment, Place::Record(start)).map(Some)
    }

    /// Adds a fragment to the pool.
    fn collect(
        &mut self,
        record: &Record<'_>,
        packet: &IpPacket,
        part: Fragment,
        vlan: u32,
        body: &[u8],
    ) -> Result<Option<Found>, &'static str> {
        let is_v4 = packet.source.is_ipv4();
        if is_v4 && packet.protocol != UDP {
            return Err("not_udp");
        }
        let key = Key {
            source: packet.source,
            destination: packet.destination,
            protocol: if is_v4 { packet.protocol } else { 0 },
            identification: part.identification,
            vlan,
        };
        let added = self
            .pool
            .push(key, packet.protocol, part, body, record.time);
        self.tell_incomplete();
        match added {
            Added::Waiting => Ok(None),
            Added::Complete => self.completed(packet).map(Some),
            Added::Duplicate => Err("fragment_duplicate"),
            Added::Contradiction => Err("fragment_damaged"),
        }
    }

    fn completed(&self, packet: &IpPacket) -> Result<Found, &'static str> {
        let (whole, protocol) = self.pool.completed();
        if packet.source.is_ipv4() {
            return in_segment(packet, protocol, whole, Place::Pool(0));
        }
        let chain = ip::skip_extensions(protocol, whole)?;
        if chain.fragment.is_some() {
            return Err("damaged_headers"); // a fragment within a fragment
        }
        let place = Place::Pool(chain.len);
        in_segment(packet, chain.protocol, &whole[chain.len..], place)
    }

    fn tell_incomplete(&mut self) {
        let incomplete = self.pool.facts().incomplete;
        self.drops
            .add("fragment_incomplete", incomplete - self.incomplete_told);
        self.incomplete_told = incomplete;
    }
}

/// Reads the UDP header of `segment`, which stands at `place`.
#[inline]
fn in_segment(
    packet: &IpPacket,
    protocol: u8,
    segment: &[u8],
    place: Place,
) -> Result<Found, &'static str> {
    if protocol != UDP {
        return Err("not_udp");
    }
    let header = udp::parse(segment)?;
    let socket = |address: IpAddr, port| SocketAddr::new(address, port);
    Ok(Found {
        source: socket(packet.source, header.source_port),
        destination: socket(packet.destination, header.destination_port),
        place: match place {
            Place::Record(start) => Place::Record(start + udp::HEADER_LEN),
            Place::Pool(start) => Place::Pool(start + udp::HEADER_LEN),
        },
        len: header.payload_len,
    })
}
