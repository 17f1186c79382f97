//! First guesses without a mounting: how a lidar stands, from the planes and targets that it sees.
//!
//! Planes are found in its scan whatever way it is turned; named planes and targets of the survey are laid
//! onto what was found in every way that angles and distances allow, and the way is kept in which most rays
//! end on the surveyed surfaces, if no other does nearly as well.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::hold::{Beam, Hold};
use super::start::point;
use super::surface::Surface;
use super::target::{Cluster, Target, clusters};
use crate::fit::plane::{Plane, fit_plane};

/// What a lidar is known to be surrounded by.
#[derive(Debug, Clone, Copy)]
pub struct Yard<'a> {
    /// Surveyed surfaces.
    pub surfaces: &'a [Surface],
    /// Surveyed targets.
    pub targets: &'a [Target],
    /// Where the lidar stands, if that was surveyed, world frame, metres.
    pub position_m: Option<Vector3<f64>>,
}

/// A way in which a lidar may stand.
#[derive(Debug, Clone, Copy)]
pub struct Stand {
    /// World from sensor.
    pub rotation: Rotation3<f64>,
    /// World frame, metres.
    pub position_m: Vector3<f64>,
}

/// What the search found.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    /// The best way.
    pub stand: Stand,
    /// How much speaks for it: share of the rays that end on surveyed surfaces, and targets seen.
    pub score: f64,
    /// The same of the best way that is another one.
    pub rival: f64,
}

impl Found {
    /// Whether nothing else fits nearly as well.
    pub fn is_clear(&self) -> bool {
        self.score >= LEAST_SCORE && self.rival < RIVAL * self.score
    }
}

/// Less than this is chance.
const LEAST_SCORE: f64 = 0.15;
/// Another way that fits as well as this leaves it open which is right.
const RIVAL: f64 = 0.85;
/// Ways nearer to one another than this are the same one, radians and metres.
const SAME_RAD: f64 = 0.1;
const SAME_M: f64 = 1.0;
/// Planes that are looked for, and points that each needs, of those that are tried.
const PLANES: usize = 8;
const LEAST_ON: usize = 25;
const TRIED: usize = 3000;
const TRIALS: usize = 300;
/// Points within this of a plane are on it, metres; three of this distance make one.
const ON_M: f64 = 0.08;
const PATCH_M: f64 = 4.0;
/// Angles and lengths agree to within this, radians (cosine differs by no more), metres and per metre.
const ALIKE_COSINE: f64 = 0.06;
/// Normals are laid onto others to within 3 degrees.
const TURNED_COSINE: f64 = 0.9986;
const ALIKE_M: f64 = 0.3;
const ALIKE: f64 = 0.02;
/// Normals whose volume, or sine of the angle between two, is less than this fix nothing.
const APART: f64 = 0.25;
/// Bright things that are tried.
const BRIGHT: usize = 14;
/// Of a sphere's echoes the mean lies so far before its middle, in radii.
const BEFORE_MIDDLE: f64 = 0.75;
/// What a seen target counts for, in shares of all rays.
const TARGET_SCORE: f64 = 0.1;
/// Rays that say how well a stand fits.
const JUDGES: usize = 1500;

/// The stand of a lidar that fits the yard best; None where nothing fits at all.
pub fn stand(hold: &Hold, yard: &Yard<'_>) -> Option<Found> {
    let seen = Seen::of(hold);
    let scored = seen
        .stands(yard)
        .into_iter()
        .map(|stand| (seen.score(&stand, yard), stand));
    let mut scored: Vec<_> = scored.collect();
    scored.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (score, best) = *scored.first()?;
    let other = scored.iter().find(|(_, stand)| !stand.is_like(&best));
    Some(Found {
        stand: best,
        score,
        rival: other.map_or(0.0, |(score, _)| *score),
    })
}

impl Stand {
    fn world(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.position_m + self.rotation * point_m
    }

    fn is_like(&self, other: &Self) -> bool {
        // The norm of the difference of two rotations is the chord of the angle, times the root of two.
        let apart = (self.rotation.matrix() - other.rotation.matrix()).norm() / 2f64.sqrt();
        apart < SAME_RAD && (self.position_m - other.position_m).norm() < SAME_M
    }
}

/// What a lidar sees that can be recognised, sensor frame.
struct Seen {
    planes: Vec<Plane>,
    bright: Vec<Cluster>,
    rays: Vec<Vector3<f64>>,
}

impl Seen {
    fn of(hold: &Hold) -> Self {
        let every = |most: usize| hold.beams.len().div_ceil(most).max(1);
        let rays = hold.beams.iter().step_by(every(JUDGES));
        let mut bright = clusters(hold);
        bright.truncate(BRIGHT);
        Self {
            planes: planes(hold.beams.iter().step_by(every(TRIED))),
            bright,
            rays: rays.map(|beam| point(beam).into()).collect(),
        }
    }

    fn stands(&self, yard: &Yard<'_>) -> Vec<Stand> {
        let mut all = match &yard.position_m {
            Some(at_m) => self.turned(yard, at_m),
            None => self.by_planes(yard.surfaces),
        };
        all.extend(self.by_targets(yard));
        all
    }

    /// Two planes, two targets, or one of each, about a known place.
    fn turned(&self, yard: &Yard<'_>, at_m: &Vector3<f64>) -> Vec<Stand> {
        let mut arrows = self.normals(yard.surfaces, at_m);
        arrows.extend(self.bearings(yard.targets, at_m));
        let mut all = Vec::new();
        for (k, a) in arrows.iter().enumerate() {
            for b in arrows.iter().skip(k + 1).filter(|b| a.agrees(b)) {
                let rotation = rotation(&[a.pair(), b.pair()]);
                all.extend(rotation.map(|rotation| Stand {
                    rotation,
                    position_m: *at_m,
                }));
            }
        }
        all
    }

    /// Normals of planes that lie as far off as a surveyed surface does, towards the lidar.
    fn normals(&self, surfaces: &[Surface], at_m: &Vector3<f64>) -> Vec<Arrow> {
        let pairs = surfaces.iter().enumerate().flat_map(|(k, surface)| {
            let [_, _, above_m] = surface.frame.local(at_m);
            let alike = self.planes.iter().enumerate();
            let alike = alike.filter(move |(_, p)| alike_m(p.offset_m.abs(), above_m.abs()));
            alike.map(move |(own, plane)| Arrow {
                of: (own, k),
                sensor: plane.normal,
                world: surface.frame.normal.into_inner() * above_m.signum(),
            })
        });
        pairs.collect()
    }

    /// Directions to bright things that lie as far off as a target does.
    fn bearings(&self, targets: &[Target], at_m: &Vector3<f64>) -> Vec<Arrow> {
        let pairs = targets.iter().enumerate().flat_map(|(k, target)| {
            let from = target.centre_m - at_m;
            let alike = self.bright.iter().enumerate();
            alike.filter_map(move |(own, cluster)| {
                let seen = middle(cluster, target);
                alike_m(seen.norm(), from.norm()).then(|| Arrow {
                    of: (PLANES + own, usize::MAX - k),
                    sensor: seen.normalize(),
                    world: from.normalize(),
                })
            })
        });
        pairs.collect()
    }

    /// Three planes that stand to one another as three surveyed surfaces do.
    fn by_planes(&self, surfaces: &[Surface]) -> Vec<Stand> {
        let mut all = Vec::new();
        for [i, j, k] in triples(surfaces.len()).filter(|[i, j, k]| i < j && j < k) {
            let wanted = [i, j, k].map(|s| &surfaces[s].frame);
            let normals =
                [i, j, k].map(|s| side(s, surfaces) * surfaces[s].frame.normal.into_inner());
            let standing = Matrix3::from_columns(&normals).transpose();
            if standing.determinant().abs() < APART {
                continue;
            }
            let solve = standing.lu();
            for own in triples(self.planes.len()) {
                let planes = own.map(|p| &self.planes[p]);
                let Some(rotation) = agreeing(&[0, 1, 2].map(|n| (planes[n].normal, normals[n])))
                else {
                    continue;
                };
                // normal . (p - origin) is the distance of the lidar.
                let levels =
                    [0, 1, 2].map(|n| planes[n].offset_m + normals[n].dot(&wanted[n].origin_m));
                let position_m = solve.solve(&Vector3::from(levels));
                all.extend(position_m.map(|position_m| Stand {
                    rotation,
                    position_m,
                }));
            }
        }
        all
    }

    /// Three bright things as far from one another as three targets.
    fn by_targets(&self, yard: &Yard<'_>) -> Vec<Stand> {
        let mut all = Vec::new();
        for wanted in triples(yard.targets.len()).filter(|[i, j, k]| i < j && j < k) {
            let targets = wanted.map(|t| &yard.targets[t]);
            let world = targets.map(|target| target.centre_m);
            if (world[1] - world[0]).cross(&(world[2] - world[0])).norm() < 1.0 {
                continue; // on a line, or too near to one another
            }
            for own in triples(self.bright.len()) {
                let seen = [0, 1, 2].map(|n| middle(&self.bright[own[n]], targets[n]));
                let sides = [(0, 1), (1, 2), (2, 0)];
                let far = |p: &[Vector3<f64>; 3], (a, b): (usize, usize)| (p[a] - p[b]).norm();
                if sides
                    .iter()
                    .all(|side| alike_m(far(&seen, *side), far(&world, *side)))
                {
                    all.extend(laid(&seen, &world));
                }
            }
        }
        all
    }

    /// Share of the rays that end on a surveyed surface, less those that pass through one; more for
    /// every target where something bright is.
    fn score(&self, stand: &Stand, yard: &Yard<'_>) -> f64 {
        let met = self
            .rays
            .iter()
            .map(|ray| meets(stand, ray, yard.surfaces))
            .sum::<f64>();
        let seen = yard.targets.iter().filter(|target| {
            self.bright.iter().any(|cluster| {
                let seen = middle(cluster, target);
                let apart_m = (stand.world(&seen) - target.centre_m).norm();
                apart_m < 0.5 * ALIKE_M + ALIKE * seen.norm()
            })
        });
        met / self.rays.len().max(1) as f64 + TARGET_SCORE * seen.count() as f64
    }
}

/// On which side of its normal a surface has the rest of what was surveyed, and so the lidars.
fn side(surface: usize, surfaces: &[Surface]) -> f64 {
    let frame = &surfaces[surface].frame;
    let above = surfaces
        .iter()
        .map(|other| frame.local(&other.frame.origin_m)[2]);
    above.sum::<f64>().signum()
}

/// One for a ray that ends on a surface, minus one for one that ends far behind it.
fn meets(stand: &Stand, ray: &Vector3<f64>, surfaces: &[Surface]) -> f64 {
    let (end, far_m) = (stand.world(ray), ray.norm());
    let near_m = 0.5 * ALIKE_M + 0.5 * ALIKE * far_m;
    let each = surfaces.iter().map(|surface| {
        let [u, v, above_m] = surface.frame.local(&end);
        let side = surface.frame.local(&stand.position_m)[2].signum();
        let [a, b] = surface.frame.half_m;
        match u.abs() < a && v.abs() < b {
            true if above_m.abs() < near_m => 1.0,
            true if above_m * side < -3.0 * near_m => -1.0,
            _ => 0.0,
        }
    });
    each.fold(
        0.0,
        |sum: f64, one| if sum == 0.0 { one } else { sum.max(one) },
    )
}

/// A direction of the sensor that may be one of the world.
#[derive(Debug, Clone, Copy)]
struct Arrow {
    /// Which of those seen, which of those surveyed.
    of: (usize, usize),
    sensor: Vector3<f64>,
    world: Vector3<f64>,
}

impl Arrow {
    fn pair(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.sensor, self.world)
    }

    /// Whether two of them may hold at once and fix a rotation.
    fn agrees(&self, other: &Self) -> bool {
        let cosines = [self.sensor.dot(&other.sensor), self.world.dot(&other.world)];
        self.of.0 != other.of.0
            && self.of.1 != other.of.1
            && (cosines[0] - cosines[1]).abs() < ALIKE_COSINE
            && self.world.cross(&other.world).norm() > APART
    }
}

/// The rotation that lays directions onto others, if all agree.
fn agreeing(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Rotation3<f64>> {
    let rotation = rotation(pairs)?;
    let agree =
        |(from, to): &(Vector3<f64>, Vector3<f64>)| (rotation * from).dot(to) > TURNED_COSINE;
    pairs.iter().all(agree).then_some(rotation)
}

/// The rotation that lays vectors onto others best (Kabsch 1976): a proper one always.
fn rotation(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Rotation3<f64>> {
    let sum: Matrix3<f64> = pairs.iter().map(|(from, to)| to * from.transpose()).sum();
    let parts = sum.svd(true, true);
    let (u, v_t) = (parts.u?, parts.v_t?);
    let mut proper = Matrix3::identity();
    // Of sorted singular values the last one matters least.
    let last = parts.singular_values.imin();
    proper[(last, last)] = (u * v_t).determinant().signum();
    Some(Rotation3::from_matrix_unchecked(u * proper * v_t))
}

/// The stand that lays three points of the sensor onto three of the world.
fn laid(seen: &[Vector3<f64>; 3], world: &[Vector3<f64>; 3]) -> Option<Stand> {
    let mean = |p: &[Vector3<f64>; 3]| p.iter().sum::<Vector3<f64>>() / 3.0;
    let (from, to) = (mean(seen), mean(world));
    let rotation = rotation(&[0, 1, 2].map(|n| (seen[n] - from, world[n] - to)))?;
    Some(Stand {
        rotation,
        position_m: to - rotation * from,
    })
}

/// Where the middle of a target would be, were these its echoes.
fn middle(cluster: &Cluster, target: &Target) -> Vector3<f64> {
    let deeper_m = BEFORE_MIDDLE * target.radius_m.unwrap_or(0.0);
    cluster.middle_m * (1.0 + deeper_m / cluster.middle_m.norm())
}

fn alike_m(a: f64, b: f64) -> bool {
    (a - b).abs() < ALIKE_M + ALIKE * a.min(b)
}

fn triples(count: usize) -> impl Iterator<Item = [usize; 3]> {
    let all = (0..count)
        .flat_map(move |i| (0..count).flat_map(move |j| (0..count).map(move |k| [i, j, k])));
    all.filter(|[i, j, k]| i != j && j != k && i != k)
}

/// The largest planes among rays, one after the other, normals towards the sensor.
fn planes<'a>(beams: impl Iterator<Item = &'a Beam>) -> Vec<Plane> {
    let mut open: Vec<[f64; 3]> = beams.map(point).collect();
    let mut found = Vec::new();
    while found.len() < PLANES
        && let Some(plane) = largest(&open)
    {
        found.push(plane);
        open.retain(|p| plane.distance_m(&Vector3::from(*p)).abs() > 2.0 * ON_M);
    }
    found
}

fn largest(open: &[[f64; 3]]) -> Option<Plane> {
    let tried = (0..TRIALS).filter_map(|trial| patch(open, trial));
    let counted = tried.map(|plane| (on(open, &plane).len(), plane));
    let best = counted.fold(None, |best: Option<(usize, Plane)>, next| match best {
        Some(best) if best.0 >= next.0 => Some(best),
        _ => Some(next),
    })?;
    let mut plane = best.1;
    for _ in 0..3 {
        let points = on(open, &plane);
        if points.len() < LEAST_ON {
            return None;
        }
        plane = fit_plane(&points, &Vector3::zeros()).ok()?.estimate;
    }
    Some(plane)
}

/// The plane of the points around one of them: three points from all over would seldom be of one surface.
fn patch(open: &[[f64; 3]], trial: usize) -> Option<Plane> {
    let middle = Vector3::from(*open.get(trial * 7919 % open.len().max(1))?);
    let near = |p: &&[f64; 3]| (Vector3::from(**p) - middle).norm() < PATCH_M;
    let around: Vec<[f64; 3]> = open.iter().filter(near).copied().collect();
    fit_plane(&around, &Vector3::zeros())
        .ok()
        .map(|fit| fit.estimate)
}

fn on(points: &[[f64; 3]], plane: &Plane) -> Vec<[f64; 3]> {
    let near = |p: &&[f64; 3]| plane.distance_m(&Vector3::from(**p)).abs() < ON_M;
    points.iter().filter(near).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::super::surface::SurfaceFrame;
    use super::*;
    use nalgebra::Unit;

    /// Ground and two walls, each reaching far.
    fn surfaces() -> Vec<Surface> {
        let flat = |origin: [f64; 3], normal: [f64; 3]| {
            let normal = Unit::new_normalize(Vector3::from(normal));
            Surface::flat(SurfaceFrame::new(origin.into(), normal, [40.0, 40.0]))
        };
        vec![
            flat([0.0, -7.0, 90.0], [0.01, 1.0, 0.02]),
            flat([-15.0, 0.0, 90.0], [1.0, 0.0, 0.05]),
            flat([0.0, 0.0, 108.0], [0.1, 0.0, 1.0]),
        ]
    }

    fn targets() -> Vec<Target> {
        let places = [
            [-5.0, -5.5, 92.0],
            [9.0, -5.0, 88.0],
            [6.0, -4.6, 92.5],
            [-6.0, -4.5, 88.5],
        ];
        let sphere = |place: [f64; 3]| Target {
            centre_m: place.into(),
            radius_m: Some(0.2),
        };
        places.map(sphere).into()
    }

    fn true_stand() -> Stand {
        Stand {
            rotation: Rotation3::new(Vector3::new(0.1, -0.15, 0.0))
                * Rotation3::from_axis_angle(&Vector3::z_axis(), 2.4),
            position_m: Vector3::new(2.0, -5.8, 91.0),
        }
    }

    /// What a sensor of 31 rings sees of surfaces and spheres from there.
    fn hold(surfaces: &[Surface], targets: &[Target]) -> Hold {
        let stand = true_stand();
        let mut hold = Hold::default();
        for (ring, azimuth) in (0..31u16).flat_map(|r| (0..1800).map(move |a| (r, a))) {
            let (e, a) = (
                (2.0 * f64::from(ring) - 30.0).to_radians(),
                (0.2 * f64::from(azimuth)).to_radians(),
            );
            let direction = Vector3::new(e.cos() * a.cos(), e.cos() * a.sin(), e.sin());
            let ray = stand.rotation * direction;
            let walls = surfaces.iter().map(|s| {
                let down = s.frame.normal.dot(&ray);
                -s.frame.local(&stand.position_m)[2] / down
            });
            let far_m = walls.filter(|r| *r > 0.0).fold(60.0, f64::min);
            let spheres = targets.iter().filter_map(|t| {
                let from = t.centre_m - stand.position_m;
                let deep_m2 = t.radius_m?.powi(2) - (from - ray * from.dot(&ray)).norm_squared();
                (deep_m2 > 0.0 && from.dot(&ray) > 0.0).then(|| from.dot(&ray) - deep_m2.sqrt())
            });
            let near_m = spheres.fold(f64::INFINITY, f64::min);
            let beam = Beam {
                direction: Unit::new_normalize(direction),
                range_m: far_m.min(near_m),
                sigma_m: 0.005,
                intensity: 30.0,
                ring,
                cell: azimuth,
            };
            if near_m < far_m {
                hold.bright.push(beam);
            } else if far_m < 60.0 {
                hold.beams.push(beam);
            }
        }
        hold
    }

    fn check(surfaces: &[Surface], targets: &[Target], position_m: Option<Vector3<f64>>) {
        let hold = hold(&self::surfaces(), &self::targets());
        let yard = Yard {
            surfaces,
            targets,
            position_m,
        };
        let found = stand(&hold, &yard).unwrap();
        assert!(found.is_clear(), "{found:?}");
        let off = found.stand.rotation.matrix() - true_stand().rotation.matrix();
        // Gates of the adjustment begin at 0.25 m and 20 mrad.
        assert!(off.norm() < 0.02, "{off}");
        assert!((found.stand.position_m - true_stand().position_m).norm() < 0.25);
    }

    #[test]
    fn three_planes_tell_how_a_lidar_stands_whatever_way_it_is_turned() {
        check(&surfaces(), &[], None);
    }

    #[test]
    fn so_do_ground_and_a_wall_about_a_surveyed_place() {
        check(&surfaces()[..2], &[], Some(true_stand().position_m));
    }

    #[test]
    fn so_do_targets_alone() {
        check(&[], &targets(), None);
    }

    #[test]
    fn the_ground_alone_does_not() {
        let hold = hold(&surfaces(), &targets());
        let yard = Yard {
            surfaces: &surfaces()[..1],
            targets: &[],
            position_m: Some(true_stand().position_m),
        };
        assert!(stand(&hold, &yard).is_none_or(|found| !found.is_clear()));
    }
}
