//! Clusters: `lidar_deflect.clustering`.

use lidar_deflect_core::cluster::line::ContourCluster;
use lidar_deflect_core::cluster::{
    DbscanParams, Fate, Intervals, LineParams, Radius, RadiusModel, dbscan as cluster_points,
    line_clusters as cluster_lines,
};
use lidar_deflect_core::fit::SpanAxis;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{self, Cloud, with_points};
use crate::compute::compute;
use crate::error::BorderResult;
use crate::fit::RawPolynomial;

/// Angle (rad), factor, constant part (m) and least number of points of a radius model.
type RawModel = (f64, f64, f64, usize);

fn model((alpha_rad, mu, beta_m, min_points): RawModel) -> BorderResult<RadiusModel> {
    Ok(RadiusModel::new(alpha_rad, mu, beta_m, min_points)?)
}

/// Labels with one radius.
#[pyfunction]
fn dbscan<'py>(
    py: Python<'py>,
    xyz: Cloud<'py>,
    radius_m: f64,
    min_points: usize,
    strict: bool,
    threads: Option<usize>,
) -> BorderResult<Bound<'py, PyArray1<i32>>> {
    label(py, &xyz, radius_m.into(), min_points, strict, threads)
}

/// Labels with a radius per point.
#[pyfunction]
fn dbscan_radii<'py>(
    py: Python<'py>,
    xyz: Cloud<'py>,
    radii_m: PyReadonlyArray1<'py, f64>,
    min_points: usize,
    strict: bool,
    threads: Option<usize>,
) -> BorderResult<Bound<'py, PyArray1<i32>>> {
    let radii_m = arrays::column("radius_m", &radii_m, radii_m.len())?;
    label(py, &xyz, radii_m.into(), min_points, strict, threads)
}

fn label<'py>(
    py: Python<'py>,
    xyz: &Cloud<'py>,
    radius_m: Radius<'_>,
    min_points: usize,
    strict: bool,
    threads: Option<usize>,
) -> BorderResult<Bound<'py, PyArray1<i32>>> {
    let params = DbscanParams::new(radius_m, min_points)?;
    let params = if strict { params.strict() } else { params };
    let labels = with_points!(xyz, |points| compute(py, threads, || {
        cluster_points(points, &params)
    })??);
    Ok(labels.into_vec().into_pyarray(py))
}

/// Radii at distances.
#[pyfunction]
fn radii_at<'py>(
    py: Python<'py>,
    raw: RawModel,
    distances_m: PyReadonlyArray1<'py, f64>,
) -> BorderResult<Bound<'py, PyArray1<f64>>> {
    let distances_m = arrays::column("distance_m", &distances_m, distances_m.len())?;
    Ok(model(raw)?.radii_at_m(distances_m).into_pyarray(py))
}

/// Radii of points by their distance from an origin.
#[pyfunction]
fn radii_of<'py>(
    py: Python<'py>,
    raw: RawModel,
    xyz: Cloud<'py>,
    origin_m: [f64; 3],
) -> BorderResult<Bound<'py, PyArray1<f64>>> {
    let model = model(raw)?;
    let radii_m = with_points!(&xyz, |points| model.radii_m(points, origin_m)?);
    Ok(radii_m.into_pyarray(py))
}

/// Right edges of the intervals that hold distances.
#[pyfunction]
fn right_edges<'py>(
    py: Python<'py>,
    min_m: f64,
    max_m: f64,
    count: usize,
    distances_m: PyReadonlyArray1<'py, f64>,
) -> BorderResult<Bound<'py, PyArray1<f64>>> {
    let distances_m = arrays::column("distance_m", &distances_m, distances_m.len())?;
    let intervals = Intervals::new(min_m, max_m, count)?;
    Ok(intervals.right_edges_m(distances_m).into_pyarray(py))
}

/// Label, count, centre, the two polynomials, is reduced, supporters, distance, is kept.
type RawCluster = (
    i32,
    usize,
    [f64; 3],
    [RawPolynomial; 2],
    bool,
    usize,
    f64,
    bool,
);
/// Clusters, the chosen one, which samples are kept, number of noise samples.
type RawLines<'py> = (Vec<RawCluster>, usize, Bound<'py, PyArray1<bool>>, usize);

/// Pieces of a contour on one curve.
#[pyfunction]
fn line_clusters<'py>(
    py: Python<'py>,
    samples_m: PyReadonlyArray2<'py, f64>,
    labels: PyReadonlyArray1<'py, i32>,
    axis: usize,
    degrees: [usize; 2],
    reach_m: f64,
) -> BorderResult<RawLines<'py>> {
    let samples_m = arrays::points("samples_m", &samples_m)?;
    let labels = arrays::column("labels", &labels, samples_m.len())?;
    let params = LineParams::new(SpanAxis::from_index(axis)?, degrees, reach_m)?;
    let found = cluster_lines(samples_m, labels, &params)?;
    let clusters = found.clusters.into_iter().map(raw_cluster).collect();
    Ok((
        clusters,
        found.chosen,
        found.keep.into_pyarray(py),
        found.noise,
    ))
}

fn raw_cluster(cluster: ContourCluster) -> RawCluster {
    (
        cluster.label,
        cluster.count,
        cluster.center_m,
        cluster.curve.across.map(RawPolynomial::from),
        cluster.is_reduced,
        cluster.supporters,
        cluster.distance_m,
        cluster.fate == Fate::Kept,
    )
}

/// Adds the functions to the module.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(dbscan, module)?)?;
    module.add_function(wrap_pyfunction!(dbscan_radii, module)?)?;
    module.add_function(wrap_pyfunction!(radii_at, module)?)?;
    module.add_function(wrap_pyfunction!(radii_of, module)?)?;
    module.add_function(wrap_pyfunction!(right_edges, module)?)?;
    module.add_function(wrap_pyfunction!(line_clusters, module)?)
}
