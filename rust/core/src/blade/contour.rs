//! Extremes of scan lines: samples of the leading and the trailing edge (step 7).

use nalgebra::{Unit, Vector3};

/// Both ends of one scan line along the chord, metres, world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineExtremes {
    /// Number of the beam that drew the line.
    pub ring: u16,
    /// Echo farthest towards the leading edge.
    pub leading_m: [f64; 3],
    /// Echo farthest towards the trailing edge.
    pub trailing_m: [f64; 3],
}

/// Place along the chord, and the echo.
type Extreme = (f64, [f64; 3]);

/// The echoes of each ring that lie farthest along `leading_edge` and against it, ring by ring.
///
/// The extreme echo lies inside the true edge by up to one angular step and outside by half the
/// beam's footprint; the paper takes it for the edge, and so does this step.
pub fn line_extremes(
    points_m: &[[f32; 3]],
    rings: &[u16],
    leading_edge: &Unit<Vector3<f64>>,
) -> Vec<LineExtremes> {
    let count = rings.iter().max().map_or(0, |last| usize::from(*last) + 1);
    let mut lines: Vec<Option<[Extreme; 2]>> = vec![None; count];
    for (point, ring) in points_m.iter().zip(rings) {
        let point = point.map(f64::from);
        let along = leading_edge.dot(&Vector3::from(point));
        let [leading, trailing] = lines[usize::from(*ring)]
            .get_or_insert([(f64::NEG_INFINITY, point), (f64::INFINITY, point)]);
        if along > leading.0 {
            *leading = (along, point);
        }
        if along < trailing.0 {
            *trailing = (along, point);
        }
    }
    let both = |(ring, [leading, trailing]): (u16, [Extreme; 2])| LineExtremes {
        ring,
        leading_m: leading.1,
        trailing_m: trailing.1,
    };
    let drawn = (0..)
        .zip(lines)
        .filter_map(|(ring, line)| Some((ring, line?)));
    drawn.map(both).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_ring_gives_its_two_ends() {
        let points = [
            [0.0, 0.0, 1.0],
            [-2.0, 0.1, 1.0],
            [3.0, 0.2, 1.0],
            [1.0, 5.0, 2.0f32],
        ];
        let lines = line_extremes(&points, &[7, 7, 7, 2], &-Vector3::x_axis());
        assert_eq!(lines.len(), 2);
        assert_eq!(lines[0].ring, 2);
        assert_eq!(lines[0].leading_m, lines[0].trailing_m);
        assert_eq!(lines[1].leading_m[0], -2.0);
        assert_eq!(lines[1].trailing_m[0], 3.0);
    }

    #[test]
    fn no_points_no_lines() {
        assert!(line_extremes(&[], &[], &Vector3::x_axis()).is_empty());
    }
}
