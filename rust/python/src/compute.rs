//! The one way into long computations: without the interpreter lock, on a pool of their own.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::Thread;
use std::time::Duration;

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::error::BorderResult;
use lidar_deflect_core::error::InvalidValue;

/// From one look for Ctrl-C to the next.
const LOOK: Duration = Duration::from_millis(20);

/// Runs `work` without the interpreter lock on `threads` threads (`None`: all processors), then
/// lets a pending Ctrl-C through.
///
/// The pool is local to the call, so that notebooks and worker processes do not oversubscribe.
pub fn compute<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce() -> T + Send,
) -> BorderResult<T> {
    let pool = pool_of(threads)?;
    let result = py.detach(|| pool.install(work));
    py.check_signals()?;
    Ok(result)
}

/// Runs `work` on a thread of its own without the interpreter lock; on Ctrl-C its flag is set, and
/// it is to return soon.
pub fn interruptible<T: Send>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> BorderResult<T> {
    let (stop, is_over) = (AtomicBool::new(false), AtomicBool::new(false));
    let end = Waker {
        is_over: &is_over,
        waits: std::thread::current(),
    };
    let (result, signal) = std::thread::scope(|scope| {
        let flag = &stop;
        let worker = scope.spawn(move || {
            let _end = end;
            work(flag)
        });
        let mut signal = Ok(());
        while !is_over.load(Ordering::Acquire) {
            py.detach(|| std::thread::park_timeout(LOOK));
            if signal.is_ok() {
                signal = py.check_signals();
                stop.store(signal.is_err(), Ordering::Relaxed);
            }
        }
        (worker.join(), signal)
    });
    signal?;
    Ok(result.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
}

/// Wakes who waits for the end of some work when it goes, whether the work came to it or panicked.
struct Waker<'a> {
    is_over: &'a AtomicBool,
    waits: Thread,
}

impl Drop for Waker<'_> {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Release);
        self.waits.unpark();
    }
}

/// As [`compute`], for work that looks at the flag of [`interruptible`] now and then.
pub fn compute_until<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> BorderResult<T> {
    let pool = pool_of(threads)?;
    interruptible(py, |stop| pool.install(|| work(stop)))
}

/// Threads for `compute`'s work, for who has much of it in small parts.
pub fn pool_of(threads: Option<usize>) -> BorderResult<ThreadPool> {
    let pool = ThreadPoolBuilder::new()
        .num_threads(checked_threads(threads)?)
        .build();
    Ok(pool.map_err(|error| InvalidValue {
        name: "threads",
        expected: "a number of threads that the system can start".into(),
        found: error.to_string(),
    })?)
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
