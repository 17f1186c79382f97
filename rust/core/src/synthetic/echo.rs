//! From a laser shot to the number that the sensor sends: footprint, noise, drop-outs.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::body::{Body, Pose};
use super::random::Stream;
use super::target::RETROREFLECTIVITY;
use super::terrain::{Hit, Ray, Terrain};
use crate::packet::writer::Echo;

/// The optics and electronics of a sensor.
#[derive(Debug, Clone, Copy)]
pub struct Optics {
    /// Full angle of a beam, rad.
    pub beam_rad: f64,
    /// Standard deviation of a range, metres.
    pub noise_m: f64,
    /// Share of echoes that is lost whatever they meet.
    pub dropout: f64,
    /// Echoes that are closer than this melt into one, metres.
    pub merge_m: f64,
    /// Range at which a matt surface of 10 % gives nineteen echoes in twenty, metres.
    pub range_at_10_percent_m: f64,
    /// Largest range, metres.
    pub max_range_m: f64,
    /// Angle of incidence at which half of the echoes are lost, rad.
    pub grazing_rad: f64,
    /// Error of range that grows with 1 / cos(incidence) - 1, metres.
    pub incidence_bias_m: f64,
    /// Error of range per halving of the light that comes back, against a bright wall, metres.
    pub faint_bias_m: f64,
    /// Error of range to retroreflectors, metres.
    pub retro_bias_m: f64,
    /// Degrees of freedom of the noise: few for heavy tails; 0 = normal.
    pub noise_freedom: u32,
}

/// Echoes nearer than this are not sent.
const MIN_RANGE_M: f64 = 0.5;
/// Rays of a footprint: the middle, six and twelve around it.
const FOOTPRINT_RAYS: usize = 19;

/// Places of the rays within the footprint, in radii: each stands for an equal area.
fn footprint(i: usize) -> (f64, f64) {
    let (radius, angle) = match i {
        0 => (0.0, 0.0),
        1..=6 => (0.46, TAU * i as f64 / 6.0),
        _ => (0.84, TAU * (i as f64 + 0.5) / 12.0),
    };
    (radius * angle.cos(), radius * angle.sin())
}

/// Light that comes back from about one range.
#[derive(Debug, Clone, Copy, Default)]
struct Glow {
    energy: f64,
    range_m: f64,
    cosine: f64,
    brightness: f64,
}

/// What a ray of one sensor can meet at one instant.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// All that stands still.
    pub terrain: &'a Terrain,
    /// The blade.
    pub body: &'a Body,
    /// The blade's state.
    pub pose: Pose<'a>,
    /// Nodes of the blade that the ray can meet; `None` where it passes the blade by far.
    pub nodes: Option<(usize, usize)>,
}

impl View<'_> {
    /// The nearest surface along a ray; with how far the ray passes from the silhouette, and where.
    fn look(&self, ray: &Ray, optics: &Optics) -> (Option<Hit>, Option<(f64, f64)>) {
        let around = Hit::nearer(
            self.terrain.hit(ray, optics.max_range_m),
            self.body.attachments(&self.pose, ray, optics.beam_rad),
        );
        let glance = self.nodes.and_then(|nodes| {
            self.body
                .glance(&self.pose, ray, nodes, 50.0 * optics.beam_rad)
        });
        match glance {
            None => (around, None),
            Some(glance) => (
                Hit::nearer(around, glance.hit),
                Some((glance.inside_m, glance.range_m)),
            ),
        }
    }

    /// All surfaces that light of a beam comes back from, sorted by range, each with its share.
    fn glows(&self, ray: &Ray, optics: &Optics) -> Vec<Glow> {
        let (hit, edge) = self.look(ray, optics);
        let at_edge = edge
            .is_some_and(|(inside_m, range_m)| inside_m.abs() < 0.5 * optics.beam_rad * range_m);
        if !at_edge {
            return hit.map(|hit| Glow::new(&hit, 1.0)).into_iter().collect();
        }
        let across = ray.direction.cross(&Vector3::z()).normalize();
        let up = across.cross(&ray.direction);
        let rays = (0..FOOTPRINT_RAYS).map(|i| {
            let (a, b) = footprint(i);
            let aside = (across * a + up * b) * (0.5 * optics.beam_rad);
            Ray {
                direction: (ray.direction + aside).normalize(),
                ..*ray
            }
        });
        let share = 1.0 / FOOTPRINT_RAYS as f64;
        let hits = rays.filter_map(|ray| self.look(&ray, optics).0);
        let mut glows: Vec<Glow> = hits.map(|hit| Glow::new(&hit, share)).collect();
        glows.sort_by(|a, b| a.range_m.total_cmp(&b.range_m));
        glows
    }
}

impl Glow {
    fn new(hit: &Hit, share: f64) -> Self {
        let brightness = hit.reflectivity * hit.cos_incidence.max(0.0) * share;
        Self {
            energy: brightness / (hit.range_m * hit.range_m),
            range_m: hit.range_m,
            cosine: hit.cos_incidence,
            brightness,
        }
    }

    /// Whether most of the light comes from a retroreflector.
    fn is_retro(&self) -> bool {
        self.brightness > 1.0
    }

    /// 1 to 100 for matt surfaces, above for retroreflectors.
    fn intensity(&self, stream: &mut Stream) -> u8 {
        let scatter = 1.5 * stream.normal();
        if self.is_retro() {
            let above = 130.0 + 120.0 * self.brightness / RETROREFLECTIVITY + 4.0 * scatter;
            return above.round().clamp(101.0, 255.0) as u8;
        }
        (100.0 * self.brightness + scatter)
            .round()
            .clamp(1.0, 100.0) as u8
    }

    fn join(&self, other: &Glow) -> Self {
        let energy = self.energy + other.energy;
        let mean = |a: f64, b: f64| (a * self.energy + b * other.energy) / energy.max(1e-300);
        Self {
            energy,
            range_m: mean(self.range_m, other.range_m),
            cosine: mean(self.cosine, other.cosine),
            brightness: self.brightness + other.brightness,
        }
    }
}

impl Optics {
    /// The strongest echo of a shot as the sensor sends it, or none.
    pub fn shoot(&self, view: &View<'_>, ray: &Ray, offset_m: f64, stream: &mut Stream) -> Echo {
        let glows = view.glows(ray, self);
        let Some(echo) = self.strongest(&glows) else {
            return Echo::default();
        };
        if !stream.happens(self.detection(&echo)) {
            return Echo::default();
        }
        let range_m = echo.range_m + offset_m + self.bias_m(&echo) + self.noise(stream);
        if range_m < MIN_RANGE_M || range_m > self.max_range_m {
            return Echo::default();
        }
        Echo {
            range_m,
            intensity: echo.intensity(stream),
        }
    }

    fn bias_m(&self, echo: &Glow) -> f64 {
        if echo.is_retro() {
            return self.retro_bias_m;
        }
        let slant = 1.0 / echo.cosine.max(0.05) - 1.0;
        let faint = (0.5 / echo.brightness.max(1e-3)).log2().clamp(-1.0, 5.0);
        slant * self.incidence_bias_m + faint * self.faint_bias_m
    }

    /// Student's distribution with the deviation of the noise.
    fn noise(&self, stream: &mut Stream) -> f64 {
        let normal = stream.normal();
        if self.noise_freedom < 3 {
            return self.noise_m * normal;
        }
        let squares: f64 = (0..self.noise_freedom)
            .map(|_| stream.normal().powi(2))
            .sum();
        let freedom = f64::from(self.noise_freedom);
        self.noise_m * normal * ((freedom - 2.0) / squares.max(1e-12)).sqrt()
    }

    /// Neighbours in range melt together; the brightest of what remains is sent.
    fn strongest(&self, glows: &[Glow]) -> Option<Glow> {
        let mut best: Option<Glow> = None;
        for group in glows.chunk_by(|a, b| b.range_m - a.range_m < self.merge_m) {
            let joined = group[1..].iter().fold(group[0], |sum, glow| sum.join(glow));
            if best.is_none_or(|best| joined.energy > best.energy) {
                best = Some(joined);
            }
        }
        best
    }

    fn detection(&self, echo: &Glow) -> f64 {
        let strength = echo.energy * self.range_at_10_percent_m.powi(2) / 0.1;
        let upright = (echo.cosine - self.grazing_rad.cos()) / 0.03;
        (1.0 - self.dropout) * (1.0 - (-3.0 * strength).exp()) / (1.0 + (-upright).exp())
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Subject;
    use super::*;

    fn optics() -> Optics {
        Optics {
            beam_rad: 1e-3,
            noise_m: 0.01,
            dropout: 0.0,
            merge_m: 0.4,
            range_at_10_percent_m: 60.0,
            max_range_m: 100.0,
            grazing_rad: 82f64.to_radians(),
            incidence_bias_m: 0.0,
            faint_bias_m: 0.0,
            retro_bias_m: 0.0,
            noise_freedom: 0,
        }
    }

    fn glow(range_m: f64, cosine: f64, share: f64) -> Glow {
        let hit = Hit {
            range_m,
            cos_incidence: cosine,
            reflectivity: 0.5,
        };
        Glow::new(&hit, share)
    }

    #[test]
    fn near_echoes_melt_and_far_ones_compete() {
        let mixed = optics()
            .strongest(&[glow(10.0, 1.0, 0.5), glow(10.2, 1.0, 0.5)])
            .unwrap();
        assert!((mixed.range_m - 10.098).abs() < 1e-3); // 0.2 m / (1 + (10.2 / 10)^2) from the near one
        let apart = optics()
            .strongest(&[glow(10.0, 1.0, 0.2), glow(12.0, 1.0, 0.8)])
            .unwrap();
        assert_eq!(apart.range_m, 12.0);
    }

    #[test]
    fn weak_and_grazing_echoes_are_lost() {
        let share = |glow| optics().detection(&glow);
        assert!(share(glow(15.0, 0.9, 1.0)) > 0.999);
        assert!((share(glow(15.0, 82f64.to_radians().cos(), 1.0)) - 0.5).abs() < 0.01);
        assert!(share(glow(90.0, 0.02, 1.0)) < 0.1);
    }

    #[test]
    fn heavy_tails_keep_the_deviation() {
        let heavy = Optics {
            noise_freedom: 4,
            ..optics()
        };
        let mut stream = Stream::new(5, Subject::Packet, [0, 0]);
        let draws: Vec<f64> = (0..40_000).map(|_| heavy.noise(&mut stream)).collect();
        let sigma = (draws.iter().map(|d| d * d).sum::<f64>() / 4e4).sqrt();
        // The square of Student's t with 4 degrees has no variance: the deviation settles slowly.
        assert!((sigma - 0.01).abs() < 1.5e-3, "{sigma}");
        let far = draws.iter().filter(|d| d.abs() > 0.04).count();
        // Beyond four deviations: 0.5 % of them, of normal noise 0.006 %.
        assert!(far > 80, "{far}");
    }

    #[test]
    fn retroreflectors_are_told_by_their_brightness() {
        let mut stream = Stream::new(6, Subject::Packet, [0, 0]);
        let retro = |share| {
            Glow::new(
                &Hit {
                    range_m: 20.0,
                    cos_incidence: 0.9,
                    reflectivity: RETROREFLECTIVITY,
                },
                share,
            )
        };
        assert!(retro(1.0).intensity(&mut stream) > 200 && retro(0.2).intensity(&mut stream) > 100);
        assert!(glow(20.0, 1.0, 1.0).intensity(&mut stream) <= 100);
        let biased = Optics {
            faint_bias_m: 0.001,
            ..optics()
        };
        // A quarter of the light of a bright wall: two halvings.
        assert!((biased.bias_m(&glow(20.0, 0.25, 1.0)) - 0.002).abs() < 1e-12);
    }

    #[test]
    fn a_footprint_is_round_and_even() {
        let places: Vec<_> = (0..FOOTPRINT_RAYS).map(footprint).collect();
        let mean = places
            .iter()
            .fold((0.0, 0.0), |sum, p| (sum.0 + p.0, sum.1 + p.1));
        assert!(mean.0.abs() < 1e-12 && mean.1.abs() < 1e-12);
        // The mean square of x over an even disc of radius 1 is a quarter.
        let square = places.iter().map(|p| p.0 * p.0).sum::<f64>() / FOOTPRINT_RAYS as f64;
        assert!((square - 0.25).abs() < 0.02, "{square}");
    }

    #[test]
    fn ranges_scatter_by_the_noise() {
        use super::super::terrain::{Ground, GroundPlan};
        let plan = GroundPlan {
            height_m: 0.0,
            slope: [0.0; 2],
            roughness_m: 0.0,
            correlation_m: 1.0,
            swell_m: 0.0,
        };
        let terrain = Terrain {
            ground: Ground::new(plan, 1),
            wall: None,
            boxes: Vec::new(),
            targets: Vec::new(),
        };
        let body = Body::empty();
        let view = View {
            terrain: &terrain,
            body: &body,
            pose: Pose {
                before: &[],
                after: &[],
                share: 0.0,
            },
            nodes: None,
        };
        let ray = Ray {
            origin_m: Vector3::y() * 10.0,
            direction: -Vector3::y(),
        };
        let mut stream = Stream::new(2, Subject::Packet, [0, 0]);
        let ranges: Vec<f64> = (0..4000)
            .map(|_| optics().shoot(&view, &ray, 0.02, &mut stream).range_m)
            .collect();
        let mean = ranges.iter().sum::<f64>() / 4000.0;
        let sigma = (ranges.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 4000.0).sqrt();
        // Standard errors: 0.16 mm of the mean, 0.11 mm of the deviation; four of each.
        assert!(
            (mean - 10.02).abs() < 7e-4 && (sigma - 0.01).abs() < 5e-4,
            "{mean} {sigma}"
        );
    }
}
