//! Many runs at once, on all cores of this machine.
//!
//! ```text
//!   jobs (what, seed) ──▶ whichever core is free ──▶ results by job: the order of ending changes nothing
//! ```

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// What comes of every job, whichever core did it; the first fault ends all.
pub(super) fn on_all_cores<J: Copy + Ord + Send + Sync, T: Send>(
    jobs: &[J],
    work: impl Fn(J) -> Result<T, String> + Sync,
) -> Result<BTreeMap<J, T>, String> {
    let next = AtomicUsize::new(0);
    let results: Mutex<BTreeMap<J, T>> = Mutex::default();
    let fault: Mutex<Option<String>> = Mutex::default();
    let worker = || {
        while let Some(&job) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
            match work(job) {
                Ok(result) => {
                    results.lock().unwrap_or_else(PoisonError::into_inner).insert(job, result);
                }
                Err(text) => {
                    next.store(jobs.len(), Ordering::Relaxed);
                    fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
                    return;
                }
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(worker);
        }
    });
    let fault = fault.into_inner().unwrap_or_else(PoisonError::into_inner);
    fault.map_or_else(|| Ok(results.into_inner().unwrap_or_else(PoisonError::into_inner)), Err)
}
