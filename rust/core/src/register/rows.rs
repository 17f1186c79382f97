//! What is observed, as residuals with their derivatives by every unknown.
//!
//! A residual is observed minus modelled. Derivatives are taken where the model's ray meets the model's
//! surface, never at the measured point: that would carry the residual into the derivative, with the
//! same sign on every echo, and turn the lidars.

use nalgebra::{Rotation3, Unit, Vector3};

use super::field::Around;
use super::hold::Beam;
use super::state::{Layout, LidarState, State, Term};
use super::surface::Height;
use super::target::OnSphere;

/// How steady the direction of a mean ray is, radians: stamps of the azimuth, eccentricity of the encoder.
pub const DIRECTION_U_RAD: f64 = 1e-4;

/// One observation: residual in its unit, its standard deviation, derivatives by the unknowns.
#[derive(Debug, Clone, Default)]
pub struct Row {
    /// Observed minus modelled.
    pub residual: f64,
    /// Standard deviation of the observation.
    pub sigma: f64,
    /// Derivatives of the residual by poses, nuisances, planes and targets: number and value.
    pub border: Vec<(usize, f64)>,
    /// Derivatives of the residual by nodes of the roughness: number and value.
    pub field: Vec<(usize, f64)>,
}

impl Row {
    pub(super) fn vector(&mut self, start: usize, values: &Vector3<f64>) {
        let entries = values.iter().enumerate();
        self.border
            .extend(entries.map(|(k, value)| (start + k, *value)));
    }

    /// Derivatives by a lidar's pose and what is wrong with it, of a ray that ends at `arm` from its
    /// origin on something whose gradient over closing is `slope`.
    fn ray(
        &mut self,
        start: usize,
        beam: &Beam,
        slope: &Vector3<f64>,
        arm: &Vector3<f64>,
        lifted: &Vector3<f64>,
    ) {
        self.vector(start + Term::ROTATION, &arm.cross(slope));
        self.vector(start + Term::POSITION, slope);
        self.border
            .push((start + Term::ELEVATION, slope.dot(lifted)));
        self.border.push((start + Term::SCALE, beam.range_m));
        self.border
            .push((start + Term::OFFSETS + usize::from(beam.ring), 1.0));
    }

    /// Derivatives by the shape of a surface, times `factor`.
    fn shape(&mut self, layout: &Layout, surface: usize, height: &Height, factor: f64) {
        let start = layout.surfaces[surface];
        let basis = height.basis.iter().enumerate();
        self.border
            .extend(basis.map(|(k, value)| (start + k, factor * value)));
        if let Some(around) = &height.around {
            let nodes = around.nodes.iter().zip(around.weights);
            let start = layout.fields[surface];
            self.field
                .extend(nodes.map(|(node, weight)| (start + node, factor * weight)));
        }
    }
}

/// A direction whose elevation above the plane of rotation is larger by `elevation_rad`, and the
/// derivative of the direction by it, sensor frame (z is the spin axis).
pub fn raised(direction: &Unit<Vector3<f64>>, elevation_rad: f64) -> (Vector3<f64>, Vector3<f64>) {
    let level = direction.xy().norm();
    let up = if level < 1e-9 {
        Vector3::zeros()
    } else {
        let (x, y) = (direction.x / level, direction.y / level);
        Vector3::new(-direction.z * x, -direction.z * y, level)
    };
    let (sine, cosine) = elevation_rad.sin_cos();
    let turned = direction.into_inner() * cosine + up * sine;
    (turned, up * cosine - direction.into_inner() * sine)
}

/// A ray as the state has it: range, direction in the world, its derivative by the elevation offset.
struct Aimed {
    range_m: f64,
    direction: Vector3<f64>,
    by_elevation: Vector3<f64>,
}

fn aimed(of: &LidarState, beam: &Beam) -> Aimed {
    let offset = of.offsets_m.get(usize::from(beam.ring)).copied();
    let (direction, by_elevation) = raised(&beam.direction, of.elevation_rad);
    Aimed {
        range_m: beam.range_m * (1.0 + of.scale) + offset.unwrap_or(0.0),
        direction: of.rotation * direction,
        by_elevation: of.rotation * by_elevation,
    }
}

/// The place on a surface where a ray ended.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Which surface.
    pub surface: usize,
    /// Nodes of its roughness around the place.
    pub around: Option<Around>,
    /// So many rays of the same lidar share what the surface hides there.
    pub alike: f64,
    /// How slantwise the ray meets it: 1 / cos(incidence) - 1.
    pub slant: f64,
}

/// A mean ray that met a surface; None where the model's ray meets it nowhere.
pub fn ray(
    state: &State,
    layout: &Layout,
    lidar: usize,
    beam: &Beam,
    place: &Place,
) -> Option<Row> {
    let surface = place.surface;
    let (of, shape) = (&state.lidars[lidar], &state.surfaces[surface]);
    let Aimed {
        range_m,
        direction,
        by_elevation,
    } = aimed(of, beam);
    let range_m = range_m + of.slant_m * place.slant;
    let (meets_m, gradient, height) =
        shape.meet(&of.position_m, &direction, range_m, place.around)?;
    let closing = gradient.dot(&direction);
    let mut row = Row {
        residual: range_m - meets_m,
        sigma: ray_sigma(
            state,
            surface,
            beam,
            meets_m,
            closing.abs() / gradient.norm(),
            &height,
            place.alike,
        ),
        ..Row::default()
    };
    let arm = direction * meets_m; // to the model's intersection
    let lifted = by_elevation * meets_m;
    row.ray(
        layout.lidars[lidar],
        beam,
        &(gradient / closing),
        &arm,
        &lifted,
    );
    row.border.push((layout.slants[lidar], place.slant));
    row.shape(layout, surface, &height, -1.0 / closing);
    Some(row)
}

/// Scatter of the mean, of its direction and of the surface under it, seen along the ray, metres.
fn ray_sigma(
    state: &State,
    surface: usize,
    beam: &Beam,
    range_m: f64,
    cosine: f64,
    height: &Height,
    alike: f64,
) -> f64 {
    let tangent = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine;
    let aimed = range_m * DIRECTION_U_RAD * tangent;
    let rough = state.unseen_m(surface, height) / cosine;
    (beam.sigma_m.powi(2) + aimed.powi(2) + alike * rough.powi(2)).sqrt()
}

/// Rays that pass a sphere's middle by more than this share of its radius meet it nowhere in particular.
const RIM: f64 = 0.98;
/// How smooth a sphere is, metres; alike for as many rays as there are, since patches are large.
const SMOOTH_U_M: f64 = 3e-4;

/// A bright echo of a sphere, of which its lidar has `alike`; None where the model's ray misses it
/// or the target is no sphere. `slack_m` is what the poses may still be off.
pub fn on_sphere(
    state: &State,
    layout: &Layout,
    met: &OnSphere,
    beam: &Beam,
    slack_m: f64,
    alike: f64,
) -> Option<Row> {
    let (of, target) = (&state.lidars[met.lidar], &state.targets[met.target]);
    let radius_m = target.radius_m?;
    let skin_m = of.skins_m.get(met.target)?;
    let ray = aimed(of, beam);
    let from = target.centre_m - of.position_m;
    let ahead_m = from.dot(&ray.direction);
    let aside_m = (from - ray.direction * ahead_m).norm();
    if aside_m > RIM * radius_m {
        return None;
    }
    let meets_m = ahead_m - (radius_m.powi(2) - aside_m.powi(2)).sqrt();
    let arm = ray.direction * meets_m;
    let normal = (arm - from) / radius_m;
    let closing = normal.dot(&ray.direction);
    let aim_m = DIRECTION_U_RAD * meets_m * (1.0 - closing * closing).max(0.0).sqrt() / closing;
    let variance = beam.sigma_m.powi(2) + aim_m.powi(2) + slack_m.powi(2);
    let mut row = Row {
        residual: ray.range_m + of.retro_m + skin_m - meets_m,
        sigma: (variance + alike * SMOOTH_U_M.powi(2)).sqrt(),
        ..Row::default()
    };
    let slope = normal / closing;
    let lifted = ray.by_elevation * meets_m;
    row.ray(layout.lidars[met.lidar], beam, &slope, &arm, &lifted);
    row.vector(layout.targets[met.target], &-slope);
    row.border.push((layout.retro[met.lidar], 1.0));
    row.border.push((layout.skins[met.lidar] + met.target, 1.0));
    Some(row)
}

/// A surveyed point on a surface.
pub fn control(
    state: &State,
    layout: &Layout,
    surface: usize,
    xyz_m: &Vector3<f64>,
    u_m: f64,
) -> Row {
    let (above_m, gradient, height) = state.surfaces[surface].above(xyz_m);
    let mut row = Row {
        residual: above_m,
        sigma: (u_m * gradient.norm()).hypot(state.unseen_m(surface, &height)),
        ..Row::default()
    };
    row.shape(layout, surface, &height, -1.0);
    row
}

/// The surveyed mark of a lidar: three rows along the world's axes.
pub fn position(
    state: &State,
    layout: &Layout,
    lidar: usize,
    mark_m: &Vector3<f64>,
    lever_arm_m: &Vector3<f64>,
    u_m: f64,
) -> [Row; 3] {
    let of = &state.lidars[lidar];
    let arm = of.rotation * lever_arm_m;
    let residual = mark_m + arm - of.position_m;
    let start = layout.lidars[lidar];
    [0, 1, 2].map(|k| {
        let axis = Vector3::ith(k, 1.0);
        let mut row = Row {
            residual: residual[k],
            sigma: u_m,
            ..Row::default()
        };
        row.vector(start + Term::ROTATION, &arm.cross(&axis));
        row.border.push((start + Term::POSITION + k, -1.0));
        row
    })
}

/// How a lidar is mounted: three rows, the rotation that is left from there, radians.
pub fn mounting(
    state: &State,
    layout: &Layout,
    lidar: usize,
    nominal: &Rotation3<f64>,
    u_rad: f64,
) -> [Row; 3] {
    let left = (state.lidars[lidar].rotation * nominal.inverse()).scaled_axis();
    let angle = left.norm();
    // Derivative of the rotation vector by a small turn on the left: inverse left Jacobian of SO(3).
    let cross = left.cross_matrix();
    let factor = match angle < 1e-4 {
        true => 1.0 / 12.0,
        false => (1.0 - angle / 2.0 / (angle / 2.0).tan()) / (angle * angle),
    };
    let inverse = nalgebra::Matrix3::identity() - cross * 0.5 + cross * cross * factor;
    let start = layout.lidars[lidar] + Term::ROTATION;
    [0, 1, 2].map(|k| {
        let mut row = Row {
            residual: -left[k],
            sigma: u_rad,
            ..Row::default()
        };
        row.vector(start, &-inverse.row(k).transpose());
        row
    })
}

/// A direction of the sensor that is up: two rows, its level components in the world, radians.
pub fn gravity(
    state: &State,
    layout: &Layout,
    lidar: usize,
    up_in_sensor: &Unit<Vector3<f64>>,
    u_rad: f64,
) -> [Row; 2] {
    let up = state.lidars[lidar].rotation * up_in_sensor.into_inner();
    let start = layout.lidars[lidar] + Term::ROTATION;
    [0, 2].map(|k| {
        let axis: Vector3<f64> = Vector3::ith(k, 1.0);
        let mut row = Row {
            residual: -up[k],
            sigma: u_rad,
            ..Row::default()
        };
        row.vector(start, &-up.cross(&axis)); // (w x up) . axis = w . (up x axis)
        row
    })
}

/// A taped distance between two optical centres.
pub fn distance(state: &State, layout: &Layout, between: [usize; 2], m: f64, u_m: f64) -> Row {
    let [a, b] = between.map(|k| &state.lidars[k]);
    let from = b.position_m - a.position_m;
    let length = from.norm().max(1e-6);
    let mut row = Row {
        residual: m - length,
        sigma: u_m,
        ..Row::default()
    };
    row.vector(layout.lidars[between[0]] + Term::POSITION, &(from / length));
    row.vector(
        layout.lidars[between[1]] + Term::POSITION,
        &(-from / length),
    );
    row
}

/// The survey of a target: three rows.
pub fn target(
    state: &State,
    layout: &Layout,
    target: usize,
    xyz_m: &Vector3<f64>,
    u_m: f64,
) -> [Row; 3] {
    let residual = xyz_m - state.targets[target].centre_m;
    [0, 1, 2].map(|k| Row {
        residual: residual[k],
        sigma: u_m,
        border: vec![(layout.targets[target] + k, -1.0)],
        ..Row::default()
    })
}
