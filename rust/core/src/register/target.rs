//! Targets: retroreflecting spheres and sheets, found by brightness, size and place.
//!
//! A sphere's echoes are rays of the adjustment like those on the ground; a sheet is reduced to its middle
//! ([`super::sheet`]).

use std::collections::BTreeMap;

use nalgebra::{Rotation3, Vector3};

use super::hold::{Beam, Hold};
use super::state::{LidarState, State};

/// A target as it is taken to stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Its middle, world frame, metres.
    pub centre_m: Vector3<f64>,
    /// Radius of a sphere, metres; None for a sheet, whose middle alone is modelled.
    pub radius_m: Option<f64>,
}

/// A bright echo of a sphere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnSphere {
    /// Which lidar.
    pub lidar: usize,
    /// Which of its bright echoes.
    pub echo: usize,
    /// Which target.
    pub target: usize,
}

/// Echoes that pass a sphere's middle by more than this share of its radius graze its rim.
const RIM: f64 = 0.9;

/// The bright echoes of one lidar within `near_m` of a sphere of the present state, but for its rim.
pub fn met(state: &State, hold: &Hold, lidar: usize, near_m: impl Fn(f64) -> f64) -> Vec<OnSphere> {
    let of = &state.lidars[lidar];
    let owner = |echo: &Beam| {
        let point = place(of, echo);
        let mut near = state.targets.iter().enumerate().filter(|(_, target)| {
            let radius_m = target.radius_m.unwrap_or(f64::NEG_INFINITY);
            let from = point - target.centre_m;
            let along = (point - of.position_m) / echo.range_m;
            let aside_m = (from - along * from.dot(&along)).norm();
            (from.norm() - radius_m).abs() < near_m(echo.range_m) && aside_m < RIM * radius_m
        });
        let only = near.next().map(|(target, _)| target)?;
        near.next().is_none().then_some(only)
    };
    let echoes = hold.bright.iter().enumerate();
    let owned = echoes.filter_map(|(echo, beam)| Some((echo, owner(beam)?)));
    owned
        .map(|(echo, target)| OnSphere {
            lidar,
            echo,
            target,
        })
        .collect()
}

fn place(of: &LidarState, echo: &Beam) -> Vector3<f64> {
    of.position_m + of.rotation * (echo.direction.into_inner() * echo.range_m)
}

/// Bright echoes that lie together, sensor frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Cluster {
    /// Numbers of the echoes.
    pub echoes: Vec<usize>,
    /// Their mean, metres.
    pub middle_m: Vector3<f64>,
    /// Largest distance of an echo from there, metres.
    pub radius_m: f64,
}

/// Echoes nearer to one another than about this belong together, metres.
const TOGETHER_M: f64 = 0.4;
/// Fewer echoes than this are chance.
const LEAST_ECHOES: usize = 6;

/// Groups of bright echoes, the largest first.
pub fn clusters(hold: &Hold) -> Vec<Cluster> {
    let cell = |beam: &Beam| {
        (beam.direction.into_inner() * (beam.range_m / TOGETHER_M)).map(|x| x.floor() as i64)
    };
    let mut cells: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (index, beam) in hold.bright.iter().enumerate() {
        cells.entry(cell(beam).into()).or_default().push(index);
    }
    let mut groups = Vec::new();
    while let Some((first, members)) = cells.pop_first() {
        let (mut group, mut open) = (members, vec![first]);
        while let Some(at) = open.pop() {
            for next in around(at) {
                if let Some(members) = cells.remove(&next) {
                    group.extend(members);
                    open.push(next);
                }
            }
        }
        groups.push(group);
    }
    let large = groups.into_iter().filter(|g| g.len() >= LEAST_ECHOES);
    let mut found: Vec<Cluster> = large.map(|group| cluster(hold, group)).collect();
    found.sort_by_key(|c| (usize::MAX - c.echoes.len(), c.echoes[0]));
    found
}

fn around([i, j, k]: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    let steps = || -1..=1;
    let pairs = steps().flat_map(move |a| steps().map(move |b| (a, b)));
    pairs.flat_map(move |(a, b)| steps().map(move |c| [i + a, j + b, k + c]))
}

fn cluster(hold: &Hold, mut echoes: Vec<usize>) -> Cluster {
    echoes.sort_unstable();
    let point = |k: &usize| hold.bright[*k].direction.into_inner() * hold.bright[*k].range_m;
    let middle_m = echoes.iter().map(point).sum::<Vector3<f64>>() / echoes.len() as f64;
    let away = echoes.iter().map(|k| (point(k) - middle_m).norm());
    let radius_m = away.fold(0.0, f64::max);
    Cluster {
        echoes,
        middle_m,
        radius_m,
    }
}

/// A surveyed target as the search knows it: place from the lidar in the world's axes, and half size.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// From the optical centre, world axes, metres.
    pub from_m: Vector3<f64>,
    /// Half of its size, metres.
    pub half_m: f64,
}

/// Bright things agree in place with targets to within this, metres, plus this per metre.
const AGREE_M: f64 = 0.25;
const AGREE: f64 = 0.02;

/// Turn about the world's vertical that brings most bright things of a levelled lidar onto targets,
/// radians, and how many; None where none agrees, or one alone that fits two turns.
pub fn turn(
    clusters: &[Cluster],
    levelled: &Rotation3<f64>,
    wanted: &[Wanted],
    range_rad: f64,
) -> Option<(f64, usize)> {
    let pairs: Vec<(usize, f64)> = clusters
        .iter()
        .flat_map(|c| {
            let alike = wanted.iter().enumerate();
            alike.filter_map(|(k, want)| Some((k, turn_of(c, levelled, want, range_rad)?)))
        })
        .collect();
    let best = pairs.iter().map(|(_, turn)| agreeing(&pairs, *turn)).fold(
        None,
        |best: Option<(f64, usize)>, next| match best {
            Some(best) if best.1 >= next.1 => Some(best),
            _ => Some(next),
        },
    )?;
    let single = best.1 == 1 && pairs.len() > 1;
    (!single).then_some(best)
}

/// The turn that brings a bright thing onto a target, if it is as large, as far and as high.
fn turn_of(
    cluster: &Cluster,
    levelled: &Rotation3<f64>,
    want: &Wanted,
    range_rad: f64,
) -> Option<f64> {
    let seen = levelled * cluster.middle_m;
    let limit_m = AGREE_M + want.half_m + AGREE * seen.norm();
    let is_like = cluster.radius_m < 2.0 * want.half_m + 0.1
        && (seen.norm() - want.from_m.norm()).abs() < limit_m
        && (seen.y - want.from_m.y).abs() < limit_m;
    let azimuth = |p: &Vector3<f64>| p.x.atan2(p.z);
    let turn = crate::angle::wrap_half_turn(azimuth(&want.from_m) - azimuth(&seen));
    (is_like && turn.abs() < range_rad).then_some(turn)
}

/// Mean of the turns near one, of different targets, and how many.
fn agreeing(pairs: &[(usize, f64)], turn: f64) -> (f64, usize) {
    let mut nearest: BTreeMap<usize, f64> = BTreeMap::new();
    for (target, other) in pairs.iter().filter(|(_, t)| (t - turn).abs() < AGREE) {
        let own = nearest.entry(*target).or_insert(*other);
        if (other - turn).abs() < (*own - turn).abs() {
            *own = *other;
        }
    }
    let count = nearest.len();
    (nearest.values().sum::<f64>() / count.max(1) as f64, count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Unit;

    /// Bright echoes of spheres at places of the sensor frame, as rays of 0.1 by 0.5 degrees see them.
    fn spheres(places: &[Vector3<f64>], radius_m: f64) -> Hold {
        let mut hold = Hold::default();
        for azimuth in 0..3600 {
            for ring in 0..31u16 {
                let (a, e) = (
                    (0.1 * f64::from(azimuth)).to_radians(),
                    (0.5 * f64::from(ring) - 7.5).to_radians(),
                );
                let direction = Vector3::new(e.cos() * a.cos(), e.cos() * a.sin(), e.sin());
                let hits = places.iter().filter_map(|c| {
                    let ahead = c.dot(&direction);
                    let deep2 = radius_m.powi(2) - (c - direction * ahead).norm_squared();
                    (ahead > 0.0 && deep2 > 0.0).then(|| ahead - deep2.sqrt())
                });
                hold.bright.extend(hits.map(|range_m| Beam {
                    direction: Unit::new_normalize(direction),
                    range_m,
                    sigma_m: 0.005,
                    intensity: 200.0,
                    ring,
                    cell: 0,
                }));
            }
        }
        hold
    }

    fn places() -> Vec<Vector3<f64>> {
        vec![
            Vector3::new(9.0, 2.0, 0.3),
            Vector3::new(-7.0, 4.0, -0.5),
            Vector3::new(3.0, -8.0, 0.1),
        ]
    }

    #[test]
    fn every_sphere_is_one_cluster() {
        let found = clusters(&spheres(&places(), 0.2));
        assert_eq!(found.len(), 3);
        for place in places() {
            // Echoes lie on the near side, half to one radius before the middle.
            let near = |c: &&Cluster| (c.middle_m - place).norm() < 0.2;
            assert_eq!(found.iter().filter(near).count(), 1);
        }
    }

    #[test]
    fn the_turn_is_found_from_spheres_though_one_is_hidden() {
        let found = clusters(&spheres(&places()[..2], 0.2));
        // The sensor's z is up here; the world's is y.
        let upright = Rotation3::from_axis_angle(&Vector3::x_axis(), -std::f64::consts::FRAC_PI_2);
        let turned = Rotation3::from_axis_angle(&Vector3::y_axis(), 0.2);
        let wanted: Vec<_> = places()
            .iter()
            .map(|p| Wanted {
                from_m: turned * (upright * p),
                half_m: 0.2,
            })
            .collect();
        let (turn, count) = turn(&found, &upright, &wanted, 0.35).unwrap();
        assert_eq!(count, 2);
        // Rings half a degree apart may see a sphere aside by a centimetre at 8 m.
        assert!((turn - 0.2).abs() < 3e-3, "{turn}");
    }

    #[test]
    fn nothing_bright_turns_nothing() {
        let wanted = [Wanted {
            from_m: Vector3::new(5.0, 1.0, 0.0),
            half_m: 0.2,
        }];
        assert!(turn(&[], &Rotation3::identity(), &wanted, 0.35).is_none());
    }
}
