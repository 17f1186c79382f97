//! Single steps of the paper, for people who look at one frame.

use lidar_deflect_core::blade::contour;
use lidar_deflect_core::paper::curves::{Degrees, fit_contour};
use lidar_deflect_core::paper::frame::Contours;
use lidar_deflect_core::paper::passthrough::PassThrough;
use lidar_deflect_core::paper::sections::MidLine;
use lidar_deflect_core::paper::tip::{TipLimits, intersect};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use super::plane_named;
use crate::arrays;
use crate::error::BorderResult;

/// Adds this file's functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(pass_through, module)?)?;
    module.add_function(wrap_pyfunction!(line_extremes, module)?)?;
    module.add_class::<ContourCurves>()
}

/// Step 5: which points (n, 3) lie in a box (2, 3).
#[pyfunction]
fn pass_through<'py>(
    py: Python<'py>,
    xyz: PyReadonlyArray2<'py, f32>,
    box_m: PyReadonlyArray2<'py, f64>,
) -> BorderResult<Bound<'py, PyArray1<bool>>> {
    let points = arrays::points("xyz", &xyz)?;
    let corners = arrays::points("box_m", &box_m)?;
    arrays::expect_rows("box_m", corners.len(), 2)?;
    Ok(PassThrough::new(corners[0], corners[1])?
        .mask(points)
        .into_pyarray(py))
}

/// Step 7: rings (r,), leading (r, 3) and trailing (r, 3) extremes of scan lines.
#[pyfunction]
#[allow(clippy::type_complexity)] // the three columns that Python unpacks
fn line_extremes<'py>(
    py: Python<'py>,
    xyz: PyReadonlyArray2<'py, f32>,
    ring: PyReadonlyArray1<'py, u16>,
    leading_edge: PyReadonlyArray1<'py, f64>,
) -> BorderResult<(
    Bound<'py, PyArray1<u16>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
)> {
    let points = arrays::points("xyz", &xyz)?;
    let rings = arrays::column("ring", &ring, points.len())?;
    let lines = contour::line_extremes(
        points,
        rings,
        &arrays::direction("leading_edge", &leading_edge)?,
    );
    let ring: Vec<u16> = lines.iter().map(|line| line.ring).collect();
    Ok((
        ring.into_pyarray(py),
        arrays::rows(py, lines.iter().map(|line| line.leading_m).collect())?,
        arrays::rows(py, lines.iter().map(|line| line.trailing_m).collect())?,
    ))
}

/// Steps 9 to 11 of one frame: both contour curves, their tip, and points before it.
#[pyclass(frozen, module = "lidar_deflect._native")]
pub struct ContourCurves {
    contours: Contours,
    middle: MidLine,
}

#[pymethods]
impl ContourCurves {
    /// Fits the samples of both edges, (n, 3) each, metres.
    #[new]
    #[pyo3(signature = (leading_m, trailing_m, *, degree_yoz, degree_xoz))]
    fn new(
        leading_m: PyReadonlyArray2<'_, f64>,
        trailing_m: PyReadonlyArray2<'_, f64>,
        degree_yoz: usize,
        degree_xoz: usize,
    ) -> BorderResult<Self> {
        let degrees = Degrees::new(degree_yoz, degree_xoz)?;
        let leading = fit_contour(arrays::points("leading_m", &leading_m)?, degrees)?;
        let trailing = fit_contour(arrays::points("trailing_m", &trailing_m)?, degrees)?;
        let contours = Contours { leading, trailing };
        Ok(Self {
            middle: contours.middle()?,
            contours,
        })
    }

    /// Points of the leading edge, the trailing edge and between them at each z, (z, 3) each.
    #[allow(clippy::type_complexity)] // the three columns that Python unpacks
    fn at<'py>(
        &self,
        py: Python<'py>,
        z_m: PyReadonlyArray1<'py, f64>,
    ) -> BorderResult<(
        Bound<'py, PyArray2<f64>>,
        Bound<'py, PyArray2<f64>>,
        Bound<'py, PyArray2<f64>>,
    )> {
        let places = arrays::values("z_m", &z_m)?;
        let points = |of: &dyn Fn(f64) -> [f64; 3]| places.iter().map(|z| of(*z)).collect();
        Ok((
            arrays::rows(py, points(&|z| self.contours.leading.point_m(z)))?,
            arrays::rows(py, points(&|z| self.contours.trailing.point_m(z)))?,
            arrays::rows(py, points(&|z| self.middle.point_m(z)))?,
        ))
    }

    /// z of the intersection on a plane and its standard uncertainty, metres.
    fn tip(&self, plane: &str, max_u_m: f64) -> BorderResult<(f64, f64)> {
        let Contours { leading, trailing } = &self.contours;
        let tip = intersect(
            leading,
            trailing,
            plane_named(plane)?,
            &TipLimits::new(max_u_m)?,
        )?;
        Ok((tip.z_m, tip.u_z_m))
    }

    /// Arc length of the middle line between two places along z, metres, equation (15).
    fn length_m(&self, from_z_m: f64, to_z_m: f64) -> BorderResult<f64> {
        Ok(self.middle.length_m(from_z_m, to_z_m)?)
    }

    /// Point of the middle line so far before a place along z, metres.
    fn before_m(&self, tip_z_m: f64, length_m: f64) -> BorderResult<[f64; 3]> {
        Ok(self.middle.before_tip_m(tip_z_m, length_m)?)
    }
}
