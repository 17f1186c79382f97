//! Azimuth and time along one packet: rows of equal time step, with gaps of a limited field of view.

use super::{BLOCKS, Packet, TURN_CENTIDEG};
use crate::packet::LeftOut;
use crate::packet::aim::RAD_PER_CENTIDEG;

/// One turn, 0.01 degree.
pub const TURN: i32 = TURN_CENTIDEG as i32;
/// More rows than any packet of the family has.
pub const MAX_ROWS: usize = BLOCKS;
/// Steps back by less than this are jitter of the encoder, not a gap of nearly a turn; 0.01 degree.
const BACKLASH_CENTIDEG: i32 = 100;
/// Steps may always differ by this from the usual one; 0.01 degree.
const JITTER_CENTIDEG: i32 = 20;

/// Rows of one packet: the azimuths that it states and the times that follow from them.
#[derive(Debug, Clone, Copy)]
pub struct Rotation {
    rows: usize,
    raw: [u16; MAX_ROWS],
    row_ns: i64,
    /// By how much rows are late for what was left out before them.
    late_ns: [i64; MAX_ROWS],
    rate_rad_per_ns: f64,
    turned_rad: f64,
    duration_ns: i64,
    left_out: Option<LeftOut>,
}

impl Rotation {
    /// Reads `rows` azimuths (0.01 degree) that follow each other every `row_ns`.
    ///
    /// Where one step is far off the others the sensor left out a part of the turn: the rows behind
    /// it were shot later by the time it takes to turn through, and the rate comes from the rest.
    /// A few rows tell the rate to some 0.3 % only, which is much over a long gap: there
    /// `mean_rate_rad_per_ns` over many packets is better, where it is known (above 0).
    pub fn new(
        azimuths_centideg: impl Iterator<Item = u16>,
        row_ns: i64,
        mean_rate_rad_per_ns: f64,
    ) -> Self {
        let mut raw = [0; MAX_ROWS];
        let mut rows = 0_usize;
        for (place, azimuth) in raw.iter_mut().zip(azimuths_centideg) {
            *place = azimuth;
            rows += 1;
        }
        Self::of_rows(raw, rows, row_ns, mean_rate_rad_per_ns)
    }

    /// The same of the blocks of a packet, `returns` of which make a row.
    #[inline]
    pub fn of_blocks(
        packet: &Packet<'_>,
        returns: usize,
        row_ns: i64,
        mean_rate_rad_per_ns: f64,
    ) -> Self {
        let (raw, rows) = rows_of(packet, returns);
        Self::of_rows(raw, rows, row_ns, mean_rate_rad_per_ns)
    }

    fn of_rows(raw: [u16; MAX_ROWS], rows: usize, row_ns: i64, mean_rate_rad_per_ns: f64) -> Self {
        let steps = steps(&raw);
        let between = &steps[..rows.saturating_sub(1)];
        let usual = Usual::of(between);
        let row_step = usual.mean(between); // 0.01 degree a row
        let mut rotation = Self {
            rows,
            raw,
            row_ns,
            late_ns: [0; MAX_ROWS],
            rate_rad_per_ns: row_step * RAD_PER_CENTIDEG / row_ns as f64,
            turned_rad: 0.0,
            duration_ns: 0,
            left_out: None,
        };
        let (gap_ns, gap_rad) = match usual {
            Usual::Any => (0, 0.0),
            _ => rotation.leave_gaps(&usual, between, row_step, mean_rate_rad_per_ns),
        };
        rotation.duration_ns = rows as i64 * row_ns + gap_ns;
        rotation.turned_rad = rows as f64 * row_step * RAD_PER_CENTIDEG + gap_rad;
        rotation
    }

    /// Makes the rows behind what was left out late; gives time and angle of it all.
    fn leave_gaps(
        &mut self,
        usual: &Usual,
        between: &[i32],
        row_step: f64,
        mean_rate_rad_per_ns: f64,
    ) -> (i64, f64) {
        let over_gap = if mean_rate_rad_per_ns > 0.0 {
            mean_rate_rad_per_ns
        } else {
            self.rate_rad_per_ns
        };
        let (mut gap_ns, mut gap_rad) = (0, 0.0);
        for (row, step) in (1..).zip(between) {
            if !usual.holds(*step) && over_gap > 0.0 {
                let excess_rad = (f64::from(*step) - row_step) * RAD_PER_CENTIDEG;
                self.leave_out(row as f64 * row_step * RAD_PER_CENTIDEG, excess_rad);
                gap_ns += (excess_rad / over_gap) as i64;
                gap_rad += excess_rad;
            }
            self.late_ns[row] = gap_ns;
        }
        (gap_ns, gap_rad)
    }

    /// Keeps the widest gap: a sensor has one field of view.
    fn leave_out(&mut self, after_rad: f64, width_rad: f64) {
        if self.left_out.is_none_or(|gap| gap.width_rad < width_rad) {
            self.left_out = Some(LeftOut {
                after_rad,
                width_rad,
                is_instant: false,
            });
        }
    }

    /// The part of the turn that the sensor left out within the packet.
    pub fn left_out(&self) -> Option<LeftOut> {
        self.left_out
    }

    /// Encoder azimuth of a row's first shot, [0, 2 pi).
    pub fn azimuth_rad(&self, row: usize) -> f64 {
        f64::from(self.raw[row]) * RAD_PER_CENTIDEG
    }

    /// Time of a row's first shot after the packet's stamp.
    pub fn start_ns(&self, row: usize) -> i64 {
        row as i64 * self.row_ns + self.late_ns[row]
    }

    /// Whether the row states an azimuth within one turn.
    pub fn is_valid(&self, row: usize) -> bool {
        row < self.rows && self.raw[row] < TURN_CENTIDEG
    }

    /// Rotation rate within the packet.
    pub fn rate_rad_per_ns(&self) -> f64 {
        self.rate_rad_per_ns
    }

    /// Angle to where the next packet starts.
    pub fn turned_rad(&self) -> f64 {
        self.turned_rad
    }

    /// Time to where the next packet starts.
    pub fn duration_ns(&self) -> i64 {
        self.duration_ns
    }
}

/// Which steps from row to row are those of the rotation, 0.01 degree.
#[derive(Debug, Clone, Copy)]
enum Usual {
    /// All: they are so near to each other that none can be far off the others.
    Any,
    /// Those near the median.
    Near(i32),
}

impl Usual {
    fn of(steps: &[i32]) -> Self {
        if spread(steps) <= JITTER_CENTIDEG {
            Self::Any
        } else {
            Self::Near(median(steps))
        }
    }

    fn holds(&self, step: i32) -> bool {
        match self {
            Self::Any => true,
            Self::Near(usual) => (step - usual).abs() <= usual.abs() / 2 + JITTER_CENTIDEG,
        }
    }

    /// Mean of the steps that are usual.
    fn mean(&self, steps: &[i32]) -> f64 {
        let usual = steps.iter().filter(|step| self.holds(**step));
        let (sum, count) = usual.fold((0, 0), |(sum, count), step| (sum + step, count + 1));
        f64::from(sum) / f64::from(count.max(1))
    }
}

/// Azimuths of the rows of a packet, and how many there are.
#[inline]
pub fn rows_of(packet: &Packet<'_>, returns: usize) -> ([u16; MAX_ROWS], usize) {
    let blocks = packet.azimuths_centideg();
    if returns == 1 {
        return (blocks, BLOCKS);
    }
    let mut raw = [0; MAX_ROWS];
    for (azimuth, block) in raw.iter_mut().zip(blocks.iter().step_by(returns)) {
        *azimuth = *block;
    }
    (raw, BLOCKS.div_ceil(returns))
}

/// Forward steps from row to row, 0.01 degree, in [-`BACKLASH_CENTIDEG`, one turn).
pub fn steps(raw: &[u16; MAX_ROWS]) -> [i32; MAX_ROWS] {
    let mut steps = [0; MAX_ROWS];
    for (step, row) in steps.iter_mut().zip(1..MAX_ROWS) {
        let forth = within_turn(i32::from(raw[row]) - i32::from(raw[row - 1]));
        let is_back = forth > TURN - BACKLASH_CENTIDEG;
        *step = forth - if is_back { TURN } else { 0 };
    }
    steps
}

/// A difference of numbers of two bytes, 0.01 degree, brought into one turn: without branches.
#[inline(always)]
pub fn within_turn(difference: i32) -> i32 {
    let up = |angle: i32| angle + if angle < 0 { TURN } else { 0 };
    let positive = up(up(difference));
    positive - if positive >= TURN { TURN } else { 0 }
}

/// Widest step less the smallest.
fn spread(steps: &[i32]) -> i32 {
    let Some(first) = steps.first() else { return 0 };
    let ends = steps.iter().fold((*first, *first), |(low, high), step| {
        (low.min(*step), high.max(*step))
    });
    ends.1 - ends.0
}

fn median(steps: &[i32]) -> i32 {
    let mut sorted = [0; MAX_ROWS];
    let sorted = &mut sorted[..steps.len()];
    sorted.copy_from_slice(steps);
    sorted.sort_unstable();
    sorted.get(sorted.len() / 2).copied().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROW_NS: i64 = 110_592;

    fn degrees(angle_rad: f64) -> f64 {
        angle_rad.to_degrees()
    }

    #[test]
    fn the_seam_is_no_gap() {
        let rotation = Rotation::new((0..12).map(|row| (35_800 + row * 40) % 36_000), ROW_NS, 0.0);
        assert!((degrees(rotation.rate_rad_per_ns()) * ROW_NS as f64 - 0.4).abs() < 1e-9);
        assert_eq!(rotation.duration_ns(), 12 * ROW_NS);
        assert!((degrees(rotation.turned_rad()) - 4.8).abs() < 1e-9);
        assert_eq!(rotation.azimuth_rad(5), 0.0);
    }

    #[test]
    fn a_gap_of_the_field_of_view_does_not_bend_the_rest() {
        // 0.4 degrees a row; between rows 4 and 5 the sensor leaves out 180 degrees.
        let azimuth = |row: u16| (26_000 + row * 40 + if row > 4 { 18_000 } else { 0 }) % 36_000;
        let rotation = Rotation::new((0..12).map(azimuth), ROW_NS, 0.0);
        assert!((degrees(rotation.rate_rad_per_ns()) * ROW_NS as f64 - 0.4).abs() < 1e-9);
        // 180 degrees at 0.4 degrees a row are 450 rows.
        let late = rotation.start_ns(5) - 5 * ROW_NS;
        assert!((late - 450 * ROW_NS).abs() <= 1, "{late}");
        assert_eq!(rotation.start_ns(4), 4 * ROW_NS);
        assert!((degrees(rotation.turned_rad()) - 184.8).abs() < 1e-6);
        let gap = rotation.left_out().unwrap();
        assert!((degrees(gap.after_rad) - 2.0).abs() < 1e-9);
        assert!((degrees(gap.width_rad) - 180.0).abs() < 1e-9);
    }

    #[test]
    fn all_differences_of_two_bytes_are_brought_into_one_turn() {
        for difference in -65_535..=65_535 {
            assert_eq!(within_turn(difference), difference.rem_euclid(TURN));
        }
    }

    #[test]
    fn a_standing_rotor_and_noise_are_survived() {
        let standing = Rotation::new([7, 7, 6, 7, 7, 7].into_iter(), ROW_NS, 0.0);
        assert!(standing.rate_rad_per_ns().abs() * (ROW_NS as f64) < 1e-4);
        let noise = Rotation::new([65_535, 0, 36_000, 12, 40_000, 3].into_iter(), ROW_NS, 0.0);
        assert!(!noise.is_valid(0) && noise.is_valid(1) && !noise.is_valid(6));
    }
}
