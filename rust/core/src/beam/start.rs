//! Loads that bend the drawing as far as a prediction says.

use nalgebra::{DMatrix, DVector, Vector3};

use super::axis::Axis;
use super::equilibrium::Physics;
use super::family::{self, Equilibrium, Kind, Unknown};
use super::mesh::Mesh;

/// Relative standard deviation of a load at one saddle about the even spread.
const SPREAD: f64 = 0.15;
/// Relative standard deviation of a prediction.
const PREDICTED: f64 = 0.03;

/// Forces at the saddles, newtons along `direction`, for which the sections at `s_m` move by
/// `deflection_m`; `None` where no load does.
pub fn forces_for(
    mesh: &Mesh,
    saddles: &[usize],
    direction: &Vector3<f64>,
    s_m: &[f64],
    deflection_m: &[f64],
) -> Option<Vec<f64>> {
    let unloaded = Physics::unloaded(mesh, saddles);
    let rest = unloaded.solve(mesh, &mesh.free)?;
    let far = (0..s_m.len()).max_by(|a, b| deflection_m[*a].total_cmp(&deflection_m[*b]))?;
    let (mut axis, even) = even_force(
        mesh,
        &unloaded,
        &rest,
        direction,
        (s_m[far], deflection_m[far]),
    )?;
    let mut forces = vec![even; saddles.len()];
    for _ in 0..4 {
        let change = spread(
            mesh,
            &rest,
            &axis,
            (&forces, even, direction),
            &unloaded,
            (s_m, deflection_m),
        )?;
        forces
            .iter_mut()
            .zip(change.iter())
            .for_each(|(force, step)| *force += step);
        axis = loaded(&unloaded, &forces, direction).solve(mesh, &axis.curvature)?;
    }
    Some(forces)
}

fn loaded(unloaded: &Physics, forces: &[f64], direction: &Vector3<f64>) -> Physics {
    let mut physics = unloaded.clone();
    for (place, force) in physics.forces.iter_mut().zip(forces) {
        place.1 = direction * *force;
    }
    physics
}

fn moved(mesh: &Mesh, rest: &Axis, axis: &Axis, s_m: f64) -> Vector3<f64> {
    let node = mesh.node_at(s_m);
    axis.place[node] - rest.place[node]
}

/// One force for all saddles, from little to enough.
fn even_force(
    mesh: &Mesh,
    unloaded: &Physics,
    rest: &Axis,
    direction: &Vector3<f64>,
    (s_m, wanted_m): (f64, f64),
) -> Option<(Axis, f64)> {
    let saddles = unloaded.forces.len();
    let mut axis = rest.clone();
    let mut force = 1e3;
    for _ in 0..60 {
        let next =
            loaded(unloaded, &vec![force; saddles], direction).solve(mesh, &axis.curvature)?;
        let reached = moved(mesh, rest, &next, s_m).norm();
        axis = next;
        if (reached / wanted_m - 1.0).abs() < 1e-3 {
            return Some((axis, force));
        }
        // Deflection grows a little less than the load does.
        force *= (wanted_m / reached.max(1e-6)).clamp(0.5, 1.6);
    }
    Some((axis, force))
}

/// Change of the forces towards the predicted deflections, held near the even spread.
fn spread(
    mesh: &Mesh,
    rest: &Axis,
    axis: &Axis,
    (forces, even, direction): (&[f64], f64, &Vector3<f64>),
    unloaded: &Physics,
    (s_m, deflection_m): (&[f64], &[f64]),
) -> Option<DVector<f64>> {
    let physics = loaded(unloaded, forces, direction);
    let (sections, count) = (s_m.len(), forces.len());
    let mut matrix = DMatrix::<f64>::zeros(count, count);
    let mut right = DVector::<f64>::zeros(count);
    for i in 0..count {
        let tight = (SPREAD * even).powi(-2);
        matrix[(i, i)] += tight;
        right[i] += tight * (even - forces[i]);
    }
    let equilibrium = Equilibrium::new(mesh, &physics, axis)?;
    let mut slopes = DMatrix::<f64>::zeros(sections, count);
    for saddle in 0..count {
        for axis_number in 0..3 {
            let kind = Kind::Force {
                saddle,
                axis: axis_number,
            };
            let unknown = Unknown {
                kind,
                sigma: SPREAD * even,
            };
            let field = &family::fields(mesh, axis, &[equilibrium.response(&unknown)])[0];
            for (row, s) in s_m.iter().enumerate() {
                let way = moved(mesh, rest, axis, *s).normalize();
                let slope = way.dot(&field.place[mesh.node_at(*s)]) / unknown.sigma;
                slopes[(row, saddle)] += slope * direction[axis_number];
            }
        }
    }
    for (row, s) in s_m.iter().enumerate() {
        let miss = deflection_m[row] - moved(mesh, rest, axis, *s).norm();
        let weight = (PREDICTED * deflection_m[row]).powi(-2);
        let slope = slopes.row(row).transpose();
        matrix += &slope * slope.transpose() * weight;
        right += slope * (miss * weight);
    }
    matrix.cholesky().map(|factor| factor.solve(&right))
}
