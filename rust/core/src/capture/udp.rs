//! UDP headers.
//!
//! Source: RFC 768.

use super::ip::u16_at;

/// Number of the protocol in IP headers.
pub(crate) const UDP: u8 = 17;
pub(crate) const HEADER_LEN: usize = 8;

/// A UDP header and how much of what follows belongs to it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct UdpHeader {
    pub source_port: u16,
    pub destination_port: u16,
    pub payload_len: usize,
}

/// Reads the UDP header at the start of `segment`.
///
/// # Errors
/// `damaged_headers`, or `truncated_record` where the length field reaches beyond `segment`.
#[inline]
pub(crate) fn parse(segment: &[u8]) -> Result<UdpHeader, &'static str> {
    let header = segment
        .first_chunk::<HEADER_LEN>()
        .ok_or("damaged_headers")?;
    let len = match usize::from(u16_at(header, 4)) {
        0 => segment.len(), // offload, or an IPv6 jumbogram
        len => len,
    };
    if len > segment.len() {
        return Err("truncated_record");
    }
    Ok(UdpHeader {
        source_port: u16_at(header, 0),
        destination_port: u16_at(header, 2),
        payload_len: len.checked_sub(HEADER_LEN).ok_or("damaged_headers")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn udp_length_against_what_is_there() {
        let segment = [0x09, 0x40, 0x20, 0x74, 0, 10, 0, 0, 1, 2, 3];
        let header = parse(&segment).unwrap();
        assert_eq!((header.source_port, header.destination_port), (2368, 8308));
        assert_eq!(header.payload_len, 2);
        assert_eq!(parse(&segment[..9]), Err("truncated_record"));
        assert_eq!(parse(&segment[..7]), Err("damaged_headers"));
        let mut offload = segment;
        offload[5] = 0;
        assert_eq!(parse(&offload).unwrap().payload_len, 3);
        offload[5] = 7;
        assert_eq!(parse(&offload), Err("damaged_headers"));
    }
}
