//! Fits and curves: `lidar_deflect.fitting`.

use lidar_deflect_core::fit::{
    Fit, Polynomial, SpaceCurve, SpanAxis, fit_line as line_through, fit_plane as plane_through,
    fit_polynomial as polynomial_through,
};
use nalgebra::{DMatrix, Vector3};
use numpy::PyUntypedArrayMethods;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

use crate::arrays::{self, Cloud, with_points};
use crate::compute::compute;
use crate::error::BorderResult;

/// Coefficients, centre and scale of a polynomial.
#[derive(FromPyObject, IntoPyObject)]
pub struct RawPolynomial(Vec<f64>, f64, f64);

impl From<Polynomial> for RawPolynomial {
    fn from(polynomial: Polynomial) -> Self {
        let (center, scale) = (polynomial.center(), polynomial.scale());
        Self(polynomial.coefficients().to_vec(), center, scale)
    }
}

impl RawPolynomial {
    fn checked(self) -> BorderResult<Polynomial> {
        Ok(Polynomial::new(self.0, self.1, self.2)?)
    }
}

/// Index of the axis and the two polynomials across it.
type RawCurve = (usize, [RawPolynomial; 2]);

fn curve((axis, [first, second]): RawCurve) -> BorderResult<SpaceCurve> {
    Ok(SpaceCurve {
        axis: SpanAxis::from_index(axis)?,
        across: [first.checked()?, second.checked()?],
    })
}

/// Estimate, covariance, rms, count.
type RawFit<'py, T> = (T, Bound<'py, PyArray2<f64>>, f64, usize);

fn raw_fit<T, R>(py: Python<'_>, fit: Fit<T>, raw: impl Fn(T) -> R) -> PyResult<RawFit<'_, R>> {
    let covariance = fit.covariance.as_slice().to_vec().into_pyarray(py); // symmetric: order is the same
    let covariance = covariance.reshape(fit.covariance.shape())?;
    Ok((raw(fit.estimate), covariance, fit.rms, fit.count))
}

/// Normal, offset and centroid of a plane.
type RawPlane = ([f64; 3], f64, [f64; 3]);

/// Plane through points.
#[pyfunction]
fn fit_plane<'py>(
    py: Python<'py>,
    xyz: Cloud<'py>,
    towards_m: [f64; 3],
    threads: Option<usize>,
) -> BorderResult<RawFit<'py, RawPlane>> {
    let towards_m = Vector3::from(towards_m);
    let fit = with_points!(&xyz, |points| compute(py, threads, || {
        plane_through(points, &towards_m)
    })??);
    Ok(raw_fit(py, fit, |p| {
        (p.normal.into(), p.offset_m, p.centroid_m.into())
    })?)
}

/// Line through points: point and direction.
#[pyfunction]
fn fit_line<'py>(
    py: Python<'py>,
    xyz: Cloud<'py>,
    along: [f64; 3],
    threads: Option<usize>,
) -> BorderResult<RawFit<'py, ([f64; 3], [f64; 3])>> {
    let along = Vector3::from(along);
    let fit = with_points!(&xyz, |points| compute(py, threads, || {
        line_through(points, &along)
    })??);
    Ok(raw_fit(py, fit, |l| {
        (l.point_m.into(), l.direction.into())
    })?)
}

/// Polynomial through pairs.
#[pyfunction]
fn fit_polynomial<'py>(
    py: Python<'py>,
    abscissas: PyReadonlyArray1<'py, f64>,
    ordinates: PyReadonlyArray1<'py, f64>,
    degree: usize,
) -> BorderResult<RawFit<'py, RawPolynomial>> {
    let abscissas = arrays::column("t", &abscissas, abscissas.len())?;
    let ordinates = arrays::column("x", &ordinates, abscissas.len())?;
    let fit = polynomial_through(abscissas, ordinates, degree)?;
    Ok(raw_fit(py, fit, RawPolynomial::from)?)
}

/// Values of a polynomial.
#[pyfunction]
fn polynomial_values<'py>(
    py: Python<'py>,
    polynomial: RawPolynomial,
    t: PyReadonlyArray1<'py, f64>,
) -> BorderResult<Bound<'py, PyArray1<f64>>> {
    let t = arrays::column("t", &t, t.len())?;
    Ok(polynomial.checked()?.values(t).into_pyarray(py))
}

/// First derivatives of a polynomial.
#[pyfunction]
fn polynomial_slopes<'py>(
    py: Python<'py>,
    polynomial: RawPolynomial,
    t: PyReadonlyArray1<'py, f64>,
) -> BorderResult<Bound<'py, PyArray1<f64>>> {
    let t = arrays::column("t", &t, t.len())?;
    Ok(polynomial.checked()?.slopes(t).into_pyarray(py))
}

/// Variances of the values of a polynomial.
#[pyfunction]
fn polynomial_variances<'py>(
    py: Python<'py>,
    polynomial: RawPolynomial,
    covariance: PyReadonlyArray2<'py, f64>,
    t: PyReadonlyArray1<'py, f64>,
) -> BorderResult<Bound<'py, PyArray1<f64>>> {
    let polynomial = polynomial.checked()?;
    let unknowns = polynomial.degree() + 1;
    let flat = covariance.reshape([covariance.len()])?;
    let flat = flat.readonly();
    let covariance = arrays::column("covariance", &flat, unknowns * unknowns)?;
    let covariance = DMatrix::from_row_slice(unknowns, unknowns, covariance);
    let t = arrays::column("t", &t, t.len())?;
    Ok(polynomial.variances(&covariance, t).into_pyarray(py))
}

/// Coefficients of the powers of the abscissa itself.
#[pyfunction]
fn polynomial_powers(
    py: Python<'_>,
    polynomial: RawPolynomial,
) -> BorderResult<Bound<'_, PyArray1<f64>>> {
    Ok(polynomial.checked()?.powers().into_pyarray(py))
}

/// Length of a curve.
#[pyfunction]
fn arc_length(raw: RawCurve, from_m: f64, to_m: f64, tolerance_m: f64) -> BorderResult<f64> {
    Ok(curve(raw)?.arc_length_m(from_m, to_m, tolerance_m)?)
}

/// Parameter after a length of curve.
#[pyfunction]
fn walk_arc(raw: RawCurve, from_m: f64, length_m: f64, tolerance_m: f64) -> BorderResult<f64> {
    Ok(curve(raw)?.walk_m(from_m, length_m, tolerance_m)?)
}

/// Points of a curve.
#[pyfunction]
fn curve_points<'py>(
    py: Python<'py>,
    raw: RawCurve,
    t_m: PyReadonlyArray1<'py, f64>,
) -> BorderResult<Bound<'py, PyArray2<f64>>> {
    let t_m = arrays::column("t_m", &t_m, t_m.len())?;
    let points = curve(raw)?.points_m(t_m).into_flattened().into_pyarray(py);
    Ok(points.reshape([t_m.len(), 3])?)
}

/// Distances of points from a curve.
#[pyfunction]
fn curve_distances<'py>(
    py: Python<'py>,
    raw: RawCurve,
    xyz: PyReadonlyArray2<'py, f64>,
) -> BorderResult<Bound<'py, PyArray1<f64>>> {
    let points = arrays::points("xyz", &xyz)?;
    Ok(curve(raw)?.distances_m(points).into_pyarray(py))
}

/// Adds the functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(fit_plane, module)?)?;
    module.add_function(wrap_pyfunction!(fit_line, module)?)?;
    module.add_function(wrap_pyfunction!(fit_polynomial, module)?)?;
    module.add_function(wrap_pyfunction!(polynomial_values, module)?)?;
    module.add_function(wrap_pyfunction!(polynomial_slopes, module)?)?;
    module.add_function(wrap_pyfunction!(polynomial_variances, module)?)?;
    module.add_function(wrap_pyfunction!(polynomial_powers, module)?)?;
    module.add_function(wrap_pyfunction!(arc_length, module)?)?;
    module.add_function(wrap_pyfunction!(walk_arc, module)?)?;
    module.add_function(wrap_pyfunction!(curve_points, module)?)?;
    module.add_function(wrap_pyfunction!(curve_distances, module)?)
}
