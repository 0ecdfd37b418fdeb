//! Recordings of another simulator's world, with its truth (`../shared/cases`): six of them.
//!
//! The bounds are what was printed when the test was written, less what one changed person or moment costs: they are
//! development data, and say whether a change made another world worse.

use std::path::Path;

use host_sim::baselines::Choice;
use host_sim::experiment::cases::{find, run};
use host_sim::experiment::table::Row;
use indicatif::ProgressBar;

/// The rows of these cases with one tracker; none where the data is not there.
fn rows(tracker: &str, cases: &[&str]) -> Option<Vec<Row>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/cases");
    if !folder.is_dir() {
        test_support::fail_in_ci_else_skip("no recordings of other worlds in ../shared/cases");
        return None;
    }
    let names: Vec<String> = cases.iter().map(|name| (*name).to_owned()).collect();
    let choice: Choice = tracker.parse().unwrap();
    Some(run(&find(&folder, &names).unwrap(), &[choice], &ProgressBar::hidden()).unwrap())
}

/// IDF1 of these cases at least, and the greatest mean distance, m.
fn holds(tracker: &str, bounds: &[(&str, f64, f64)]) {
    for (name, idf1, motp_m) in bounds {
        let Some(rows) = rows(tracker, &[name]) else { return };
        let row = &rows[0];
        let (own, distance_m) = (row.idf1.unwrap(), row.motp_m.unwrap());
        println!("{tracker} {name}: IDF1 {own:.3}, {distance_m:.3} m, counted right in {}", row.successes);
        assert!(own >= *idf1 && distance_m <= *motp_m, "{name}: {own} {distance_m}");
        assert!(row.doors == 0 || row.emptied == row.doors, "{name}: not empty in time");
    }
}

#[test]
fn the_tracker_is_as_good_in_another_world_as_was_printed() {
    holds(
        "kehai",
        &[
            ("H5-1100", 0.94, 0.06),
            ("H6-1100", 0.79, 0.075),
            ("D7-1100", 0.97, 0.065),
            ("P4-1100", 0.98, 0.05),
            ("T3-1100", 0.98, 0.06),
            ("home1-1100", 0.98, 0.06),
        ],
    );
}

#[test]
fn a_folder_without_cases_is_said() {
    let error = find(Path::new(env!("CARGO_MANIFEST_DIR")), &[]).unwrap_err().to_string();
    assert!(error.contains("no case there"), "{error}");
}
