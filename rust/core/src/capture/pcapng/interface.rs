//! Interface descriptions: link type, snap length and clock of the packets of one interface.

use super::clock::Clock;
use crate::capture::order::ByteOrder;

/// Codes of the options that are read.
mod option {
    pub const END: u16 = 0;
    pub const TSRESOL: u16 = 9;
    pub const TSOFFSET: u16 = 14;
}

/// Microseconds, where an interface says nothing.
const DEFAULT_TSRESOL: u8 = 6;

/// One interface of a section.
#[derive(Debug, Clone, Copy)]
pub(super) struct Interface {
    pub(super) linktype: u32,
    /// 0 is no limit.
    pub(super) snaplen: u32,
    pub(super) clock: Clock,
}

impl Interface {
    /// Reads the body of an interface description; `None` where it is too short.
    pub(super) fn parse(body: &[u8], order: ByteOrder) -> Option<Self> {
        let (fixed, options) = body.split_first_chunk::<8>()?;
        let (tsresol, offset_s) = clock_options(options, order);
        Some(Self {
            linktype: u32::from(order.u16_at(fixed, 0)),
            snaplen: order.u32_at(fixed, 4),
            clock: Clock::new(tsresol, offset_s),
        })
    }
}

/// `if_tsresol` and `if_tsoffset`; options that are cut off end the list.
fn clock_options(mut options: &[u8], order: ByteOrder) -> (u8, i64) {
    let mut clock = (DEFAULT_TSRESOL, 0);
    while let Some((head, rest)) = options.split_first_chunk::<4>() {
        let (code, len) = (order.u16_at(head, 0), order.u16_at(head, 2) as usize);
        let Some(value) = rest.get(..len) else { break };
        match (code, len) {
            (option::END, _) => break,
            (option::TSRESOL, 1) => clock.0 = value[0],
            (option::TSOFFSET, 8) => clock.1 = value.try_into().map_or(0, |v| order.i64(v)),
            _ => {}
        }
        options = rest.get(len.next_multiple_of(4)..).unwrap_or_default();
    }
    clock
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIXED: [u8; 8] = [1, 0, 0, 0, 0, 0, 4, 0];

    fn options(options: &[u8]) -> (u8, i64) {
        clock_options(options, ByteOrder::Little)
    }

    #[test]
    fn clock_options_are_found_among_others() {
        let name = [2, 0, 5, 0, b'e', b't', b'h', b'1', b'0', 0, 0, 0];
        let resolution = [9, 0, 1, 0, 9, 0, 0, 0];
        let offset = [14, 0, 8, 0, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF];
        let end = [0, 0, 0, 0, 9, 0, 1, 0, 3, 0, 0, 0];
        assert_eq!(
            options(&[&name[..], &resolution, &offset, &end].concat()),
            (9, -1)
        );
        assert_eq!(options(&[]), (6, 0));
    }

    #[test]
    fn options_that_are_cut_off_end_the_list() {
        let bytes = [9, 0, 1, 0, 9, 0, 0, 0, 14, 0, 8, 0, 1];
        assert_eq!(options(&bytes), (9, 0));
        for len in 0..bytes.len() {
            options(&bytes[..len]);
        }
    }

    #[test]
    fn link_type_and_snap_length() {
        let interface = Interface::parse(&FIXED, ByteOrder::Little).unwrap();
        assert_eq!((interface.linktype, interface.snaplen), (1, 262_144));
        assert!(Interface::parse(&FIXED[..7], ByteOrder::Little).is_none());
    }
}
