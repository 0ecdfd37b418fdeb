//! Which times exactly one run of a tracker tells of.
//!
//! ```text
//!   runs    ├────────────┤  set back        ├──────┤
//!                    ├──────────┤
//!   told    ├────────┤   ├──────┤           ├──────┤    of what two tell of nothing is known
//! ```
//!
//! The row with which a run ends is of its last millisecond, in which the other does not tell alone yet.

/// What exactly one of these spans holds, in order of time.
fn told_once(runs: &[(u64, u64)]) -> Vec<(u64, u64)> {
    let spans = runs.iter().filter(|(begun_ms, ended_ms)| begun_ms < ended_ms);
    let mut edges: Vec<(u64, i32)> =
        spans.flat_map(|&(begun_ms, ended_ms)| [(begun_ms, 1), (ended_ms, -1)]).collect();
    // One that ends goes before one that begins: those do not overlap.
    edges.sort_unstable();
    let (mut told, mut running, mut since_ms) = (Vec::new(), 0, 0);
    for (at_ms, change) in edges {
        if running == 1 && since_ms < at_ms {
            told.push((since_ms, at_ms));
        }
        running += change;
        since_ms = at_ms + u64::from(change < 0);
    }
    told
}

/// The same, as far as it touches the time from `from_ms` to `to_ms`. All runs are asked: one that ends before may tell of the
/// beginning of another that does not.
pub(super) fn told_within(runs: &[(u64, u64)], (from_ms, to_ms): (u64, u64)) -> Vec<(u64, u64)> {
    let mut told = told_once(runs);
    told.retain(|(begun_ms, ended_ms)| *begun_ms <= to_ms && *ended_ms >= from_ms);
    told
}

#[cfg(test)]
mod tests {
    use super::told_once;

    #[test]
    fn what_two_runs_tell_of_is_told_by_none() {
        assert_eq!(told_once(&[(0, 100), (200, 300)]), [(0, 100), (200, 300)]);
        assert_eq!(told_once(&[(0, 100), (60, 160)]), [(0, 60), (101, 160)], "set back by 40 ms");
        assert_eq!(told_once(&[(0, 100), (20, 50)]), [(0, 20), (51, 100)]);
        assert_eq!(told_once(&[(0, 100), (100, 200), (200, 200)]), [(0, 100), (100, 200)]);
    }
}
