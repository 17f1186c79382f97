//! Shots that each go in a direction of their own from the origin of the sensor.

use std::ops::Range;

use super::aim::bearing;
use super::sheet::{LANES, Sheet, lane, lane_mut};
use crate::simd::{Kernel, vectorized};

/// Directions of one metre, part by part, with room for a chunk behind the last one.
#[derive(Debug, Default)]
pub struct Rays {
    /// x, y, z.
    pub parts: [Vec<f64>; 3],
}

impl Rays {
    /// Makes room for the directions of so many shots.
    pub fn open(&mut self, shots: usize) {
        for part in &mut self.parts {
            part.resize(shots + LANES, 0.0);
        }
    }

    /// Places echoes of a sheet along the directions from number `first` on.
    pub fn place(&self, first: usize, unit_m: f64, echoes: Range<usize>, sheet: &mut Sheet) {
        vectorized(Place::<false> {
            parts: self.parts.each_ref().map(|part| &part[first..]),
            unit_m,
            echoes,
            sheet,
        });
    }

    /// The same, and takes the azimuths of the positions, from x towards y.
    pub fn place_and_bear(&self, unit_m: f64, echoes: Range<usize>, sheet: &mut Sheet) {
        vectorized(Place::<true> {
            parts: self.parts.each_ref().map(Vec::as_slice),
            unit_m,
            echoes,
            sheet,
        });
    }
}

impl FromIterator<[f64; 3]> for Rays {
    fn from_iter<I: IntoIterator<Item = [f64; 3]>>(directions: I) -> Self {
        let mut rays = Self::default();
        for direction in directions {
            for (part, value) in rays.parts.iter_mut().zip(direction) {
                part.push(value);
            }
        }
        rays.open(rays.parts[0].len());
        rays
    }
}

struct Place<'a, const BEARS: bool> {
    parts: [&'a [f64]; 3],
    unit_m: f64,
    echoes: Range<usize>,
    sheet: &'a mut Sheet,
}

impl<const BEARS: bool> Kernel for Place<'_, BEARS> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let Self { unit_m, sheet, .. } = self;
        for (from, at) in self.echoes.step_by(LANES).enumerate() {
            let [x, y, z] = self.parts.map(|part| lane(part, LANES * from));
            let ranges = lane(&sheet.range, at);
            let range_m = lane_mut(&mut sheet.range_m, at);
            let xyz_m = lane_mut(&mut sheet.xyz_m, at);
            let (mut x_m, mut y_m) = ([0.0; LANES], [0.0; LANES]);
            for k in 0..LANES {
                let metres = f64::from(ranges[k]) * unit_m;
                range_m[k] = metres as f32;
                x_m[k] = (metres * x[k]) as f32;
                y_m[k] = (metres * y[k]) as f32;
                xyz_m[k] = [x_m[k], y_m[k], (metres * z[k]) as f32];
            }
            if BEARS {
                let azimuth_rad = lane_mut(&mut sheet.azimuth_rad, at);
                for k in 0..LANES {
                    azimuth_rad[k] = bearing(x_m[k], y_m[k]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::ReturnKind;
    use crate::packet::Decoded;

    #[test]
    fn echoes_lie_along_their_directions() {
        let directions = (0..40).map(|k| f64::from(k).sin_cos());
        let rays: Rays = directions.clone().map(|(s, c)| [c, s, 0.5]).collect();
        let (mut sheet, mut out) = (Sheet::default(), Decoded::default());
        sheet.open(30, 2);
        (0..)
            .zip(&mut sheet.range[..60])
            .for_each(|(k, range)| *range = k);
        for echo in 0..2 {
            rays.place(10, 0.5, sheet.echoes(echo), &mut sheet);
        }
        sheet.flush_singles(ReturnKind::Strongest, 3, &mut out);
        assert_eq!(out.cloud.len(), 59);
        for (k, echo) in (1..).zip(out.cloud.iter()) {
            let (sin, cos) = f64::from(10 + k % 30).sin_cos();
            let range_m = f64::from(k) * 0.5;
            assert_eq!(echo.range_m, range_m as f32);
            assert_eq!(
                echo.xyz_m,
                [cos, sin, 0.5].map(|part| (range_m * part) as f32)
            );
        }
    }
}
