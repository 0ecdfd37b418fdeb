//! Rows of the database, as they are made of frames and written.
//!
//! ```text
//!   change recorder ─▶ Row │ PathRow ─▶ writer ─▶ a table each
//! ```

use super::card::CardHash;
use super::event::Event;
use super::pose::PoseRow;
use kehai_tracking::alarm_list::ListedAlarm;
use kehai_tracking::door::doors::Passed;
use kehai_tracking::jsonl::ZoneKnown;
use kehai_tracking::lines::{Direction, Totals};
use kehai_tracking::snapshot::ModuleLine;

/// Something to be kept, beside paths.
#[derive(Clone, Debug, PartialEq)]
pub enum Row {
    /// How many people are in a zone from now on.
    Count {
        /// Its name.
        zone: String,
        /// ms since 1970.
        at_ms: u64,
        /// People; none where that is not known.
        count: Option<u32>,
        /// How far that can be trusted.
        state: ZoneKnown,
    },
    /// A person has crossed a counting line.
    Crossing {
        /// Its name.
        line: String,
        /// ms since 1970.
        at_ms: u64,
        /// Which way.
        direction: Direction,
    },
    /// How often a line has been crossed in all, and whether it is seen from now on.
    Line {
        /// Its name.
        name: String,
        /// ms since 1970.
        at_ms: u64,
        /// Both counts.
        totals: Totals,
        /// Whether it is seen.
        state: ZoneKnown,
    },
    /// From now on these zones make the site's total.
    Total {
        /// ms since 1970.
        at_ms: u64,
        /// Their names, in order.
        zones: Vec<String>,
    },
    /// Something happened.
    Event(Event),
    /// A group went through a door, or did not.
    Passage(Box<Passed>),
    /// An alarm, as it is now.
    Alarm(Box<ListedAlarm>),
    /// How a module was.
    Health {
        /// ms since 1970.
        at_ms: u64,
        /// The module.
        module: Box<ModuleLine>,
    },
    /// Where a module is from now on.
    Pose(PoseRow),
    /// The card of a passage, kept for a time of its own.
    Card {
        /// When the passage began, ms since 1970.
        at_ms: u64,
        /// The door's name.
        place: String,
        /// What may be kept of the card.
        hash: CardHash,
    },
    /// From now on an ID is probably this track's, or, with a probability of at most 0.5, of no track that is known;
    /// kept for as long as cards are.
    Name {
        /// ms since 1970.
        at_ms: u64,
        /// The track.
        track: u64,
        /// What may be kept of the ID.
        hash: CardHash,
        /// How probable that is.
        probability: f64,
    },
}

/// A part of a person's path; it replaces what was written of that part before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathRow {
    /// Its first time, ms since 1970.
    pub begun_ms: u64,
    /// Its last.
    pub ended_ms: u64,
    /// As [`encode`](super::path::encode) makes them.
    pub points: Vec<u8>,
}
