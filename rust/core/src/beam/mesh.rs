//! The blade cut into elements, with the outline of every node.

use nalgebra::{Matrix3, Vector3};

use super::design::Design;
use super::table;

/// Distance between nodes of the inner half, which no lidar sees, metres.
const INNER_M: f64 = 1.5;
/// Distance between nodes of the outer half, metres.
const OUTER_M: f64 = 0.6;

/// Nodes from root to tip and what each of them carries.
#[derive(Debug, Clone)]
pub struct Mesh {
    /// Arc lengths of the nodes, metres.
    pub s_m: Vec<f64>,
    /// Outline of each node about the axis in its own directions, metres.
    pub outline: Vec<Vec<[f64; 2]>>,
    /// Place of each outline point along the chord at each node, from 0 to 1.
    pub x_c: Vec<Vec<f64>>,
    /// Middle of the chord from the axis in the node's directions, metres.
    pub middle: Vec<Vector3<f64>>,
    /// Chord direction to the trailing edge in the node's directions.
    pub chord: Vec<Vector3<f64>>,
    /// Chord, metres.
    pub chord_m: Vec<f64>,
    /// Stress-free curvature of each element, rad/m, in its own directions.
    pub free: Vec<Vector3<f64>>,
    /// Compliance of each element by edgewise, flapwise and torsional stiffness and by a whole coupling
    /// of both bendings, 1/(N m^2).
    pub compliance: Vec<[Matrix3<f64>; 4]>,
    /// How much less the stiffness of each element is known than that of the root.
    pub doubt: Vec<f64>,
    /// A first guess of the mass per length of each element, kg/m.
    pub mass_kg_m: Vec<f64>,
    /// World directions of the root, stress-free.
    pub root: Matrix3<f64>,
    /// World sense of the twist of the drawing about the tangent: 1 or -1.
    pub hand: f64,
}

/// Bending stiffness over mass and chord squared, N m^2 / (kg/m m^2): glass and carbon blades lie
/// near it, and the weight is estimated.
const STIFFNESS_PER_MASS: f64 = 3e6;

impl Mesh {
    /// Cuts a blade, with nodes at the stations of the drawing and at `extra_m`.
    pub fn new(design: &Design, extra_m: &[f64]) -> Self {
        let s_m = nodes(design, extra_m);
        let middles: Vec<f64> = s_m
            .windows(2)
            .map(|ends| 0.5 * (ends[0] + ends[1]))
            .collect();
        let turn = |s: f64| -design.hand * design.lean(s).clamp(-0.9, 0.9).asin();
        let free = s_m
            .windows(2)
            .map(|ends| Vector3::x() * ((turn(ends[1]) - turn(ends[0])) / (ends[1] - ends[0])));
        let lean = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), turn(0.0));
        Self {
            outline: s_m.iter().map(|s| design.outline(*s)).collect(),
            x_c: s_m.iter().map(|s| along_chord(design, *s)).collect(),
            middle: s_m.iter().map(|s| middle(design, *s)).collect(),
            chord: s_m.iter().map(|s| design.directions(*s)[0]).collect(),
            chord_m: s_m.iter().map(|s| design.chord_m(*s)).collect(),
            free: free.collect(),
            compliance: middles.iter().map(|s| compliance(design, *s)).collect(),
            doubt: vec![1.0; middles.len()],
            mass_kg_m: middles.iter().map(|s| mass_kg_m(design, *s)).collect(),
            root: design.clamp * lean.matrix(),
            hand: design.hand,
            s_m,
        }
    }

    /// With stiffness known less and less towards the tip, where it is known by so much less.
    #[must_use]
    pub fn doubted(mut self, tip: f64) -> Self {
        let length = self.length_m();
        for (doubt, s_m) in self.doubt.iter_mut().zip(&self.s_m) {
            *doubt = 1.0 + (tip - 1.0) * (s_m / length).powi(4);
        }
        self
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.s_m.len()
    }

    /// Whether there is no node: never.
    pub fn is_empty(&self) -> bool {
        self.s_m.is_empty()
    }

    /// Arc length of the tip, metres.
    pub fn length_m(&self) -> f64 {
        self.s_m[self.s_m.len() - 1]
    }

    /// Whether a point of the outline, or the facet behind it, lies on the second side: the pressure side.
    pub fn is_second_side(&self, vertex: usize) -> bool {
        vertex >= self.outline[0].len() / 2
    }

    /// Length of an element, metres.
    pub fn step_m(&self, element: usize) -> f64 {
        self.s_m[element + 1] - self.s_m[element]
    }

    /// Node nearest to an arc length.
    pub fn node_at(&self, s_m: f64) -> usize {
        let (index, share) = table::interval(&self.s_m, s_m);
        index + usize::from(share > 0.5)
    }
}

fn nodes(design: &Design, extra_m: &[f64]) -> Vec<f64> {
    let length = design.length_m();
    let mut nodes: Vec<f64> = extra_m.to_vec();
    nodes.extend_from_slice(&design.stations().s_m);
    nodes.retain(|s| (0.0..=length).contains(s));
    nodes.push(0.0);
    nodes.sort_by(f64::total_cmp);
    nodes.dedup_by(|a, b| (*a - *b).abs() < 0.02);
    let fill = |ends: &[f64]| -> Vec<f64> {
        let spacing = if ends[0] < 0.5 * length {
            INNER_M
        } else {
            OUTER_M
        };
        let count = ((ends[1] - ends[0]) / spacing).ceil().max(1.0);
        let at = |i: usize| ends[0] + (ends[1] - ends[0]) * i as f64 / count;
        (0..count as usize).map(at).collect()
    };
    let mut all: Vec<f64> = nodes.windows(2).flat_map(fill).collect();
    all.push(length);
    all
}

fn along_chord(design: &Design, s_m: f64) -> Vec<f64> {
    design
        .contour(s_m)
        .into_iter()
        .map(|[x_c, _]| x_c)
        .collect()
}

fn middle(design: &Design, s_m: f64) -> Vector3<f64> {
    design.directions(s_m)[0] * ((0.5 - design.axis_fraction(s_m)) * design.chord_m(s_m))
}

fn compliance(design: &Design, s_m: f64) -> [Matrix3<f64>; 4] {
    let [chord, normal] = design.directions(s_m);
    let [edge, flap, torsion] = design.stiffness_nm2(s_m);
    let along = |axis: Vector3<f64>, stiffness: f64| axis * axis.transpose() / stiffness;
    let both = chord * normal.transpose();
    // Edgewise bending turns about the chord's normal, flapwise bending about the chord.
    [
        along(normal, edge),
        along(chord, flap),
        along(Vector3::z(), torsion),
        (both + both.transpose()) / (edge * flap).sqrt(),
    ]
}

fn mass_kg_m(design: &Design, s_m: f64) -> f64 {
    design.stiffness_nm2(s_m)[0] / design.chord_m(s_m).powi(2) / STIFFNESS_PER_MASS
}
