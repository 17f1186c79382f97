//! Ethernet frames of a UDP datagram: headers, checksums, fragments.

use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::ops::Range;

use super::udp::{HEADER_LEN as UDP_HEADER_LEN, UDP};
use super::writer::{MTU, invalid, same_version};

const IPV4_LEN: usize = 20;
const IPV6_LEN: usize = 40;
const FRAGMENT_LEN: usize = 8;
const FRAGMENT: u8 = 44;
const TIME_TO_LIVE: u8 = 64;
const MAX_LEN: usize = 65_535;

/// Identifications of datagrams, counted per sender as its network stack would.
#[derive(Debug, Default)]
pub(super) struct Datagrams(BTreeMap<IpAddr, u32>);

impl Datagrams {
    pub(super) fn next(&mut self, sender: IpAddr) -> u32 {
        let count = self.0.entry(sender).or_default();
        *count = count.wrapping_add(1);
        *count
    }
}

/// The headers that all frames of one datagram share.
#[derive(Debug)]
pub(super) struct Headers {
    source: IpAddr,
    destination: IpAddr,
    udp: [u8; UDP_HEADER_LEN],
    /// UDP header and payload.
    len: usize,
}

/// One fragment, or the whole.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Part {
    /// Which bytes of UDP header and payload.
    range: Range<usize>,
    more: bool,
    whole: bool,
}

impl Headers {
    pub(super) fn new(
        source: SocketAddr,
        destination: SocketAddr,
        payload: &[u8],
    ) -> io::Result<Self> {
        if !same_version(source.ip(), destination.ip()) {
            return Err(invalid("source and destination of different IP versions"));
        }
        let len = UDP_HEADER_LEN + payload.len();
        let before = if source.is_ipv4() { IPV4_LEN } else { 0 };
        if before + len > MAX_LEN {
            return Err(invalid("a payload that exceeds a UDP datagram"));
        }
        let mut headers = Self {
            source: source.ip(),
            destination: destination.ip(),
            udp: [0; UDP_HEADER_LEN],
            len,
        };
        headers.udp[0..2].copy_from_slice(&source.port().to_be_bytes());
        headers.udp[2..4].copy_from_slice(&destination.port().to_be_bytes());
        headers.udp[4..6].copy_from_slice(&(len as u16).to_be_bytes());
        let checksum = headers.udp_checksum(payload);
        headers.udp[6..8].copy_from_slice(&checksum.to_be_bytes());
        Ok(headers)
    }

    /// The parts that fit Ethernet frames, in order.
    pub(super) fn parts(&self) -> impl Iterator<Item = Part> + use<> {
        let (len, room) = (self.len, MTU - self.ip_len());
        let whole = len <= room;
        let fragment_room = match self.source {
            IpAddr::V4(_) => room,
            IpAddr::V6(_) => room - FRAGMENT_LEN,
        };
        let step = if whole { len } else { fragment_room / 8 * 8 };
        (0..len).step_by(step).map(move |start| {
            let stop = (start + step).min(len);
            Part {
                range: start..stop,
                more: stop < len,
                whole,
            }
        })
    }

    /// Appends the Ethernet frame of one part.
    pub(super) fn write_part(&self, frame: &mut Vec<u8>, part: &Part, id: u32, payload: &[u8]) {
        frame.extend(mac(self.destination));
        frame.extend(mac(self.source));
        match self.source {
            IpAddr::V4(_) => self.write_v4(frame, part, id as u16),
            IpAddr::V6(_) => self.write_v6(frame, part, id),
        }
        let Range { start, end } = part.range;
        let from = start.saturating_sub(UDP_HEADER_LEN);
        if start == 0 {
            frame.extend(self.udp);
        }
        frame.extend(&payload[from..end - UDP_HEADER_LEN]);
    }

    fn ip_len(&self) -> usize {
        match self.source {
            IpAddr::V4(_) => IPV4_LEN,
            IpAddr::V6(_) => IPV6_LEN,
        }
    }

    fn write_v4(&self, frame: &mut Vec<u8>, part: &Part, id: u16) {
        frame.extend([0x08, 0x00]);
        let start = frame.len();
        frame.extend([0x45, 0]);
        frame.extend(((IPV4_LEN + part.range.len()) as u16).to_be_bytes());
        frame.extend(id.to_be_bytes());
        let more = if part.more { 0x2000 } else { 0 };
        frame.extend((more | (part.range.start / 8) as u16).to_be_bytes());
        frame.extend([TIME_TO_LIVE, UDP, 0, 0]);
        extend_address(frame, self.source);
        extend_address(frame, self.destination);
        let checksum = !fold(sum(&frame[start..]));
        frame[start + 10..start + 12].copy_from_slice(&checksum.to_be_bytes());
    }

    fn write_v6(&self, frame: &mut Vec<u8>, part: &Part, id: u32) {
        let (next, extra) = match part.whole {
            true => (UDP, 0),
            false => (FRAGMENT, FRAGMENT_LEN),
        };
        frame.extend([0x86, 0xDD, 0x60, 0, 0, 0]);
        frame.extend(((part.range.len() + extra) as u16).to_be_bytes());
        frame.extend([next, TIME_TO_LIVE]);
        extend_address(frame, self.source);
        extend_address(frame, self.destination);
        if !part.whole {
            frame.extend([UDP, 0]);
            frame.extend((part.range.start as u16 | u16::from(part.more)).to_be_bytes());
            frame.extend(id.to_be_bytes());
        }
    }

    /// Over the pseudo header, the UDP header and the payload.
    fn udp_checksum(&self, payload: &[u8]) -> u16 {
        let mut addresses = Vec::with_capacity(32);
        extend_address(&mut addresses, self.source);
        extend_address(&mut addresses, self.destination);
        let pseudo = sum(&addresses) + u64::from(UDP) + self.len as u64;
        match !fold(pseudo + sum(&self.udp) + sum(payload)) {
            0 => 0xFFFF, // 0 would say that there is none
            checksum => checksum,
        }
    }
}

fn extend_address(bytes: &mut Vec<u8>, address: IpAddr) {
    match address {
        IpAddr::V4(address) => bytes.extend(address.octets()),
        IpAddr::V6(address) => bytes.extend(address.octets()),
    }
}

/// A locally administered hardware address made from the IP address; the group address for groups.
fn mac(address: IpAddr) -> [u8; 6] {
    match address {
        IpAddr::V4(v4) if v4.is_broadcast() => [0xFF; 6],
        IpAddr::V4(v4) => {
            let [a, b, c, d] = v4.octets();
            match v4.is_multicast() {
                true => [0x01, 0x00, 0x5E, b & 0x7F, c, d],
                false => [0x02, 0x00, a, b, c, d],
            }
        }
        IpAddr::V6(v6) => {
            let [.., a, b, c, d] = v6.octets();
            match v6.is_multicast() {
                true => [0x33, 0x33, a, b, c, d],
                false => [0x02, 0x06, a, b, c, d],
            }
        }
    }
}

/// Sum of the 16-bit words, big endian, the last padded with 0.
fn sum(bytes: &[u8]) -> u64 {
    let (words, rest) = bytes.as_chunks::<2>();
    let padded = rest.first().map_or(0, |byte| u64::from(*byte) << 8);
    let words = words
        .iter()
        .map(|word| u64::from(u16::from_be_bytes(*word)));
    words.sum::<u64>() + padded
}

fn fold(mut sum: u64) -> u16 {
    while sum > 0xFFFF {
        sum = (sum & 0xFFFF) + (sum >> 16);
    }
    sum as u16
}
