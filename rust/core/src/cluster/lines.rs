//! A cloud sorted by scan line, and which of its points have neighbours enough right beside them.

use crate::neighbors::{Coordinate, squared_distance, wide};
use crate::simd::{Kernel, vectorized};

/// Points on each side beyond which none is looked at.
const FARTHEST: usize = 16;

/// Points line by line, in a line as they came, by columns.
pub struct Lines {
    /// Where each stands in the cloud.
    pub order: Vec<u32>,
    /// Squared radius of each.
    pub limits: Vec<f64>,
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

impl Lines {
    /// Sorts points by the number of their line; `radius_m` gives the radius by place in the cloud.
    pub fn new<T: Coordinate>(
        points: &[[T; 3]],
        lines: &[u16],
        radius_m: impl Fn(usize) -> f64,
    ) -> Self {
        let order = by_line(lines);
        let column = |axis: usize| {
            let along = |place: &u32| wide(points[*place as usize])[axis];
            order.iter().map(along).collect()
        };
        let (x, y, z) = (column(0), column(1), column(2));
        let limit = |place: &u32| radius_m(*place as usize) * radius_m(*place as usize);
        Self {
            limits: order.iter().map(limit).collect(),
            order,
            x,
            y,
            z,
        }
    }

    /// The point at a sorted place.
    #[inline(always)]
    pub fn point(&self, place: usize) -> [f64; 3] {
        [self.x[place], self.y[place], self.z[place]]
    }

    /// Squared distance of two points.
    #[inline(always)]
    pub fn squared_distance(&self, one: usize, other: usize) -> f64 {
        squared_distance(self.point(one), self.point(other))
    }

    /// The points that have `needed` neighbours, themselves among them, right before and behind them. Others may be
    /// cores as well.
    pub fn proven_cores(&self, needed: usize) -> Vec<bool> {
        let counts = vectorized(CountBeside {
            lines: self,
            reach: reach(needed),
        });
        counts.into_iter().map(|c| c as usize >= needed).collect()
    }

    /// Whether one of the `cores` right before and behind a point reaches it.
    pub fn is_reached_beside(&self, place: usize, needed: usize, cores: &[bool]) -> bool {
        let reach = reach(needed);
        let mut beside = place.saturating_sub(reach)..cores.len().min(place + reach + 1);
        beside
            .any(|other| cores[other] && self.squared_distance(place, other) <= self.limits[other])
    }
}

/// At the end of a line all neighbours lie on one side.
fn reach(needed: usize) -> usize {
    needed.saturating_sub(1).min(FARTHEST)
}

/// Places in the cloud, line by line.
fn by_line(lines: &[u16]) -> Vec<u32> {
    let count = lines.iter().max().map_or(0, |last| usize::from(*last) + 1);
    let mut next = vec![0_u32; count];
    for line in lines {
        next[usize::from(*line)] += 1;
    }
    let mut start = 0;
    for next in &mut next {
        start += std::mem::replace(next, start);
    }
    let mut order = vec![0; lines.len()];
    for (place, line) in (0..).zip(lines) {
        let next = &mut next[usize::from(*line)];
        order[*next as usize] = place;
        *next += 1;
    }
    order
}

/// Counts the neighbours of all points among those up to `reach` places away.
struct CountBeside<'a> {
    lines: &'a Lines,
    reach: usize,
}

impl Kernel for CountBeside<'_> {
    type Out = Vec<u64>;

    #[inline(always)]
    fn run(self) -> Vec<u64> {
        let Lines {
            limits, x, y, z, ..
        } = self.lines;
        let count = x.len();
        let (mut counts, mut squares) = (vec![1; count], vec![0.0; count]);
        for apart in 1..=self.reach.min(count.saturating_sub(1)) {
            let squares = &mut squares[..count - apart];
            squared_distances(squares, [x, y, z].map(|c| sides(c, apart)));
            count_within(
                &mut counts[..count - apart],
                squares,
                &limits[..count - apart],
            );
            count_within(&mut counts[apart..], squares, &limits[apart..]);
        }
        counts
    }
}

/// A column without its last values, and without its first.
#[inline(always)]
fn sides(column: &[f64], apart: usize) -> (&[f64], &[f64]) {
    (&column[..column.len() - apart], &column[apart..])
}

#[inline(always)]
fn squared_distances(squares: &mut [f64], [x, y, z]: [(&[f64], &[f64]); 3]) {
    let sides =
        x.0.iter()
            .zip(x.1)
            .zip(y.0.iter().zip(y.1))
            .zip(z.0.iter().zip(z.1));
    for (square, ((x, y), z)) in squares.iter_mut().zip(sides) {
        *square = squared_distance([*x.0, *y.0, *z.0], [*x.1, *y.1, *z.1]);
    }
}

#[inline(always)]
fn count_within(counts: &mut [u64], squares: &[f64], limits: &[f64]) {
    for (count, (square, limit)) in counts.iter_mut().zip(squares.iter().zip(limits)) {
        *count = count.wrapping_add(u64::from(square <= limit)); // no check: side by side
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_of_a_line_stay_in_order_and_prove_each_other() {
        let points = [0.0f32, 5.0, 0.1, 9.0, 0.2].map(|x| [x, 0.0, 0.0]);
        let lines = Lines::new(&points, &[3, 1, 3, 1, 3], |_| 0.15);
        assert_eq!(lines.order, [1, 3, 0, 2, 4]);
        assert_eq!(lines.proven_cores(3), [false, false, false, true, false]);
        let cores = lines.proven_cores(3);
        let reached = [0, 1, 2, 4].map(|place| lines.is_reached_beside(place, 3, &cores));
        assert_eq!(reached, [false, false, true, true]);
    }
}
