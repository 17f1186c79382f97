//! What was seen while a capture was read: counts, times, link types and warnings.

use std::collections::BTreeMap;
use std::fmt;

use crate::time::Timestamp;

/// File format of a capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// Classic pcap.
    Pcap,
    /// pcapng.
    PcapNg,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Format::Pcap => "pcap",
            Format::PcapNg => "pcapng",
        })
    }
}

/// Something about a capture that a user should know although reading went on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CaptureWarning {
    /// The capture ends inside a record, as when the recording was killed.
    TruncatedTail {
        /// Number of the incomplete record, 0-based.
        record: u64,
        /// Where it begins, byte of the uncompressed capture.
        offset: u64,
        /// How many of its bytes are there.
        found: u64,
    },
    /// The compressed stream ends too early.
    CompressionCutShort {
        /// Uncompressed bytes that could be read.
        offset: u64,
        /// What the decompressor says.
        reason: String,
    },
}

impl fmt::Display for CaptureWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TruncatedTail {
                record,
                offset,
                found,
            } => write!(
                f,
                "the capture ends inside record {record} (byte {offset}): {found} bytes of it are there, the record is left out"
            ),
            Self::CompressionCutShort { offset, reason } => write!(
                f,
                "the compressed capture is cut short after {offset} uncompressed bytes ({reason})"
            ),
        }
    }
}

/// Counts and times of the records of one capture, as far as it was read.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CaptureFacts {
    /// File format; `None` before anything was read.
    pub format: Option<Format>,
    /// Complete records.
    pub records: u64,
    /// Uncompressed bytes.
    pub bytes: u64,
    /// Records by link type.
    pub linktypes: BTreeMap<u32, u64>,
    /// Records without a time stamp of their own (simple packets of pcapng).
    pub without_time: u64,
    /// Earliest time stamp.
    pub first_time: Option<Timestamp>,
    /// Latest time stamp.
    pub last_time: Option<Timestamp>,
    /// Incomplete records at the end: 0 or 1.
    pub truncated_tail: u64,
    /// What a user should know.
    pub warnings: Vec<CaptureWarning>,
}

impl CaptureFacts {
    /// Widens the span of times by one stamp.
    pub(crate) fn see_time(&mut self, time: Timestamp) {
        self.first_time = Some(self.first_time.map_or(time, |first| first.min(time)));
        self.last_time = Some(self.last_time.map_or(time, |last| last.max(time)));
    }

    pub(crate) fn see_tail(&mut self, record: u64, offset: u64, found: u64) {
        self.truncated_tail = 1;
        self.warnings.push(CaptureWarning::TruncatedTail {
            record,
            offset,
            found,
        });
    }
}

/// How datagrams came together from IP fragments.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FragmentFacts {
    /// Fragments seen.
    pub fragments: u64,
    /// Datagrams put together from them.
    pub datagrams: u64,
    /// Fragments that brought nothing new.
    pub duplicates: u64,
    /// Datagrams given up because parts of them never came.
    pub incomplete: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_name_the_place() {
        let warning = CaptureWarning::TruncatedTail {
            record: 18_204,
            offset: 22_531_090,
            found: 988,
        };
        let text = warning.to_string();
        assert!(text.contains("record 18204 (byte 22531090)") && text.contains("988 bytes"));
    }

    #[test]
    fn the_span_of_times_does_not_need_order() {
        let mut facts = CaptureFacts::default();
        for nanos in [5, 3, 9] {
            facts.see_time(Timestamp(nanos));
        }
        assert_eq!(facts.first_time, Some(Timestamp(3)));
        assert_eq!(facts.last_time, Some(Timestamp(9)));
    }
}
