//! What experiments have in common on the command line: which seeds, and how far they are.

use std::error::Error;
use std::ops::RangeInclusive;

use indicatif::{ProgressBar, ProgressStyle};

/// Most seeds: a thousand times what any table has. A list of all that a number can say takes all memory.
const MOST: u64 = 1_000_000;

/// First and last seed.
pub fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let bounds =
        text.split_once('-').and_then(|(first, last)| Some((first.parse().ok()?, last.parse().ok()?)));
    match bounds {
        Some((first, last)) if first <= last && last - first >= MOST => Err(format!("at most {MOST} seeds")),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_seeds_are_taken_than_can_be_run() {
        assert_eq!(seeds("3-3"), Ok(3..=3));
        assert_eq!(seeds("7-1000006"), Ok(7..=1_000_006));
        for slip in ["0-1000000", "7-1000007", "0-18446744073709551615"] {
            assert_eq!(seeds(slip), Err("at most 1000000 seeds".into()), "{slip}");
        }
        for wrong in ["", "4", "4-3", "a-b", "0-18446744073709551616"] {
            assert!(seeds(wrong).is_err(), "{wrong}");
        }
    }
}
