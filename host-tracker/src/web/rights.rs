//! Which right a request needs, as the table of operations says it of each route.
//!
//! ```text
//!   Right::Free ─▶ none: any client │ To(action) ─▶ that one │ ToTell ─▶ by the input that the path names
//! ```

use crate::access::roles::Action;
use kehai_tracking::door::inbox::Input;

/// The right that a route needs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Right {
    /// None.
    Free,
    /// To do this.
    To(Action),
    /// To send the door the input that the path names.
    ToTell,
}

impl Right {
    /// What a client must be allowed to do; none: nothing. `input` is that of a message to a door, if it is one that doors have.
    pub const fn action(self, input: Option<Input>) -> Option<Action> {
        match (self, input) {
            (Self::Free, _) => None,
            (Self::To(action), _) => Some(action),
            (Self::ToTell, Some(input)) => Some(Action::Tell(input)),
            // A client that may see the door is told that there is no such input.
            (Self::ToTell, None) => Some(Action::LookAtDoor),
        }
    }
}
