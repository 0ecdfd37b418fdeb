//! What people at the door put in: a card, a number, the end of an alarm.
//!
//! ```text
//!   phase     Idle ── card ─▶ Asked ── number ─▶ Checking       else refused, with the reason
//!             Alarmed ── reset ─▶ Idle                          a card that is inside: an alarm;
//!                                                               no report of the leaf yet, or a group at another
//!                                                               door of the zone: no card is taken
//! ```

use super::Machine;
use crate::door::event::Action;
use crate::door::progress::Progress;
use crate::door::prompt::Prompt;
use crate::door::terms::{Alarm, Card, EndsWith, Refusal};
use crate::door::transition::{Cause, Phase};

impl Machine {
    pub(super) fn card(&mut self, card: Card, actions: &mut Vec<Action>) {
        let inside = self.cards.is_inside(card, self.now_s, self.door.passback_s);
        let own = self.progress.as_ref().and_then(|progress| progress.passage.card);
        match self.phase {
            Phase::Idle if inside => self.alarmed(Alarm::PassedBack, Some(card), actions),
            Phase::Idle if self.leaf.contact.is_none() => {
                actions.push(Action::Refused(Refusal::NoContact));
            }
            Phase::Idle if self.zone_is_taken => actions.push(Action::Refused(Refusal::Busy)),
            Phase::Idle => {
                self.passages += 1;
                self.progress = Some(Progress::new(&self.door.name, self.passages, self.now_s, Some(card)));
                self.identify(card, actions);
                self.go(Cause::Card, Phase::Asked, Prompt::HowMany);
            }
            Phase::Asked | Phase::Checking if own == Some(card) => {
                actions.push(Action::Refused(Refusal::SameCard));
            }
            Phase::Unlocked | Phase::Closing | Phase::HeldOpen if inside || own == Some(card) => {
                self.alarmed(Alarm::PassedBack, Some(card), actions);
            }
            Phase::Asked | Phase::Checking | Phase::Unlocked | Phase::Closing => {
                actions.push(Action::Refused(Refusal::Busy));
            }
            Phase::HeldOpen | Phase::Alarmed | Phase::Failed => {
                actions.push(Action::Refused(Refusal::NotNow));
            }
        }
    }

    pub(super) fn number(&mut self, number: u32, actions: &mut Vec<Action>) {
        let refusal = match self.phase {
            Phase::Asked | Phase::Checking if !(1..=self.door.people_max).contains(&number) => {
                Refusal::Number
            }
            Phase::Asked => {
                if let Some(progress) = &mut self.progress {
                    progress.passage.entered = number;
                    progress.passage.tries += 1;
                }
                self.go(Cause::Number, Phase::Checking, Prompt::Counting);
                return;
            }
            Phase::Idle => Refusal::NoCard,
            Phase::Checking | Phase::Unlocked | Phase::Closing => Refusal::Busy,
            Phase::HeldOpen | Phase::Alarmed | Phase::Failed => Refusal::NotNow,
        };
        actions.push(Action::Refused(refusal));
    }

    pub(super) fn reset(&mut self, actions: &mut Vec<Action>) {
        if self.standing.is_none_or(|alarm| alarm.ends_with() != EndsWith::Reset) {
            actions.push(Action::Refused(Refusal::NoAlarm));
            return;
        }
        self.standing = None;
        self.leaf.begin_anew(self.now_s);
        if self.phase == Phase::Alarmed {
            self.go(Cause::Reset, Phase::Idle, Prompt::Ready);
        }
    }
}
