//! Ends of scan lines as rows: the silhouette in the plane of a line lies between its last hit and its first miss.

use std::sync::Arc;

use nalgebra::Vector3;

use super::{FLAT_COSINE, Rows, arc_m, some_edges};
use crate::beam::adjust::{Adjustment, EDGE_OFFSET_RAD, EDGE_RAD, Gates, Stage};
use crate::beam::echoes::Edge;
use crate::beam::posed::Posed;
use crate::beam::rig::Lidar;
use crate::beam::silhouette::{ScanPlane, Silhouette};
use crate::beam::sums::Part;
use crate::beam::weights::{EdgeMet, faded, robust};

/// Edges beside facets seen at a grazing angle over so much are soft, metres across: they count less, and from
/// the second one on not at all.
const SOFT_M: (f64, f64) = (0.008, 0.016);

/// What silhouettes of a hold are found by, whatever becomes of its rows meanwhile.
struct Finder<'a> {
    adjustment: &'a Adjustment,
    lidars: &'a [Lidar],
    posed: Arc<Posed>,
    shifts_ns: Vec<i64>,
}

/// The end of a scan line, and the silhouette in its plane where there is one.
struct End<'a> {
    edge: &'a Edge,
    time_ns: i64,
    step_rad: f64,
    plane: ScanPlane,
    silhouette: Option<Silhouette>,
}

impl<'a> Finder<'a> {
    /// Each is looked for where the last one was.
    fn all(&self, edges: impl Iterator<Item = &'a Edge>) -> Vec<End<'a>> {
        let mut last_m = None;
        let find = |edge| {
            let end = self.end(edge, last_m);
            if let Some(silhouette) = &end.silhouette {
                last_m = Some(arc_m(&self.adjustment.problem.mesh, &silhouette.contact));
            }
            end
        };
        edges.map(find).collect()
    }

    fn end(&self, edge: &'a Edge, last_m: Option<f64>) -> End<'a> {
        let lidar = &self.lidars[edge.lidar];
        let hit = lidar.direction(&edge.hit);
        let miss = lidar.direction(&edge.miss);
        let plane = ScanPlane {
            origin: lidar.origin,
            ahead: hit,
            aside: (miss - hit * hit.dot(&miss)).normalize(),
        };
        let mesh = &self.adjustment.problem.mesh;
        let time_ns = edge.time_ns + self.shifts_ns[edge.lidar];
        let blade = self.posed.at(time_ns);
        let near = |s_m: f64| blade.silhouette(mesh, &plane, s_m);
        let known = last_m.and_then(near);
        End {
            silhouette: known.or_else(|| near(blade.nearest_s_m(mesh, &plane.origin, &hit))),
            step_rad: hit.cross(&miss).norm().asin(),
            edge,
            time_ns,
            plane,
        }
    }
}

impl<'a> Rows<'a> {
    /// Takes echoes, and behind them at most so many edges, evenly: the silhouettes are looked for meanwhile.
    pub(in crate::beam) fn take(&mut self, echoes: impl FnOnce(&mut Self) + Send, most: usize) {
        let finder = Finder {
            adjustment: self.adjustment,
            lidars: self.lidars,
            posed: Arc::clone(&self.posed),
            shifts_ns: self.shifts_ns.clone(),
        };
        let edges = &finder.adjustment.problem.holds[self.hold].seen.edges;
        let ((), ends) = rayon::join(|| echoes(self), || finder.all(some_edges(edges, most)));
        ends.iter().for_each(|end| self.add_end(end));
    }

    /// The rows of the edges alone.
    pub(in crate::beam) fn of_edges(mut self) -> Part {
        self.take(|_| (), usize::MAX);
        self.finish().0
    }

    /// Adds the end of a scan line: the silhouette lies between its last hit and its first miss.
    fn add_end(&mut self, end: &End<'_>) {
        match &end.silhouette {
            Some(silhouette) => self.add_silhouette(end, silhouette),
            None => self.tally.edges_left_out[1] += 1,
        }
    }

    fn add_silhouette(&mut self, end: &End<'_>, silhouette: &Silhouette) {
        let (edge, step_rad) = (end.edge, end.step_rad);
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
        let along = across(&end.plane, silhouette);
        let moves = self.fill_row(&silhouette.contact, &along, edge.lidar, end.time_ns);
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
