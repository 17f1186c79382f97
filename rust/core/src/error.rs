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

/// A file that should describe a unit and does not, or a unit that cannot be decoded without one.
#[derive(Debug, Clone, Error, PartialEq, Eq)]
pub enum UnitError {
    /// The model means nothing without the calibration of the unit.
    #[error(
        "{model}: no points without the calibration of the unit, and neither a file nor the packets give one"
    )]
    Missing {
        /// Name of the model.
        model: &'static str,
        /// How to get the calibration.
        obtain: &'static str,
    },
    /// No lidar of the capture can use the file.
    #[error("{file}: expected a calibration file of {models}, found {found}")]
    NotTaken {
        /// Name of the file.
        file: String,
        /// Models that were asked.
        models: String,
        /// What it looks like.
        found: String,
    },
    /// The file is of the right kind and broken.
    #[error("{file}{place}: expected {expected}, found {found}")]
    Malformed {
        /// Name of the file.
        file: String,
        /// Where in it.
        place: String,
        /// What a sound file has there.
        expected: String,
        /// What was there.
        found: String,
    },
}

impl Coded for UnitError {
    fn code(&self) -> &'static str {
        match self {
            Self::Missing { .. } => "beams.missing",
            Self::NotTaken { .. } => "beams.not_taken",
            Self::Malformed { .. } => "beams.malformed",
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::Missing { obtain, .. } => Some((*obtain).into()),
            Self::NotTaken { .. } => {
                Some("see docs/sensors.md for the files that each model takes".into())
            }
            Self::Malformed { .. } => Some("fetch the file from the sensor again".into()),
        }
    }
}

/// Why a lidar of a capture cannot be read.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum ReadError {
    /// There is no such lidar.
    #[error(transparent)]
    Value(#[from] InvalidValue),
    /// Nothing fit to decode it with is known of the unit.
    #[error(transparent)]
    Unit(#[from] UnitError),
}

impl Coded for ReadError {
    fn code(&self) -> &'static str {
        match self {
            Self::Value(error) => error.code(),
            Self::Unit(error) => error.code(),
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::Value(error) => error.hint(),
            Self::Unit(error) => error.hint(),
        }
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

/// A point cloud that cannot be searched or clustered.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum ClusterError {
    /// A coordinate is NaN or infinite.
    #[error("point {index}: expected finite coordinates, found {point:?}")]
    NotFinite {
        /// Place of the first such point.
        index: usize,
        /// Its coordinates.
        point: [f64; 3],
    },
    /// More points than labels can number.
    #[error("points: expected at most {most}, found {found}")]
    TooMany {
        /// What 32-bit labels allow.
        most: usize,
        /// Number of points.
        found: usize,
    },
    /// One radius per point, or one label per sample, was announced, but the lengths differ.
    #[error("{name}: expected {expected} values, one per point, found {found}")]
    Length {
        /// What there should be one of for every point.
        name: &'static str,
        /// Number of points.
        expected: usize,
        /// Number of values.
        found: usize,
    },
}

impl Coded for ClusterError {
    fn code(&self) -> &'static str {
        match self {
            Self::NotFinite { .. } => "cluster.not_finite",
            Self::TooMany { .. } => "cluster.too_many_points",
            Self::Length { .. } => "cluster.length",
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::NotFinite { .. } => Some("leave out NaN and infinite points first".into()),
            Self::TooMany { .. } => Some("cluster sweep by sweep".into()),
            Self::Length { .. } => None,
        }
    }
}

/// A shape that the points do not fix.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum FitError {
    /// Fewer points than unknowns.
    #[error("{shape}: expected at least {needed} points, found {found}")]
    TooFew {
        /// What was to be fitted.
        shape: &'static str,
        /// Least number of points.
        needed: usize,
        /// Number of points.
        found: usize,
    },
    /// Enough points, but lying so that more than one shape fits them equally well.
    #[error("{shape}: {reason}")]
    Degenerate {
        /// What was to be fitted.
        shape: &'static str,
        /// How the points lie.
        reason: String,
    },
    /// A coordinate is NaN or infinite.
    #[error("{shape}: point {index} has a coordinate that is not finite")]
    NotFinite {
        /// What was to be fitted.
        shape: &'static str,
        /// Place of the first such point.
        index: usize,
    },
    /// A search did not reach its tolerance.
    #[error("{what}: no convergence to {tolerance:e} within {steps} steps")]
    NotConverged {
        /// What was searched.
        what: &'static str,
        /// Wanted tolerance, in the unit of the result.
        tolerance: f64,
        /// Steps allowed.
        steps: usize,
    },
    /// A line clustering without any cluster: all samples are noise.
    #[error("line clustering: all {samples} samples are noise")]
    NoCluster {
        /// Number of samples.
        samples: usize,
    },
}

impl Coded for FitError {
    fn code(&self) -> &'static str {
        match self {
            Self::TooFew { .. } => "fit.too_few",
            Self::Degenerate { .. } => "fit.degenerate",
            Self::NotFinite { .. } => "fit.not_finite",
            Self::NotConverged { .. } => "fit.not_converged",
            Self::NoCluster { .. } => "fit.no_cluster",
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Self::TooFew { .. } => Some("take more points or a lower degree".into()),
            Self::Degenerate { .. } => Some("take points that spread wider".into()),
            Self::NotFinite { .. } => Some("leave out NaN and infinite points first".into()),
            Self::NotConverged { .. } => Some("a larger tolerance or a shorter stretch".into()),
            Self::NoCluster { .. } => Some("a larger clustering radius or fewer points".into()),
        }
    }
}

/// Why the beam method has no result.
#[derive(Debug, Clone, Copy, Error, PartialEq, Eq)]
pub enum BeamError {
    /// A load has no equilibrium.
    #[error("a state of the blade has no equilibrium under the loads that were tried")]
    Unsettled,
    /// The unknowns are not fixed by data and prior knowledge together.
    #[error("the equations of the adjustment are singular")]
    Singular,
}

impl Coded for BeamError {
    fn code(&self) -> &'static str {
        match self {
            Self::Unsettled => "measurement.unsettled",
            Self::Singular => "measurement.singular",
        }
    }

    fn hint(&self) -> Option<String> {
        Some(match self {
            Self::Unsettled => "check stiffness and prediction against each other".into(),
            Self::Singular => "check the covariance of the calibration".into(),
        })
    }
}
