//! Results of the papers, for comparison with ours.

/// Paper A, Table 1: trials in which one to seven people in the area were counted right.
pub const PAPER_A_SUCCESSES: [u64; 7] = [10, 10, 10, 10, 8, 5, 1];

/// Trials of each.
pub const PAPER_A_TRIALS: u64 = 10;

/// How it is called in tables and pictures.
pub const PAPER_A_NAME: &str = "paper A, Table 1";
