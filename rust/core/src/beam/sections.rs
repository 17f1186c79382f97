//! Where the material sections of a hold are, how they are twisted, and how well that is known.

use nalgebra::{DMatrix, Rotation3, Vector3};
use rayon::prelude::*;

use super::adjust::Adjustment;
use super::mesh::Mesh;
use super::posed::Posed;
use super::sight::{Contact, Section};

/// Sections of all holds with one covariance.
#[derive(Debug, Clone)]
pub struct Sections {
    /// By hold and section: x, y, z of the mid-chord point, metres, averaged over the hold, and the
    /// twist change since the first hold, rad.
    pub values: Vec<[f64; 4]>,
    /// Joint covariance of all values in that order.
    pub covariance: DMatrix<f64>,
}

/// Sections in the first hold.
#[derive(Debug, Clone)]
pub struct Rests {
    /// Arc lengths, metres.
    pub s_m: Vec<f64>,
    pub(super) posed: Posed,
    pub(super) places: Vec<Place>,
}

impl Rests {
    /// The first `count` of the sections.
    pub(super) fn first(&self, count: usize) -> Self {
        Self {
            s_m: self.s_m[..count].to_vec(),
            posed: self.posed.clone(),
            places: self.places[..count].to_vec(),
        }
    }
}

/// One section of one state.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub(super) contact: Contact,
    chord: Vector3<f64>,
    pub(super) point: Vector3<f64>,
    sway: Vec<(usize, f64)>,
}

impl Adjustment {
    /// The sections at `s_m` of all holds, and how all unknowns move them: columns in the order of the
    /// values.
    pub(super) fn section_rows(&self, rests: &Rests) -> (Vec<[f64; 4]>, DMatrix<f64>) {
        let holds = (0..self.problem.holds.len()).into_par_iter();
        let found: Vec<_> = holds.map(|hold| self.hold_rows(rests, hold)).collect();
        let (values, rows): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        let count = 4 * values.iter().map(Vec::len).sum::<usize>();
        let columns: Vec<Vec<f64>> = rows.into_iter().map(|of| of.data.into()).collect();
        let rows = DMatrix::from_vec(self.layout.len(), count, columns.concat());
        (values.concat(), rows)
    }

    fn hold_rows(&self, rests: &Rests, hold: usize) -> (Vec<[f64; 4]>, DMatrix<f64>) {
        let posed = self.posed(hold);
        let mut values = Vec::with_capacity(rests.s_m.len());
        let mut rows = DMatrix::zeros(self.layout.len(), 4 * rests.s_m.len());
        for (s_m, rest) in rests.s_m.iter().zip(&rests.places) {
            let (at, first) = (self.place_at(&posed, hold, *s_m, None), 4 * values.len());
            values.push(self.fill_state(&mut rows, first, &posed, hold, &at, rest));
            self.fill_rest(&mut rows, first + 3, &rests.posed, rest, &at);
        }
        (values, rows)
    }

    /// The sections at `s_m` in the first hold.
    pub(super) fn rests(&self, s_m: &[f64]) -> Rests {
        let posed = self.posed(0);
        Rests {
            s_m: s_m.to_vec(),
            places: s_m
                .iter()
                .map(|s| self.place_at(&posed, 0, *s, None))
                .collect(),
            posed,
        }
    }

    /// How the first hold's unknowns move the twist of a section since then.
    pub(super) fn fill_rest(
        &self,
        rows: &mut DMatrix<f64>,
        column: usize,
        posed: &Posed,
        rest: &Place,
        at: &Place,
    ) {
        let slopes = twist_slopes(&self.problem.mesh, rest, at);
        self.fill(
            rows,
            column,
            (posed, 0),
            rest,
            &Vector3::zeros(),
            &slopes[0],
        );
    }

    /// Position and twist of a section of a hold, with their slopes in four columns from `first`.
    pub(super) fn fill_state(
        &self,
        rows: &mut DMatrix<f64>,
        first: usize,
        posed: &Posed,
        hold: usize,
        at: &Place,
        rest: &Place,
    ) -> [f64; 4] {
        for axis in 0..3 {
            let along = Vector3::ith(axis, 1.0);
            self.fill(
                rows,
                first + axis,
                (posed, hold),
                at,
                &along,
                &Vector3::zeros(),
            );
        }
        let slopes = twist_slopes(&self.problem.mesh, rest, at);
        self.fill(
            rows,
            first + 3,
            (posed, hold),
            at,
            &Vector3::zeros(),
            &slopes[1],
        );
        self.state_of(at, rest)
    }

    /// Position and twist of a section.
    pub(super) fn state_of(&self, at: &Place, rest: &Place) -> [f64; 4] {
        let still = [Vector3::zeros(); 2];
        let twist = twist(&self.problem.mesh, rest, at, &still);
        [at.point.x, at.point.y, at.point.z, twist]
    }

    /// A section of a hold at an instant, or averaged over the hold.
    pub(super) fn place_at(
        &self,
        blade: &Posed,
        hold: usize,
        s_m: f64,
        time_ns: Option<i64>,
    ) -> Place {
        let mesh = &self.problem.mesh;
        let section = match time_ns {
            None => blade.at_rest().section(mesh, s_m),
            Some(time_ns) => blade.at(time_ns).section(mesh, s_m),
        };
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
        let sway = match time_ns {
            None => self.mean_sway(blade, hold),
            Some(time_ns) => {
                let (first, weights) = blade.beat(time_ns);
                (0..4).map(|k| (first + k, weights[k])).collect()
            }
        };
        let mut place = Place {
            point: contact.point,
            chord: section.turn * blend(&mesh.chord).normalize(),
            contact,
            sway,
        };
        if time_ns.is_none() {
            place.point += self.mean_correction((blade, hold), &place);
        }
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

    /// What the sway of the hold's mean adds to the place at rest.
    pub(super) fn mean_correction(&self, of: (&Posed, usize), place: &Place) -> Vector3<f64> {
        let mut rows = DMatrix::zeros(self.layout.len(), 3);
        for axis in 0..3 {
            let along = Vector3::ith(axis, 1.0);
            self.fill(&mut rows, axis, of, place, &along, &Vector3::zeros());
        }
        let sway = self.layout.sway_at(0)..self.layout.clock_at(0);
        let (of_sway, count) = (rows.rows(sway.start, sway.len()), sway.len());
        let values = self.values.rows(sway.start, count);
        Vector3::from_iterator(of_sway.tr_mul(&values).iter().copied())
    }

    /// Adds to a column how all unknowns move a place along `along` and turn it about `turn`.
    pub(super) fn fill(
        &self,
        rows: &mut DMatrix<f64>,
        column: usize,
        (posed, hold): (&Posed, usize),
        place: &Place,
        along: &Vector3<f64>,
        turn: &Vector3<f64>,
    ) {
        let (layout, section) = (&self.layout, &place.contact.section);
        let about = (place.contact.point - section.place).cross(along) + turn;
        let slopes = posed.slopes(section, along, &about);
        for (unknown, slope) in self.state_at(hold).into_iter().zip(slopes) {
            rows[(unknown, column)] += slope;
        }
        for (mode, slope) in posed.sway_slopes(section, along, &about).enumerate() {
            let first = layout.sway_at(hold) + mode * layout.knots[hold];
            for (knot, weight) in &place.sway {
                rows[(first + knot, column)] += slope * weight * self.modes_m[mode];
            }
        }
        let mut shape = Vec::new();
        let problem = &self.problem;
        problem.shape.slopes(
            &problem.mesh,
            &place.contact,
            along,
            layout.shape_at(),
            &mut shape,
        );
        for (unknown, slope) in shape {
            rows[(unknown, column)] += slope;
        }
    }
}

/// Twist change from one state to another, positive as in the drawing, once both sections are turned about
/// the world axes.
fn twist(mesh: &Mesh, rest: &Place, now: &Place, turns: &[Vector3<f64>; 2]) -> f64 {
    let [a, b] = turns.map(Rotation3::from_scaled_axis);
    mesh.hand
        * twist_rad(
            &(a * tangent(&rest.contact.section)),
            &(a * rest.chord),
            &(b * tangent(&now.contact.section)),
            &(b * now.chord),
        )
}

/// Slopes of the twist change by rotations of both sections.
fn twist_slopes(mesh: &Mesh, rest: &Place, now: &Place) -> [Vector3<f64>; 2] {
    let (zero, step) = (Vector3::zeros(), 1e-5);
    let slope = |turned: &dyn Fn(Vector3<f64>) -> [Vector3<f64>; 2]| {
        let of = |turn| twist(mesh, rest, now, &turned(turn));
        Vector3::from_fn(|axis, _| {
            let turn = Vector3::ith(axis, step);
            (of(turn) - of(-turn)) / (2.0 * step)
        })
    };
    [slope(&|turn| [turn, zero]), slope(&|turn| [zero, turn])]
}

fn tangent(section: &Section) -> Vector3<f64> {
    section.turn.column(2).normalize()
}

/// Angle about the tangent from the chord at rest, carried by the smallest rotation between both
/// tangents, to the chord now.
pub fn twist_rad(
    rest_tangent: &Vector3<f64>,
    rest_chord: &Vector3<f64>,
    tangent: &Vector3<f64>,
    chord: &Vector3<f64>,
) -> f64 {
    let smallest = Rotation3::rotation_between(rest_tangent, tangent).unwrap_or_default();
    let carried = smallest * rest_chord;
    carried.cross(chord).dot(tangent).atan2(carried.dot(chord))
}
