//! Captures written byte by byte, for tests.
#![allow(dead_code)] // each test crate uses a part of it

use lidar_deflect_core::capture::{DatagramReader, PcapWriter};
use lidar_deflect_core::drops::Drops;
use lidar_deflect_core::error::CaptureError;
use lidar_deflect_core::time::Timestamp;

/// Byte order of a pcapng section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    Little,
    Big,
}

/// Builds pcapng blocks.
pub struct PcapNg {
    pub bytes: Vec<u8>,
    order: Order,
}

impl PcapNg {
    pub fn new(order: Order) -> Self {
        let mut file = Self {
            bytes: Vec::new(),
            order,
        };
        file.section(order);
        file
    }

    pub fn u16(&self, value: u16) -> [u8; 2] {
        match self.order {
            Order::Little => value.to_le_bytes(),
            Order::Big => value.to_be_bytes(),
        }
    }

    pub fn u32(&self, value: u32) -> [u8; 4] {
        match self.order {
            Order::Little => value.to_le_bytes(),
            Order::Big => value.to_be_bytes(),
        }
    }

    pub fn block(&mut self, kind: u32, body: &[u8]) {
        let padding = body.len().next_multiple_of(4) - body.len();
        let total = self.u32((12 + body.len() + padding) as u32);
        let kind = self.u32(kind);
        for part in [&kind, &total, body, &[0; 3][..padding], &total] {
            self.bytes.extend(part);
        }
    }

    pub fn section(&mut self, order: Order) {
        self.order = order;
        let body = [
            &self.u32(0x1A2B_3C4D)[..],
            &self.u16(1),
            &self.u16(0),
            &[0xFF; 8],
        ]
        .concat();
        self.block(0x0A0D_0D0A, &body);
    }

    /// An interface; options are (code, value) in file order.
    pub fn interface(&mut self, linktype: u16, snaplen: u32, options: &[(u16, &[u8])]) {
        let mut body = [&self.u16(linktype)[..], &[0, 0], &self.u32(snaplen)].concat();
        for (code, value) in options {
            body.extend(self.u16(*code));
            body.extend(self.u16(value.len() as u16));
            body.extend(*value);
            body.resize(body.len().next_multiple_of(4), 0);
        }
        if !options.is_empty() {
            body.extend([0; 4]);
        }
        self.block(1, &body);
    }

    pub fn enhanced(&mut self, interface: u32, ticks: u64, data: &[u8]) {
        let words = [
            interface,
            (ticks >> 32) as u32,
            ticks as u32,
            data.len() as u32,
            data.len() as u32,
        ];
        let mut body: Vec<u8> = words.iter().flat_map(|word| self.u32(*word)).collect();
        body.extend(data);
        self.block(6, &body);
    }

    pub fn obsolete(&mut self, interface: u16, ticks: u64, data: &[u8]) {
        let mut body = [self.u16(interface), self.u16(0xFFFF)].concat();
        let words = [
            (ticks >> 32) as u32,
            ticks as u32,
            data.len() as u32,
            data.len() as u32,
        ];
        body.extend(words.iter().flat_map(|word| self.u32(*word)));
        body.extend(data);
        self.block(2, &body);
    }

    pub fn simple(&mut self, original_len: u32, data: &[u8]) {
        let body = [&self.u32(original_len)[..], data].concat();
        self.block(3, &body);
    }
}

/// The Ethernet frames that [`PcapWriter`] makes of one datagram.
pub fn frames(source: &str, destination: &str, payload: &[u8]) -> Vec<Vec<u8>> {
    let mut writer = PcapWriter::new(Vec::new()).unwrap();
    let (source, destination) = (source.parse().unwrap(), destination.parse().unwrap());
    writer
        .write_udp(Timestamp(0), source, destination, payload)
        .unwrap();
    let file = writer.into_inner();
    let mut frames = Vec::new();
    let mut rest = &file[24..];
    while let Some((header, data)) = rest.split_first_chunk::<16>() {
        let len = u32::from_le_bytes([header[8], header[9], header[10], header[11]]) as usize;
        frames.push(data[..len].to_vec());
        rest = &data[len..];
    }
    frames
}

/// One frame of an unfragmented IPv4 datagram.
pub fn frame(payload: &[u8]) -> Vec<u8> {
    frames("192.168.1.201:2368", "192.168.1.100:2368", payload).remove(0)
}

/// A classic pcap, little endian, microseconds, one record per frame and second.
pub fn pcap(linktype: u32, frames: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = vec![0xD4, 0xC3, 0xB2, 0xA1, 2, 0, 4, 0];
    bytes.extend([0; 8]);
    bytes.extend(65_535u32.to_le_bytes());
    bytes.extend(linktype.to_le_bytes());
    for (second, frame) in frames.iter().enumerate() {
        for word in [second as u32, 0, frame.len() as u32, frame.len() as u32] {
            bytes.extend(word.to_le_bytes());
        }
        bytes.extend(frame);
    }
    bytes
}

/// Everything that came out of a capture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Outcome {
    /// Time in nanoseconds, payload.
    pub datagrams: Vec<(i64, Vec<u8>)>,
    pub drops: Drops,
    pub records: u64,
    pub truncated_tail: u64,
    pub error: Option<CaptureError>,
}

/// Reads a capture to its end, or to its first error.
pub fn read(reader: impl std::io::Read) -> Outcome {
    let mut outcome = Outcome {
        datagrams: Vec::new(),
        drops: Drops::default(),
        records: 0,
        truncated_tail: 0,
        error: None,
    };
    let mut reader = match DatagramReader::new(reader) {
        Ok(reader) => reader,
        Err(error) => {
            outcome.error = Some(error);
            return outcome;
        }
    };
    loop {
        match reader.next() {
            Ok(Some(datagram)) => {
                outcome
                    .datagrams
                    .push((datagram.time.0, datagram.payload.to_vec()));
            }
            Ok(None) => break,
            Err(error) => {
                outcome.error = Some(error);
                break;
            }
        }
    }
    outcome.drops = reader.drops().clone();
    outcome.records = reader.facts().records;
    outcome.truncated_tail = reader.facts().truncated_tail;
    outcome
}
