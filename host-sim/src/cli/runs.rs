//! What experiments have in common on the command line: which seeds, and how far they are.

use std::error::Error;
use std::ops::RangeInclusive;

use indicatif::{ProgressBar, ProgressStyle};

/// First and last seed.
pub fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let bounds =
        text.split_once('-').and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
    match bounds {
        Some((first, last)) if first <= last => Ok(first..=last),
        _ => Err("first and last seed, as in 10000-10199".into()),
    }
}

/// A bar of the runs that are done, with this name before it.
pub fn bar(name: impl ToString) -> Result<ProgressBar, Box<dyn Error>> {
    let bar = ProgressBar::new(0);
    bar.set_style(ProgressStyle::with_template("{prefix:9} {bar:40} {pos}/{len} runs, {eta} left")?);
    bar.set_prefix(name.to_string());
    Ok(bar)
}
