//! The one way into long computations: without the interpreter lock, on a pool of their own.

use pyo3::prelude::*;
use rayon::ThreadPoolBuilder;

use crate::error::BorderResult;
use lidar_deflect_core::error::InvalidValue;

/// Runs `work` without the interpreter lock on `threads` threads (`None`: all processors), then
/// lets a pending Ctrl-C through.
///
/// The pool is local to the call, so that notebooks and worker processes do not oversubscribe.
pub fn compute<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> BorderResult<T> {
    let pool = ThreadPoolBuilder::new()
        .num_threads(checked_threads(threads)?)
        .build();
    let pool = pool.map_err(|error| InvalidValue {
        name: "threads",
        expected: "a number of threads that the system can start".into(),
        found: error.to_string(),
    })?;
    let result = py.detach(|| pool.install(work));
    py.check_signals()?;
    Ok(result)
}

fn checked_threads(threads: Option<usize>) -> Result<usize, InvalidValue> {
    match threads {
        None => Ok(0), // rayon's word for "as many as there are processors"
        Some(0) => Err(InvalidValue {
            name: "threads",
            expected: "at least 1".into(),
            found: "0".into(),
        }),
        Some(count) => Ok(count),
    }
}
