//! Echoes and edges of one hold as rows of the normal equations.

mod edges;

use std::sync::Arc;

use nalgebra::Vector3;

use super::adjust::{Adjustment, Gates, RANGE_M};
use super::bill::Bill;
use super::common;
use super::echoes::{Echo, Edge};
use super::layout::{Layout, RANGES, RIG};
use super::mesh::Mesh;
use super::posed::{Posed, node_slopes};
use super::rig::Lidar;
use super::sight::{Contact, Hit};
use super::sums::{BOTH, Part, Row, Sums};
use super::weights::{Tally, Used, faded, robust};

/// Echoes nearer to the end of their run than this are mixed with what lies behind.
pub(super) const MIXED_ECHOES: u32 = 2;
/// Rays that meet the surface at a flatter angle count less, and from the second one on not at all,
/// cosine of incidence: an echo that comes and goes with the estimate would never let it settle.
const FLAT_COSINE: (f64, f64) = (0.35, 0.22);

/// So many echoes and edges bring the blade to where all of them can take it in one step: the gate is still wide.
const WIDE: (usize, usize) = (1500, 500);
/// The same of a stretch, of which less is unknown.
const WIDE_STRETCH: (usize, usize) = (600, 250);

/// At most so many echoes, evenly.
pub(super) fn some(all: &[Echo], most: usize) -> impl Iterator<Item = &Echo> {
    let count = most.min(all.len());
    (0..count).map(move |k| &all[k * all.len() / count])
}

/// At most so many edges, evenly; an odd stride, for ends of scan lines come by twos.
pub(super) fn some_edges(all: &[Edge], most: usize) -> impl Iterator<Item = &Edge> {
    all.iter().step_by(all.len().div_ceil(most) | 1)
}

/// Where unknowns stand that every row asks for: sums over holds and lidars, made once.
struct Places {
    sway: usize,
    clock: usize,
    /// By lidar.
    lidars: Vec<usize>,
    shape: usize,
    edge: usize,
    ranges: usize,
    len: usize,
}

impl Places {
    fn of(layout: &Layout, hold: usize) -> Self {
        Self {
            sway: layout.sway_at(hold),
            clock: layout.clock_at(0),
            lidars: (0..layout.channels.len())
                .map(|lidar| layout.lidar_at(lidar))
                .collect(),
            shape: layout.shape_at(),
            edge: layout.edge_at(),
            ranges: layout.range_at(0),
            len: layout.len(),
        }
    }
}

/// Arc length of a contact, metres.
fn arc_m(mesh: &Mesh, contact: &Contact) -> f64 {
    let section = &contact.section;
    mesh.s_m[section.node] + section.share * mesh.step_m(section.node)
}

/// Makes the rows of one hold.
pub struct Rows<'a> {
    pub(super) adjustment: &'a Adjustment,
    pub(super) lidars: &'a [Lidar],
    pub(super) gates: &'a Gates,
    pub(super) hold: usize,
    pub(super) posed: Arc<Posed>,
    sums: Sums,
    entries: Vec<(usize, f64)>,
    places: Places,
    /// By lidar: what its clock is behind, nanoseconds, and the noise of its ranges, metres.
    shifts_ns: Vec<i64>,
    noise_m: Vec<f64>,
    /// Whether single echoes are wanted; nobody asks a stretch before its last step.
    keeps: bool,
    /// Whether it is the cost alone that is wanted.
    pub(super) only_costs: bool,
    pub(super) echo_bill: Bill,
    edge_bill: Bill,
    pub(super) tally: Tally,
}

impl<'a> Rows<'a> {
    /// For a hold as estimated so far.
    pub fn new(
        adjustment: &'a Adjustment,
        hold: usize,
        lidars: &'a [Lidar],
        gates: &'a Gates,
    ) -> Self {
        let is_judged = adjustment.judges(gates);
        Self {
            lidars,
            gates,
            hold,
            posed: Arc::new(adjustment.posed(hold)),
            sums: Sums::new(
                adjustment.problem.mesh.len(),
                adjustment.touched_at(hold),
                &adjustment.asked,
                &adjustment.free,
                &adjustment.waves(),
            ),
            entries: Vec::new(),
            places: Places::of(&adjustment.layout, hold),
            shifts_ns: (0..lidars.len())
                .map(|lidar| (adjustment.clock_s(lidar) * 1e9).round() as i64)
                .collect(),
            noise_m: adjustment
                .weights
                .noise_m
                .iter()
                .map(|noise_m| noise_m.hypot(gates.coarse_m()[0]))
                .collect(),
            echo_bill: Bill::new(is_judged),
            edge_bill: Bill::new(is_judged),
            keeps: gates.is_fine() || !adjustment.follows_load,
            only_costs: false,
            tally: Tally::default(),
            adjustment,
        }
    }

    /// All rows, and what became of the data.
    pub fn collect(mut self) -> (Part, Tally) {
        self.look();
        self.finish()
    }

    /// What the data cost.
    pub(super) fn cost(mut self) -> f64 {
        self.only_costs = true;
        self.look();
        self.charge();
        self.tally.cost
    }

    fn charge(&mut self) {
        self.tally.cost += self.echo_bill.total(self.tally.missed);
        self.tally.cost += self.edge_bill.total(self.tally.edges_left_out[1]);
    }

    fn look(&mut self) {
        if self.gates.is_search() {
            return self.look_near();
        }
        let seen = &self.adjustment.problem.holds[self.hold].seen;
        let (echoes, edges) = self.most();
        if self.keeps {
            self.tally.used.reserve(echoes.min(seen.echoes.len()));
        }
        let take = |rows: &mut Self| {
            let echoes = some(&seen.echoes, echoes);
            echoes.fold(None, |hint, echo| rows.add_echo(echo, hint));
        };
        self.take(take, edges);
    }

    /// How many echoes and how many edges are used: few to come near. Without a drawing steps are held back
    /// against the data, and with few of them the holds would not arrive.
    fn most(&self) -> (usize, usize) {
        let adjustment = self.adjustment;
        let most = adjustment.weights.echoes;
        let is_held_back = adjustment.is_vague() && !adjustment.follows_load;
        let wide = match adjustment.follows_load {
            true => WIDE_STRETCH,
            false => WIDE,
        };
        match self.gates.is_fine() || is_held_back {
            true => (most, usize::MAX),
            false => (most.min(wide.0), wide.1),
        }
    }

    pub(super) fn finish(mut self) -> (Part, Tally) {
        self.charge();
        let asked = &self.adjustment.asked;
        let state = self.adjustment.state_at(self.hold).into_iter().enumerate();
        let (places, unknowns): (Vec<_>, Vec<_>) = state.filter(|(_, i)| asked.contains(i)).unzip();
        (
            self.sums.part(unknowns, &self.posed.moves(&places)),
            self.tally,
        )
    }

    /// Adds one echo; gives the arc length at which it met the blade, for the next one.
    fn add_echo(&mut self, echo: &Echo, hint: Option<f64>) -> Option<f64> {
        let lidar = &self.lidars[echo.lidar];
        let direction = lidar.direction(&echo.direction);
        let time_ns = self.time_ns(echo.lidar, echo.time_ns);
        let Some(hit) = self.hit(&lidar.origin, &direction, time_ns, hint) else {
            self.tally.missed += 1;
            return None;
        };
        let s_m = self.arc_m(&hit.contact);
        let upright = faded(hit.cosine, FLAT_COSINE);
        if echo.from_end < MIXED_ECHOES || upright == 0.0 {
            if upright == 0.0 {
                self.echo_bill.add_faded();
            }
            self.tally.unfit += 1;
            return Some(s_m);
        }
        let misread_m = self.misread_m(echo.lidar, hit.cosine);
        let residual = echo.range_m - lidar.reported_m(hit.range_m, echo.ring) - misread_m;
        let weights = &self.adjustment.weights;
        let noise_m = self.noise_m[echo.lidar];
        let own_m = weights.surface_m / hit.cosine;
        let sigma = (noise_m * noise_m + own_m * own_m).sqrt();
        let point = lidar.origin + direction * (hit.range_m + residual);
        let met = self.met(echo, &hit.contact, residual, point, hit.cosine);
        let variance = self.variance_m2(&met, noise_m);
        let gate_m = self.gates.echo_m.max(4.0 * sigma);
        self.echo_bill
            .add(residual, sigma, gate_m, variance, upright);
        if self.only_costs {
            return Some(s_m);
        }
        if residual.abs() > gate_m {
            if self.keeps {
                self.tally.rejected.push(met);
            }
            return Some(s_m);
        }
        if self.keeps {
            self.tally.used.push(met);
        }
        let weight = robust(residual, sigma, self.gates.echo_m) / variance;
        self.add_hit(echo, &hit, time_ns, residual, upright * weight);
        Some(s_m)
    }

    /// Variance of an echo among those of its patch, by the noise of its range.
    fn variance_m2(&self, met: &Used, noise_m: f64) -> f64 {
        let weights = &self.adjustment.weights;
        let alone = (met.cosine / noise_m).powi(2);
        let factor = match weights.common.get(self.hold) {
            Some(common) => common.echo_factor(met.patch, weights.surface_m, alone),
            None => 1.0 + weights.surface_m * weights.surface_m * alone,
        };
        noise_m * noise_m * factor
    }

    /// An echo as it met the model at a contact.
    pub(super) fn met(
        &self,
        echo: &Echo,
        contact: &Contact,
        residual_m: f64,
        point: Vector3<f64>,
        cosine: f64,
    ) -> Used {
        let s_m = self.arc_m(contact);
        Used {
            time_ns: echo.time_ns,
            lidar: echo.lidar,
            ring: echo.ring,
            s_m,
            residual_m,
            point,
            chord: self.chord(contact),
            cosine,
            patch: self.patch(contact, s_m),
        }
    }

    /// Instant of a shot by the clock that all lidars share, as thought so far.
    pub(super) fn time_ns(&self, lidar: usize, stamp_ns: i64) -> i64 {
        stamp_ns + self.shifts_ns[lidar]
    }

    fn hit(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        time_ns: i64,
        hint: Option<f64>,
    ) -> Option<Hit> {
        let mesh = &self.adjustment.problem.mesh;
        let blade = self.posed.at(time_ns);
        let near = hint.and_then(|s_m| blade.hit(mesh, origin, direction, s_m));
        near.or_else(|| {
            let s_m = blade.nearest_s_m(mesh, origin, direction);
            blade.hit(mesh, origin, direction, s_m)
        })
    }

    fn chord(&self, contact: &Contact) -> f64 {
        if self.adjustment.problem.mesh.is_second_side(contact.vertex) {
            -contact.x_c
        } else {
            contact.x_c
        }
    }

    fn arc_m(&self, contact: &Contact) -> f64 {
        arc_m(&self.adjustment.problem.mesh, contact)
    }

    fn patch(&self, contact: &Contact, s_m: f64) -> usize {
        let is_second_side = self.adjustment.problem.mesh.is_second_side(contact.vertex);
        common::patch(s_m, is_second_side, contact.x_c)
    }

    /// What errors of range add to the prediction.
    fn misread_m(&self, lidar: usize, cosine: f64) -> f64 {
        let first = self.places.ranges + RANGES * lidar;
        let values = &self.adjustment.values;
        let slopes = range_slopes_m(cosine);
        slopes[0] * values[first] + slopes[1] * values[first + 1]
    }

    fn add_hit(&mut self, echo: &Echo, hit: &Hit, time_ns: i64, residual: f64, weight: f64) {
        let along = -hit.contact.normal / hit.cosine;
        let moves = self.fill_row(&hit.contact, &along, echo.lidar, time_ns);
        let layout = &self.adjustment.layout;
        let first = self.places.lidars[echo.lidar];
        self.entries.push((first + 7, -hit.range_m));
        if echo.ring < layout.channels[echo.lidar] {
            self.entries.push((first + RIG + echo.ring, -1.0));
        }
        self.fill_surface(&hit.contact, &along);
        let ranges = self.places.ranges + RANGES * echo.lidar;
        let slopes = range_slopes_m(hit.cosine);
        self.entries
            .extend([(ranges, slopes[0]), (ranges + 1, slopes[1])]);
        self.add_row(&hit.contact, (&along, moves), residual, weight);
    }

    /// Adds a row of which the entries are filled: how it moves with a displacement, and with the nodes.
    pub(super) fn add_row(
        &mut self,
        contact: &Contact,
        (along, moves): (&Vector3<f64>, [f64; BOTH]),
        residual: f64,
        weight: f64,
    ) {
        if self.adjustment.asked.end > self.places.len {
            // A strain is fitted as a check: everything moves away from the root.
            let strain = along.dot(&contact.section.place);
            self.entries.push((self.places.len + self.hold, strain));
        }
        self.sums.add(&Row {
            node: contact.section.node,
            moves,
            others: &self.entries,
            residual,
            weight,
        });
    }

    /// How the surface moves `along . displacement` of a contact, behind what is in `entries`.
    pub(super) fn fill_surface(&mut self, contact: &Contact, along: &Vector3<f64>) {
        let (problem, first) = (&self.adjustment.problem, self.places.shape);
        if self.adjustment.asked.end > first {
            let (mesh, row) = (&problem.mesh, &mut self.entries);
            problem.shape.slopes(mesh, contact, along, first, row);
            problem.shape.waves(mesh, contact, along, first, row);
        }
    }

    /// How the nodes, and unknowns of sway, clock and pose, move `along . displacement` of a contact against
    /// the lidar: the latter in `entries`, which rise by their numbers.
    pub(super) fn fill_row(
        &mut self,
        contact: &Contact,
        along: &Vector3<f64>,
        lidar: usize,
        time_ns: i64,
    ) -> [f64; BOTH] {
        let layout = &self.adjustment.layout;
        let about = (contact.point - contact.section.place).cross(along);
        let row = &mut self.entries;
        row.clear();
        let (knot, weights) = self.posed.beat(time_ns);
        let sway = self.posed.sway_slopes(&contact.section, along, &about);
        for (mode, slope) in sway.enumerate() {
            let first = self.places.sway + mode * layout.knots[self.hold] + knot;
            let parts = weights.iter().enumerate();
            row.extend(
                parts
                    .map(|(k, weight)| (first + k, slope * weight * self.adjustment.modes_m[mode])),
            );
        }
        let velocity_m_s = self.posed.velocity_m_s(contact, time_ns);
        let clock_s = self.adjustment.rig.clock_s[lidar];
        row.push((
            self.places.clock + lidar,
            along.dot(&velocity_m_s) * clock_s,
        ));
        if self.adjustment.asked.end > self.places.lidars[0] {
            self.lidars[lidar].slopes(contact, along, self.places.lidars[lidar], row);
        }
        node_slopes(&contact.section, along, &about)
    }
}

/// How the range errors of a lidar add to its ranges, metres.
fn range_slopes_m(cosine: f64) -> [f64; 2] {
    [RANGE_M[0], RANGE_M[1] * (1.0 / cosine - 1.0)]
}

#[cfg(test)]
mod tests {
    use super::super::adjust::Stage;
    use super::super::sample;
    use super::*;

    const WIDE: Gates = Gates {
        echo_m: 3.0,
        edge_m: 3.0,
        stage: Stage::All,
    };

    #[test]
    fn no_more_data_than_are_wanted_are_taken_from_all_of_them() {
        let adjustment = sample::adjustment(0.0);
        let seen = &adjustment.problem.holds[0].seen;
        let (echoes, edges) = (seen.echoes.len(), seen.edges.len());
        let most = echoes * 2 / 3;
        let taken: Vec<i64> = some(&seen.echoes, most).map(|echo| echo.time_ns).collect();
        assert_eq!(taken.len(), most);
        assert_eq!(
            taken[most / 2],
            seen.echoes[most / 2 * echoes / most].time_ns
        );
        assert_eq!(some(&seen.echoes, echoes + 1).count(), echoes);
        // Every third, for every second would be the ends of one side.
        assert_eq!(
            some_edges(&seen.edges, edges / 2).count(),
            edges.div_ceil(3)
        );
        assert_eq!(some_edges(&seen.edges, usize::MAX).count(), edges);
    }

    #[test]
    fn slopes_of_all_unknowns_are_those_of_the_residuals() {
        let adjustment = sample::adjustment(0.02);
        let unknowns = (0..adjustment.layout.len()).step_by(7);
        expect_slopes(&adjustment, unknowns, 0.02);
    }

    #[test]
    fn so_are_those_of_a_surface_without_a_drawing() {
        let mut adjustment = sample::undrawn();
        let surface = adjustment.layout.shape_at();
        adjustment.shift(surface, 0.05);
        let unknowns = surface..surface + adjustment.problem.shape.waves_from();
        expect_slopes(&adjustment, unknowns, 0.002);
    }

    fn expect_slopes(adjustment: &Adjustment, unknowns: impl Iterator<Item = usize>, step: f64) {
        let ((normal, _), prior) = (adjustment.normal(&WIDE), adjustment.prior(WIDE.stage));
        let cost = |unknown: usize, change: f64| {
            let mut moved = adjustment.clone();
            moved.shift(unknown, change);
            moved.normal(&WIDE).0.cost
        };
        let rig = adjustment.layout.lidar_at(0)..adjustment.layout.shape_at();
        let scale = normal.right.amax();
        for unknown in unknowns {
            // Unknowns of the lidars have units of their own.
            let step = if rig.contains(&unknown) { 1e-5 } else { step };
            let slope = (cost(unknown, step) - cost(unknown, -step)) / (2.0 * step);
            // The cost is that of the data, without what was known before.
            let expected = -2.0 * (normal.right[unknown] - prior.right[unknown]);
            let close = (slope - expected).abs() < 0.03 * expected.abs() + 2e-3 * scale;
            assert!(close, "unknown {unknown}: {slope} instead of {expected}");
        }
    }

    #[test]
    fn at_the_true_state_no_unknown_is_pulled_beyond_noise() {
        let adjustment = sample::adjustment(0.0);
        let (normal, tallies) = adjustment.normal(&WIDE);
        assert!(tallies[0].used.len() > 1000 && tallies[0].edges.len() > 50);
        for unknown in 0..adjustment.layout.len() {
            let weight = normal.matrix[(unknown, unknown)];
            let pull = normal.right[unknown] / weight.sqrt();
            assert!(pull.abs() < 4.5, "unknown {unknown} is pulled by {pull}");
        }
    }
}
