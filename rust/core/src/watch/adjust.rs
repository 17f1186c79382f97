//! Loops over cells in the adjustment of a pose; what is small, matrices of six rows, is solved elsewhere.

/// A turn about and a shift along the world axes, six columns.
pub type Row = [f64; 6];

/// How a turn and a shift change each height over its uncertainty: minus (ray x normal, normal) by sigma.
pub fn design(ray_m: &[[f64; 3]], normal: &[[f64; 3]], sigma_m: &[f64]) -> Vec<Row> {
    let cells = ray_m.iter().zip(normal).zip(sigma_m);
    let row = |((ray, normal), sigma_m): ((&[f64; 3], &[f64; 3]), &f64)| {
        let ([x, y, z], [u, v, w]) = (*ray, *normal);
        [y * w - z * v, z * u - x * w, x * v - y * u, u, v, w].map(|change| -change / sigma_m)
    };
    cells.map(row).collect()
}

/// Median of the sizes of values, of an even number the mean of the two in the middle; NaN without any.
pub fn median_size(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    if sizes.is_empty() {
        return f64::NAN;
    }
    let middle = sizes.len() / 2;
    let is_even = sizes.len().is_multiple_of(2);
    let (below, upper, _) = sizes.select_nth_unstable_by(middle, f64::total_cmp);
    if !is_even {
        return *upper;
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (lower + *upper) / 2.0
}

/// One within the limit, beyond it the limit by the size; all over `square`.
pub fn huber(left: &[f64], limit: f64, square: f64) -> Vec<f64> {
    let weight = |left: &f64| (limit / left.abs().max(1e-9)).min(1.0) / square;
    left.iter().map(weight).collect()
}

/// Rows times their weights.
pub fn weighted(design: &[Row], weight: &[f64]) -> Vec<Row> {
    let rows = design.iter().zip(weight);
    rows.map(|(row, weight)| row.map(|value| value * weight))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_about_an_axis_lowers_what_lies_beside_it() {
        // 2 m along x, ground below: a turn about z lifts the beam by 2 m a radian, so the ground seems lower.
        let row = design(&[[2.0, -1.0, 0.0]], &[[0.0, 1.0, 0.0]], &[0.5])[0];
        assert_eq!(row, [0.0, 0.0, -4.0, 0.0, -2.0, 0.0]);
    }

    #[test]
    fn the_median_is_of_sizes() {
        assert_eq!(median_size(&[-3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median_size(&[-3.0, 1.0, 2.0, -8.0]), 2.5);
        assert!(median_size(&[]).is_nan());
    }

    #[test]
    fn what_is_far_off_weighs_less() {
        let weight = huber(&[0.0, -2.0, 8.0], 4.0, 4.0);
        assert_eq!(weight, [0.25, 0.25, 0.125]);
        assert_eq!(weighted(&[[8.0; 6]], &weight[2..]), [[1.0; 6]]);
    }
}
