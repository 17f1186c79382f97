//! Where the material sections really are.

use nalgebra::{Rotation3, Vector3};
use rayon::prelude::*;

use super::blade::Blade;
use super::motion::Motion;
use super::rod::{Node, integrate};

/// One section at one time, world frame, metres.
#[derive(Debug, Clone, Copy)]
pub struct SectionTruth {
    /// Half-way between leading and trailing edge.
    pub middle_m: Vector3<f64>,
    /// Leading edge.
    pub leading_m: Vector3<f64>,
    /// Trailing edge.
    pub trailing_m: Vector3<f64>,
    /// From leading to trailing edge, unit length.
    pub chord: Vector3<f64>,
    /// Change of twist since the unloaded, still state, rad; positive turns the trailing edge
    /// towards the suction side.
    pub twist_rad: f64,
}

impl SectionTruth {
    /// Middle, leading edge, trailing edge, chord direction and twist in one row.
    pub fn row(&self) -> [f64; 13] {
        let vectors = [self.middle_m, self.leading_m, self.trailing_m, self.chord];
        std::array::from_fn(|i| {
            vectors
                .get(i / 3)
                .map_or(self.twist_rad, |vector| vector[i % 3])
        })
    }
}

/// A material section, with what is needed to follow it.
#[derive(Debug, Clone)]
struct Follower {
    element: usize,
    ahead_m: f64,
    /// Leading and trailing edge in the section's directions, metres.
    edges_m: [Vector3<f64>; 2],
    rest: Node,
}

/// Truth of `sections` (arc lengths) at scene times: one row of sections per time.
pub fn sections(
    blade: &Blade,
    motion: &Motion,
    sections_m: &[f64],
    times_s: &[f64],
) -> Vec<Vec<SectionTruth>> {
    let (curvatures, root) = motion.rest();
    let nodes = integrate(&root, &motion.arc_m, &curvatures);
    let followers: Vec<Follower> = sections_m
        .iter()
        .map(|s_m| follower(blade, motion, *s_m, &nodes, &curvatures))
        .collect();
    let at = |time_s: &f64| {
        let (curvatures, root) = motion.bent(*time_s);
        let nodes = integrate(&root, &motion.arc_m, &curvatures);
        let state = |f: &Follower| {
            let node = nodes[f.element].advance(&curvatures[f.element], f.ahead_m);
            f.truth(&node, blade.handedness)
        };
        followers.iter().map(state).collect()
    };
    times_s.par_iter().map(at).collect()
}

fn follower(
    blade: &Blade,
    motion: &Motion,
    s_m: f64,
    nodes: &[Node],
    curvatures: &[Vector3<f64>],
) -> Follower {
    let last = motion.arc_m.len() - 2;
    let inner = motion.arc_m.partition_point(|node| *node <= s_m);
    let element = inner.saturating_sub(1).min(last);
    let ahead_m = s_m - motion.arc_m[element];
    Follower {
        element,
        ahead_m,
        edges_m: [blade.local(s_m, 0.0, 0.0), blade.local(s_m, 1.0, 0.0)],
        rest: nodes[element].advance(&curvatures[element], ahead_m),
    }
}

impl Follower {
    fn truth(&self, node: &Node, handedness: f64) -> SectionTruth {
        let [leading_m, trailing_m] = self.edges_m.map(|edge| node.point(&edge));
        let local = (self.edges_m[1] - self.edges_m[0]).normalize();
        let chord = node.rotation * local;
        SectionTruth {
            middle_m: 0.5 * (leading_m + trailing_m),
            leading_m,
            trailing_m,
            chord,
            twist_rad: handedness * twist(&(self.rest.rotation * local), &chord, &self.rest, node),
        }
    }
}

/// Angle about the tangent from the chord at rest, carried over by the smallest rotation between
/// both tangents, to the chord now.
fn twist(rest_chord: &Vector3<f64>, chord: &Vector3<f64>, rest: &Node, node: &Node) -> f64 {
    let tangent = node.tangent();
    let smallest = Rotation3::rotation_between(&rest.tangent(), &tangent);
    let carried = smallest.unwrap_or_default() * rest_chord;
    carried.cross(chord).dot(&tangent).atan2(carried.dot(chord))
}

#[cfg(test)]
mod tests {
    use super::super::rod::turn;
    use super::*;

    #[test]
    fn twist_is_counted_about_the_tangent_alone() {
        let rest = Node {
            rotation: Rotation3::identity(),
            position_m: Vector3::zeros(),
        };
        let bend = turn(&Vector3::new(0.2, 0.4, 0.0));
        let bent = Node {
            rotation: bend * turn(&(Vector3::z() * 0.03)),
            ..rest
        };
        let chord = bent.rotation * Vector3::x();
        // A rotation about an axis across the tangent is the smallest one.
        assert!((twist(&Vector3::x(), &chord, &rest, &bent) - 0.03).abs() < 1e-12);
    }
}
