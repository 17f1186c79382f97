//! One error per family; each says where it was, what was expected and what was found.

use thiserror::Error;

/// What every error of the library tells beside its message.
pub trait Coded: std::error::Error {
    /// Stable name of the kind of failure, such as `capture.truncated`.
    fn code(&self) -> &'static str;

    /// One next step for the user.
    fn hint(&self) -> Option<String> {
        None
    }
}

/// An argument or parameter outside of what its meaning allows.
#[derive(Debug, Clone, Error, PartialEq)]
#[error("{name}: expected {expected}, found {found}")]
pub struct InvalidValue {
    /// Name of the parameter as the caller knows it.
    pub name: &'static str,
    /// What would have been accepted.
    pub expected: String,
    /// What was given.
    pub found: String,
}

impl Coded for InvalidValue {
    fn code(&self) -> &'static str {
        "value.invalid"
    }
}

/// Bytes that are not the capture they should be. What stood before them has been read.
#[derive(Debug, Clone, Error, PartialEq, Eq)]
pub enum CaptureError {
    /// The first bytes are not those of pcap or pcapng.
    #[error("not a capture: expected the first bytes of pcap or pcapng, found {found}")]
    UnknownFormat {
        /// The first bytes in hexadecimal, or what they look like.
        found: String,
    },
    /// A version of a format that is not known.
    #[error("byte {offset} of the capture: expected {expected}, found {found}")]
    Version {
        /// Byte of the uncompressed capture.
        offset: u64,
        /// Versions that can be read.
        expected: &'static str,
        /// The version of the capture.
        found: String,
    },
    /// Garbage where a record should be.
    #[error("record {record} (byte {offset} of the capture): expected {expected}, found {found}")]
    Damaged {
        /// Number of the record, 0-based.
        record: u64,
        /// Byte of the uncompressed capture.
        offset: u64,
        /// What a sound capture has there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The reader failed: disk, network or decompression.
    #[error("byte {offset} of the capture cannot be read: {reason}")]
    Read {
        /// Byte of the uncompressed capture.
        offset: u64,
        /// What the reader says.
        reason: String,
    },
}

impl Coded for CaptureError {
    fn code(&self) -> &'static str {
        match self {
            Self::UnknownFormat { .. } => "capture.unknown_format",
            Self::Version { .. } => "capture.version",
            Self::Damaged { .. } => "capture.damaged",
            Self::Read { .. } => "capture.read",
        }
    }

    fn hint(&self) -> Option<String> {
        let hint = match self {
            Self::UnknownFormat { .. } => "record with tcpdump or Wireshark, as pcap or pcapng",
            Self::Version { .. } => "save it anew with Wireshark: File, Save As, pcapng",
            Self::Damaged { .. } => {
                "the capture is damaged from this byte on; copy it anew, or cut it before this record"
            }
            Self::Read { .. } => "copy the capture anew and compare the sizes",
        };
        Some(hint.into())
    }
}
