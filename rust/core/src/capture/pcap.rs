//! Classic pcap: one file header, then records.
//!
//! Source: the pcap file format of tcpdump.org (draft-ietf-opsawg-pcap).

use std::io::Read;

use super::order::ByteOrder::{self, Big, Little};
use super::record::{Head, MAX_RECORD_LEN, Step, Stop, need};
use super::window::Window;
use crate::error::CaptureError;
use crate::time::{NANOS_PER_SECOND, Timestamp};

/// Places in the file header; the magic number stands before them.
mod file_field {
    pub const VERSION_MAJOR: usize = 4; // u16
    pub const VERSION_MINOR: usize = 6; // u16
    pub const LINKTYPE: usize = 20; // u32, see LINKTYPE_MASK
    pub const LEN: usize = 24;
}

/// Places in a record header, each a u32.
mod field {
    pub const SECONDS: usize = 0;
    pub const FRACTION: usize = 4;
    pub const CAPTURED_LEN: usize = 8;
    pub const ORIGINAL_LEN: usize = 12;
    pub const LEN: usize = 16;
}

/// The upper bits say whether and how long a frame check sequence is.
const LINKTYPE_MASK: u32 = 0x03FF_FFFF;

/// What the file header says about all records.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FileHeader {
    order: ByteOrder,
    nanos_per_unit: i64,
    linktype: u32,
}

impl FileHeader {
    /// Reads the file header; `None` where the magic number is another one.
    pub(crate) fn read<R: Read>(window: &mut Window<R>) -> Step<Option<Self>> {
        let Some((order, nanos_per_unit)) = by_magic(window.bytes()) else {
            return Ok(None);
        };
        need(window, file_field::LEN, 0)?;
        let bytes = window.bytes();
        let major = order.u16_at(bytes, file_field::VERSION_MAJOR);
        let minor = order.u16_at(bytes, file_field::VERSION_MINOR);
        if major != 2 {
            return Err(Stop::Final(CaptureError::Version {
                offset: file_field::VERSION_MAJOR as u64,
                expected: "pcap version 2",
                found: format!("version {major}.{minor}"),
            }));
        }
        let linktype = order.u32_at(bytes, file_field::LINKTYPE) & LINKTYPE_MASK;
        window.consume(file_field::LEN);
        Ok(Some(Self {
            order,
            nanos_per_unit,
            linktype,
        }))
    }

    /// The next record; `None` at the end.
    #[inline]
    pub(crate) fn next<R: Read>(&self, window: &mut Window<R>) -> Step<Option<Head>> {
        let offset = window.offset();
        if !window.require(field::LEN)? && window.available() == 0 {
            return Ok(None);
        }
        need(window, field::LEN, offset)?;
        let mut head = self.parse(window.bytes(), offset)?;
        need(window, field::LEN + head.len, offset)?;
        head.place = window.consume(field::LEN + head.len) + field::LEN;
        Ok(Some(head))
    }

    fn parse(&self, bytes: &[u8], offset: u64) -> Step<Head> {
        let word = |at| self.order.u32_at(bytes, at);
        let (seconds, fraction) = (word(field::SECONDS), word(field::FRACTION));
        let (captured, original) = (word(field::CAPTURED_LEN), word(field::ORIGINAL_LEN));
        check(seconds, fraction, captured, original)
            .map_err(|(expected, found)| Stop::Damaged(offset, expected, found))?;
        let nanos =
            i64::from(seconds) * NANOS_PER_SECOND + i64::from(fraction) * self.nanos_per_unit;
        Ok(Head {
            time: Some(Timestamp(nanos)),
            linktype: self.linktype,
            len: captured as usize,
            original_len: original,
            offset,
            ..Head::default()
        })
    }
}

fn by_magic(bytes: &[u8]) -> Option<(ByteOrder, i64)> {
    match bytes.first_chunk::<4>()? {
        [0xD4, 0xC3, 0xB2, 0xA1] => Some((Little, 1000)),
        [0xA1, 0xB2, 0xC3, 0xD4] => Some((Big, 1000)),
        [0x4D, 0x3C, 0xB2, 0xA1] => Some((Little, 1)),
        [0xA1, 0xB2, 0x3C, 0x4D] => Some((Big, 1)),
        _ => None,
    }
}

/// Whether the four words can head a record; else what was expected and found.
fn check(
    seconds: u32,
    fraction: u32,
    captured: u32,
    original: u32,
) -> Result<(), (String, String)> {
    if captured > MAX_RECORD_LEN {
        let expected = format!("a captured length of at most {MAX_RECORD_LEN} bytes");
        return Err((expected, captured.to_string()));
    }
    if fraction >= NANOS_PER_SECOND as u32 {
        let expected = "a fraction of a second below 1000000000".to_string();
        return Err((expected, fraction.to_string()));
    }
    if (seconds, fraction, captured, original) == (0, 0, 0, 0) {
        return Err(("a record header".into(), "zeros".into()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::RecordReader;

    /// A capture in both byte orders: `magic` as a number, one record of 3 bytes and one cut to 2.
    fn capture(order: ByteOrder, magic: u32) -> Vec<u8> {
        let word = |value: u32| match order {
            Little => value.to_le_bytes(),
            Big => value.to_be_bytes(),
        };
        let version = match order {
            Little => [2, 0, 4, 0],
            Big => [0, 2, 0, 4],
        };
        let mut bytes = word(magic).to_vec();
        bytes.extend(version);
        // thiszone, sigfigs, snaplen, link type with 4 bytes of frame check sequence announced
        for value in [0, 0, 65_535, 0xF400_0001] {
            bytes.extend(word(value));
        }
        for value in [1_700_000_000, 999_999, 3, 3] {
            bytes.extend(word(value));
        }
        bytes.extend([1, 2, 3]);
        for value in [1_700_000_001, 0, 2, 60] {
            bytes.extend(word(value));
        }
        bytes.extend([4, 5]);
        bytes
    }

    #[test]
    fn both_orders_and_both_resolutions() {
        for (order, magic, nanos) in [
            (Little, 0xA1B2_C3D4, 999_999_000),
            (Big, 0xA1B2_C3D4, 999_999_000),
            (Little, 0xA1B2_3C4D, 999_999),
            (Big, 0xA1B2_3C4D, 999_999),
        ] {
            let bytes = capture(order, magic);
            let mut reader = RecordReader::new(&bytes[..]).unwrap();
            assert!(reader.advance().unwrap());
            let record = reader.record();
            assert_eq!(record.time.0, 1_700_000_000 * NANOS_PER_SECOND + nanos);
            assert_eq!((record.data, record.linktype), (&[1, 2, 3][..], 1));
            assert_eq!((record.number, record.offset), (0, 24));
            assert!(reader.advance().unwrap());
            let record = reader.record();
            assert_eq!((record.data, record.original_len), (&[4, 5][..], 60));
            assert_eq!((record.number, record.offset), (1, 24 + 19));
            assert!(!reader.advance().unwrap());
            assert_eq!(reader.facts().bytes, bytes.len() as u64);
        }
    }

    #[test]
    fn a_truncated_last_record_is_a_warning() {
        let bytes = capture(Little, 0xA1B2_C3D4);
        for len in 24..bytes.len() {
            let mut reader = RecordReader::new(&bytes[..len]).unwrap();
            let mut records = 0;
            while reader.advance().unwrap() {
                records += 1;
            }
            let whole = [24, 24 + 19].contains(&len);
            assert_eq!(records, u64::from(len >= 24 + 19));
            assert_eq!(reader.facts().truncated_tail, u64::from(!whole));
            assert_eq!(reader.facts().warnings.len(), usize::from(!whole));
        }
    }

    #[test]
    fn garbage_between_records_names_its_place() {
        for (garbage, expected) in [
            ([0xFF; 16], "a captured length of at most 1048576 bytes"),
            ([0; 16], "a record header"),
        ] {
            let mut bytes = capture(Little, 0xA1B2_C3D4);
            bytes.splice(24 + 19..24 + 19, garbage);
            let mut reader = RecordReader::new(&bytes[..]).unwrap();
            assert!(reader.advance().unwrap());
            let error = reader.advance().unwrap_err();
            let text = error.to_string();
            assert!(
                text.starts_with("record 1 (byte 43 of the capture)") && text.contains(expected),
                "{text}"
            );
            assert!(!reader.advance().unwrap(), "told once");
        }
    }

    #[test]
    fn other_files_are_refused() {
        for bytes in [
            &b""[..],
            b"PK\x03\x04",
            b"hello world",
            &[0xD4, 0xC3, 0xB2, 0xA1, 2],
        ] {
            let error = RecordReader::new(bytes).unwrap_err();
            assert!(
                matches!(error, CaptureError::UnknownFormat { .. }),
                "{error}"
            );
        }
        let mut old = capture(Little, 0xA1B2_C3D4);
        old[4] = 3;
        let error = RecordReader::new(&old[..]).unwrap_err();
        assert!(matches!(error, CaptureError::Version { .. }), "{error}");
    }
}
