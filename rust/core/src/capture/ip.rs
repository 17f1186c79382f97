//! IPv4 and IPv6 headers, extension headers and fragments.
//!
//! Source: RFC 791, RFC 8200, RFC 4302 (authentication header). Checksums are not verified:
//! captures of the sending machine hold wrong ones.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::ops::Range;

use super::link::Version;
use super::udp::{self, UDP};

const IPV4_MIN_LEN: usize = 20;
const IPV6_LEN: usize = 40;

/// Next-header values of IPv6 that stand before the transport.
mod extension {
    pub const HOP_BY_HOP: u8 = 0;
    pub const ROUTING: u8 = 43;
    pub const FRAGMENT: u8 = 44;
    pub const AUTHENTICATION: u8 = 51;
    pub const DESTINATION: u8 = 60;
    pub const MOBILITY: u8 = 135;
    pub const HOST_IDENTITY: u8 = 139;
    pub const SHIM6: u8 = 140;
}

/// Part of a larger packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Fragment {
    pub identification: u32,
    /// Place of the body in the whole, bytes.
    pub offset: usize,
    /// Whether more follow.
    pub more: bool,
}

/// An IP packet by its header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct IpPacket {
    pub source: IpAddr,
    pub destination: IpAddr,
    /// Protocol of the body; of IPv6 fragments the header type that the whole begins with.
    pub protocol: u8,
    /// Where the body stands, bytes from the IP header; padding of the link layer is left out.
    pub body: Range<usize>,
    pub fragment: Option<Fragment>,
}

/// Reads the IP headers of `data`.
///
/// A whole datagram of UDP that says itself where it ends is taken by its own word: the first VLP-16 wrote the
/// length of its data packets into the IPv4 headers of its position packets as well.
///
/// # Errors
/// The reason to drop the record: `damaged_headers` or `truncated_record`.
#[inline]
pub(crate) fn parse(version: Version, data: &[u8]) -> Result<IpPacket, &'static str> {
    match version {
        Version::V4 => parse_v4(data),
        Version::V6 => parse_v6(data),
    }
}

fn parse_v4(data: &[u8]) -> Result<IpPacket, &'static str> {
    let header = data
        .first_chunk::<IPV4_MIN_LEN>()
        .ok_or("damaged_headers")?;
    let header_len = usize::from(header[0] & 0x0F) * 4;
    if header[0] >> 4 != 4 || header_len < IPV4_MIN_LEN {
        return Err("damaged_headers");
    }
    let flags = u16_at(header, 6);
    let (offset, more) = (usize::from(flags & 0x1FFF) * 8, flags & 0x2000 != 0);
    let is_whole = header[9] == UDP && offset == 0 && !more;
    let stop = match end_of_body(u16_at(header, 2), 0, data.len()) {
        Err(_) if is_whole && udp::parse(data.get(header_len..).unwrap_or_default()).is_ok() => {
            data.len()
        }
        stop => stop?,
    };
    if stop < header_len {
        return Err("damaged_headers");
    }
    let part = Fragment {
        identification: u32::from(u16_at(header, 4)),
        offset,
        more,
    };
    Ok(IpPacket {
        source: v4_at(header, 12),
        destination: v4_at(header, 16),
        protocol: header[9],
        body: header_len..stop,
        fragment: (more || offset > 0).then_some(part),
    })
}

fn parse_v6(data: &[u8]) -> Result<IpPacket, &'static str> {
    let header = data.first_chunk::<IPV6_LEN>().ok_or("damaged_headers")?;
    if header[0] >> 4 != 6 {
        return Err("damaged_headers");
    }
    let stop = end_of_body(u16_at(header, 4), IPV6_LEN, data.len())?;
    let chain = skip_extensions(header[6], &data[IPV6_LEN..stop])?;
    Ok(IpPacket {
        source: v6_at(header, 8),
        destination: v6_at(header, 24),
        protocol: chain.protocol,
        body: IPV6_LEN + chain.len..stop,
        fragment: chain.fragment,
    })
}

/// End of an IP packet whose length field says `len` behind `before` bytes. 0 is written where the
/// network card was to cut the packet (offload): then all that was captured counts.
fn end_of_body(len: u16, before: usize, captured: usize) -> Result<usize, &'static str> {
    match usize::from(len) + before {
        _ if len == 0 => Ok(captured),
        stop if stop > captured => Err("truncated_record"),
        stop => Ok(stop),
    }
}

/// What stands between the IPv6 header and the transport.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Chain {
    pub protocol: u8,
    pub len: usize,
    pub fragment: Option<Fragment>,
}

/// Follows the extension headers of IPv6 up to the transport or to the part of a fragment.
///
/// # Errors
/// `damaged_headers` where a header reaches beyond the packet.
pub(crate) fn skip_extensions(first: u8, data: &[u8]) -> Result<Chain, &'static str> {
    let (mut protocol, mut len) = (first, 0);
    let done = |protocol, len, fragment| {
        Ok(Chain {
            protocol,
            len,
            fragment,
        })
    };
    loop {
        let Some(step) = header_len(protocol, &data[len..])? else {
            return done(protocol, len, None);
        };
        let header = data.get(len..len + step).ok_or("damaged_headers")?;
        let kind = protocol;
        protocol = header[0];
        len += step;
        if kind == extension::FRAGMENT
            && let Some(part) = v6_fragment(header)
        {
            return done(protocol, len, Some(part));
        }
    }
}

/// Length of the extension header of type `kind`, at least 8; `None` where it is none.
fn header_len(kind: u8, data: &[u8]) -> Result<Option<usize>, &'static str> {
    use extension::{
        AUTHENTICATION, DESTINATION, FRAGMENT, HOP_BY_HOP, HOST_IDENTITY, MOBILITY, ROUTING, SHIM6,
    };
    let units = || {
        data.get(1)
            .copied()
            .map(usize::from)
            .ok_or("damaged_headers")
    };
    Ok(Some(match kind {
        HOP_BY_HOP | ROUTING | DESTINATION | MOBILITY | HOST_IDENTITY | SHIM6 => units()? * 8 + 8,
        AUTHENTICATION => units()? * 4 + 8,
        FRAGMENT => 8,
        _ => return Ok(None),
    }))
}

/// `None` for a whole packet that carries a fragment header nevertheless (RFC 6946).
fn v6_fragment(header: &[u8]) -> Option<Fragment> {
    let flags = u16_at(header, 2);
    let (offset, more) = (usize::from(flags & 0xFFF8), flags & 1 != 0);
    let identification = u32::from(u16_at(header, 4)) << 16 | u32::from(u16_at(header, 6));
    (more || offset > 0).then_some(Fragment {
        identification,
        offset,
        more,
    })
}

/// Big endian, as all of the network; the caller has checked the length.
pub(crate) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_be_bytes([bytes[at], bytes[at + 1]])
}

fn v4_at(header: &[u8; IPV4_MIN_LEN], at: usize) -> IpAddr {
    Ipv4Addr::new(header[at], header[at + 1], header[at + 2], header[at + 3]).into()
}

fn v6_at(header: &[u8; IPV6_LEN], at: usize) -> IpAddr {
    let octets = std::array::from_fn::<u8, 16, _>(|i| header[at + i]);
    Ipv6Addr::from(octets).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 10.0.0.1 -> 10.0.0.2, UDP, 8 bytes of body and 2 of padding behind them.
    fn v4() -> Vec<u8> {
        let mut bytes = vec![0x45, 0, 0, 28, 0x12, 0x34, 0, 0, 64, 17, 0, 0];
        bytes.extend([10, 0, 0, 1, 10, 0, 0, 2]);
        bytes.extend([0; 10]);
        bytes
    }

    fn v6(next: u8, body: &[u8]) -> Vec<u8> {
        let mut bytes = vec![0x60, 0, 0, 0, 0, body.len() as u8, next, 64];
        bytes.extend([0xFE; 16]);
        bytes.extend([0xFD; 16]);
        bytes.extend(body);
        bytes
    }

    #[test]
    fn padding_behind_ipv4_is_left_out() {
        let packet = parse(Version::V4, &v4()).unwrap();
        assert_eq!(
            (packet.body, packet.protocol, packet.fragment),
            (20..28, UDP, None)
        );
        assert_eq!(packet.source, IpAddr::from([10, 0, 0, 1]));
    }

    #[test]
    fn ipv4_options_and_offload() {
        let mut bytes = v4();
        bytes[0] = 0x46;
        assert_eq!(parse(Version::V4, &bytes).unwrap().body, 24..28);
        bytes[3] = 0;
        assert_eq!(parse(Version::V4, &bytes).unwrap().body, 24..30);
    }

    /// As the position packets of a VLP-16 of 2014: 1234 bytes by their IPv4 header, fewer by UDP's and on the wire.
    #[test]
    fn udp_tells_the_end_where_ipv4_says_too_much() {
        let mut bytes = v4();
        bytes[2..4].copy_from_slice(&1234_u16.to_be_bytes());
        bytes[24..26].copy_from_slice(&10_u16.to_be_bytes());
        assert_eq!(parse(Version::V4, &bytes).unwrap().body, 20..30);
        let mut cut = bytes.clone();
        cut[25] = 11;
        assert_eq!(parse(Version::V4, &cut), Err("truncated_record"));
        let mut part = bytes.clone();
        part[6] = 0x20; // more fragments follow
        assert_eq!(parse(Version::V4, &part), Err("truncated_record"));
        bytes[9] = 6;
        assert_eq!(parse(Version::V4, &bytes), Err("truncated_record"));
    }

    #[test]
    fn ipv4_that_was_cut_or_damaged() {
        assert_eq!(parse(Version::V4, &v4()[..27]), Err("truncated_record"));
        assert_eq!(parse(Version::V4, &v4()[..19]), Err("damaged_headers"));
        assert_eq!(parse(Version::V6, &v4()), Err("damaged_headers"));
        let mut bytes = v4();
        bytes[0] = 0x44; // a header of 16 bytes
        assert_eq!(parse(Version::V4, &bytes), Err("damaged_headers"));
        bytes[0] = 0x4F; // a header of 60 bytes in a packet of 28
        assert_eq!(parse(Version::V4, &bytes), Err("damaged_headers"));
    }

    #[test]
    fn ipv4_fragments() {
        let mut bytes = v4();
        bytes[6..8].copy_from_slice(&[0x20, 185]); // more follow, 185 x 8 bytes
        let part = Fragment {
            identification: 0x1234,
            offset: 1480,
            more: true,
        };
        assert_eq!(parse(Version::V4, &bytes).unwrap().fragment, Some(part));
        bytes[6..8].copy_from_slice(&[0x40, 0]); // don't fragment
        assert_eq!(parse(Version::V4, &bytes).unwrap().fragment, None);
    }

    #[test]
    fn ipv6_extension_headers_are_followed() {
        let mut body = vec![60, 0, 0, 0, 0, 0, 0, 0]; // hop by hop, 8 bytes
        body.extend([51, 1].iter().chain(&[0; 14])); // destination options, 16 bytes
        body.extend([44, 1].iter().chain(&[0; 10])); // authentication, 12 bytes
        body.extend([17, 0, 0, 0, 1, 2, 3, 4]); // fragment header of a whole packet
        body.extend([9; 8]);
        let bytes = v6(0, &body);
        let packet = parse(Version::V6, &bytes).unwrap();
        assert_eq!((packet.protocol, packet.fragment), (UDP, None));
        assert_eq!(packet.body, 84..92);
        for len in 0..bytes.len() {
            assert!(parse(Version::V6, &bytes[..len]).is_err());
        }
    }

    #[test]
    fn ipv6_fragments() {
        let bytes = v6(44, &[17, 0, 0x05, 0xA9, 1, 2, 3, 4, 7, 7, 7, 7, 7, 7, 7, 7]);
        let packet = parse(Version::V6, &bytes).unwrap();
        let part = Fragment {
            identification: 0x0102_0304,
            offset: 1448,
            more: true,
        };
        assert_eq!(packet.fragment, Some(part));
        assert_eq!((packet.protocol, packet.body), (UDP, 48..56));
    }
}
