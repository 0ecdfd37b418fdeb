//! Areas: several trackers of one large site, each with its own modules, put together to one picture.
//!
//! ```text
//!   tracker of area east ── AreaFrame ─╮               ╭─▶ map, HTTP, metrics, MQTT: as of one tracker
//!                           border     ├─▶ Campus ─▶ Snapshot
//!   tracker of area west ── AreaFrame ─╯               zones "east/hall", people with one number everywhere
//! ```
//!
//! All areas are drawn in one frame: the same metres, the same axes. A module at a border stands in the files of both areas, and
//! both trackers follow who walks in the strip that it sees: there a person is two tracks, and one person (`persons`).
//!
//! *Unknown is never empty*: of an area that is not heard, every zone is unknown, and so is the total.
//!
//! | file | what |
//! |---|---|
//! | `name` | the name of an area, in topics and in front of the names of its zones |
//! | `campus` | the areas of a site, and the picture of all |
//! | `area` | what was heard of one area |
//! | `alarms` | alarms about areas, and those that their trackers list |
//! | `fields` | what modules see empty, which few frames say |
//! | `grounds` | whose ground a place is: what is behind the border is for the other area to say |
//! | `persons` | persons, whose numbers go over borders, and which track leads each |
//! | `assigned` | tracks of an area, assigned to persons |
//! | `births` | new persons, and persons that are merged |
//! | `tracks` | a track as its area says it, at the time of the picture |
//! | `named` | names that areas have read, kept among the persons of all |
//! | `prefix` | the names of an area's zones, lines, doors and modules among those of all |

mod alarms;
mod area;
mod assigned;
mod births;
mod campus;
mod fields;
mod grounds;
mod name;
mod named;
mod persons;
mod prefix;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_names;
#[cfg(test)]
mod tests_persons;
#[cfg(test)]
mod tests_walks;
mod tracks;

use crate::snapshot::Snapshot;

pub use campus::Campus;
pub use fields::packed;
pub use name::{AreaName, NameError};

/// An area of which no frame was heard for so long is not heard, µs: twenty frames, so that a network that loses a third of them
/// never loses so many in a row, and less than the three seconds that frames hold elsewhere.
pub const SILENT_US: u64 = 2_000_000;

/// What became of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Taken {
    /// It is the newest of its area.
    News,
    /// It is older than one of the same start that was taken before, and left out.
    Late,
    /// There is no room for its area.
    Crowded,
}

/// What the tracker of an area says at one time.
#[derive(Clone, Debug)]
pub struct AreaFrame {
    /// Another one after each start of the tracker, which numbers its tracks anew.
    pub epoch: u64,
    /// Counts its frames, so that one that was held up on the way is not taken for news.
    pub number: u64,
    /// Its tracks, zones, modules and alarms.
    pub frame: Snapshot,
}
