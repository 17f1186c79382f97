//! Steps 6 to 10 for one frame: from the points in the box to contour curves and tip.

use nalgebra::{Point3, Unit, Vector3};

use super::curves::{ContourCurve, Degrees, fit_contour};
use super::frames::{Frame, Share};
use super::sections::MidLine;
use super::tip::{NoTip, Plane, Tip, TipLimits, intersect};
use crate::blade::contour::{LineExtremes, line_extremes};
use crate::cluster::dbscan::{DbscanParams, dbscan};
use crate::cluster::line::{LineParams, line_clusters};
use crate::cluster::radius::{Intervals, RadiusModel};
use crate::cluster::{NOISE, is_noise};
use crate::error::InvalidValue;
use crate::fit::Fit;
use crate::fit::polynomial::Polynomial;
use crate::time::Timestamp;

/// How step 6 chooses its radius by equation (10).
#[derive(Debug, Clone)]
pub enum RadiusRule {
    /// From the right edge of the interval of d; one division per lidar, `None` for a lidar that
    /// never saw the blade.
    Intervals(Vec<Option<Intervals>>),
    /// From each point's own distance.
    Continuous,
}

/// Parameters of steps 6 to 10, checked where they are made.
#[derive(Debug, Clone)]
pub struct FrameParams {
    /// Optical centres of the lidars, metres, world frame.
    pub sensors_m: Vec<Point3<f64>>,
    /// Step 6: equation (10).
    pub model: RadiusModel,
    /// Step 6: the distance that goes into it.
    pub rule: RadiusRule,
    /// Step 6: `MinPts`.
    pub min_points: usize,
    /// Step 6: core if more than `MinPts`, as printed, instead of at least.
    pub strict: bool,
    /// Step 7: direction of the leading edge along the chord, world frame.
    pub leading_edge: Unit<Vector3<f64>>,
    /// Step 8: radius along one contour; `None` for 1.5 times the largest distance between lines.
    pub contour_radius_m: Option<f64>,
    /// Step 8: `MinPts` along one contour.
    pub contour_min_points: usize,
    /// Step 8: degree of the curve through a cluster and D of (13).
    pub line: LineParams,
    /// Step 9.
    pub degrees: Degrees,
    /// Step 10.
    pub tip: TipLimits,
    /// Step 12: a lidar nearer than this to the vertical below the blade gives no points; `None`
    /// where the view from below is a good one.
    pub overhead_m: Option<f64>,
}

/// What became of one lidar's share.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ShareUse {
    /// Whether the lidar gave a sweep.
    pub present: bool,
    /// Whether packets were lost where it saw the blade.
    pub lost: bool,
    /// Whether the blade was overhead and the points were left out.
    pub overhead: bool,
    /// Points in the box.
    pub points: u32,
    /// Points that are not noise, and were used.
    pub used: u32,
}

/// Both contours of a frame.
#[derive(Debug, Clone)]
pub struct Contours {
    /// Leading edge.
    pub leading: ContourCurve,
    /// Trailing edge.
    pub trailing: ContourCurve,
}

impl Contours {
    /// The line between them.
    ///
    /// # Errors
    /// [`InvalidValue`] where their coefficients are not finite.
    pub fn middle(&self) -> Result<MidLine, InvalidValue> {
        MidLine::new(&self.leading, &self.trailing)
    }

    /// Leading minus trailing edge at `z_m`, metres; nothing along z by construction.
    pub fn chord_m(&self, z_m: f64) -> [f64; 3] {
        let across = |a: &Fit<Polynomial>, b: &Fit<Polynomial>| {
            a.estimate.value(z_m) - b.estimate.value(z_m)
        };
        let (a, b) = (&self.leading, &self.trailing);
        [across(&a.x, &b.x), across(&a.y, &b.y), 0.0]
    }
}

/// A contour cluster that did not agree with the others (step 8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rejected {
    /// Its centre, metres, world frame.
    pub centre_m: [f64; 3],
    /// Its samples.
    pub count: u32,
    /// Whether it was noise along the contour, or a cluster apart from the line of the others.
    pub reason: &'static str,
}

/// One frame after steps 6 to 10.
#[derive(Debug, Clone)]
pub struct FrameContours {
    /// Middle of the frame.
    pub time: Timestamp,
    /// Per lidar.
    pub uses: Vec<ShareUse>,
    /// Contour curves; `None` where too few samples were left.
    pub contours: Option<Contours>,
    /// Tip on each plane.
    pub tips: [Result<Tip, NoTip>; 2],
    /// Samples of leading and trailing edge that were left out.
    pub rejected: Vec<Rejected>,
}

impl FrameContours {
    /// Tip on one plane.
    pub fn tip(&self, plane: Plane) -> Result<Tip, NoTip> {
        self.tips[match plane {
            Plane::Xoz => 0,
            Plane::Yoz => 1,
        }]
    }
}

/// Points of one lidar that are not noise (step 6).
#[derive(Debug, Clone, Default)]
pub struct BladePoints {
    /// Positions, metres, world frame.
    pub points_m: Vec<[f32; 3]>,
    /// Their beams.
    pub rings: Vec<u16>,
}

impl BladePoints {
    /// At most about `count` of them, evenly chosen.
    pub fn thinned(&self, count: usize) -> Self {
        let step = self.rings.len().div_ceil(count.max(1)).max(1);
        Self {
            points_m: self.points_m.iter().step_by(step).copied().collect(),
            rings: self.rings.iter().step_by(step).copied().collect(),
        }
    }
}

/// Steps 6 to 10; beside them what step 6 left of each lidar's points.
pub fn frame_contours(frame: &Frame, params: &FrameParams) -> (FrameContours, Vec<BladePoints>) {
    let (uses, blades): (Vec<_>, Vec<_>) = frame
        .shares
        .iter()
        .enumerate()
        .map(|(lidar, share)| blade_of(share, lidar, params))
        .unzip();
    let lines: Vec<Vec<LineExtremes>> = blades
        .iter()
        .map(|blade| line_extremes(&blade.points_m, &blade.rings, &params.leading_edge))
        .collect();
    let mut rejected = Vec::new();
    let mut curve = |edge: fn(&LineExtremes) -> [f64; 3]| {
        let kept = agreeing_samples(&lines, edge, params, &mut rejected);
        fit_contour(&kept, params.degrees).ok()
    };
    let contours = match (curve(|line| line.leading_m), curve(|line| line.trailing_m)) {
        (Some(leading), Some(trailing)) => Some(Contours { leading, trailing }),
        _ => None,
    };
    let tips = [Plane::Xoz, Plane::Yoz].map(|plane| match &contours {
        Some(Contours { leading, trailing }) => intersect(leading, trailing, plane, &params.tip),
        None => Err(NoTip::NoIntersection),
    });
    let found = FrameContours {
        time: frame.time,
        uses,
        contours,
        tips,
        rejected,
    };
    (found, blades)
}

/// Steps 12 and 6 for one lidar: leave an overhead blade out, then drop the noise.
fn blade_of(share: &Share, lidar: usize, params: &FrameParams) -> (ShareUse, BladePoints) {
    let mut used = ShareUse {
        present: share.present,
        lost: share.lost_on_blade,
        overhead: is_overhead(share, &params.sensors_m[lidar], params.overhead_m),
        points: share.points_m.len() as u32,
        used: 0,
    };
    if used.overhead {
        return (used, BladePoints::default());
    }
    let blade = without_noise(share, lidar, params);
    used.used = blade.points_m.len() as u32;
    (used, blade)
}

/// Whether the blade is nearer to the vertical above the sensor than the limit.
fn is_overhead(share: &Share, sensor_m: &Point3<f64>, limit_m: Option<f64>) -> bool {
    let Some(limit_m) = limit_m else { return false };
    let aside = |p: &[f32; 3]| (f64::from(p[0]) - sensor_m.x).hypot(f64::from(p[2]) - sensor_m.z);
    share.points_m.iter().any(|p| aside(p) < limit_m)
}

fn without_noise(share: &Share, lidar: usize, params: &FrameParams) -> BladePoints {
    // Points of a box are finite and their radii positive, so nothing can refuse them.
    let tell = |made| is_noise(&share.points_m, &share.rings, &made).ok();
    let Some(noise) = clustering(share, lidar, params).and_then(tell) else {
        return BladePoints::default();
    };
    BladePoints {
        points_m: without(&share.points_m, &noise),
        rings: without(&share.rings, &noise),
    }
}

fn without<T: Copy>(values: &[T], noise: &[bool]) -> Vec<T> {
    let kept = values.iter().zip(noise).filter(|(_, noise)| !**noise);
    kept.map(|(value, _)| *value).collect()
}

/// Parameters of step 6 for one share; `None` where it has no points or its lidar no distances.
fn clustering(share: &Share, lidar: usize, params: &FrameParams) -> Option<DbscanParams<'static>> {
    let sensor = &params.sensors_m[lidar];
    let distance_m = share.distance_m(sensor)?;
    let made = match &params.rule {
        RadiusRule::Intervals(divisions) => {
            let edge_m = divisions.get(lidar)?.as_ref()?.right_edge_m(distance_m);
            DbscanParams::new(params.model.radius_m(edge_m), params.min_points)
        }
        RadiusRule::Continuous => {
            let radii = params
                .model
                .radii_m(&share.points_m, (*sensor).into())
                .ok()?;
            DbscanParams::new(radii, params.min_points)
        }
    };
    made.ok()
        .map(|made| if params.strict { made.strict() } else { made })
}

/// Step 8: samples of one contour that agree on a line; the others are listed with their reason.
fn agreeing_samples(
    lines: &[Vec<LineExtremes>],
    edge: fn(&LineExtremes) -> [f64; 3],
    params: &FrameParams,
    rejected: &mut Vec<Rejected>,
) -> Vec<[f64; 3]> {
    let samples: Vec<[f64; 3]> = lines.iter().flatten().map(edge).collect();
    let Some(radius_m) = params
        .contour_radius_m
        .or_else(|| line_radius_m(lines, edge))
    else {
        return Vec::new();
    };
    let Ok(clustering) = DbscanParams::new(radius_m, params.contour_min_points) else {
        return Vec::new();
    };
    let Ok(labels) = dbscan(&samples, &clustering) else {
        return Vec::new();
    };
    let Ok(judged) = line_clusters(&samples, labels.as_slice(), &params.line) else {
        return Vec::new(); // all samples are noise
    };
    rejected.extend(noise(&samples, labels.as_slice()));
    rejected.extend(judged.left().map(|cluster| Rejected {
        centre_m: cluster.center_m,
        count: cluster.count as u32,
        reason: "off_the_line",
    }));
    samples
        .into_iter()
        .zip(judged.keep)
        .filter(|(_, keep)| *keep)
        .map(|(p, _)| p)
        .collect()
}

fn noise<'a>(samples: &'a [[f64; 3]], labels: &'a [i32]) -> impl Iterator<Item = Rejected> + 'a {
    let alone = samples
        .iter()
        .zip(labels)
        .filter(|(_, label)| **label == NOISE);
    alone.map(|(sample, _)| Rejected {
        centre_m: *sample,
        count: 1,
        reason: "alone",
    })
}

/// 1.5 times the largest distance along the span between lines of neighbouring beams.
fn line_radius_m(lines: &[Vec<LineExtremes>], edge: fn(&LineExtremes) -> [f64; 3]) -> Option<f64> {
    const FACTOR: f64 = 1.5;
    let neighbours = lines.iter().flat_map(|of_lidar| of_lidar.windows(2));
    let adjacent = neighbours.filter(|pair| pair[0].ring.abs_diff(pair[1].ring) == 1);
    let spacing = adjacent.map(|pair| (edge(&pair[1])[2] - edge(&pair[0])[2]).abs());
    spacing
        .reduce(f64::max)
        .map(|largest| FACTOR * largest)
        .filter(|radius| *radius > 0.0)
}
