//! A simulated floor with tags: paper B's experiments (docs/bibliography.md, B).
//!
//! ```text
//!   walkers ─▶ soles ─▶ panels, 9 Hz ─▶ kehai::floor ─▶ patches ─┬─▶ bodies, names       ours
//!       └────▶ tags, line of sight, 9.09 Hz ──────────────────────┴─▶ condensation        the paper's
//! ```
//!
//! | file | what |
//! |---|---|
//! | `crowd` | the feet of all people in a world |
//! | `feet` | the two feet under any body |
//! | `gait` | where a walker and its soles are |
//! | `host` | a host that is told of a floor and tags |
//! | `panels` | which panels soles press, as the floor reads them |
//! | `replay` | frames of a SensFloor through a device to tracks |
//! | `tags` | where a camera reads the tags, and when it cannot |
//! | `scene` | the three experiments |
//! | `silence` | IDs that are not read for up to a minute |
//! | `trial` | one of them, with each tracker, and its figures |

pub mod crowd;
pub mod feet;
pub mod gait;
pub mod host;
pub mod panels;
pub mod replay;
pub mod scene;
pub mod silence;
pub mod tags;
pub mod trial;
