//! Where the material sections of a hold are, how they are twisted, and how well that is known.

use nalgebra::{DMatrix, Rotation3, Vector3};

use super::adjust::{Adjustment, Gates, sway_m};
use super::mesh::Mesh;
use super::posed::Posed;
use super::sight::{Contact, Section};
use crate::error::BeamError;

/// Sections of all holds with one covariance.
#[derive(Debug, Clone)]
pub struct Sections {
    /// By hold and section: x, y, z of the mid-chord point, metres, averaged over the hold, and the
    /// twist change since the first hold, rad.
    pub values: Vec<[f64; 4]>,
    /// Joint covariance of all values in that order.
    pub covariance: DMatrix<f64>,
}

/// One section of one hold.
struct Place {
    contact: Contact,
    chord: Vector3<f64>,
    point: Vector3<f64>,
    sway: Vec<(usize, f64)>,
}

impl Adjustment {
    /// The sections at `s_m` of all holds.
    ///
    /// # Errors
    /// [`BeamError::Singular`].
    pub fn sections(&self, s_m: &[f64], gates: &Gates) -> Result<Sections, BeamError> {
        let posed: Vec<Posed> = (0..self.problem.holds.len()).map(|hold| self.posed(hold)).collect();
        let count = posed.len() * s_m.len();
        let mut values = Vec::with_capacity(count);
        let mut rows = DMatrix::zeros(self.layout.len(), 4 * count);
        for hold in 0..posed.len() {
            for (i, s) in s_m.iter().enumerate() {
                let (at, rest) = (self.place(&posed, hold, *s), self.place(&posed, 0, *s));
                let first = 4 * (hold * s_m.len() + i);
                for axis in 0..3 {
                    let along = Vector3::ith(axis, 1.0);
                    self.fill(&mut rows, first + axis, &posed, hold, &at, &along, &Vector3::zeros());
                }
                let (twist, slopes) = twist(&self.problem.mesh, &rest, &at);
                for (which, place, slope) in [(0, &rest, slopes[0]), (hold, &at, slopes[1])] {
                    self.fill(&mut rows, first + 3, &posed, which, place, &Vector3::zeros(), &slope);
                }
                values.push([at.point.x, at.point.y, at.point.z, twist]);
            }
        }
        let (_, factor) = self.normal(gates).0.solve().ok_or(BeamError::Singular)?;
        let covariance = rows.tr_mul(&factor.solve(&rows));
        Ok(Sections { values, covariance })
    }

    fn place(&self, posed: &[Posed], hold: usize, s_m: f64) -> Place {
        let (mesh, blade) = (&self.problem.mesh, &posed[hold]);
        let section = blade.at_rest().section(mesh, s_m);
        let blend = |column: &[Vector3<f64>]| {
            column[section.node] * (1.0 - section.share) + column[section.node + 1] * section.share
        };
        let local = blend(&mesh.middle);
        let contact = Contact {
            local,
            point: section.place + section.turn * local,
            x_c: 0.5,
            vertex: 0,
            normal: Vector3::zeros(),
            section,
        };
        let mut place = Place {
            point: contact.point,
            chord: section.turn * blend(&mesh.chord).normalize(),
            contact,
            sway: self.mean_sway(blade, hold),
        };
        place.point += self.correction(posed, hold, &place);
        place
    }

    /// Mean of the sway over a hold: its unknowns and their weights per metre at the tip.
    fn mean_sway(&self, blade: &Posed, hold: usize) -> Vec<(usize, f64)> {
        let span = self.problem.holds[hold].span_ns;
        let instants = 200;
        let mut weights = vec![0.0; blade.knots()];
        for i in 0..instants {
            let time_ns = span.0 + (span.1 - span.0) * (2 * i + 1) / (2 * instants);
            let (first, parts) = blade.beat(time_ns);
            (0..4).for_each(|k| weights[first + k] += parts[k] / instants as f64);
        }
        weights.into_iter().enumerate().collect()
    }

    /// What sway and surface unknowns add to the point of the drawing.
    fn correction(&self, posed: &[Posed], hold: usize, place: &Place) -> Vector3<f64> {
        let mut rows = DMatrix::zeros(self.layout.len(), 3);
        for axis in 0..3 {
            let along = Vector3::ith(axis, 1.0);
            self.fill(&mut rows, axis, posed, hold, place, &along, &Vector3::zeros());
        }
        let mut values = self.values.clone();
        values.rows_mut(0, self.layout.sway_at(0)).fill(0.0);
        Vector3::from_iterator(rows.tr_mul(&values).iter().copied())
    }

    #[allow(clippy::too_many_arguments)] // one row of one place
    fn fill(
        &self,
        rows: &mut DMatrix<f64>,
        column: usize,
        posed: &[Posed],
        hold: usize,
        place: &Place,
        along: &Vector3<f64>,
        turn: &Vector3<f64>,
    ) {
        let (layout, section) = (&self.layout, &place.contact.section);
        let about = (place.contact.point - section.place).cross(along) + turn;
        let slopes = posed[hold].slopes(section, along, &about);
        for (unknown, slope) in self.state_at(hold).into_iter().zip(slopes) {
            rows[(unknown, column)] += slope;
        }
        for (mode, slope) in posed[hold].sway_slopes(section, along, &about).enumerate() {
            let first = layout.sway_at(hold) + mode * layout.knots[hold];
            for (knot, weight) in &place.sway {
                rows[(first + knot, column)] += slope * weight * sway_m(mode);
            }
        }
        let mut shape = Vec::new();
        let problem = &self.problem;
        problem.shape.slopes(&problem.mesh, &place.contact, along, layout.shape_at(), &mut shape);
        for (unknown, slope) in shape {
            rows[(unknown, column)] += slope;
        }
    }
}

/// Twist change from one state to another, positive as in the drawing, and its slopes by rotations of
/// both sections about the world axes.
fn twist(mesh: &Mesh, rest: &Place, now: &Place) -> (f64, [Vector3<f64>; 2]) {
    let of = |rest_turn: &Vector3<f64>, turn: &Vector3<f64>| {
        let (a, b) = (Rotation3::from_scaled_axis(*rest_turn), Rotation3::from_scaled_axis(*turn));
        mesh.hand * twist_rad(
            &(a * tangent(&rest.contact.section)),
            &(a * rest.chord),
            &(b * tangent(&now.contact.section)),
            &(b * now.chord),
        )
    };
    let zero = Vector3::zeros();
    let step = 1e-5;
    let slope = |of: &dyn Fn(&Vector3<f64>) -> f64| {
        Vector3::from_fn(|axis, _| {
            let turn = Vector3::ith(axis, step);
            (of(&turn) - of(&-turn)) / (2.0 * step)
        })
    };
    let slopes = [slope(&|turn| of(turn, &zero)), slope(&|turn| of(&zero, turn))];
    (of(&zero, &zero), slopes)
}

fn tangent(section: &Section) -> Vector3<f64> {
    section.turn.column(2).normalize()
}

/// Angle about the tangent from the chord at rest, carried by the smallest rotation between both
/// tangents, to the chord now.
pub fn twist_rad(rest_tangent: &Vector3<f64>, rest_chord: &Vector3<f64>, tangent: &Vector3<f64>, chord: &Vector3<f64>) -> f64 {
    let smallest = Rotation3::rotation_between(rest_tangent, tangent).unwrap_or_default();
    let carried = smallest * rest_chord;
    carried.cross(chord).dot(tangent).atan2(carried.dot(chord))
}
