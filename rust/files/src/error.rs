//! What can be wrong with the files of a capture.

use std::fmt;
use std::path::PathBuf;

use lidar_deflect_core::error::{CaptureError, Coded};
use thiserror::Error;

/// What a file is that is no capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Foreign {
    /// Compressed with xz.
    Xz,
    /// Compressed with bzip2.
    Bzip2,
    /// Compressed with lz4.
    Lz4,
    /// A ZIP archive.
    Zip,
    /// A 7-Zip archive.
    SevenZip,
    /// A bag of ROS 1.
    RosBag,
    /// A bag of ROS 2 in a `SQLite` database.
    Ros2Database,
    /// An MCAP file, as ROS 2 and Foxglove write it.
    Mcap,
    /// A Parquet table.
    Parquet,
    /// Text.
    Text,
    /// Nothing that is known.
    Unknown,
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Xz => "an xz file",
            Self::Bzip2 => "a bzip2 file",
            Self::Lz4 => "an lz4 file",
            Self::Zip => "a ZIP archive",
            Self::SevenZip => "a 7-Zip archive",
            Self::RosBag => "a ROS 1 bag",
            Self::Ros2Database => "a SQLite database, as a ROS 2 bag",
            Self::Mcap => "an MCAP file",
            Self::Parquet => "a Parquet table",
            Self::Text => "text",
            Self::Unknown => "bytes of no known kind",
        })
    }
}

impl Foreign {
    fn code(self) -> &'static str {
        match self {
            Self::Xz | Self::Bzip2 | Self::Lz4 => "capture.compression",
            Self::Zip | Self::SevenZip => "capture.archive",
            Self::RosBag | Self::Ros2Database | Self::Mcap => "capture.bag",
            Self::Parquet | Self::Text | Self::Unknown => "capture.unknown_format",
        }
    }

    fn hint(self) -> &'static str {
        match self {
            Self::Xz => "decompress it first: xz -dk FILE",
            Self::Bzip2 => "decompress it first: bzip2 -dk FILE",
            Self::Lz4 => "decompress it first: lz4 -dk FILE",
            Self::Zip | Self::SevenZip => "unpack it and give the captures in it",
            Self::RosBag | Self::Ros2Database | Self::Mcap => {
                "the Python package and the command line read bags: pip install 'lidar-deflect[ros]'"
            }
            Self::Parquet | Self::Text => {
                "give a pcap or pcapng, as tcpdump and Wireshark record it"
            }
            Self::Unknown => {
                "record with tcpdump or Wireshark, as pcap or pcapng, plain, .gz or .zst"
            }
        }
    }
}

/// A capture that cannot be opened or read, with the file that is to blame.
#[derive(Debug, Clone, Error, PartialEq, Eq)]
pub enum FileError {
    /// No file was named.
    #[error("no capture was given")]
    NoneGiven,
    /// The path leads nowhere.
    #[error("{}: no such file", path.display())]
    NotFound {
        /// The path as given.
        path: PathBuf,
    },
    /// The path is a directory.
    #[error("{}: expected a capture file, found a directory", path.display())]
    Directory {
        /// The path as given.
        path: PathBuf,
    },
    /// One file was named twice.
    #[error("{}: given twice", path.display())]
    Twice {
        /// The path as given the second time.
        path: PathBuf,
    },
    /// The system refuses to open or read it.
    #[error("{}: cannot be read: {reason}", path.display())]
    Unreadable {
        /// The path as given.
        path: PathBuf,
        /// What the system says.
        reason: String,
    },
    /// There is not a single byte in it.
    #[error("{}: expected a capture, found an empty file", path.display())]
    Empty {
        /// The path as given.
        path: PathBuf,
    },
    /// It is something else.
    #[error("{}: expected pcap or pcapng, plain, gzip or zstd, found {kind}", path.display())]
    Foreign {
        /// The path as given.
        path: PathBuf,
        /// What it is.
        kind: Foreign,
    },
    /// The bytes of the capture are not in order.
    #[error("{}: {error}", path.display())]
    Capture {
        /// The path as given.
        path: PathBuf,
        /// What is wrong with them.
        error: CaptureError,
    },
}

impl FileError {
    /// Whether the file is missing, to be told as Python's `FileNotFoundError`.
    pub fn is_not_found(&self) -> bool {
        matches!(self, Self::NotFound { .. })
    }
}

impl Coded for FileError {
    fn code(&self) -> &'static str {
        match self {
            Self::NoneGiven => "capture.none_given",
            Self::NotFound { .. } => "capture.not_found",
            Self::Directory { .. } => "capture.directory",
            Self::Twice { .. } => "capture.given_twice",
            Self::Unreadable { .. } => "capture.unreadable",
            Self::Empty { .. } => "capture.empty",
            Self::Foreign { kind, .. } => kind.code(),
            Self::Capture { error, .. } => error.code(),
        }
    }

    fn hint(&self) -> Option<String> {
        let hint = match self {
            Self::NoneGiven => "name at least one pcap or pcapng",
            Self::NotFound { .. } => {
                "check the path; relative paths start at the working directory"
            }
            Self::Directory { .. } => "name the captures in it, as DIRECTORY/*.pcap",
            Self::Twice { .. } => "name every file once, or its packets would count twice",
            Self::Unreadable { .. } => {
                "check that you may read the file and that its disk is there"
            }
            Self::Empty { .. } => "the recording wrote nothing: check its interface and its rights",
            Self::Foreign { kind, .. } => kind.hint(),
            Self::Capture { error, .. } => return error.hint(),
        };
        Some(hint.into())
    }
}
