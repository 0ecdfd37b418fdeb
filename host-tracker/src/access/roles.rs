//! Roles, what can be done, and one function of both.
//!
//! ```text
//!   people    view ─ edit ─ operator ─ admin            a password and a session, or a token
//!   devices   reader ─ keypad ─ contact ─ lock ─ alarm ─ button     a token, for one door or all
//! ```
//!
//! The way out is no right: `exit` is taken from everybody, with a wrong token or none. A button whose token was forgotten, revoked
//! or mistyped must still open, as must all buttons once the file of users is damaged. A lock that stays shut in a fire is
//! worse than one that a stranger opens. What that costs stands in docs/security.md.

use std::fmt;
use std::str::FromStr;

use kehai_tracking::door::inbox::Input;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::named::named;

named! {
    /// What a user or a program may do.
    #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize, JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    pub enum Role {
        /// Looks at the map, the past and the metrics.
        View = "view",
        /// Draws the site and looks after its modules, too, if it has no door, and acknowledges alarms.
        Edit = "edit",
        /// Looks, acknowledges alarms, resets those of doors, and enters numbers for people.
        Operator = "operator",
        /// Everything.
        Admin = "admin",
        /// A reader of cards or tags.
        Reader = "reader",
        /// The screen or the keys where numbers are entered.
        Keypad = "keypad",
        /// The contact at the leaf.
        Contact = "contact",
        /// The lock.
        Lock = "lock",
        /// What sounds or shows the alarm.
        Alarm = "alarm",
        /// The button of the way out. It may no more than everybody; with a token its messages are told from a stranger's.
        Button = "button",
    }
}

/// What can be done over HTTP.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Action {
    /// See people, the past, the site, the metrics.
    Look,
    /// See how a door is.
    LookAtDoor,
    /// Change a site without doors, and find poses by walking.
    ChangeSite,
    /// Change a site with doors: moving a zone or a module changes what a door counts.
    ChangeGuardedSite,
    /// Ask a module of a site without doors for something: to learn, to restart, for its settings.
    AskModule,
    /// Note that one has seen an alarm.
    Acknowledge,
    /// Say what a reader of the site has read.
    Sign,
    /// Send a message to a door.
    Tell(Input),
}

impl Role {
    /// Whether people have it, who log in with a password.
    #[must_use]
    pub const fn is_of_people(self) -> bool {
        matches!(self, Self::View | Self::Edit | Self::Operator | Self::Admin)
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Role {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::named(text)
            .ok_or_else(|| format!("a role is one of {}", Self::NAMED.map(|(_, name)| name).join(", ")))
    }
}

/// Whether this is taken from every client, known or not.
#[must_use]
pub const fn is_free(action: Action) -> bool {
    matches!(action, Action::Tell(Input::Exit))
}

/// Whether a role may do this.
#[must_use]
pub const fn may(role: Role, action: Action) -> bool {
    use Action::{Acknowledge, AskModule, ChangeSite, Look, LookAtDoor, Sign, Tell};
    let granted = match role {
        Role::Admin => true,
        Role::View => matches!(action, Look | LookAtDoor),
        Role::Edit => matches!(action, Look | LookAtDoor | ChangeSite | AskModule | Acknowledge),
        Role::Operator => {
            matches!(action, Look | LookAtDoor | Acknowledge | Tell(Input::Number | Input::Reset))
        }
        // A device sees its door, as the tracker's time is there, by which it stamps its messages.
        Role::Reader => matches!(action, LookAtDoor | Sign | Tell(Input::Card)),
        Role::Keypad => matches!(action, LookAtDoor | Tell(Input::Number)),
        Role::Contact => matches!(action, LookAtDoor | Tell(Input::Contact)),
        Role::Lock => matches!(action, LookAtDoor | Tell(Input::LockReady | Input::LockTaken)),
        Role::Alarm => matches!(action, LookAtDoor | Tell(Input::AlarmTaken)),
        Role::Button => matches!(action, LookAtDoor),
    };
    granted || is_free(action)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_input_of_a_door_is_for_one_device_and_the_way_out_for_all() {
        let devices = || Role::NAMED.into_iter().map(|(role, _)| role).filter(|role| !role.is_of_people());
        for (input, name) in Input::NAMED {
            let who: Vec<Role> = devices().filter(|role| may(*role, Action::Tell(input))).collect();
            match input {
                Input::Exit => assert_eq!(who.len(), devices().count()),
                Input::Reset => assert!(who.is_empty(), "people reset alarms: {who:?}"),
                _ => assert_eq!(who.len(), 1, "{name}: {who:?}"),
            }
            assert_eq!(is_free(Action::Tell(input)), input == Input::Exit);
        }
        assert!(devices().all(|role| !may(role, Action::Look) && !may(role, Action::ChangeGuardedSite)));
    }

    #[test]
    fn names_are_read_as_they_are_written() {
        for (role, name) in Role::NAMED {
            assert_eq!((role.to_string().as_str(), name.parse()), (name, Ok(role)));
            assert_eq!(serde_json::to_string(&role).unwrap(), format!("\"{name}\""));
        }
        assert!("root".parse::<Role>().unwrap_err().contains("view, edit, operator, admin"));
    }
}
