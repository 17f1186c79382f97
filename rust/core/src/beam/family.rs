//! Which states a blade can have: the unknowns of loads, weight, stiffness and prebend, how well each
//! is known beforehand, and the field by which each moves the blade.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::axis::{Axis, Field};
use super::equilibrium::Physics;
use super::mesh::Mesh;
use super::tangent::Tangent;

/// What an unknown changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// World force at a saddle, newtons.
    Force {
        /// Number of the saddle.
        saddle: usize,
        /// World axis.
        axis: usize,
    },
    /// Moment about the tangent at a saddle, newton metres.
    Couple {
        /// Number of the saddle.
        saddle: usize,
    },
    /// Load, as a share of full load.
    Load,
    /// Weight, relative, as a function along the span.
    Weight(usize),
    /// Compliance: logarithm of the edgewise (0), flapwise (1) and torsional (2) one, or coupling of both
    /// bendings (3); as a function along the span.
    Soft {
        /// Which of the four.
        which: usize,
        /// Number of the function along the span.
        mode: usize,
    },
    /// Stress-free curvature about the section's first or second direction, rad/m.
    Free {
        /// Direction of the section.
        axis: usize,
        /// Number of the function along the span.
        mode: usize,
    },
    /// Prebend, relative.
    Prebend,
    /// Rotation of the root about a world axis, rad.
    Root {
        /// World axis.
        axis: usize,
    },
}

/// One unknown with its standard deviation before any data, in its own unit.
#[derive(Debug, Clone, Copy)]
pub struct Unknown {
    /// What it changes.
    pub kind: Kind,
    /// Standard deviation before the data.
    pub sigma: f64,
}

/// How well a drawing is known beforehand.
#[derive(Debug, Clone, Copy)]
pub struct Trust {
    /// Smooth functions along the span per quantity that is known only roughly: more of them where what a lidar
    /// sees of the outer blade tells little of the inner.
    pub span_modes: usize,
    /// Relative standard deviation of the stiffness as a whole; its waves along the span have 0.6 of it.
    pub stiffness: f64,
    /// The same of the stiffness at the tip, over that.
    pub stiffness_tip: f64,
    /// Relative standard deviation of the weight.
    pub weight: f64,
    /// Relative standard deviation of the prebend.
    pub prebend: f64,
    /// Standard deviation of each function of stress-free curvature, rad/m.
    pub free_rad_m: f64,
    /// Standard deviation of the root's rotation, rad.
    pub root_rad: f64,
    /// Standard deviation of each function of the coupling of both bendings, as a share of the mean of
    /// their stiffnesses.
    pub coupling: f64,
}

impl Default for Trust {
    /// A drawing with stiffness, as designers give it.
    fn default() -> Self {
        Self {
            span_modes: 5,
            stiffness: 0.05,
            stiffness_tip: 1.0,
            weight: 0.5,
            prebend: 0.05,
            free_rad_m: 1.5e-5,
            root_rad: 1e-3,
            coupling: 0.06,
        }
    }
}

/// Number of the compliance that couples both bendings.
const COUPLING: usize = 3;

/// Unknowns that all states of one blade share.
pub fn shared_unknowns(trust: &Trust) -> Vec<Unknown> {
    let mut unknowns = Vec::new();
    let mut add = |kind, sigma| unknowns.push(Unknown { kind, sigma });
    for mode in 0..trust.span_modes {
        let wave = if mode == 0 { 1.0 } else { 0.6 };
        add(Kind::Weight(mode), trust.weight * wave);
        for which in 0..3 {
            add(Kind::Soft { which, mode }, trust.stiffness * wave);
        }
        add(
            Kind::Soft {
                which: COUPLING,
                mode,
            },
            trust.coupling,
        );
        for axis in 0..2 {
            add(Kind::Free { axis, mode }, trust.free_rad_m);
        }
    }
    add(Kind::Prebend, trust.prebend);
    unknowns
}

/// Loads as they are thought to be before the data.
#[derive(Debug, Clone)]
pub struct Loading {
    /// Force at each saddle, newtons, world.
    pub force_n: Vec<Vector3<f64>>,
    /// Sum of the forces at full load, newtons.
    pub full_n: f64,
}

/// Share of full load that cables and saddles put on the blade whatever the load channel says.
const IDLE_SHARE: f64 = 0.01;
/// Relative standard deviation of how the load is spread over the saddles.
const SPREAD: f64 = 0.8;
/// Relative standard deviation of what the load has across its direction.
const SIDEWAYS: f64 = 0.4;
/// Lever of a saddle's pull about the axis, metres.
const LEVER_M: f64 = 0.6;

/// Unknowns of one state: its loads, its root, and what the shared ones do not tell.
pub fn hold_unknowns(loading: &Loading, trust: &Trust) -> Vec<Unknown> {
    let mut unknowns = Vec::new();
    let mut add = |kind, sigma| unknowns.push(Unknown { kind, sigma });
    let idle = IDLE_SHARE * loading.full_n;
    for (saddle, force) in loading.force_n.iter().enumerate() {
        let pull = force.norm();
        for axis in 0..3 {
            let along = SPREAD * force[axis].abs();
            let sigma = along.hypot(SIDEWAYS * pull).hypot(idle);
            add(Kind::Force { saddle, axis }, sigma);
        }
        add(Kind::Couple { saddle }, LEVER_M * pull.hypot(idle));
    }
    for axis in 0..3 {
        add(Kind::Root { axis }, trust.root_rad);
    }
    for mode in 0..trust.span_modes {
        for which in 0..3 {
            add(Kind::Soft { which, mode }, 0.1 * trust.stiffness);
        }
    }
    unknowns
}

/// A function along the span, `x` from root to tip in 0 to 1.
fn span_mode(mode: usize, x: f64) -> f64 {
    (PI * mode as f64 * x).cos()
}

/// Physics with `value` of one unknown added, in its own unit.
pub fn add(physics: &mut Physics, mesh: &Mesh, kind: Kind, value: f64) {
    let length = mesh.length_m();
    let wave = |element: usize, mode: usize| {
        span_mode(
            mode,
            0.5 * (mesh.s_m[element] + mesh.s_m[element + 1]) / length,
        )
    };
    let elements = 0..mesh.len() - 1;
    match kind {
        Kind::Force { saddle, axis } => physics.forces[saddle].1[axis] += value,
        Kind::Load => {
            let places = physics.forces.iter_mut().zip(&physics.full);
            places.for_each(|(place, full)| place.1 += full * value);
        }
        Kind::Couple { saddle } => physics.couples_nm[saddle] += value,
        Kind::Weight(mode) => elements.for_each(|e| physics.weight[e] += value * wave(e, mode)),
        Kind::Soft { which, mode } if which == COUPLING => {
            elements.for_each(|e| physics.soft[which][e] += value * wave(e, mode));
        }
        Kind::Soft { which, mode } => {
            elements.for_each(|e| {
                physics.soft[which][e] *= (value * mesh.doubt[e] * wave(e, mode)).exp();
            });
        }
        Kind::Free { axis, mode } => {
            elements.for_each(|e| physics.free[e][axis] += value * wave(e, mode));
        }
        Kind::Prebend => physics.prebend += value,
        Kind::Root { axis } => physics.root_rad[axis] += value,
    }
}

/// Change of curvature by one standard deviation of each unknown, and of the root's rotation.
#[derive(Debug, Clone)]
pub struct Response {
    /// By element, rad/m.
    pub curvature: Vec<Vector3<f64>>,
    /// World, rad.
    pub root_rad: Vector3<f64>,
}

/// Step of the differences, standard deviations: what an unknown does to a fixed shape is nearly linear.
const STEP: f64 = 0.02;

/// An equilibrium that holds, and how it answers to small changes.
#[derive(Debug, Clone)]
pub struct Equilibrium<'a> {
    mesh: &'a Mesh,
    physics: &'a Physics,
    at: &'a Axis,
    tangent: Tangent,
}

impl<'a> Equilibrium<'a> {
    /// At a shape that `physics` gave; `None` where it is none that holds.
    pub fn new(mesh: &'a Mesh, physics: &'a Physics, at: &'a Axis) -> Option<Self> {
        Some(Self {
            mesh,
            physics,
            at,
            tangent: Tangent::of(mesh, physics, at)?,
        })
    }

    /// Response to one standard deviation of an unknown.
    pub fn response(&self, unknown: &Unknown) -> Response {
        let root_rad = match unknown.kind {
            Kind::Root { axis } => Vector3::ith(axis, unknown.sigma),
            _ => Vector3::zeros(),
        };
        Response {
            curvature: self.tangent.answer(&self.asked(unknown), &root_rad),
            root_rad,
        }
    }

    /// What one standard deviation of an unknown asks of the curvatures of a fixed shape, rad/m.
    fn asked(&self, unknown: &Unknown) -> Vec<Vector3<f64>> {
        let side = |step: f64| {
            let mut physics = self.physics.clone();
            add(&mut physics, self.mesh, unknown.kind, step * unknown.sigma);
            physics.curvatures(self.mesh, self.at)
        };
        let (ahead, behind) = (side(STEP), side(-STEP));
        let slope = |(a, b): (&Vector3<f64>, &Vector3<f64>)| (a - b) / (2.0 * STEP);
        ahead.iter().zip(&behind).map(slope).collect()
    }
}

/// What each response moves at a shape.
pub fn fields(mesh: &Mesh, at: &Axis, responses: &[Response]) -> Vec<Field> {
    let field = |r: &Response| at.field(&mesh.s_m, &r.curvature, &r.root_rad);
    responses.iter().map(field).collect()
}

/// Curvatures of the sway: the blade under the inertia of its first two modes in x and in y, scaled
/// to one metre at the tip.
pub fn sway_responses(mesh: &Mesh, at: &Axis) -> Vec<Response> {
    let mut responses = Vec::new();
    for order in [1, 2] {
        for axis in [0, 1] {
            responses.push(sway_response(mesh, at, order, &Vector3::ith(axis, 1.0)));
        }
    }
    responses
}

fn sway_shape(order: usize, x: f64) -> f64 {
    if order == 1 {
        x * x
    } else {
        x * x * (4.0 * x - 3.0)
    }
}

fn sway_response(mesh: &Mesh, at: &Axis, order: usize, direction: &Vector3<f64>) -> Response {
    let (mut force, mut about) = (Vector3::zeros(), Vector3::<f64>::zeros());
    let mut curvature = vec![Vector3::zeros(); mesh.len() - 1];
    for e in (0..mesh.len() - 1).rev() {
        let x = 0.5 * (mesh.s_m[e] + mesh.s_m[e + 1]) / mesh.length_m();
        let middle = 0.5 * (at.place[e] + at.place[e + 1]);
        let inertia = direction * (mesh.mass_kg_m[e] * mesh.step_m(e) * sway_shape(order, x));
        force += inertia;
        about += middle.cross(&inertia);
        let turn = 0.5 * (at.turn[e] + at.turn[e + 1]);
        let moment = turn.tr_mul(&(about - middle.cross(&force)));
        let [edge, flap, torsion, _] = &mesh.compliance[e];
        curvature[e] = (edge + flap + torsion) * moment;
    }
    let still = Vector3::zeros();
    let tip = at.field(&mesh.s_m, &curvature, &still).place[mesh.len() - 1];
    curvature.iter_mut().for_each(|bend| *bend /= tip.norm());
    Response {
        curvature,
        root_rad: still,
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample;
    use super::*;

    fn bent() -> (Mesh, Physics, Axis) {
        let mesh = Mesh::new(&sample::design(), &[20.0, 40.0]);
        let saddles = [mesh.node_at(20.0), mesh.node_at(40.0)];
        let mut physics = Physics::unloaded(&mesh, &saddles);
        for (place, couple) in physics.forces.iter_mut().zip(&mut physics.couples_nm) {
            place.1 = Vector3::new(2e6, 2e5, -1e5);
            *couple = 2e4;
        }
        let axis = physics.solve(&mesh, &mesh.free).unwrap();
        (mesh, physics, axis)
    }

    #[test]
    fn stiffness_may_be_known_less_towards_the_tip() {
        let (mesh, physics, _) = bent();
        let mesh = mesh.doubted(3.0);
        let mut softer = physics.clone();
        let flap = Kind::Soft { which: 1, mode: 0 };
        add(&mut softer, &mesh, flap, 0.1);
        let change = |e: usize| (softer.soft[1][e] / physics.soft[1][e]).ln();
        assert!((change(0) - 0.1).abs() < 1e-6);
        assert!((change(mesh.len() - 2) - 0.3).abs() < 0.02);
    }

    #[test]
    fn responses_are_those_of_neighbouring_equilibria() {
        let (mesh, physics, at) = bent();
        let tip = mesh.len() - 1;
        assert!(at.place[tip].xy().norm() > 0.3 * mesh.length_m());
        let unknowns = [
            shared_unknowns(&Trust::default()),
            vec![
                Unknown {
                    kind: Kind::Force { saddle: 0, axis: 0 },
                    sigma: 1e4,
                },
                Unknown {
                    kind: Kind::Force { saddle: 1, axis: 2 },
                    sigma: 1e4,
                },
                Unknown {
                    kind: Kind::Couple { saddle: 1 },
                    sigma: 1e4,
                },
                Unknown {
                    kind: Kind::Root { axis: 0 },
                    sigma: 1e-3,
                },
                Unknown {
                    kind: Kind::Root { axis: 2 },
                    sigma: 1e-3,
                },
            ],
        ]
        .concat();
        let equilibrium = Equilibrium::new(&mesh, &physics, &at).unwrap();
        let responses: Vec<_> = unknowns.iter().map(|u| equilibrium.response(u)).collect();
        let fields = fields(&mesh, &at, &responses);
        for (unknown, field) in unknowns.iter().zip(&fields) {
            let side = |step: f64| {
                let mut physics = physics.clone();
                add(&mut physics, &mesh, unknown.kind, step * unknown.sigma);
                physics.solve(&mesh, &at.curvature).unwrap().place
            };
            let slopes: Vec<_> = side(0.05)
                .iter()
                .zip(&side(-0.05))
                .map(|(a, b)| (a - b) / 0.1)
                .collect();
            let size = slopes.iter().map(Vector3::norm).fold(0.0, f64::max);
            let errors = slopes
                .iter()
                .zip(&field.place)
                .map(|(slope, found)| (slope - found).norm());
            let error = errors.fold(0.0, f64::max);
            // The sweep takes each element, bent by 0.03 rad, for straight: torsion, a small difference of
            // large moments, feels that most.
            assert!(error < 1e-2 * size, "{unknown:?}: off by {error} of {size}");
        }
    }
}
