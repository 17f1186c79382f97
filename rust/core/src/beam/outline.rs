//! Outlines of material sections as the adjustment has them, with how well each point is known.

use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;

use super::adjust::Adjustment;
use super::few::Few;
use super::mesh::Mesh;
use super::posed::Posed;
use super::sections::Place;
use super::solution::Solution;

impl Adjustment {
    /// By hold, section and point of the outline: x, y, z in metres, averaged over the hold, and the
    /// standard deviation along the outward normal, metres.
    pub fn outlines(&self, s_m: &[f64], solution: &Solution) -> Vec<[f64; 4]> {
        let holds = (0..self.problem.holds.len()).into_par_iter();
        let of = |hold: usize| {
            let posed = self.posed(hold);
            let section = |s: &f64| self.outline(&posed, hold, *s, &solution.covariance);
            s_m.iter().flat_map(section).collect::<Vec<_>>()
        };
        let parts: Vec<Vec<[f64; 4]>> = holds.map(of).collect();
        parts.concat()
    }

    fn outline(
        &self,
        posed: &Posed,
        hold: usize,
        s_m: f64,
        covariance: &DMatrix<f64>,
    ) -> Vec<[f64; 4]> {
        let count = self.problem.mesh.outline[0].len();
        let mut rows = DMatrix::zeros(self.layout.len(), count);
        let middle = self.place_at(posed, hold, s_m, None);
        let mut point = |vertex: usize| {
            let mut place = middle.clone();
            self.put_on(&mut place, posed, hold, vertex);
            self.surface_point(&mut rows, vertex, (posed, hold), &place)
        };
        let points: Vec<Vector3<f64>> = (0..count).map(&mut point).collect();
        let variances = Few::of(&rows, 0, count).variances(covariance);
        let known = points.iter().zip(variances);
        known
            .map(|(p, variance)| [p.x, p.y, p.z, variance.max(0.0).sqrt()])
            .collect()
    }

    /// Moves a place from the middle of the chord to a point of the outline.
    fn put_on(&self, place: &mut Place, posed: &Posed, hold: usize, vertex: usize) {
        let mesh = &self.problem.mesh;
        let section = place.contact.section;
        let at = |k: usize| local(mesh, section.node, section.share, k);
        let count = mesh.outline[0].len();
        let along = at((vertex + 1) % count) - at((vertex + count - 1) % count);
        let mut outward = Vector3::new(along.y, -along.x, 0.0).normalize();
        let middle = (0..count).map(at).sum::<Vector3<f64>>() / count as f64;
        if outward.dot(&(at(vertex) - middle)) < 0.0 {
            outward = -outward;
        }
        let contact = &mut place.contact;
        contact.local = at(vertex);
        contact.point = section.place + section.turn * contact.local;
        contact.x_c = mesh.x_c[section.node][vertex];
        contact.vertex = vertex;
        contact.normal = section.turn * outward;
        place.point = contact.point;
        place.point += self.mean_correction((posed, hold), place);
    }

    /// The point, and its slopes along the normal in a column.
    fn surface_point(
        &self,
        rows: &mut DMatrix<f64>,
        column: usize,
        of: (&Posed, usize),
        place: &Place,
    ) -> Vector3<f64> {
        let normal = place.contact.normal;
        self.fill(rows, column, of, place, &normal, &Vector3::zeros());
        let mut waves = Vec::new();
        let (problem, first) = (&self.problem, self.layout.shape_at());
        let mesh = &problem.mesh;
        problem
            .shape
            .waves(mesh, &place.contact, &normal, first, &mut waves);
        for (unknown, slope) in waves {
            rows[(unknown, column)] += slope;
        }
        place.point
    }
}

/// A point of the outline about the axis, between two nodes, metres.
fn local(mesh: &Mesh, node: usize, share: f64, vertex: usize) -> Vector3<f64> {
    let at = |node: usize| {
        Vector3::new(
            mesh.outline[node][vertex][0],
            mesh.outline[node][vertex][1],
            0.0,
        )
    };
    at(node) * (1.0 - share) + at(node + 1) * share
}

#[cfg(test)]
mod tests {
    use super::super::adjust::{Gates, Stage};
    use super::super::sample;
    use super::*;

    #[test]
    fn an_outline_surrounds_its_section_and_what_is_seen_is_known_best() {
        let adjustment = sample::adjustment(0.0);
        let gates = Gates {
            echo_m: 0.05,
            edge_m: 0.05,
            stage: Stage::All,
        };
        let (s_m, count) = (50.0, adjustment.problem.mesh.outline[0].len());
        let solution = adjustment.solution(&gates).unwrap();
        let points = adjustment.outlines(&[s_m], &solution);
        assert_eq!(points.len(), count);
        let middle = adjustment.knowledge(&[s_m], &solution).0.values[0];
        let off = |p: &[f64; 4]| Vector3::new(p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]);
        // The sample's chord at 50 m is 4 - 3.4 * 50 / 60 = 1.17 m: half of it on both sides.
        let far = points.iter().map(|p| off(p).norm()).fold(0.0, f64::max);
        assert!((far - 0.58).abs() < 0.03, "{far}");
        // The lidar stands below: the lower side is nearer to it.
        let by_height = |a: &&[f64; 4], b: &&[f64; 4]| a[1].total_cmp(&b[1]);
        let lowest = points.iter().min_by(by_height).unwrap();
        let highest = points.iter().max_by(by_height).unwrap();
        assert!(lowest[3] < highest[3], "{lowest:?} {highest:?}");
    }
}
