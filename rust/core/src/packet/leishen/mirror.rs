//! The models of the CH series: lines, angles of prism and mirror.
//!
//! Source: the maker's driver and the manual of the CH128X1. Of a CH64W, whose two sides see 180 degrees,
//! the packets are not taken: they would need corrections that only the driver has.

use super::ch::Ch;

/// What one model is.
#[derive(Debug, PartialEq)]
pub struct Mirror {
    /// Id of the model.
    pub id: &'static str,
    /// Name with vendor.
    pub title: &'static str,
    /// Ids of models whose packets cannot be told from this one's.
    pub candidates: &'static [&'static str],
    /// Bytes of a data packet.
    pub len: usize,
    /// Numbers of lines: those that the smaller models of the length do not have.
    pub least_line: usize,
    /// Lines.
    pub lines: usize,
    /// Lines that share one angle of the prism.
    pub group: usize,
    /// Angle of the prism of each group of lines.
    pub first: First,
    /// Angle of the mirror from line to line of a group, degrees.
    pub second_deg: f64,
    /// Whether the azimuths of the unit are corrected piece by piece.
    pub is_bent: bool,
}

/// Angles of the prism, degrees.
#[derive(Debug, PartialEq)]
pub enum First {
    /// By group.
    Listed(&'static [f64]),
    /// Of the first group, and from group to group.
    Even(f64, f64),
}

const CH128X1_DEG: &[f64] = &[
    -17.0, -16.0, -15.0, -14.0, -13.0, -12.0, -11.0, -10.0, -9.0, -8.0, -7.0, -6.0, -5.0, -4.125,
    -4.0, -3.125, -3.0, -2.125, -2.0, -1.125, -1.0, -0.125, 0.0, 0.875, 1.0, 1.875, 2.0, 3.0, 4.0,
    5.0, 6.0, 7.0,
];
const CH128S1_DEG: &[f64] = &[
    -12.0, -11.0, -10.0, -9.0, -8.0, -7.0, -6.0, -5.0, -4.125, -4.0, -3.125, -3.0, -2.125, -2.0,
    -1.125, -1.0, -0.125, 0.0, 0.875, 1.0, 1.875, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0,
    11.0, 12.0,
];

const fn mirror(
    (id, title): (&'static str, &'static str),
    len: usize,
    (least_line, lines): (usize, usize),
    group: usize,
    first: First,
    second_deg: f64,
) -> Mirror {
    Mirror {
        id,
        title,
        candidates: &[],
        len,
        least_line,
        lines,
        group,
        first,
        second_deg,
        is_bent: false,
    }
}

/// All models of the series that are decoded.
pub static MIRRORS: [Mirror; 8] = [
    mirror(
        ("ch128x1", "Leishen CH128X1"),
        1206,
        (64, 128),
        4,
        First::Listed(CH128X1_DEG),
        -0.17,
    ),
    mirror(
        ("cb64s1-a", "Leishen CB64S1-A"),
        1206,
        (0, 64),
        4,
        First::Even(-25.0, 2.5),
        0.35,
    ),
    Mirror {
        candidates: &["cx128s2"],
        ..mirror(
            ("ch128s1", "Leishen CH128S1"),
            1212,
            (126, 128),
            4,
            First::Listed(CH128S1_DEG),
            -0.17,
        )
    },
    Mirror {
        candidates: &["ch128s1"],
        is_bent: true,
        ..mirror(
            ("cx128s2", "Leishen CX128S2"),
            1212,
            (126, 128),
            4,
            First::Listed(CH128S1_DEG),
            -0.17,
        )
    },
    mirror(
        ("cx126s3", "Leishen CX126S3"),
        1212,
        (16, 126),
        3,
        First::Even(-12.0, 0.6),
        -0.14,
    ),
    mirror(
        ("ch16x1", "Leishen CH16X1"),
        1212,
        (6, 16),
        4,
        First::Even(-1.0, 1.0),
        -0.17,
    ),
    mirror(
        ("cx6s3", "Leishen CX6S3"),
        1212,
        (0, 6),
        3,
        First::Even(-0.6, 0.6),
        -0.14,
    ),
    mirror(
        ("ch256", "Leishen CH256"),
        1212,
        (128, 256),
        4,
        First::Even(-20.0, 0.625),
        0.11,
    ),
];

/// The models, in the order of [`MIRRORS`].
pub static MODELS: [Ch; 8] = [
    Ch::of(&MIRRORS[0]),
    Ch::of(&MIRRORS[1]),
    Ch::of(&MIRRORS[2]),
    Ch::of(&MIRRORS[3]),
    Ch::of(&MIRRORS[4]),
    Ch::of(&MIRRORS[5]),
    Ch::of(&MIRRORS[6]),
    Ch::of(&MIRRORS[7]),
];

impl Mirror {
    /// Angle of the prism of a group, degrees.
    pub fn first_deg(&self, group: usize) -> f64 {
        match self.first {
            First::Listed(angles) => angles.get(group).copied().unwrap_or(0.0),
            First::Even(start, step) => start + step * group as f64,
        }
    }

    /// Azimuth of a shot from what the packet states, degrees.
    pub fn azimuth_deg(&self, stated_deg: f64) -> f64 {
        match stated_deg {
            _ if !self.is_bent => stated_deg,
            30.0..=60.0 => 0.9822 * stated_deg + 1.322,
            60.0..=120.0 => 0.9932 * stated_deg + 0.655,
            120.0..=150.0 => 0.9873 * stated_deg + 1.372,
            _ => stated_deg,
        }
    }
}
