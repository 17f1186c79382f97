//! Cells of many echoes, side by side; the numbers are those of [`CellGrid::cell`].

use super::CellGrid;
use crate::cloud::in_degrees;
use crate::simd::{Kernel, vectorized};

const ABREAST: usize = 16;

/// Tells the number and the cell of each echo, in their order.
pub fn each(
    grid: &CellGrid,
    rings: &[u16],
    azimuths_rad: &[f32],
    mut take: impl FnMut(usize, u32),
) {
    let (beams, last_beams) = rings.as_chunks::<ABREAST>();
    let (azimuths, last_azimuths) = azimuths_rad.as_chunks::<ABREAST>();
    let mut number = 0;
    for (rings, azimuths_rad) in beams.iter().zip(azimuths) {
        let cells = vectorized(Cells {
            grid,
            rings,
            azimuths_rad,
        });
        for cell in cells {
            take(number, cell);
            number += 1;
        }
    }
    for (ring, azimuth_rad) in last_beams.iter().zip(last_azimuths) {
        take(number, grid.cell(*ring, in_degrees(azimuth_rad)));
        number += 1;
    }
}

struct Cells<'a> {
    grid: &'a CellGrid,
    rings: &'a [u16; ABREAST],
    azimuths_rad: &'a [f32; ABREAST],
}

impl Kernel for Cells<'_> {
    type Out = [u32; ABREAST];

    #[inline(always)]
    fn run(self) -> Self::Out {
        let Self {
            grid,
            rings,
            azimuths_rad,
        } = self;
        let turn = grid.steps as f32;
        let mut cells = [0; ABREAST];
        let mut is_plain = true;
        for k in 0..ABREAST {
            let steps = in_degrees(&azimuths_rad[k]) / grid.step_deg;
            is_plain &= steps >= 0.0 && steps < turn; // nearly all, without a division of integers
            let beam = u32::from(rings[k].min(grid.last_ring));
            // Kept within a turn, so that no cast and no sum runs over.
            let step = steps.clamp(0.0, turn - 1.0) as i32 as u32;
            cells[k] = beam.wrapping_mul(grid.steps).wrapping_add(step);
        }
        if is_plain {
            return cells;
        }
        std::array::from_fn(|k| grid.cell(rings[k], in_degrees(&azimuths_rad[k])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    #[test]
    fn side_by_side_echoes_fall_into_the_same_cells_as_one_by_one() {
        let grid = CellGrid {
            step_deg: 0.5,
            steps: 720,
            last_ring: 3,
        };
        let azimuth = |k: usize| match k {
            40 => f32::NAN,
            60 => -0.01,
            80 => TAU,
            _ => k as f32 * 0.0617 % TAU,
        };
        let azimuths_rad: Vec<f32> = (0..103).map(azimuth).collect();
        let rings: Vec<u16> = (0..103).map(|k| k % 7).collect();
        let mut found = Vec::new();
        each(&grid, &rings, &azimuths_rad, |echo, cell| {
            found.push((echo, cell));
        });
        let expected = |k: usize| (k, grid.cell(rings[k], in_degrees(&azimuths_rad[k])));
        assert_eq!(found, (0..103).map(expected).collect::<Vec<_>>());
    }
}
