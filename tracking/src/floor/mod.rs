//! A pressure floor in the site: from panels that are down to bodies that are followed.
//!
//! ```text
//!   panels down ─▶ patches ─▶ feet of bodies ─▶ bodies
//!     ▪▪ ·            ◖          each patch to the nearest body          a floor hides no person: each on it presses panels,
//!     ▪▪ ▪▪              ◗       that it may be a foot of                but for the flight of a running step
//! ```
//!
//! | file | what |
//! |---|---|
//! | `plan` | where each panel is |
//! | `patches` | panels that touch, as one |
//! | `bodies` | patches to bodies, followed in time |
//! | `reading` | what a session makes of a datagram of a floor |
//! | `floors` | all floors of a site, and their silence |
//! | `line` | what is written of a floor |
//!
//! Source: the floor of Ota et al. 2006 (docs/bibliography.md, B).

pub mod bodies;
pub mod floors;
pub mod line;
pub mod patches;
pub mod plan;
pub mod reading;

pub use bodies::Bodies;
pub(crate) use floors::FOUND_S;
pub use floors::Floors;
pub use line::FloorLine;
pub use patches::{Patch, patches};
pub use plan::Plan;
pub use reading::{Reading, unknown_from};
