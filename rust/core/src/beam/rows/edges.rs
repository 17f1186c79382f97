//! Ends of scan lines as rows: the silhouette in the plane of a line lies between its last hit and its first miss.

use nalgebra::Vector3;

use super::{FLAT_COSINE, Rows};
use crate::beam::adjust::{EDGE_OFFSET_RAD, EDGE_RAD, Gates, Stage};
use crate::beam::echoes::Edge;
use crate::beam::silhouette::{ScanPlane, Silhouette};
use crate::beam::weights::{EdgeMet, faded, robust};

/// Edges beside facets seen at a grazing angle over so much are soft, metres across: they count less, and from
/// the second one on not at all.
const SOFT_M: (f64, f64) = (0.008, 0.016);

impl Rows<'_> {
    /// Adds the end of a scan line: the silhouette lies between its last hit and its first miss.
    pub(in crate::beam) fn add_edge(&mut self, edge: &Edge) {
        let lidar = &self.lidars[edge.lidar];
        let hit = lidar.direction(&edge.hit);
        let miss = lidar.direction(&edge.miss);
        let step_rad = hit.cross(&miss).norm().asin();
        let plane = ScanPlane {
            origin: lidar.origin,
            ahead: hit,
            aside: (miss - hit * hit.dot(&miss)).normalize(),
        };
        let mesh = &self.adjustment.problem.mesh;
        let time_ns = self.time_ns(edge.lidar, edge.time_ns);
        let blade = self.posed.at(time_ns);
        let near = |s_m: f64| blade.silhouette(mesh, &plane, s_m);
        let known = self.last_edge_m.and_then(near);
        let Some(silhouette) = known.or_else(|| near(blade.nearest_s_m(mesh, &plane.origin, &hit)))
        else {
            self.tally.edges_left_out[1] += 1;
            return;
        };
        self.last_edge_m = Some(self.arc_m(&silhouette.contact));
        self.add_silhouette(edge, time_ns, &plane, &silhouette, step_rad);
    }

    fn add_silhouette(
        &mut self,
        edge: &Edge,
        time_ns: i64,
        plane: &ScanPlane,
        silhouette: &Silhouette,
        step_rad: f64,
    ) {
        let firm = firmness(silhouette, self.gates);
        if firm == 0.0 {
            self.edge_bill.add_faded();
            self.tally.edges_left_out[0] += 1;
            return;
        }
        let layout = &self.adjustment.layout;
        let side = side_of(silhouette.contact.x_c);
        let at = layout.edge_offset_at(self.hold, edge.lidar, side);
        let values = &self.adjustment.values;
        let outside = values[self.places.edge] * EDGE_RAD + values[at] * EDGE_OFFSET_RAD;
        if self.adjustment.muted.contains(&(edge.lidar, side)) {
            self.tally.edges_left_out[2] += 1;
            return;
        }
        let residual = 0.5 * step_rad - silhouette.angle_rad - outside;
        let coarse_rad = self.gates.coarse_m()[1] / silhouette.range_m;
        let weights = &self.adjustment.weights;
        let sigma_rad = weights.edge_rad.hypot(coarse_rad);
        let sigma = (step_rad / 12f64.sqrt()).hypot(sigma_rad);
        let known = weights.common.get(self.hold);
        let grid = known
            .and_then(|common| common.edge_variance(edge.lidar, side, edge.ring))
            .unwrap_or(step_rad * step_rad / 12.0);
        let gate_rad = (self.gates.edge_m / silhouette.range_m).max(4.0 * sigma);
        let depth_m = (edge.range_m - silhouette.range_m).abs();
        let variance = sigma_rad * sigma_rad + grid;
        self.edge_bill
            .add(residual, sigma, gate_rad, variance, firm);
        if self.only_costs {
            return;
        }
        if residual.abs() > gate_rad || depth_m > self.gates.echo_m.max(0.5) {
            self.tally.edges_left_out[2] += 1;
            return;
        }
        self.tally.edges.push(EdgeMet {
            lidar: edge.lidar,
            ring: edge.ring,
            side,
            residual_rad: residual,
            step_rad,
        });
        let weight = robust(residual, sigma, gate_rad) / variance;
        let edge_at = self.places.edge;
        let along = across(plane, silhouette);
        let moves = self.fill_row(&silhouette.contact, &along, edge.lidar, time_ns);
        self.fill_surface(&silhouette.contact, &along);
        self.entries
            .extend([(edge_at, EDGE_RAD), (at, EDGE_OFFSET_RAD)]);
        let row = (&along, moves);
        self.add_row(&silhouette.contact, row, residual, firm * weight);
    }
}

/// By how much a displacement widens the angle of a silhouette, rad/m.
fn across(plane: &ScanPlane, silhouette: &Silhouette) -> Vector3<f64> {
    let to = silhouette.contact.point - plane.origin;
    let range = to.norm();
    let aside = (plane.aside - to * (plane.aside.dot(&to) / (range * range))).normalize();
    let normal = to.cross(&silhouette.slope).normalize();
    normal / (normal.dot(&aside) * range)
}

/// Share of its weight that an edge keeps: less where the surface turns away slowly or is seen edge-on.
fn firmness(silhouette: &Silhouette, gates: &Gates) -> f64 {
    if gates.stage >= Stage::Surface {
        return faded(silhouette.soft_m, SOFT_M) * faded(silhouette.cosine, FLAT_COSINE);
    }
    let coarse_m = gates.coarse_m()[1];
    faded(silhouette.soft_m, (coarse_m, 2.0 * coarse_m))
}

/// 0 at the leading edge, 1 at the trailing edge.
fn side_of(x_c: f64) -> usize {
    usize::from(x_c > 0.5)
}
