//! Writes UDP datagrams as a classic pcap: Ethernet, IPv4 or IPv6, nanoseconds.

use std::io::{self, ErrorKind, Write};
use std::net::{IpAddr, SocketAddr};

use super::frame::{Datagrams, Headers};
use super::record::MAX_RECORD_LEN;
use crate::time::{NANOS_PER_SECOND, Timestamp};

/// Largest IP packet on Ethernet, bytes; larger datagrams are sent in fragments.
pub(super) const MTU: usize = 1500;

/// Writes UDP datagrams into a pcap file as they would have been recorded on Ethernet.
///
/// Little endian, nanoseconds, checksums in place; datagrams above an Ethernet frame become IP
/// fragments, as on the wire. The same calls give the same bytes.
#[derive(Debug)]
pub struct PcapWriter<W: Write> {
    writer: W,
    frame: Vec<u8>,
    datagrams: Datagrams,
}

impl<W: Write> PcapWriter<W> {
    /// Writes the head of the file.
    ///
    /// # Errors
    /// Those of `writer`.
    pub fn new(mut writer: W) -> io::Result<Self> {
        let mut header = vec![0x4D, 0x3C, 0xB2, 0xA1, 2, 0, 4, 0];
        header.extend([0; 8]); // time zone and accuracy, always 0
        header.extend(MAX_RECORD_LEN.to_le_bytes());
        header.extend(1u32.to_le_bytes()); // Ethernet
        writer.write_all(&header)?;
        Ok(Self {
            writer,
            frame: Vec::with_capacity(2 * MTU),
            datagrams: Datagrams::default(),
        })
    }

    /// Writes one datagram, in fragments where it is longer than an Ethernet frame.
    ///
    /// # Errors
    /// Those of the writer, and [`ErrorKind::InvalidInput`] where source and destination are not of
    /// one IP version, the payload exceeds a UDP datagram, or `time` lies outside of 1970 to 2106.
    pub fn write_udp(
        &mut self,
        time: Timestamp,
        source: SocketAddr,
        destination: SocketAddr,
        payload: &[u8],
    ) -> io::Result<()> {
        let stamp = stamp(time)?;
        let headers = Headers::new(source, destination, payload)?;
        let identification = self.datagrams.next(source.ip());
        for part in headers.parts() {
            self.frame.clear();
            headers.write_part(&mut self.frame, &part, identification, payload);
            let len = (self.frame.len() as u32).to_le_bytes();
            self.writer.write_all(&stamp)?;
            self.writer.write_all(&len)?;
            self.writer.write_all(&len)?;
            self.writer.write_all(&self.frame)?;
        }
        Ok(())
    }

    /// Hands buffered bytes on.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }

    /// The writer below.
    pub fn get_ref(&self) -> &W {
        &self.writer
    }

    /// Gives the writer back, unflushed.
    pub fn into_inner(self) -> W {
        self.writer
    }
}

/// Seconds and nanoseconds as a record header has them.
fn stamp(time: Timestamp) -> io::Result<[u8; 8]> {
    let seconds = u32::try_from(time.0.div_euclid(NANOS_PER_SECOND))
        .map_err(|_| invalid("a time outside of 1970 to 2106"))?;
    let nanos = time.0.rem_euclid(NANOS_PER_SECOND) as u32;
    let mut stamp = [0; 8];
    stamp[..4].copy_from_slice(&seconds.to_le_bytes());
    stamp[4..].copy_from_slice(&nanos.to_le_bytes());
    Ok(stamp)
}

pub(super) fn invalid(what: &str) -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, what)
}

/// Whether both ends are of one IP version.
pub(super) fn same_version(source: IpAddr, destination: IpAddr) -> bool {
    source.is_ipv4() == destination.is_ipv4()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::DatagramReader;

    fn round_trip(source: &str, destination: &str, len: usize) -> (u64, u64) {
        let (source, destination) = (source.parse().unwrap(), destination.parse().unwrap());
        let payload: Vec<u8> = (0..len).map(|i| (i * 31 % 253) as u8).collect();
        let time = Timestamp(1_700_000_000_123_456_789);
        let mut writer = PcapWriter::new(Vec::new()).unwrap();
        writer
            .write_udp(time, source, destination, &payload)
            .unwrap();
        let capture = writer.into_inner();
        let mut reader = DatagramReader::new(&capture[..]).unwrap();
        let datagram = reader.next().unwrap().unwrap();
        assert_eq!((datagram.time, datagram.source), (time, source));
        assert_eq!(
            (datagram.destination, datagram.payload),
            (destination, &payload[..])
        );
        assert!(reader.next().unwrap().is_none());
        assert_eq!(reader.drops().iter().count(), 0);
        (reader.facts().records, reader.fragments().datagrams)
    }

    #[test]
    fn what_is_written_is_read() {
        let (v4, v6) = (
            ["10.0.0.1:2368", "255.255.255.255:7502"],
            ["[fe80::1]:1", "[ff02::2]:2"],
        );
        for len in [0, 1, 1206, 1472] {
            assert_eq!(round_trip(v4[0], v4[1], len), (1, 0));
        }
        // 1480 bytes of each fragment, with the UDP header in the first: 24 904 / 1480 = 16.8
        assert_eq!(round_trip(v4[0], v4[1], 1473), (2, 1));
        assert_eq!(round_trip(v4[0], v4[1], 24_896), (17, 1));
        assert_eq!(round_trip(v4[0], v4[1], 65_507), (45, 1));
        for len in [0, 1206, 1452] {
            assert_eq!(round_trip(v6[0], v6[1], len), (1, 0));
        }
        assert_eq!(round_trip(v6[0], v6[1], 1453), (2, 1));
        // 65 535 bytes behind the IP header in fragments of 1448: 45.3
        assert_eq!(round_trip(v6[0], v6[1], 65_527), (46, 1));
    }

    #[test]
    fn what_no_capture_can_hold_is_refused() {
        let (v4, v6) = ("10.0.0.1:1".parse().unwrap(), "[::1]:1".parse().unwrap());
        let mut writer = PcapWriter::new(Vec::new()).unwrap();
        for (time, source, destination, len) in [
            (0, v4, v6, 1),
            (0, v4, v4, 65_508),
            (0, v6, v6, 65_528),
            (-1, v4, v4, 1),
            (i64::MAX, v4, v4, 1),
        ] {
            let result = writer.write_udp(Timestamp(time), source, destination, &vec![0; len]);
            assert_eq!(result.unwrap_err().kind(), ErrorKind::InvalidInput);
        }
        assert_eq!(writer.into_inner().len(), 24);
    }
}
