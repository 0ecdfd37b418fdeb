//! The state of a door, for every client that shows it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Machine;
use crate::door::names::Name;
use crate::door::prompt::Prompt;
use crate::door::terms::{Alarm, Contact, Lock, Trouble};
use crate::door::transition::Phase;

/// The state of a door, for every client that shows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DoorLine {
    /// Its name.
    pub name: String,
    /// Where it is.
    pub phase: Phase,
    /// What the lock is to be.
    pub lock: Lock,
    /// Number of that output, and whether the lock has taken it.
    pub lock_id: u64,
    /// Whether the lock has taken it.
    pub lock_taken: bool,
    /// Why there is an alarm, if there is one.
    pub alarm: Option<Alarm>,
    /// While it has failed: the alarm that stands beneath, and goes on after that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub standing: Option<Alarm>,
    /// Number of that output.
    pub alarm_id: u64,
    /// Whether the alarm has taken it.
    pub alarm_taken: bool,
    /// What is wrong, while it has failed.
    pub trouble: Option<Trouble>,
    /// Whether the leaf is shut; none: not reported yet.
    pub contact: Option<Contact>,
    /// The number entered last.
    pub entered: u32,
    /// Most people who may be entered.
    pub people_max: u32,
    /// How many have gone through.
    pub through: u32,
    /// Numbers that may still be tried.
    pub tries_left: u32,
    /// Counts passages.
    pub passage: u64,
    /// What the entrant is to do, for programs.
    #[serde(default)]
    pub prompt_name: Prompt,
    /// The same, in words.
    pub prompt: String,
    /// Which track showed which card, so probably.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<Name>,
}

impl DoorLine {
    /// The same door once its tracker says nothing any more: it has failed, and what was said of it last holds no longer.
    #[must_use]
    pub fn unheard(self) -> Self {
        Self {
            phase: Phase::Failed,
            lock_taken: false,
            alarm_taken: false,
            trouble: Some(Trouble::NoFrames),
            contact: None,
            prompt_name: Prompt::OutOfOrder,
            prompt: Prompt::OutOfOrder.words().to_owned(),
            names: Vec::new(),
            ..self
        }
    }
}

impl Machine {
    /// How it is.
    #[must_use]
    pub fn line(&self) -> DoorLine {
        let number = |value: usize| u32::try_from(value).unwrap_or(u32::MAX);
        let passage = self.progress.as_ref().map(|progress| &progress.passage);
        DoorLine {
            name: self.door.name.clone(),
            phase: self.phase,
            lock: self.orders.lock.value(),
            lock_id: self.orders.lock.id(),
            lock_taken: self.orders.lock.is_taken(),
            alarm: self.orders.alarm.value(),
            standing: self.standing.filter(|_| self.phase == Phase::Failed),
            alarm_id: self.orders.alarm.id(),
            alarm_taken: self.orders.alarm.is_taken(),
            trouble: self.trust.trouble,
            contact: self.leaf.contact,
            entered: passage.map_or(0, |passage| passage.entered),
            people_max: self.door.people_max,
            through: passage.map_or(0, |passage| number(passage.through.len())),
            tries_left: self.door.tries_max.saturating_sub(passage.map_or(0, |passage| passage.tries)),
            passage: self.passages,
            prompt_name: self.prompt,
            prompt: self.prompt.words().to_owned(),
            names: Vec::new(),
        }
    }
}
