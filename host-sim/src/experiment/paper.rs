//! Results of the papers, for comparison with ours.

/// Paper B: variance across the way of both people, mm², in the experiments for which it says one.
pub const PAPER_B_MM2: [(&str, [f64; 2]); 2] =
    [("B1 parallel", [1764.0, 1369.0]), ("B2 crossing", [10_594.0, 17_424.0])];

/// How it is called in tables.
pub const PAPER_B_NAME: &str = "paper B";

/// Paper A, Table 1: trials in which one to seven people in the area were counted right.
pub const PAPER_A_SUCCESSES: [u64; 7] = [10, 10, 10, 10, 8, 5, 1];

/// Trials of each.
pub const PAPER_A_TRIALS: u64 = 10;

/// Paper D, Tables 2 to 4, as in [`super::entrance::FIGURES`], %. Its greatest number of people at a time is four.
pub const PAPER_D: [f64; 13] =
    [99.5, 89.5, 94.3, 92.7, 94.6, 100.0, 93.8, 89.8, 79.7, 100.0, 97.0, 91.7, 92.6];

/// How it is called.
pub const PAPER_D_NAME: &str = "paper D";

/// How it is called in tables and pictures.
pub const PAPER_A_NAME: &str = "paper A, Table 1";
