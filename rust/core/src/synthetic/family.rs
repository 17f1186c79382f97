//! Blades that nobody built: drawn from smooth laws with random parameters, wide enough that no
//! estimator can have been made for one of them.

use std::f64::consts::PI;

use super::random::{Stream, Subject};
use super::reference::Stations;

/// Stations of a drawn blade.
const COUNT: usize = 41;
/// Metres of a blade whose stiffness and mass are the ones below.
const LENGTH_M: f64 = 100.0;

/// Parameters of one blade.
#[derive(Debug, Clone, Copy)]
struct Law {
    root_m: f64,
    widest: f64,
    widest_at: f64,
    tip: f64,
    taper: f64,
    twist_rad: f64,
    twist_power: f64,
    thin: f64,
    thick_power: f64,
    prebend_m: f64,
    prebend_power: f64,
    axis: f64,
    flap: f64,
    edge: f64,
    torsion: f64,
    mass: f64,
}

impl Law {
    fn draw(stream: &mut Stream) -> Self {
        Self {
            root_m: stream.between(0.042, 0.05),
            widest: stream.between(0.05, 0.06),
            widest_at: stream.between(0.18, 0.3),
            tip: stream.between(0.006, 0.012),
            taper: stream.between(0.75, 1.2),
            twist_rad: stream.between(10.0, 18.0_f64).to_radians(),
            twist_power: stream.between(1.4, 2.6),
            thin: stream.between(0.18, 0.24),
            thick_power: stream.between(1.6, 2.8),
            prebend_m: stream.between(0.0, 0.045),
            prebend_power: stream.between(2.0, 3.5),
            axis: stream.between(0.28, 0.42),
            flap: stream.between(0.7, 1.4),
            edge: stream.between(0.8, 1.3),
            torsion: stream.between(0.7, 1.4),
            mass: stream.between(0.8, 1.2),
        }
    }

    /// Chord over length at the share `x` of the length.
    fn chord(&self, x: f64) -> f64 {
        let ease = |t: f64| t * t * (3.0 - 2.0 * t);
        if x < self.widest_at {
            return self.root_m + (self.widest - self.root_m) * ease(x / self.widest_at);
        }
        let out = (x - self.widest_at) / (1.0 - self.widest_at);
        let straight = self.widest + (self.tip - self.widest) * out.powf(self.taper);
        // The tip is rounded over the last two percent.
        straight * (1.0 - 0.45 * ((x - 0.98) / 0.02).clamp(0.0, 1.0).powi(2))
    }

    /// Thickness over chord.
    fn thickness(&self, x: f64) -> f64 {
        let round = ((x - 0.04) / 0.76).clamp(0.0, 1.0);
        self.thin + (1.0 - self.thin) * (1.0 - round).powf(self.thick_power)
    }
}

impl Stations {
    /// A blade of `length_m` whose laws are drawn from `seed`.
    pub fn drawn(length_m: f64, seed: u64) -> Self {
        let law = Law::draw(&mut Stream::new(seed, Subject::Drawing, [0, 0]));
        let mut blade = Self::default();
        let grow = length_m / LENGTH_M;
        for i in 0..COUNT {
            // Closer towards the tip.
            let x = (0.5 * PI * i as f64 / (COUNT - 1) as f64).sin();
            let (chord, thickness) = (law.chord(x), law.thickness(x));
            let (chord_m, thick_m) = (LENGTH_M * chord, LENGTH_M * chord * thickness);
            // Shells and spars of composite get thinner outwards.
            let wall = 0.10 * (1.0 - 0.85 * x);
            let flap = law.flap * 5.5e9 * wall * chord_m * thick_m.powi(2);
            let edge = law.edge * 3.5e9 * wall * chord_m.powi(2) * (chord_m + thick_m) * 0.6;
            blade.s_m.push(length_m * x);
            blade.chord_m.push(length_m * chord);
            blade.rel_thickness.push(thickness);
            blade
                .twist_rad
                .push(law.twist_rad * (1.0 - x).powf(law.twist_power));
            let prebend = law.prebend_m * x.powf(law.prebend_power);
            blade.prebend_m.push(length_m * prebend);
            let out = ((x - 0.03) / 0.25).clamp(0.0, 1.0);
            blade.axis_fraction.push(0.5 + (law.axis - 0.5) * out);
            blade.ei_flap_nm2.push(flap * grow.powi(4));
            blade.ei_edge_nm2.push(edge * grow.powi(4));
            blade.ei_cross_nm2.push(0.0);
            let torsion = law.torsion * 1.4e9 * wall * chord_m * thick_m.powi(2);
            blade.gj_nm2.push(torsion * grow.powi(4));
            let mass = law.mass * 190.0 * wall / 0.1 * (chord_m + thick_m);
            blade.mass_kg_m.push(mass * grow.powi(2));
        }
        blade
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawn_blades_differ_and_are_blades() {
        for seed in 0..50 {
            let blade = Stations::drawn(80.0, seed);
            assert!((blade.length_m() - 80.0).abs() < 1e-9);
            assert!(blade.s_m.windows(2).all(|pair| pair[1] > pair[0]));
            // Where the chord widens from the root on, the section may stiffen a little.
            let steps = blade.ei_flap_nm2.windows(2).zip(&blade.s_m);
            for (pair, s_m) in steps {
                let most = if *s_m < 25.0 { 1.25 } else { 1.0 };
                assert!(pair[1] <= most * pair[0], "{seed} {s_m} {pair:?}");
            }
            let (root, tip) = (blade.chord_m[0], blade.chord_m[COUNT - 1]);
            assert!(
                (3.0..4.5).contains(&root) && (0.2..1.0).contains(&tip),
                "{root} {tip}"
            );
            let first = blade.ei_flap_nm2[0];
            // Public blades of 61 to 117 m have 1.8e10 to 1.5e11 N m^2 at the root.
            assert!((5e9..2e11).contains(&first), "{first:e}");
        }
        assert_ne!(Stations::drawn(80.0, 1), Stations::drawn(80.0, 2));
    }
}
