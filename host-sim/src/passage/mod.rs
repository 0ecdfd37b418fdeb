//! Passages through a door that is really guarded: people, sensors, modules, tracker and the door's state machine in one loop.
//!
//! ```text
//!   crowd ─▶ world ─▶ sensors ─▶ modules ─▶ tracker ─▶ door ─▶ lock ─▶ leaf
//!     ▲ ▲                                               ▲               │
//!     │ └──────────────── they walk when it is open ────│───────────────┘
//!     └─ card, number ──────────────────────────────────┘
//! ```
//!
//! | file | what |
//! |---|---|
//! | `cast` | who is there, and what they are up to |
//! | `stage` | the loop, and what came of it |

pub mod cast;
pub mod stage;

pub use stage::{Report, run};

use crate::world::gathering::Condition;

/// What happens at the door.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Rule {
    /// A group goes in; in every other run somebody else waits in the hall for the next passage.
    Honest,
    /// A tailgater keeps 0.6 to 1.2 m behind the last.
    GapWide,
    /// 0.3 to 0.6 m.
    GapNarrow,
    /// Touches the one before: at most 0.1 m.
    InFile,
    /// Goes in beside the last, shoulder to shoulder.
    SideBySide,
    /// Runs in from the hall when the door opens, at 2 to 3 m/s.
    RunsIn,
    /// The number entered is one too high or too low.
    WrongNumber,
    /// One of the group turns back: before the door, or behind it.
    TurnsBack,
    /// Somebody in the hall shows the card of somebody inside.
    CardBack,
    /// A module says nothing any more while they go in.
    ModuleLost,
    /// The last one stands in the doorway.
    HeldOpen,
}

/// A passage.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    /// What happens.
    pub rule: Rule,
    /// People who show one card.
    pub people: usize,
    /// How they wait.
    pub condition: Condition,
}

impl Plan {
    /// The passage of a seed: groups of one, two and three in turn.
    #[must_use]
    pub const fn of(rule: Rule, seed: u64) -> Self {
        let people = match rule {
            Rule::TurnsBack => 2 + (seed % 2) as usize,
            Rule::CardBack => 1,
            _ => 1 + (seed % 3) as usize,
        };
        Self { rule, people, condition: Condition::Spread }
    }
}
