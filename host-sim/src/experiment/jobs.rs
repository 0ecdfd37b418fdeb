//! Runs the jobs of an experiment on all cores, and keeps their results, so that a run that was cut goes on.
//!
//! ```text
//!   jobs (what, seed) ─┬─ kept already ────────────────┬─▶ results by job: the order of ending changes nothing
//!                      └─ rayon: whichever core is free ┘
//!                                   │
//!   kept file   job, result 00 job, result 00 …      postcard in COBS frames: one that was cut ends without its 00
//! ```

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use indicatif::ProgressBar;
use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// How the jobs of an experiment are run.
#[derive(Clone, Debug)]
pub struct Runs {
    /// Only seeds that are multiples of this are run; all of them by default.
    pub every: u64,
    /// The folder in which results are kept; none are without it.
    pub kept: Option<PathBuf>,
    /// Shows how many jobs are done.
    pub bar: ProgressBar,
}

impl Default for Runs {
    fn default() -> Self {
        Self { every: 1, kept: None, bar: ProgressBar::hidden() }
    }
}

impl Runs {
    /// The results of all jobs with a seed that is a multiple of `self.every`. `name` is the name of the kept file:
    /// different jobs need different names.
    ///
    /// # Errors
    /// The first fault of a job, or the kept file cannot be written.
    pub(super) fn results<J, T>(
        &self,
        name: &str,
        jobs: &[(J, u64)],
        work: impl Fn((J, u64)) -> Result<T, String> + Sync,
    ) -> Result<BTreeMap<(J, u64), T>, String>
    where
        J: Copy + Ord + Send + Sync + Serialize + DeserializeOwned,
        T: Send + Serialize + DeserializeOwned,
    {
        let wanted: BTreeSet<(J, u64)> =
            jobs.iter().filter(|(_, seed)| seed.is_multiple_of(self.every.max(1))).copied().collect();
        let path = self.kept.as_ref().map(|folder| folder.join(format!("{name}.postcard")));
        let mut results = path.as_deref().map(read).transpose()?.unwrap_or_default();
        results.retain(|job, _| wanted.contains(job));
        let writer = path.as_deref().map(append).transpose()?.map(Mutex::new);
        self.bar.inc_length(wanted.len() as u64);
        self.bar.inc(results.len() as u64);
        let missing: Vec<(J, u64)> = wanted.into_iter().filter(|job| !results.contains_key(job)).collect();
        let one = |job: &(J, u64)| {
            let result = work(*job)?;
            if let Some((file, path)) = writer.as_ref().zip(path.as_deref()) {
                let frame = postcard::to_stdvec_cobs(&(job, &result)).map_err(|error| error.to_string())?;
                let mut file = file.lock().unwrap_or_else(PoisonError::into_inner);
                file.write_all(&frame).map_err(|error| format!("{}: {error}", path.display()))?;
            }
            self.bar.inc(1);
            Ok((*job, result))
        };
        results.extend(missing.par_iter().map(one).collect::<Result<Vec<_>, String>>()?);
        Ok(results)
    }
}

/// The results in a kept file; none where there is no file. A frame that was cut is left out.
fn read<J: Ord + DeserializeOwned, T: DeserializeOwned>(
    path: &Path,
) -> Result<BTreeMap<(J, u64), T>, String> {
    let mut bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(BTreeMap::new()),
        Err(error) => return Err(format!("{}: {error}", path.display())),
    };
    let frames = bytes.split_inclusive_mut(|byte| *byte == 0);
    Ok(frames.filter_map(|frame| postcard::from_bytes_cobs(frame).ok()).collect())
}

/// The file, to write at its end. A 0 first: a frame that was cut before ends there, and spoils none that follows.
fn append(path: &Path) -> Result<File, String> {
    let opened = || {
        path.parent().map_or(Ok(()), std::fs::create_dir_all)?;
        let mut file = OpenOptions::new().create(true).append(true).open(path)?;
        file.write_all(&[0])?;
        Ok(file)
    };
    opened().map_err(|error: std::io::Error| format!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    const JOBS: [(u8, u64); 6] = [(0, 10), (0, 11), (0, 12), (1, 10), (1, 11), (1, 12)];

    /// The results, and how many jobs were run for them.
    fn results(runs: &Runs) -> (BTreeMap<(u8, u64), f64>, usize) {
        let number = AtomicUsize::new(0);
        let work = |(what, seed): (u8, u64)| {
            number.fetch_add(1, Ordering::Relaxed);
            Ok(f64::from(what) + 0.1 * seed as f64)
        };
        (runs.results("test", &JOBS, work).unwrap(), number.into_inner())
    }

    #[test]
    fn a_run_that_was_cut_goes_on_and_gives_the_same() {
        let folder = std::env::temp_dir().join(format!("kehai-kept-{}", std::process::id()));
        let runs = Runs { kept: Some(folder.clone()), ..Runs::default() };
        let (whole, number) = results(&runs);
        assert_eq!((whole.len(), number), (6, 6));
        assert_eq!(results(&runs), (whole.clone(), 0));
        // Cut in the middle of the last frame.
        let path = folder.join("test.postcard");
        let bytes = std::fs::read(&path).unwrap();
        let end = bytes.iter().rposition(|byte| *byte != 0).unwrap();
        std::fs::write(&path, &bytes[..end - 3]).unwrap();
        assert_eq!(results(&runs), (whole.clone(), 1));
        assert_eq!(results(&runs), (whole.clone(), 0));
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(results(&Runs::default()), (whole, 6));
    }

    #[test]
    fn only_the_seeds_that_are_asked_for_are_run() {
        let (some, number) = results(&Runs { every: 5, ..Runs::default() });
        assert_eq!((some.into_keys().collect::<Vec<_>>(), number), (vec![(0, 10), (1, 10)], 2));
    }

    #[test]
    fn a_fault_of_one_job_is_the_fault_of_all() {
        let work = |(what, seed)| if (what, seed) == (1, 11) { Err("no".into()) } else { Ok(seed) };
        assert_eq!(Runs::default().results("test", &JOBS, work), Err("no".to_owned()));
    }
}
