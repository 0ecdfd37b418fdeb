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
//! | `cast` | the actors, and what each of them does |
//! | `walk` | a step of each of them |
//! | `gap` | how near a follower comes |
//! | `load` | the load of the last of the group |
//! | `stage` | the simulation loop, and its report |

pub mod cast;
mod gap;
pub mod load;
pub mod stage;
mod walk;

pub use load::Load;
pub use stage::{Report, run};

use crate::world::gathering::Condition;

/// What happens at the door.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Rule {
    /// A group goes in; in every second run another person waits in the hall for the next passage.
    Honest,
    /// A tailgater keeps 0.6 to 1.2 m behind the last.
    GapWide,
    /// 0.3 to 0.6 m.
    GapNarrow,
    /// The tailgater touches the person before: at most 0.1 m.
    InFile,
    /// Goes in beside the last, shoulder to shoulder.
    SideBySide,
    /// Runs in from the hall when the door opens, at 2 to 3 m/s.
    RunsIn,
    /// The number entered is one too high or too low.
    WrongNumber,
    /// One of the group turns back: before the door, or behind it.
    TurnsBack,
    /// A person in the hall shows the card of a person inside.
    CardBack,
    /// A module says nothing any more while they go in.
    ModuleLost,
    /// The last person stands in the doorway.
    HeldOpen,
}

/// A passage.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Plan {
    /// What happens.
    pub rule: Rule,
    /// People that enter with one card.
    pub people: usize,
    /// How they wait.
    pub condition: Condition,
    /// Load of the last person.
    pub load: Option<Load>,
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
        Self { rule, people, condition: Condition::Spread, load: None }
    }
}
