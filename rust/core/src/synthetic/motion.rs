//! How the blade moves: load steps with holds and ramps, sway in two modes, a root that gives.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::rod::{Node, integrate, turn};
use super::solver::{Loads, Rod};
use crate::error::InvalidValue;

/// Load steps: each level is held, then the next is reached by a smooth ramp.
#[derive(Debug, Clone)]
pub struct Schedule {
    /// Levels as shares of full load.
    pub levels: Vec<f64>,
    /// Seconds at each level.
    pub hold_s: f64,
    /// Seconds from one level to the next.
    pub ramp_s: f64,
}

impl Schedule {
    /// Seconds from the start of the first hold to the end of the last.
    pub fn duration_s(&self) -> f64 {
        let steps = self.levels.len() as f64;
        steps * self.hold_s + (steps - 1.0).max(0.0) * self.ramp_s
    }

    /// Share of full load `time_s` after the start; the ends last on.
    pub fn share(&self, time_s: f64) -> f64 {
        let period = self.hold_s + self.ramp_s;
        let step = (time_s / period).floor().max(0.0);
        let last = self.levels.len() - 1;
        let (from, to) = (
            self.levels[(step as usize).min(last)],
            self.levels[(step as usize + 1).min(last)],
        );
        let way = ((time_s - step * period - self.hold_s) / self.ramp_s).clamp(0.0, 1.0);
        from + (to - from) * smooth(way)
    }
}

/// From 0 to 1; speed and acceleration vanish at both ends.
fn smooth(way: f64) -> f64 {
    way.powi(3) * (10.0 + way * (6.0 * way - 15.0))
}

/// Swaying in one mode.
#[derive(Debug, Clone, Copy)]
pub struct Sway {
    /// World direction.
    pub direction: Vector3<f64>,
    /// 1 or 2: nodes of the bending mode, the root included.
    pub order: u8,
    /// Own frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude at the tip, metres.
    pub amplitude_m: f64,
    /// Phase at the start, rad.
    pub phase_rad: f64,
    /// Driven from an instant on, seconds, and grown to its amplitude so many seconds later; `None`:
    /// it sways all the time and beats.
    pub driven: Option<(f64, f64)>,
}

impl Sway {
    fn at(&self, time_s: f64) -> f64 {
        if let Some((start_s, grown_s)) = self.driven {
            let way = ((time_s - start_s) / grown_s).clamp(0.0, 1.0);
            let angle = TAU * self.frequency_hz * (time_s - start_s) + self.phase_rad;
            return self.amplitude_m * smooth(way) * angle.sin();
        }
        // Beats slowly, as wind and winches excite it.
        let beat = 1.0 + 0.25 * (TAU * 0.11 * time_s + 2.0 * self.phase_rad).sin();
        self.amplitude_m * beat * (TAU * self.frequency_hz * time_s + self.phase_rad).sin()
    }

    /// Shape of a cantilever's mode at the share `x` of its length.
    fn shape(&self, x: f64) -> f64 {
        if self.order == 1 {
            x * x * (3.0 - x) / 2.0
        } else {
            x * x * (4.0 * x - 3.0)
        }
    }
}

/// Levels of the load at which the equilibrium is solved, per full load.
const LEVELS: usize = 24;

/// The blade's shape at any time.
#[derive(Debug, Clone)]
pub struct Motion {
    /// Arc lengths of the nodes, metres.
    pub arc_m: Vec<f64>,
    schedule: Schedule,
    sways: Vec<Sway>,
    root: Node,
    root_turn_rad: Vector3<f64>,
    full_share: f64,
    /// Curvatures by level and element.
    levels: Vec<Vec<Vector3<f64>>>,
    /// Curvatures per metre at the tip, by level, mode and element.
    responses: Vec<Vec<Vec<Vector3<f64>>>>,
}

impl Motion {
    /// Solves the equilibria from no load to the largest level of `schedule`. `root_turn_rad` is how
    /// far the root turns at full load, right-hand about the world axes.
    ///
    /// # Errors
    /// [`InvalidValue`] where the solver finds no equilibrium.
    pub fn new(
        rod: &Rod,
        loads: &Loads,
        schedule: Schedule,
        sways: Vec<Sway>,
        root_turn_rad: Vector3<f64>,
    ) -> Result<Self, InvalidValue> {
        let full_share = schedule.levels.iter().copied().fold(0.01, f64::max);
        let shares = (0..=LEVELS).map(|i| full_share * i as f64 / LEVELS as f64);
        let levels = rod.solve_levels(loads, &shares.collect::<Vec<_>>())?;
        let root = Node {
            rotation: rod.root,
            position_m: Vector3::zeros(),
        };
        let respond = |level: &Vec<Vector3<f64>>| {
            let nodes = integrate(&root, &rod.arc_m, level);
            sways
                .iter()
                .map(|sway| response(rod, &nodes, level, sway))
                .collect()
        };
        let responses = levels.iter().map(respond).collect();
        Ok(Self {
            arc_m: rod.arc_m.clone(),
            schedule,
            sways,
            root,
            root_turn_rad,
            full_share,
            levels,
            responses,
        })
    }

    /// Whether a mode is driven, so that the blade moves fast.
    pub fn is_driven(&self) -> bool {
        self.sways.iter().any(|sway| sway.driven.is_some())
    }

    /// Share of full load at a time.
    pub fn share(&self, time_s: f64) -> f64 {
        self.schedule.share(time_s)
    }

    /// Curvatures of the elements and the root's node at a time after the start.
    pub fn bent(&self, time_s: f64) -> (Vec<Vector3<f64>>, Node) {
        let share = self.share(time_s);
        let sways: Vec<f64> = self.sways.iter().map(|sway| sway.at(time_s)).collect();
        (self.curvatures(share, &sways), self.root_at(share))
    }

    /// Unloaded and still: curvatures and root.
    pub fn rest(&self) -> (Vec<Vector3<f64>>, Node) {
        (self.levels[0].clone(), self.root)
    }

    /// All nodes at a time after the start.
    pub fn nodes(&self, time_s: f64) -> Vec<Node> {
        let (curvatures, root) = self.bent(time_s);
        integrate(&root, &self.arc_m, &curvatures)
    }

    fn root_at(&self, share: f64) -> Node {
        Node {
            rotation: turn(&(self.root_turn_rad * share)) * self.root.rotation,
            ..self.root
        }
    }

    /// Cubic between four solved levels.
    fn curvatures(&self, share: f64, sways: &[f64]) -> Vec<Vector3<f64>> {
        let place = (share / self.full_share * LEVELS as f64).clamp(0.0, LEVELS as f64);
        let first = (place.floor() as usize).saturating_sub(1).min(LEVELS - 3);
        let weights = lagrange(place - first as f64);
        let mut sum = vec![Vector3::zeros(); self.levels[0].len()];
        for (level, weight) in (first..first + 4).zip(weights) {
            add(&mut sum, &self.levels[level], weight);
            for (response, sway) in self.responses[level].iter().zip(sways) {
                add(&mut sum, response, weight * sway);
            }
        }
        sum
    }
}

fn add(sum: &mut [Vector3<f64>], part: &[Vector3<f64>], weight: f64) {
    for (sum, part) in sum.iter_mut().zip(part) {
        *sum += part * weight;
    }
}

/// Weights of values at 0, 1, 2 and 3 for the cubic's value at `x`.
fn lagrange(x: f64) -> [f64; 4] {
    let [a, b, c, d] = [x, x - 1.0, x - 2.0, x - 3.0];
    [
        -b * c * d / 6.0,
        a * c * d / 2.0,
        -a * b * d / 2.0,
        a * b * c / 6.0,
    ]
}

/// Curvatures under the inertia of a mode, per metre of movement of the tip.
fn response(rod: &Rod, nodes: &[Node], level: &[Vector3<f64>], sway: &Sway) -> Vec<Vector3<f64>> {
    let length = rod.arc_m[rod.arc_m.len() - 1];
    let inertia = |(ends, mass): (&[f64], &f64)| {
        let x = 0.5 * (ends[0] + ends[1]) / length;
        sway.direction * (*mass * sway.shape(x))
    };
    let forces: Vec<_> = rod
        .arc_m
        .windows(2)
        .zip(&rod.mass_kg_m)
        .map(inertia)
        .collect();
    let bent = rod.response(nodes, &forces);
    let nudge = 1e-3 / bent.iter().map(Vector3::norm).fold(0.0, f64::max);
    let moved: Vec<_> = level
        .iter()
        .zip(&bent)
        .map(|(k, dk)| k + dk * nudge)
        .collect();
    let tip = |nodes: &[Node]| nodes[nodes.len() - 1].position_m;
    let moved_m = (tip(&integrate(&nodes[0], &rod.arc_m, &moved)) - tip(nodes)).norm();
    bent.iter().map(|dk| dk * (nudge / moved_m)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Rotation3};

    fn schedule() -> Schedule {
        Schedule {
            levels: vec![0.0, 0.4, 1.0, 0.0],
            hold_s: 4.0,
            ramp_s: 1.0,
        }
    }

    fn motion(sways: Vec<Sway>) -> Motion {
        let rod = Rod {
            arc_m: (0..=200).map(|i| f64::from(i) * 0.5).collect(),
            free_curvature: vec![Vector3::zeros(); 200],
            compliance: vec![Matrix3::from_diagonal_element(1e-9); 200],
            mass_kg_m: vec![10.0; 200],
            root: Rotation3::identity(),
        };
        let loads = Loads {
            pulls: vec![super::super::solver::Pull {
                node: 200,
                force_n: Vector3::x() * 2e4,
                lever_m: Vector3::zeros(),
                follower: false,
            }],
            share: 1.0,
            gravity_m_s2: Vector3::y() * -9.81,
        };
        Motion::new(&rod, &loads, schedule(), sways, Vector3::zeros()).unwrap()
    }

    #[test]
    fn steps_hold_and_ramp() {
        let schedule = schedule();
        assert_eq!(schedule.duration_s(), 19.0);
        assert_eq!((schedule.share(3.9), schedule.share(5.1)), (0.0, 0.4));
        assert!((schedule.share(9.5) - 0.7).abs() < 1e-12);
        assert_eq!((schedule.share(-1.0), schedule.share(99.0)), (0.0, 0.0));
    }

    #[test]
    fn a_driven_mode_keeps_its_frequency_and_amplitude() {
        let swing = Sway {
            direction: Vector3::y(),
            order: 1,
            frequency_hz: 0.8,
            amplitude_m: 2.0,
            phase_rad: 0.0,
            driven: Some((3.0, 5.0)),
        };
        assert_eq!(swing.at(2.9), 0.0);
        for cycle in 0..50 {
            let crest_s = 3.0 + (8.0 + f64::from(cycle) + 0.25) / 0.8;
            assert!((swing.at(crest_s) - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_tip_sways_by_its_amplitude() {
        let sway = Sway {
            direction: Vector3::y(),
            order: 1,
            frequency_hz: 0.5,
            amplitude_m: 0.01,
            phase_rad: 0.0,
            driven: None,
        };
        let (still, moving) = (motion(vec![]), motion(vec![sway]));
        let away = |time: f64| {
            let [a, b] = [&still, &moving].map(|motion| motion.nodes(time)[200].position_m);
            (b - a).norm() / sway.at(time).abs()
        };
        assert!((away(0.6) - 1.0).abs() < 1e-3 && (away(11.3) - 1.0).abs() < 0.02);
    }
}
