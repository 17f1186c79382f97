//! Parameters of steps 6 to 10, from the keywords of Python.

use lidar_deflect_core::cluster::line::LineParams;
use lidar_deflect_core::cluster::radius::{Intervals, RadiusModel};
use lidar_deflect_core::fit::arc::SpanAxis;
use lidar_deflect_core::paper::curves::Degrees;
use lidar_deflect_core::paper::frame::{FrameParams as Core, RadiusRule};
use lidar_deflect_core::paper::tip::TipLimits;
use nalgebra::Point3;
use numpy::{PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays;
use crate::error::BorderResult;

/// Checked parameters of steps 6 to 10; all but the places of the lidars.
#[pyclass(frozen, module = "lidar_deflect._native")]
pub struct FrameParams(Core);

#[pymethods]
impl FrameParams {
    /// `distances_m`: smallest and largest d of each lidar, (lidars, 2), NaN where there is none;
    /// None for a radius from each point's own distance. `contour_radius_m`: 0 for automatic.
    #[new]
    #[pyo3(signature = (
        *, distances_m, intervals, alpha_deg, mu, beta_m, min_points, strict, leading_edge,
        contour_radius_m, contour_min_points, line_degree, line_distance_m, degree_yoz, degree_xoz,
        tip_max_u_m, overhead_m
    ))]
    #[allow(clippy::too_many_arguments)] // keywords of Python
    fn new(
        distances_m: Option<PyReadonlyArray2<'_, f64>>,
        intervals: usize,
        alpha_deg: f64,
        mu: f64,
        beta_m: f64,
        min_points: usize,
        strict: bool,
        leading_edge: PyReadonlyArray1<'_, f64>,
        contour_radius_m: f64,
        contour_min_points: usize,
        line_degree: usize,
        line_distance_m: f64,
        degree_yoz: usize,
        degree_xoz: usize,
        tip_max_u_m: f64,
        overhead_m: Option<f64>,
    ) -> BorderResult<Self> {
        let rule = match &distances_m {
            None => RadiusRule::Continuous,
            Some(ranges) => {
                let ranges = arrays::pairs("distances_m", ranges)?.iter();
                let division = |range: &[f64; 2]| {
                    let seen = !range[0].is_nan();
                    seen.then(|| Intervals::new(range[0], range[1], intervals))
                        .transpose()
                };
                RadiusRule::Intervals(ranges.map(division).collect::<Result<_, _>>()?)
            }
        };
        Ok(Self(Core {
            sensors_m: Vec::new(),
            model: RadiusModel::new(alpha_deg.to_radians(), mu, beta_m, min_points)?,
            rule,
            min_points,
            strict,
            leading_edge: arrays::direction("leading_edge", &leading_edge)?,
            contour_radius_m: (contour_radius_m > 0.0).then_some(contour_radius_m),
            contour_min_points,
            line: LineParams::new(SpanAxis::Z, [line_degree; 2], line_distance_m)?,
            degrees: Degrees::new(degree_yoz, degree_xoz)?,
            tip: TipLimits::new(tip_max_u_m)?,
            overhead_m,
        }))
    }
}

impl FrameParams {
    /// The parameters for lidars at these places, metres, world frame.
    pub fn core(&self, sensors_m: Vec<Point3<f64>>) -> Core {
        Core {
            sensors_m,
            ..self.0.clone()
        }
    }
}
