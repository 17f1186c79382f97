//! How the built surface differs from the drawing: waves along the blade, and errors of the mould that
//! keep their form along it.

use std::f64::consts::{PI, TAU};

use super::random::Stream;

/// A smooth wave over one side.
#[derive(Debug, Clone, Copy)]
struct Wave {
    height_m: f64,
    per_metre: f64,
    over_chord: f64,
    phase: [f64; 2],
}

/// Both sides, suction side first.
#[derive(Debug, Clone)]
pub struct Shape([Vec<Wave>; 2]);

impl Shape {
    /// Draws waves of `waves_m` and errors over the chord of `mould_m`, both standard deviations.
    pub fn new(stream: &mut Stream, waves_m: f64, mould_m: f64) -> Self {
        let sides = [(); 2].map(|()| {
            let mut side = waves(stream, 16, waves_m, (4.0, 16.0), (0.0, 2.0));
            if mould_m > 0.0 {
                side.extend(waves(stream, 6, mould_m, (40.0, 200.0), (0.3, 1.5)));
            }
            side
        });
        Self(sides)
    }

    /// Height over the drawing, metres; it fades towards both edges.
    pub fn swell(&self, side: usize, s_m: f64, x_c: f64) -> f64 {
        let fade = (2.0 * (PI * x_c).sin()).min(1.0);
        let height = |w: &Wave| {
            w.height_m
                * (w.per_metre * s_m + w.phase[0]).cos()
                * (w.over_chord * x_c + w.phase[1]).cos()
        };
        fade * self.0[side].iter().map(height).sum::<f64>()
    }
}

/// Waves of these lengths along the blade, metres, and so many over the chord.
fn waves(
    stream: &mut Stream,
    count: u32,
    sigma_m: f64,
    length_m: (f64, f64),
    over_chord: (f64, f64),
) -> Vec<Wave> {
    // Each product of two cosines has a mean square of a quarter.
    let each = sigma_m * (4.0 / f64::from(count)).sqrt();
    let draw = |_| Wave {
        height_m: each,
        per_metre: TAU / stream.between(length_m.0, length_m.1),
        over_chord: TAU * stream.between(over_chord.0, over_chord.1),
        phase: [stream.between(0.0, TAU), stream.between(0.0, TAU)],
    };
    (0..count).map(draw).collect()
}

#[cfg(test)]
mod tests {
    use super::super::random::Subject;
    use super::*;

    #[test]
    fn heights_have_their_deviation_and_a_mould_keeps_its_form() {
        let mut stream = Stream::new(11, Subject::Blade, [0, 0]);
        let rms = |shape: &Shape| {
            let swells = (0..2000).map(|i| shape.swell(i % 2, 20.0 + 0.04 * i as f64, 0.5));
            (swells.map(|w| w * w).sum::<f64>() / 2000.0).sqrt()
        };
        let waved = Shape::new(&mut stream, 0.002, 0.0);
        assert!((0.001..0.003).contains(&rms(&waved)), "{}", rms(&waved));
        let cast = Shape::new(&mut stream, 0.0, 0.002);
        let change = cast.swell(0, 80.0, 0.4) - cast.swell(0, 81.0, 0.4);
        assert!(change.abs() < 0.0006 && rms(&cast) > 0.0003, "{change}");
        assert!(cast.swell(0, 80.0, 0.0) == 0.0);
    }
}
