//! How good a tracker is: its tracks against the truth, in the figures the literature uses.
//!
//! ```text
//! Frame ─▶ region ─▶ Judged ─┬─▶ clear       MOTA, MOTP, switches, precision, recall, errors, NEES
//!  truth   people judged     ├─▶ identity    IDF1
//!  tracks                    ├─▶ hota        HOTA, DetA, AssA
//!                            ├─▶ gospa       GOSPA and its parts
//!       └─▶ counting         └─▶ trajectory  paper D's identification precision and recall
//!           how many in the area            ╲
//!                                            Tally ─▶ pooled over runs ─▶ Figures
//! ```
//!
//! What is said of a count as a distribution is judged by `reliability`.
//!
//! One [`Scorer`] a run. Its result is a [`Tally`]: sums only, so that runs are pooled by addition.
//! Every figure of it agrees with py-motmetrics and TrackEval (`tests/score_reference.rs`).

pub mod assign;
pub mod clear;
pub mod counting;
pub mod figures;
pub mod frame;
pub mod gospa;
pub mod hota;
pub mod identity;
pub mod pairing;
pub mod region;
pub mod reliability;
pub mod scorer;
pub mod statistics;
pub mod trajectory;

pub use self::counting::CountLog;
pub use self::figures::Figures;
pub use self::frame::{Estimate, Frame, Target, VISIBLE_BEAMS};
pub use self::region::{Region, Settings};
pub use self::scorer::{Scorer, Tally};

#[cfg(test)]
mod tests;
