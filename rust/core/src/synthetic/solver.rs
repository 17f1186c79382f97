//! Static shape of a clamped blade under its weight and the pull of saddles.
//!
//! A geometrically exact rod without stretch or shear. Integrated from the tip, where force and
//! moment vanish: the tip's orientation is the only unknown, and it is right when the root comes
//! out as it is clamped. Newton's method in these three numbers, the load raised in steps.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::rod::{Node, turn};
use crate::error::InvalidValue;

/// A rod along its elements, in directions of the section without twist (see [`Node`]).
#[derive(Debug, Clone)]
pub struct Rod {
    /// Arc lengths of the nodes, from 0 to the length, metres.
    pub arc_m: Vec<f64>,
    /// Curvature of each element free of stress, rad/m.
    pub free_curvature: Vec<Vector3<f64>>,
    /// Curvature per moment of each element, 1/(N m^2).
    pub compliance: Vec<Matrix3<f64>>,
    /// Mass of each element per length, kg/m.
    pub mass_kg_m: Vec<f64>,
    /// Orientation of the clamped root.
    pub root: Rotation3<f64>,
}

/// A pull at a node.
#[derive(Debug, Clone, Copy)]
pub struct Pull {
    /// Index of the node.
    pub node: usize,
    /// Force at full load, world frame while the blade is unloaded, N.
    pub force_n: Vector3<f64>,
    /// Where it acts, from the axis, in the section's directions, metres.
    pub lever_m: Vector3<f64>,
    /// Whether the force turns with the section instead of keeping its direction in the world.
    pub follower: bool,
}

/// What acts on the rod besides its weight.
#[derive(Debug, Clone, Default)]
pub struct Loads {
    /// Pulls at full load.
    pub pulls: Vec<Pull>,
    /// Share of the pulls that acts; 1 is full load.
    pub share: f64,
    /// Acceleration of gravity as a vector, m/s^2.
    pub gravity_m_s2: Vector3<f64>,
}

const MAX_ITERATIONS: usize = 40;
/// Rotation of the root that is left, rad: 1e-11 over 140 m is a nanometre.
const ROOT_TOLERANCE_RAD: f64 = 1e-11;

impl Rod {
    /// Curvatures of the elements in equilibrium, rad/m; `tip` is the start and becomes the result.
    ///
    /// # Errors
    /// [`InvalidValue`] where Newton's method does not find the root clamped as it is.
    pub fn solve(
        &self,
        loads: &Loads,
        tip: &mut Rotation3<f64>,
    ) -> Result<Vec<Vector3<f64>>, InvalidValue> {
        for _ in 0..MAX_ITERATIONS {
            let miss = self.root_miss(loads, tip);
            if miss.norm() < ROOT_TOLERANCE_RAD {
                return Ok(self.inward(loads, tip).0);
            }
            let mut slope = Matrix3::zeros();
            for axis in 0..3 {
                let mut nudge = Vector3::zeros();
                nudge[axis] = 1e-6;
                let moved = self.root_miss(loads, &(turn(&nudge) * *tip));
                slope.set_column(axis, &((moved - miss) / 1e-6));
            }
            let step = slope.lu().solve(&miss).unwrap_or_else(Vector3::zeros);
            // A step of more than half a radian leaves the range of the linear model.
            *tip = turn(&(-step * (0.5 / step.norm()).min(1.0))) * *tip;
            *tip = UnitQuaternion::from_rotation_matrix(tip).to_rotation_matrix(); // stay orthogonal
        }
        Err(InvalidValue {
            name: "load",
            expected: "pulls under which the blade finds an equilibrium".into(),
            found: format!("none at {:.1} % of the load", loads.share * 100.0),
        })
    }

    /// Equilibria for rising `shares` of the load, each started from the one before.
    ///
    /// # Errors
    /// See [`Rod::solve`].
    pub fn solve_levels(
        &self,
        loads: &Loads,
        shares: &[f64],
    ) -> Result<Vec<Vec<Vector3<f64>>>, InvalidValue> {
        let mut tip = self.free_tip();
        let at = |share: f64| Loads {
            share,
            ..loads.clone()
        };
        shares
            .iter()
            .map(|share| self.solve(&at(*share), &mut tip))
            .collect()
    }

    fn free_tip(&self) -> Rotation3<f64> {
        let steps = self.arc_m.windows(2).zip(&self.free_curvature);
        steps.fold(self.root, |rotation, (ends, curvature)| {
            rotation * turn(&(curvature * (ends[1] - ends[0])))
        })
    }

    /// By how much the integrated root misses the clamped one: the sine of the angle, as a vector.
    fn root_miss(&self, loads: &Loads, tip: &Rotation3<f64>) -> Vector3<f64> {
        let miss = self.inward(loads, tip).1 * self.root.inverse();
        let m = miss.matrix();
        Vector3::new(
            m[(2, 1)] - m[(1, 2)],
            m[(0, 2)] - m[(2, 0)],
            m[(1, 0)] - m[(0, 1)],
        ) * 0.5
    }

    /// From the tip to the root: curvatures, and the root's orientation that follows.
    fn inward(&self, loads: &Loads, tip: &Rotation3<f64>) -> (Vec<Vector3<f64>>, Rotation3<f64>) {
        let mut curvatures = vec![Vector3::zeros(); self.compliance.len()];
        let mut node = Node {
            rotation: *tip,
            position_m: Vector3::zeros(),
        };
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for element in (0..self.compliance.len()).rev() {
            self.pull(loads, element + 1, &node, &mut force, &mut moment);
            let length = self.arc_m[element + 1] - self.arc_m[element];
            let weight = loads.gravity_m_s2 * (self.mass_kg_m[element] * length);
            let bend = |rotation: &Rotation3<f64>, moment: &Vector3<f64>| {
                self.free_curvature[element]
                    + self.compliance[element] * (rotation.inverse() * moment)
            };
            // Midpoint rule: curvature from the moment in the middle of the element.
            let middle = node.advance(&bend(&node.rotation, &moment), -0.5 * length);
            let arm = node.position_m - middle.position_m;
            let at_middle = moment + arm.cross(&force) + (arm * 0.5).cross(&(weight * 0.5));
            let curvature = bend(&middle.rotation, &at_middle);
            let inner = node.advance(&curvature, -length);
            let arm = node.position_m - inner.position_m;
            moment += arm.cross(&force) + (arm * 0.5).cross(&weight);
            force += weight;
            curvatures[element] = curvature;
            node = inner;
        }
        (curvatures, node.rotation)
    }

    fn pull(
        &self,
        loads: &Loads,
        index: usize,
        node: &Node,
        force: &mut Vector3<f64>,
        moment: &mut Vector3<f64>,
    ) {
        for pull in loads.pulls.iter().filter(|pull| pull.node == index) {
            let mut pulled = pull.force_n * loads.share;
            if pull.follower {
                pulled = node.rotation * (self.root.inverse() * pulled);
            }
            *force += pulled;
            *moment += (node.rotation * pull.lever_m).cross(&pulled);
        }
    }

    /// Curvatures that a small distributed force (N/m per element) adds to a shape, rad/m.
    pub fn response(&self, nodes: &[Node], force_n_m: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mut curvatures = vec![Vector3::zeros(); force_n_m.len()];
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for element in (0..force_n_m.len()).rev() {
            let length = self.arc_m[element + 1] - self.arc_m[element];
            let arm = nodes[element + 1].position_m - nodes[element].position_m;
            let own: Vector3<f64> = force_n_m[element] * length;
            let at_middle = moment + (arm * 0.5).cross(&force) + (arm * 0.25).cross(&(own * 0.5));
            curvatures[element] =
                self.compliance[element] * (nodes[element].rotation.inverse() * at_middle);
            moment += arm.cross(&force) + (arm * 0.5).cross(&own);
            force += own;
        }
        curvatures
    }
}

#[cfg(test)]
mod tests {
    use super::super::rod::integrate;
    use super::*;

    fn beam(elements: usize, length_m: f64, ei_nm2: f64) -> Rod {
        let arc_m = (0..=elements)
            .map(|i| length_m * i as f64 / elements as f64)
            .collect();
        Rod {
            arc_m,
            free_curvature: vec![Vector3::zeros(); elements],
            compliance: vec![Matrix3::from_diagonal_element(1.0 / ei_nm2); elements],
            mass_kg_m: vec![0.0; elements],
            root: Rotation3::identity(),
        }
    }

    fn end_pull(elements: usize, force_n: f64, follower: bool) -> Loads {
        Loads {
            pulls: vec![Pull {
                node: elements,
                force_n: Vector3::x() * force_n,
                lever_m: Vector3::zeros(),
                follower,
            }],
            share: 1.0,
            gravity_m_s2: Vector3::zeros(),
        }
    }

    fn shape(rod: &Rod, loads: &Loads) -> Vec<Node> {
        let shares: Vec<f64> = (0..=10).map(|i| f64::from(i) / 10.0).collect();
        let levels = rod.solve_levels(loads, &shares).unwrap();
        let root = Node {
            rotation: rod.root,
            position_m: Vector3::zeros(),
        };
        integrate(&root, &rod.arc_m, &levels[10])
    }

    #[test]
    fn a_dead_end_load_gives_the_elastica() {
        // Bisshopp and Drucker 1945 for P L^2 / (E I): deflection and height over the length from
        // the elliptic integrals, evaluated to six digits by quadrature for 1 and 2.
        for (load, deflection) in [(1.0, 0.301_721), (2.0, 0.493_457)] {
            let rod = beam(400, 1.0, 1.0);
            let tip = shape(&rod, &end_pull(400, load, false))[400];
            assert!(
                (tip.position_m.x - deflection).abs() < 1e-5,
                "{load}: {}",
                tip.position_m.x
            );
        }
    }

    #[test]
    fn energy_of_the_elastica_is_conserved() {
        // For a dead load F along x: E I k^2 / 2 + F sin(angle of the tangent) is constant.
        let rod = beam(800, 1.0, 1.0);
        let loads = end_pull(800, 3.0, false);
        let nodes = shape(&rod, &loads);
        let at_root = 0.5 * (3.0 * nodes[800].position_m.z).powi(2);
        let at_tip = 3.0 * nodes[800].tangent().x;
        assert!(
            (at_root - at_tip).abs() < 1e-4 * at_tip,
            "{at_root} {at_tip}"
        );
    }

    #[test]
    fn a_follower_turns_the_tip_farther_than_a_dead_load() {
        let rod = beam(200, 1.0, 1.0);
        let dead = shape(&rod, &end_pull(200, 2.0, false))[200];
        let follower = shape(&rod, &end_pull(200, 2.0, true))[200];
        assert!(follower.tangent().x > dead.tangent().x + 0.05);
    }

    #[test]
    fn a_lever_twists() {
        let rod = beam(100, 10.0, 1e6);
        let mut loads = end_pull(100, 1e3, false);
        loads.pulls[0].lever_m = Vector3::y() * 0.1;
        let tip = shape(&rod, &loads)[100];
        // Moment 100 N m over 10 m against 1e6 N m^2, right-hand about -z.
        assert!((tip.rotation.matrix()[(1, 0)] + 1e-3).abs() < 1e-5);
    }

    #[test]
    fn the_length_is_kept() {
        let rod = beam(300, 100.0, 1e8);
        let nodes = shape(&rod, &end_pull(300, 2e4, false));
        assert!(nodes[300].position_m.x > 40.0);
        // Chords of an arc are shorter by (k h)^2 / 24; cut elements until that is below 1e-9.
        let root = nodes[0];
        let loads = end_pull(300, 2e4, false);
        let shares = [0.0, 0.3, 0.6, 1.0];
        let curvatures = rod.solve_levels(&loads, &shares).unwrap().pop().unwrap();
        let fine: Vec<f64> = (0..=300_000).map(|i| f64::from(i) * 1e2 / 3e5).collect();
        let bent: Vec<_> = (0..300_000).map(|i| curvatures[i / 1000]).collect();
        let length: f64 = integrate(&root, &fine, &bent)
            .windows(2)
            .map(|pair| (pair[1].position_m - pair[0].position_m).norm())
            .sum();
        assert!((length - 100.0).abs() < 1e-9 * 100.0, "{length}");
    }
}
