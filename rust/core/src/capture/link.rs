//! Link layers: from the first captured byte to the IP header.
//!
//! Source: the link types of tcpdump.org, IEEE 802.1Q.

/// Registered numbers of the link types that are read.
pub(crate) mod linktype {
    pub const NULL: u32 = 0;
    pub const ETHERNET: u32 = 1;
    pub const RAW_BSD: u32 = 12;
    pub const RAW_OPENBSD: u32 = 14;
    pub const RAW: u32 = 101;
    pub const LOOP: u32 = 108;
    pub const LINUX_SLL: u32 = 113;
    pub const RAW_IPV4: u32 = 228;
    pub const RAW_IPV6: u32 = 229;
    pub const LINUX_SLL2: u32 = 276;
}

const IPV4: u16 = 0x0800;
const IPV6: u16 = 0x86DD;
const ETHERNET_LEN: usize = 14;
const SLL_LEN: usize = 16;
const SLL2_LEN: usize = 20;
const FAMILY_LEN: usize = 4;
const TAG_LEN: usize = 4;

/// Version of the internet protocol.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Version {
    V4,
    V6,
}

/// Where the IP header begins and what stood before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Link {
    pub version: Version,
    /// Length of everything before the IP header.
    pub len: usize,
    /// Identifiers of the VLAN tags, 12 bits each, outermost first; 0 without tags.
    pub vlan: u32,
}

/// Finds the IP packet of a record.
///
/// # Errors
/// The reason to drop the record: `unknown_linktype`, `not_ip` or `damaged_headers`.
#[inline]
pub(crate) fn parse(linktype: u32, data: &[u8]) -> Result<Link, &'static str> {
    let untagged = |version, len| {
        Ok(Link {
            version,
            len,
            vlan: 0,
        })
    };
    match linktype {
        linktype::ETHERNET => tagged(data, 12, ETHERNET_LEN),
        linktype::LINUX_SLL => tagged(data, 14, SLL_LEN),
        linktype::LINUX_SLL2 => tagged(data, 0, SLL2_LEN),
        linktype::NULL => untagged(family(data, false)?, FAMILY_LEN),
        linktype::LOOP => untagged(family(data, true)?, FAMILY_LEN),
        linktype::RAW | linktype::RAW_BSD | linktype::RAW_OPENBSD => untagged(version_of(data)?, 0),
        linktype::RAW_IPV4 => untagged(Version::V4, 0),
        linktype::RAW_IPV6 => untagged(Version::V6, 0),
        _ => Err("unknown_linktype"),
    }
}

/// A header of `len` bytes with an `EtherType` at `type_at`, then any number of VLAN tags.
#[inline]
fn tagged(data: &[u8], type_at: usize, mut len: usize) -> Result<Link, &'static str> {
    if data.len() < len {
        return Err("damaged_headers");
    }
    let mut ether_type = u16::from_be_bytes([data[type_at], data[type_at + 1]]);
    let mut vlan = 0u32;
    loop {
        let version = match ether_type {
            IPV4 => Version::V4,
            IPV6 => Version::V6,
            0x8100 | 0x88A8 | 0x9100 | 0x9200 => {
                let tag = data.get(len..len + TAG_LEN).ok_or("damaged_headers")?;
                let id = u16::from_be_bytes([tag[0], tag[1]]) & 0x0FFF;
                vlan = vlan << 12 | u32::from(id);
                ether_type = u16::from_be_bytes([tag[2], tag[3]]);
                len += TAG_LEN;
                continue;
            }
            _ => return Err("not_ip"),
        };
        return Ok(Link { version, len, vlan });
    }
}

/// Address family of a loopback record; the host's byte order is not known, so both are tried.
fn family(data: &[u8], big_endian_only: bool) -> Result<Version, &'static str> {
    let word = *data.first_chunk::<4>().ok_or("damaged_headers")?;
    let big = by_family(u32::from_be_bytes(word));
    let little = by_family(u32::from_le_bytes(word)).filter(|_| !big_endian_only);
    big.or(little).ok_or("not_ip")
}

fn by_family(family: u32) -> Option<Version> {
    match family {
        2 => Some(Version::V4),
        // Linux, NetBSD, FreeBSD, macOS
        10 | 24 | 28 | 30 => Some(Version::V6),
        _ => None,
    }
}

fn version_of(data: &[u8]) -> Result<Version, &'static str> {
    match data.first().ok_or("damaged_headers")? >> 4 {
        4 => Ok(Version::V4),
        6 => Ok(Version::V6),
        _ => Err("not_ip"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ethernet(types: &[u8]) -> Vec<u8> {
        [&[0xFF; 12], types].concat()
    }

    fn found(version: Version, len: usize, vlan: u32) -> Result<Link, &'static str> {
        Ok(Link { version, len, vlan })
    }

    #[test]
    fn ethernet_with_any_number_of_tags() {
        assert_eq!(parse(1, &ethernet(&[8, 0])), found(Version::V4, 14, 0));
        assert_eq!(
            parse(1, &ethernet(&[0x86, 0xDD])),
            found(Version::V6, 14, 0)
        );
        // Priority 5, identifier 0x123.
        let tagged = ethernet(&[0x81, 0, 0xA1, 0x23, 8, 0]);
        assert_eq!(parse(1, &tagged), found(Version::V4, 18, 0x123));
        for outer in [[0x88, 0xA8], [0x91, 0x00], [0x92, 0x00], [0x81, 0x00]] {
            let twice = ethernet(&[outer[0], outer[1], 0, 7, 0x81, 0, 0, 9, 0x86, 0xDD]);
            assert_eq!(parse(1, &twice), found(Version::V6, 22, 7 << 12 | 9));
        }
    }

    #[test]
    fn other_traffic_is_told_from_damage() {
        let arp = ethernet(&[8, 6]);
        assert_eq!(parse(1, &arp), Err("not_ip"));
        assert_eq!(parse(1, &arp[..13]), Err("damaged_headers"));
        assert_eq!(
            parse(1, &ethernet(&[0x81, 0, 0, 7])),
            Err("damaged_headers")
        );
        assert_eq!(parse(105, &arp), Err("unknown_linktype"));
    }

    #[test]
    fn linux_cooked_captures() {
        let mut sll = vec![0; 16];
        sll[14] = 8;
        assert_eq!(parse(113, &sll), found(Version::V4, 16, 0));
        sll[14..].copy_from_slice(&[0x81, 0]);
        sll.extend([0, 5, 0x86, 0xDD]);
        assert_eq!(parse(113, &sll), found(Version::V6, 20, 5));
        let mut sll2 = vec![0; 20];
        sll2[..2].copy_from_slice(&[0x86, 0xDD]);
        assert_eq!(parse(276, &sll2), found(Version::V6, 20, 0));
        assert_eq!(parse(276, &sll2[..19]), Err("damaged_headers"));
    }

    #[test]
    fn loopback_in_both_byte_orders() {
        for (family, version) in [
            (2u32, Version::V4),
            (10, Version::V6),
            (24, Version::V6),
            (28, Version::V6),
            (30, Version::V6),
        ] {
            assert_eq!(parse(0, &family.to_le_bytes()), found(version, 4, 0));
            assert_eq!(parse(0, &family.to_be_bytes()), found(version, 4, 0));
            assert_eq!(parse(108, &family.to_be_bytes()), found(version, 4, 0));
            assert_eq!(parse(108, &family.to_le_bytes()), Err("not_ip"));
        }
    }

    #[test]
    fn raw_ip_by_its_version() {
        for linktype in [12, 14, 101] {
            assert_eq!(parse(linktype, &[0x45]), found(Version::V4, 0, 0));
            assert_eq!(parse(linktype, &[0x60]), found(Version::V6, 0, 0));
            assert_eq!(parse(linktype, &[0x10]), Err("not_ip"));
            assert_eq!(parse(linktype, &[]), Err("damaged_headers"));
        }
        assert_eq!(parse(228, &[]), found(Version::V4, 0, 0));
        assert_eq!(parse(229, &[]), found(Version::V6, 0, 0));
    }
}
