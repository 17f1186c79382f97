//! What is known besides the scans, each with its sigma: positions, control points, tapes, targets.

use nalgebra::{Rotation3, Unit, Vector3};

use super::rows::{self, Row};
use super::sight::Sight;
use super::state::{Layout, State};

/// One thing that somebody measured or knows.
#[derive(Debug, Clone)]
pub enum Known {
    /// A surveyed point on a surface.
    Control {
        /// Which surface.
        surface: usize,
        /// World frame, metres.
        xyz_m: Vector3<f64>,
        /// Standard deviation per coordinate, metres.
        u_m: f64,
    },
    /// The surveyed mark of a lidar.
    Position {
        /// Which lidar.
        lidar: usize,
        /// World frame, metres.
        mark_m: Vector3<f64>,
        /// From the mark to the optical centre, sensor frame, metres.
        lever_arm_m: Vector3<f64>,
        /// Standard deviation per coordinate, metres.
        u_m: f64,
    },
    /// How a lidar is mounted.
    Mounting {
        /// Which lidar.
        lidar: usize,
        /// World from sensor.
        nominal: Rotation3<f64>,
        /// Standard deviation, radians.
        u_rad: f64,
    },
    /// What a lidar's own accelerometer says.
    Gravity {
        /// Which lidar.
        lidar: usize,
        /// Up, sensor frame.
        up_in_sensor: Unit<Vector3<f64>>,
        /// Standard deviation, radians.
        u_rad: f64,
    },
    /// A taped distance between two optical centres.
    Distance {
        /// Which lidars.
        between: [usize; 2],
        /// Metres.
        m: f64,
        /// Standard deviation, metres.
        u_m: f64,
    },
    /// The survey of a target.
    Target {
        /// Which target.
        target: usize,
        /// World frame, metres.
        xyz_m: Vector3<f64>,
        /// Standard deviation per coordinate, metres.
        u_m: f64,
    },
    /// A target as a lidar sees it.
    Sight(Sight),
}

impl Known {
    /// Its rows at a state.
    pub fn rows(&self, state: &State, layout: &Layout) -> Vec<Row> {
        match self {
            Self::Control {
                surface,
                xyz_m,
                u_m,
            } => vec![rows::control(state, layout, *surface, xyz_m, *u_m)],
            Self::Position {
                lidar,
                mark_m,
                lever_arm_m,
                u_m,
            } => rows::position(state, layout, *lidar, mark_m, lever_arm_m, *u_m).into(),
            Self::Mounting {
                lidar,
                nominal,
                u_rad,
            } => rows::mounting(state, layout, *lidar, nominal, *u_rad).into(),
            Self::Gravity {
                lidar,
                up_in_sensor,
                u_rad,
            } => rows::gravity(state, layout, *lidar, up_in_sensor, *u_rad).into(),
            Self::Distance { between, m, u_m } => {
                vec![rows::distance(state, layout, *between, *m, *u_m)]
            }
            Self::Target { target, xyz_m, u_m } => {
                rows::target(state, layout, *target, xyz_m, *u_m).into()
            }
            Self::Sight(sight) => sight.rows(state, layout).into(),
        }
    }

    /// Whether it speaks of things that are there, of which there are so many lidars, surfaces and
    /// targets, and its sigmas are positive.
    pub fn fits(&self, [lidars, surfaces, targets]: [usize; 3]) -> bool {
        let (lidar, surface, target, sigma) = match self {
            Self::Control { surface, u_m, .. } => (0, *surface, 0, *u_m),
            Self::Position { lidar, u_m, .. } => (*lidar, 0, 0, *u_m),
            Self::Mounting { lidar, u_rad, .. } | Self::Gravity { lidar, u_rad, .. } => {
                (*lidar, 0, 0, *u_rad)
            }
            Self::Distance { between, u_m, .. } => (between[0].max(between[1]), 0, 0, *u_m),
            Self::Target { target, u_m, .. } => (0, 0, *target, *u_m),
            Self::Sight(s) => (
                s.lidar,
                0,
                s.target,
                s.seen.sigma_m.into_iter().fold(f64::INFINITY, f64::min),
            ),
        };
        let speaks_of = |index: usize, count: usize| index == 0 || index < count;
        let there =
            speaks_of(lidar, lidars) && speaks_of(surface, surfaces) && speaks_of(target, targets);
        there && sigma > 0.0 && sigma.is_finite()
    }

    /// Whether it may be left out as a gross error: a prior on the mounting cannot be one.
    pub fn may_be_wrong(&self) -> bool {
        !matches!(self, Self::Mounting { .. })
    }
}

#[cfg(test)]
mod tests {
    use super::super::field::{Field, Roughness};
    use super::super::hold::Beam;
    use super::super::sheet::Sheet;
    use super::super::state::LidarState;
    use super::super::surface::{Surface, SurfaceFrame};
    use super::super::target::{OnSphere, Target};
    use super::rows::Place;
    use super::*;

    /// Two lidars turned anyhow over a rough bent ground, and a target.
    fn state() -> State {
        let lidar = |z: f64, turn: Vector3<f64>| LidarState {
            rotation: Rotation3::new(turn) * Rotation3::from_axis_angle(&Vector3::z_axis(), 3.1),
            position_m: Vector3::new(3.0, -6.8, z),
            elevation_rad: 0.001,
            scale: 2e-4,
            offsets_m: vec![0.01, -0.02],
            retro_m: 0.004,
            skins_m: vec![0.002],
            slant_m: 0.002,
        };
        let normal = Unit::new_normalize(Vector3::new(-0.02, 1.0, 0.0123));
        let frame = SurfaceFrame::new(Vector3::new(0.0, -8.0, 95.0), normal, [20.0, 15.0]);
        let rough = Roughness {
            sigma_m: 0.01,
            correlation_m: 2.0,
            nugget_m: 0.001,
        };
        let places: Vec<_> = (-25..25)
            .flat_map(|i| (-25..25).map(move |j| [f64::from(i), f64::from(j)]))
            .collect();
        let field = Field::new(rough, &[places]);
        let surface = Surface {
            coefficients: [0.01, 0.02, -0.01, 0.03, 0.01, -0.02],
            field: Some(field),
            frame,
        };
        State {
            lidars: vec![
                lidar(86.0, Vector3::new(0.03, -0.05, 0.02)),
                lidar(94.0, Vector3::new(-0.06, 0.02, 0.01)),
            ],
            surfaces: vec![surface],
            targets: vec![Target {
                centre_m: Vector3::new(4.0, -6.0, 90.0),
                radius_m: Some(0.2),
            }],
        }
    }

    fn beam() -> Beam {
        Beam {
            direction: Unit::new_normalize(Vector3::new(0.7, 0.5, 0.13)),
            range_m: 2.3,
            sigma_m: 0.003,
            intensity: 0.0,
            ring: 1,
            cell: 0,
        }
    }

    /// Where the ray of `beam` ends on the ground.
    fn place() -> Place {
        let state = state();
        let end = super::super::select::world(&state.lidars[0], &beam());
        Place {
            surface: 0,
            around: state.surfaces[0].around(0, &end),
            alike: 1.0,
            slant: 0.7,
        }
    }

    fn everything() -> Vec<Known> {
        let up = Vector3::new(0.02, -1.0, 0.05);
        let sight = Sight {
            lidar: 1,
            target: 0,
            seen: Sheet {
                centre_m: Vector3::new(1.0, 0.7, -4.0),
                lean: 0.07,
                sigma_m: [0.001, 0.02, 0.02],
                shares: vec![(0, 0.4), (1, 0.6)],
            },
        };
        vec![
            Known::Control {
                surface: 0,
                xyz_m: Vector3::new(-4.3, -8.05, 91.0),
                u_m: 0.005,
            },
            Known::Position {
                lidar: 0,
                mark_m: Vector3::new(3.0, -6.9, 86.0),
                lever_arm_m: Vector3::new(0.1, 0.2, -0.05),
                u_m: 0.005,
            },
            Known::Mounting {
                lidar: 1,
                nominal: Rotation3::from_axis_angle(&Vector3::z_axis(), 2.9),
                u_rad: 0.17,
            },
            Known::Gravity {
                lidar: 0,
                up_in_sensor: Unit::new_normalize(up),
                u_rad: 1e-3,
            },
            Known::Distance {
                between: [0, 1],
                m: 8.02,
                u_m: 0.01,
            },
            Known::Target {
                target: 0,
                xyz_m: Vector3::new(4.0, -6.1, 90.0),
                u_m: 0.001,
            },
            Known::Sight(sight),
        ]
    }

    /// Every derivative of every row against finite differences of the residual.
    fn check(rows_at: &dyn Fn(&State, &Layout) -> Vec<Row>) {
        let state = state();
        let layout = state.layout();
        let rows = rows_at(&state, &layout);
        assert!(!rows.is_empty());
        let step = 1e-6;
        let moved = |border: usize, nodes: usize, step: f64| {
            let mut steps = (vec![0.0; layout.border], vec![0.0; layout.nodes]);
            if border < layout.border {
                steps.0[border] = step;
            } else {
                steps.1[nodes] = step;
            }
            let mut moved = state.clone();
            moved.advance(&layout, &steps.0, &steps.1);
            rows_at(&moved, &layout)
        };
        let near =
            |found: f64, numeric: f64| (found - numeric).abs() < 2e-5 * (1.0 + numeric.abs());
        for unknown in 0..layout.border {
            let sides = moved(unknown, 0, -step)
                .into_iter()
                .zip(moved(unknown, 0, step));
            for (row, (before, after)) in rows.iter().zip(sides) {
                let found: f64 = row
                    .border
                    .iter()
                    .filter(|(i, _)| *i == unknown)
                    .map(|e| e.1)
                    .sum();
                let numeric = (after.residual - before.residual) / (2.0 * step);
                assert!(near(found, numeric), "unknown {unknown}: {found} {numeric}");
            }
        }
        for (row, k) in rows.iter().zip(0..) {
            for (node, found) in &row.field {
                let side = |step| moved(layout.border, *node, step)[k].residual;
                let numeric = (side(step) - side(-step)) / (2.0 * step);
                assert!(near(*found, numeric), "node {node}: {found} {numeric}");
            }
        }
    }

    #[test]
    fn the_derivatives_are_those_of_finite_differences() {
        for known in everything() {
            check(&|state, layout| known.rows(state, layout));
        }
        check(&|state, layout| {
            rows::ray(state, layout, 0, &beam(), &place())
                .into_iter()
                .collect()
        });
    }

    #[test]
    fn so_are_those_of_a_ray_on_a_sphere() {
        let (on, echo) = (
            OnSphere {
                lidar: 0,
                echo: 0,
                target: 0,
            },
            sphere_echo(),
        );
        check(&|state, layout| {
            rows::on_sphere(state, layout, &on, &echo, 0.0, 1.0)
                .into_iter()
                .collect()
        });
    }

    /// An echo of lidar 0 that passes the middle of the target by a third of its radius.
    fn sphere_echo() -> Beam {
        let state = state();
        let of = &state.lidars[0];
        let aim = state.targets[0].centre_m + Vector3::new(0.04, 0.05, 0.0) - of.position_m;
        Beam {
            direction: Unit::new_normalize(of.rotation.inverse() * aim),
            range_m: aim.norm() - 0.19,
            ..beam()
        }
    }

    #[test]
    fn a_residual_on_the_ray_does_not_reach_the_derivative() {
        let state = state();
        let layout = state.layout();
        let near = rows::ray(&state, &layout, 0, &beam(), &place()).unwrap();
        let mut farther = beam();
        farther.range_m += 0.03;
        let far = rows::ray(&state, &layout, 0, &farther, &place()).unwrap();
        assert!((far.residual - near.residual - 0.03 * (1.0 + 2e-4)).abs() < 1e-6);
        for (a, b) in near.border.iter().zip(&far.border).filter(|(a, _)| a.0 < 6) {
            assert!((a.1 - b.1).abs() < 1e-6);
        }
    }
}
