//! Writes arrivals as a capture: pcap with nanoseconds, Ethernet, IPv4, UDP.

use std::io::{self, Write};

use super::network::Arrival;

/// Bytes of Ethernet, IPv4 and UDP headers.
const HEADERS: usize = 14 + 20 + 8;

/// Writes the header of the file.
///
/// # Errors
/// Those of the writer.
pub fn write_header(writer: &mut impl Write) -> io::Result<()> {
    writer.write_all(&0xA1B2_3C4D_u32.to_le_bytes())?; // nanoseconds
    writer.write_all(&[2, 0, 4, 0])?; // version 2.4
    writer.write_all(&[0; 8])?;
    writer.write_all(&65_535_u32.to_le_bytes())?;
    writer.write_all(&1_u32.to_le_bytes()) // Ethernet
}

/// Writes one datagram.
///
/// # Errors
/// Those of the writer.
pub fn write_arrival(writer: &mut impl Write, arrival: &Arrival) -> io::Result<()> {
    let length = (HEADERS + arrival.payload.len()) as u32;
    let seconds = arrival.time.0.div_euclid(1_000_000_000) as u32;
    let nanos = arrival.time.0.rem_euclid(1_000_000_000) as u32;
    for word in [seconds, nanos, length, length] {
        writer.write_all(&word.to_le_bytes())?;
    }
    writer.write_all(&headers(arrival))?;
    writer.write_all(&arrival.payload)
}

fn headers(arrival: &Arrival) -> [u8; HEADERS] {
    let mut bytes = [0; HEADERS];
    let (source, destination) = (arrival.source, arrival.destination);
    bytes[..6].copy_from_slice(&[0xFF; 6]);
    bytes[6..8].copy_from_slice(&[0x60, 0x76]);
    bytes[8..12].copy_from_slice(&source.ip().octets());
    bytes[12..14].copy_from_slice(&[8, 0]);
    let udp_length = (8 + arrival.payload.len()) as u16;
    let ip = &mut bytes[14..34];
    ip[0] = 0x45;
    ip[2..4].copy_from_slice(&(20 + udp_length).to_be_bytes());
    ip[8..10].copy_from_slice(&[64, 17]);
    ip[12..16].copy_from_slice(&source.ip().octets());
    ip[16..20].copy_from_slice(&destination.ip().octets());
    let sum = checksum(ip);
    ip[10..12].copy_from_slice(&sum.to_be_bytes());
    let udp = &mut bytes[34..];
    udp[..2].copy_from_slice(&source.port().to_be_bytes());
    udp[2..4].copy_from_slice(&destination.port().to_be_bytes());
    udp[4..6].copy_from_slice(&udp_length.to_be_bytes());
    bytes // checksum 0 of UDP: not computed
}

fn checksum(header: &[u8]) -> u16 {
    let words = header.chunks_exact(2);
    let sum: u32 = words
        .map(|w| u32::from(u16::from_be_bytes([w[0], w[1]])))
        .sum();
    let folded = (sum & 0xFFFF) + (sum >> 16);
    !(((folded & 0xFFFF) + (folded >> 16)) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::time::Timestamp;
    use std::net::{Ipv4Addr, SocketAddrV4};

    #[test]
    fn a_record_is_what_the_standards_say() {
        let arrival = Arrival {
            time: Timestamp(1_000_000_007),
            order: 0,
            source: SocketAddrV4::new(Ipv4Addr::new(192, 168, 1, 201), 2368),
            destination: SocketAddrV4::new(Ipv4Addr::new(192, 168, 1, 100), 2368),
            payload: vec![7; 3],
        };
        let mut bytes = Vec::new();
        write_header(&mut bytes).unwrap();
        write_arrival(&mut bytes, &arrival).unwrap();
        assert_eq!(bytes.len(), 24 + 16 + 45);
        assert_eq!(bytes[24..32], [1, 0, 0, 0, 7, 0, 0, 0]);
        // A header with its checksum in place sums to zero.
        assert_eq!(checksum(&bytes[54..74]), 0);
        assert_eq!(bytes[74..80], [9, 0x40, 9, 0x40, 0, 11]);
    }
}
