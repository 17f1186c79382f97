//! A small test of known outcome: a straight blade bent a little, seen by one lidar through the model.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

use super::adjust::{Adjustment, Hold, Problem};
use super::design::{Design, Outlines, Stations};
use super::echoes::{LineEcho, Seen, add_line};
use super::family::{Loading, Trust};
use super::layout::RIG;
use super::mesh::Mesh;
use super::rig::Rig;
use super::shape::{Shape, ShapeTrust};
use super::weights::Weights;
use crate::frame::WorldFromSensor;

const CHANNELS: usize = 8;
const NOISE_M: f64 = 0.01;
const SPAN_NS: (i64, i64) = (0, 1_000_000_000);

/// A blade of 60 m with elliptic sections and stiffness that falls to the tip.
pub fn design() -> Design {
    let s_m: Vec<f64> = (0..=12).map(|i| 5.0 * f64::from(i)).collect();
    let along = |of: &dyn Fn(f64) -> f64| s_m.iter().map(|s| of(s / 60.0)).collect::<Vec<f64>>();
    let stations = Stations {
        chord_m: along(&|x| 4.0 - 3.4 * x),
        twist_rad: along(&|x| 0.1 * (1.0 - x)),
        prebend_m: along(&|x| 1.5 * x * x),
        axis_fraction: along(&|_| 0.35),
        ei_edge_nm2: along(&|x| 2e10 * (-7.0 * x).exp()),
        ei_flap_nm2: along(&|x| 1e10 * (-7.0 * x).exp()),
        gj_nm2: along(&|x| 2e9 * (-6.0 * x).exp()),
        s_m: s_m.clone(),
    };
    let point = |k: i32| {
        let angle = std::f64::consts::TAU * f64::from(k) / 40.0;
        [0.5 - 0.5 * angle.cos(), 0.1 * angle.sin()]
    };
    let outline: Vec<[f64; 2]> = (0..40).map(point).collect();
    let outlines = Outlines {
        s_m: vec![0.0, 60.0],
        points: vec![outline.clone(), outline],
    };
    Design::new(stations, outlines, &-Vector3::x(), &Vector3::y()).unwrap()
}

/// Even noise of unit deviation, the same in every run.
fn noise(place: usize) -> f64 {
    let uniform = |seed: f64| (seed.sin() * 43_758.547).rem_euclid(1.0);
    (0..12)
        .map(|k| uniform((12 * place + k) as f64 + 0.37))
        .sum::<f64>()
        - 6.0
}

/// An adjustment at its start whose echoes come from that very state, `shift_m` too far away.
pub fn adjustment(shift_m: f64) -> Adjustment {
    trusted(shift_m, Trust::default(), ShapeTrust::default())
}

/// The same where no drawing tells stiffness, prebend and surface.
pub fn undrawn() -> Adjustment {
    let trust = Trust {
        span_modes: 8,
        stiffness: 0.3,
        prebend: 0.8,
        free_rad_m: 3e-4,
        ..Trust::default()
    };
    let shape = ShapeTrust {
        chord: 0.2,
        chord_waves: 0.2,
        tip: 2.0,
        form: 0.7,
        waves_m: 0.006,
        slow_knot_m: 2.0,
        wave_knot_m: 2.0,
        ..ShapeTrust::default()
    };
    trusted(0.0, trust, shape)
}

fn trusted(shift_m: f64, trust: Trust, shape: ShapeTrust) -> Adjustment {
    let mesh = Mesh::new(&design(), &[20.0, 40.0]);
    let saddles = vec![mesh.node_at(20.0), mesh.node_at(40.0)];
    let force_n = vec![Vector3::x() * 3e4; 2];
    let hold = Hold {
        seen: Arc::default(),
        span_ns: SPAN_NS,
        loading: Loading {
            force_n: force_n.clone(),
            full_n: 6e4,
        },
    };
    let problem = Problem {
        shape: Shape::new(&mesh, shape, 35.0),
        trust,
        full_n: force_n,
        holds: vec![hold],
        saddles,
        mesh,
    };
    let size = RIG + CHANNELS;
    let turn = Rotation3::from_matrix_unchecked(Matrix3::new(
        -1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0,
    ));
    let pose = WorldFromSensor::new(turn, Vector3::new(2.0, -7.0, 48.0));
    let rig = Rig::new(
        vec![pose],
        vec![CHANNELS],
        vec![1e-3],
        DVector::zeros(size),
        DMatrix::identity(size, size) * 1e-6,
    );
    let weights = Weights {
        noise_m: vec![NOISE_M],
        surface_m: 0.0,
        edge_rad: 1e-4,
        echoes: 100_000,
        common: Vec::new(),
        learned: 0,
    };
    let mut adjustment = Adjustment::new(problem, rig.unwrap(), weights).unwrap();
    adjustment.problem.holds[0].seen = Arc::new(look(&adjustment, shift_m));
    adjustment
}

/// Rays of the lidar about the blade, evenly spread.
pub fn directions() -> impl Iterator<Item = Vector3<f64>> {
    (0..2000).map(|k| {
        let even = |step: f64| (f64::from(k) * step).fract() - 0.5;
        Vector3::new(5.0 * even(0.618_034), 8.0, 16.0 * even(0.754_878)).normalize()
    })
}

/// What the lidar sees of the present state, through lines whose phase wanders.
fn look(adjustment: &Adjustment, shift_m: f64) -> Seen {
    let (mesh, posed, lidar) = (
        &adjustment.problem.mesh,
        adjustment.posed(0),
        adjustment.rig.lidar(0),
    );
    let mut seen = Seen::default();
    let mut count = 0;
    for sweep in 0..8 {
        for ring in 0..CHANNELS {
            let elevation = (ring as f64 - 3.5) * 0.05;
            let mut line = Vec::new();
            for shot in 0..400 {
                let phase = 0.618 * (sweep * CHANNELS + ring) as f64;
                let azimuth = 0.0035 * (f64::from(shot) - 200.0 + phase.fract())
                    - std::f64::consts::FRAC_PI_2;
                let (sin, cos) = azimuth.sin_cos();
                let sensor = Vector3::new(
                    cos * elevation.cos(),
                    sin * elevation.cos(),
                    elevation.sin(),
                );
                let direction = lidar.direction(&sensor);
                let time_ns =
                    sweep as i64 * 100_000_000 + i64::from(shot) * 55_000 + ring as i64 * 1_000;
                let blade = posed.at(time_ns);
                let start = blade.nearest_s_m(mesh, &lidar.origin, &direction);
                if let Some(hit) = blade.hit(mesh, &lidar.origin, &direction, start) {
                    count += 1;
                    let range = hit.range_m + shift_m + NOISE_M * noise(count);
                    line.push(LineEcho {
                        time_ns,
                        xyz_m: sensor * range,
                    });
                }
            }
            if line.len() > 1 {
                add_line(&mut seen, 0, ring, &line, 55_000.0, |_, _| false);
            }
        }
    }
    seen
}
