//! pcapng: blocks in sections, each section with its own byte order and interfaces.
//!
//! Source: draft-ietf-opsawg-pcapng.

mod clock;
mod interface;

use std::io::Read;

use super::order::ByteOrder::{self, Big, Little};
use super::record::{Head, MAX_RECORD_LEN, Step, Stop, need};
use super::window::Window;
use crate::error::CaptureError;
use interface::Interface;

/// First bytes of a section, the same in both byte orders.
pub(crate) const SECTION_HEADER: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];

/// Types of the blocks that are read; all others are skipped.
mod kind {
    pub const INTERFACE: u32 = 1;
    pub const OBSOLETE_PACKET: u32 = 2;
    pub const SIMPLE_PACKET: u32 = 3;
    pub const ENHANCED_PACKET: u32 = 6;
}

/// Block type and total length before the body.
const HEAD_LEN: usize = 8;
/// Total length again, behind the body.
const FOOT_LEN: usize = 4;
/// Byte order and version of a section, behind the head.
const SECTION_LEN: usize = 8;
/// Interface, two words of time, captured and original length before the data.
const PACKET_HEAD_LEN: usize = 20;
/// Room for the options of a packet beside its data.
const MAX_PACKET_BLOCK_LEN: u32 = MAX_RECORD_LEN + 64 * 1024;
/// Blocks that are skipped may hold whole tables of names; Wireshark's own limit.
const MAX_SKIPPED_BLOCK_LEN: u32 = 16 * 1024 * 1024;
/// More interfaces than any recording has; bounds the memory.
const MAX_INTERFACES: usize = 65_536;

/// The section that is being read.
#[derive(Debug)]
pub(crate) struct Section {
    order: ByteOrder,
    interfaces: Vec<Interface>,
}

impl Default for Section {
    /// Before the first section header.
    fn default() -> Self {
        Self {
            order: Little,
            interfaces: Vec::new(),
        }
    }
}

impl Section {
    /// The next packet; `None` at the end.
    pub(crate) fn next<R: Read>(&mut self, window: &mut Window<R>) -> Step<Option<Head>> {
        loop {
            let offset = window.offset();
            if !window.require(1)? {
                return Ok(None);
            }
            need(window, HEAD_LEN + FOOT_LEN, offset)?;
            if window.bytes().starts_with(&SECTION_HEADER) {
                self.open(window, offset)?;
                continue;
            }
            let kind = self.order.u32_at(window.bytes(), 0);
            if let Some(head) = self.block(kind, window, offset)? {
                return Ok(Some(head));
            }
        }
    }

    fn block<R: Read>(
        &mut self,
        kind: u32,
        window: &mut Window<R>,
        offset: u64,
    ) -> Step<Option<Head>> {
        match kind {
            kind::INTERFACE => {
                let (place, len) = self.body(window, offset, MAX_PACKET_BLOCK_LEN)?;
                self.describe(window.slice(place, len), offset)?;
                Ok(None)
            }
            kind::ENHANCED_PACKET | kind::OBSOLETE_PACKET | kind::SIMPLE_PACKET => {
                let (place, len) = self.body(window, offset, MAX_PACKET_BLOCK_LEN)?;
                let body = window.slice(place, len);
                let mut head = match kind {
                    kind::SIMPLE_PACKET => self.simple(body),
                    _ => self.packet(body, kind == kind::OBSOLETE_PACKET),
                };
                head.place += place;
                head.offset = offset;
                Ok(Some(head))
            }
            _ => self.skip(window, offset).map(|()| None),
        }
    }

    /// Opens a section: byte order, no interfaces yet.
    fn open<R: Read>(&mut self, window: &mut Window<R>, offset: u64) -> Step<()> {
        need(window, HEAD_LEN + SECTION_LEN, offset)?;
        let bytes = window.bytes();
        self.order = match bytes[8..12] {
            [0x4D, 0x3C, 0x2B, 0x1A] => Little,
            [0x1A, 0x2B, 0x3C, 0x4D] => Big,
            _ => {
                let found = format!("{:02X?}", &bytes[8..12]);
                let expected = "byte-order magic 1A2B3C4D of a section".into();
                return Err(Stop::Damaged(offset, expected, found));
            }
        };
        let major = self.order.u16_at(bytes, 12);
        if major != 1 {
            return Err(Stop::Final(CaptureError::Version {
                offset: offset + 12,
                expected: "pcapng version 1",
                found: format!("version {major}"),
            }));
        }
        self.interfaces.clear();
        self.skip(window, offset)
    }

    fn describe(&mut self, body: &[u8], offset: u64) -> Step<()> {
        let refuse =
            |expected: &str, found: String| Err(Stop::Damaged(offset, expected.to_string(), found));
        if self.interfaces.len() >= MAX_INTERFACES {
            return refuse("at most 65536 interfaces", "one more".into());
        }
        match Interface::parse(body, self.order) {
            Some(interface) => self.interfaces.push(interface),
            None => return refuse("an interface of at least 8 bytes", body.len().to_string()),
        }
        Ok(())
    }

    /// Total length of the block at the window's start, checked.
    fn total_len(&self, bytes: &[u8], offset: u64, limit: u32) -> Step<u32> {
        let total = self.order.u32_at(bytes, 4);
        if (12..=limit).contains(&total) && total.is_multiple_of(4) {
            return Ok(total);
        }
        let expected = format!("a block length between 12 and {limit}, a multiple of 4");
        Err(Stop::Damaged(offset, expected, total.to_string()))
    }

    /// Steps over a whole block and returns place and length of its body.
    fn body<R: Read>(
        &self,
        window: &mut Window<R>,
        offset: u64,
        limit: u32,
    ) -> Step<(usize, usize)> {
        let total = self.total_len(window.bytes(), offset, limit)?;
        let len = total as usize;
        need(window, len, offset)?;
        let foot = self.order.u32_at(window.bytes(), len - FOOT_LEN);
        check_foot(total, foot, offset)?;
        let place = window.consume(len);
        Ok((place + HEAD_LEN, len - HEAD_LEN - FOOT_LEN))
    }

    /// Steps over a block of any size without keeping it.
    fn skip<R: Read>(&self, window: &mut Window<R>, offset: u64) -> Step<()> {
        let total = self.total_len(window.bytes(), offset, MAX_SKIPPED_BLOCK_LEN)?;
        if !window.skip(u64::from(total) - FOOT_LEN as u64)? {
            return Err(Stop::Tail(offset));
        }
        need(window, FOOT_LEN, offset)?;
        check_foot(total, self.order.u32_at(window.bytes(), 0), offset)?;
        window.consume(FOOT_LEN);
        Ok(())
    }

    /// An enhanced packet, or an obsolete one, which has a count of drops beside its interface.
    fn packet(&self, body: &[u8], obsolete: bool) -> Head {
        if body.len() < PACKET_HEAD_LEN {
            return defective("damaged_block");
        }
        let number = match obsolete {
            true => u32::from(self.order.u16_at(body, 0)),
            false => self.order.u32_at(body, 0),
        };
        let word = |at| self.order.u32_at(body, at);
        let (captured, original) = (word(12) as usize, word(16));
        let Some(interface) = self.interfaces.get(number as usize) else {
            return defective("unknown_interface");
        };
        if captured > body.len() - PACKET_HEAD_LEN {
            return defective("damaged_block");
        }
        Head {
            time: Some(interface.clock.time(word(4), word(8))),
            linktype: interface.linktype,
            place: PACKET_HEAD_LEN,
            len: captured,
            original_len: original,
            ..Head::default()
        }
    }

    /// A simple packet: of the first interface, without a time.
    fn simple(&self, body: &[u8]) -> Head {
        let Some(interface) = self.interfaces.first() else {
            return defective("unknown_interface");
        };
        if body.len() < 4 {
            return defective("damaged_block");
        }
        let original = self.order.u32_at(body, 0);
        let captured = match interface.snaplen {
            0 => original,
            snaplen => original.min(snaplen),
        };
        if captured as usize > body.len() - 4 {
            return defective("damaged_block");
        }
        Head {
            linktype: interface.linktype,
            place: 4,
            len: captured as usize,
            original_len: original,
            ..Head::default()
        }
    }
}

/// A packet that is counted and left out; the blocks behind it are sound.
fn defective(reason: &'static str) -> Head {
    Head {
        linktype: u32::MAX,
        defect: Some(reason),
        ..Head::default()
    }
}

fn check_foot(total: u32, foot: u32, offset: u64) -> Step<()> {
    if total == foot {
        return Ok(());
    }
    let expected = format!("the block length {total} again behind the block");
    Err(Stop::Damaged(offset, expected, foot.to_string()))
}
