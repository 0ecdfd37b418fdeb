//! What a door concludes from the tracks: whether the number matches, which tracks go through, which are too many.

use super::{Machine, SEEN, SHUT_S, STEADY_S, SURE};
use crate::door::crossing::{Crossing, is_apart};
use crate::door::event::{Action, Body};
use crate::door::passage::Outcome;
use crate::door::progress::Progress;
use crate::door::prompt::Prompt;
use crate::door::terms::{Alarm, Card, Contact, EndsWith};
use crate::door::transition::{Cause, Phase};
use crate::site::door::Fail;

/// A track that is found beyond the line so soon after one was lost before it is the same person, s: the doorway's 1.6 m at a slow
/// walk. One that is found alone may be a person inside who turns round.
const FOUND_S: f64 = 2.0;

impl Machine {
    /// Says which tracks may have shown a card: the people before the line.
    pub(super) fn identify(&self, card: Card, actions: &mut Vec<Action>) {
        let Some((_, seen)) = &self.seen else { return };
        let reader = self.door.reader.map_or_else(|| self.doorway.middle(), Into::into);
        let before = seen.bodies.iter().filter(|body| body.is_sure() && self.doorway.beyond_m(body.at) < 0.0);
        actions.push(Action::Named { card, reader, by: before.map(|body| body.id).collect() });
    }

    pub(super) fn watch(&mut self, crossings: &[Crossing], actions: &mut Vec<Action>) {
        // The lease of an order of before is over by now, and what was left of a group of before stays out.
        self.of_before &= !self.leaf.is_shut(SHUT_S, self.now_s);
        let went_in = crossings.iter().any(|way| matches!(way, Crossing::Inward(_)));
        // No person walks through a shut leaf that the door or its exit has opened: the report that it opened was lost.
        let is_opened = self.phase == Phase::Unlocked || self.now_s < self.exit_until_s;
        if went_in && is_opened && self.leaf.is_shut(SHUT_S, self.now_s) {
            self.leaf.report(Contact::Open, self.now_s);
        }
        match self.phase {
            Phase::Checking => self.check(),
            Phase::Unlocked | Phase::Closing | Phase::HeldOpen => self.follow(crossings, actions),
            Phase::Idle | Phase::Asked | Phase::Alarmed | Phase::Failed => {}
        }
        let nobody_let_in = match self.phase {
            Phase::Idle | Phase::Asked | Phase::Checking => true,
            Phase::HeldOpen => self.progress.is_none(),
            _ => false,
        };
        // A track that changes sides of a shut leaf is the tracker's mistake, not an entry.
        if nobody_let_in && self.leaf.may_be_open() && (went_in || self.is_found(crossings)) {
            self.alarmed(Alarm::WentIn, None, actions);
        }
        let is_shut = self.leaf.is_shut(SHUT_S, self.now_s);
        if is_shut && matches!(self.phase, Phase::Closing | Phase::HeldOpen) {
            self.shut(actions);
        }
    }

    /// Whether a track that was lost before the line is found beyond it.
    fn is_found(&mut self, crossings: &[Crossing]) -> bool {
        if crossings.iter().any(|way| matches!(way, Crossing::Lost(_))) {
            self.lost_s = self.now_s;
        }
        let found = crossings.iter().any(|way| matches!(way, Crossing::Found(_)));
        found && self.now_s - self.lost_s < FOUND_S
    }

    /// While it is not sure yet that all is well again, a person who goes in by a locked door is an alarm that stands beneath.
    pub(super) fn note_entry(&mut self, crossings: &[Crossing], actions: &mut Vec<Action>) {
        let went_in = crossings.iter().any(|way| matches!(way, Crossing::Inward(_)));
        let stands = self.standing.is_some_and(|alarm| alarm.ends_with() == EndsWith::Reset);
        if went_in && !stands && self.trust.fail == Fail::Secure && self.leaf.may_be_open() {
            self.stand(Alarm::WentIn, None, actions);
        }
    }

    /// Ends the passage when the leaf has been shut for so long that a person who slipped in would be known.
    pub(super) fn shut(&mut self, actions: &mut Vec<Action>) {
        let is_complete = self.progress.as_ref().is_some_and(Progress::is_complete);
        let (outcome, reason) = match (self.phase, is_complete) {
            (Phase::HeldOpen, _) => (Outcome::HeldOpen, "the leaf did not shut in time"),
            (_, true) => (Outcome::Complete, "all went through"),
            (_, false) => (Outcome::Fewer, "fewer went through than were let in"),
        };
        self.standing = None;
        self.end(outcome, reason, actions);
        self.go(Cause::Shut, Phase::Idle, Prompt::Ready);
    }

    /// Notes since when a doubtful track is in the zone: perhaps a person who touches another, or crouches.
    pub(super) fn doubt(&mut self, bodies: &[Body]) {
        let shade =
            |body: &Body| body.is_doubtful() && self.doorway.in_zone(body.at) && is_apart(body, bodies);
        self.count.doubt(bodies.iter().any(shade), self.now_s);
    }

    pub(super) fn check(&mut self) {
        let in_doubt = self.count.is_in_doubt(self.now_s);
        let (Some((_, seen)), Some(progress)) = (&self.seen, &mut self.progress) else { return };
        // A zone may reach beyond its line: the number is of those who are still to go in.
        let is_inside = |body: &Body| body.is_sure() && self.doorway.in_zone_inside(body.at);
        let in_doubt = in_doubt || seen.bodies.iter().any(is_inside);
        let entered = progress.passage.entered;
        let probability = seen.count_p.get(entered as usize).copied().unwrap_or(0.0);
        progress.passage.count_p.clone_from(&seen.count_p);
        progress.passage.seen_share = seen.seen_share;
        if in_doubt || !(probability >= SURE && seen.seen_share >= SEEN) {
            self.count.match_since_s = None;
            return;
        }
        let since_s = *self.count.match_since_s.get_or_insert(self.now_s);
        if self.now_s - since_s >= STEADY_S {
            progress.unlock(entered, &seen.bodies, &self.doorway);
            self.go(Cause::Match, Phase::Unlocked, Prompt::GoIn);
        }
    }

    pub(super) fn mismatch(&mut self, actions: &mut Vec<Action>) {
        let Some(progress) = &self.progress else { return };
        let passage = &progress.passage;
        let best = passage.count_p.iter().copied().enumerate().max_by(|one, other| one.1.total_cmp(&other.1));
        let prompt = match best {
            _ if passage.seen_share < SEEN => Prompt::NotSeen,
            Some((count, p)) if p >= SURE && count as u32 != passage.entered => Prompt::CountAgain,
            _ => Prompt::StandApart,
        };
        if passage.tries >= self.door.tries_max {
            self.end(Outcome::Refused, "the number never matched the count", actions);
            self.go(Cause::TooOften, Phase::Idle, Prompt::BeginAgain);
        } else {
            self.go(Cause::Mismatch, Phase::Asked, prompt);
        }
    }

    pub(super) fn follow(&mut self, crossings: &[Crossing], actions: &mut Vec<Action>) {
        let (Some((_, seen)), Some(progress)) = (&self.seen, &mut self.progress) else { return };
        let crossed = progress.cross(crossings, self.now_s);
        let came_back = progress.came_back(&seen.bodies, &self.doorway, self.now_s);
        let watched = progress.watch(&seen.bodies, &self.doorway, self.now_s);
        // While the leaf closes the next ones may come into the zone, and the group may turn away.
        let alarm = crossed.or(came_back).or(watched.filter(|_| self.phase == Phase::Unlocked));
        let is_complete = progress.is_complete();
        if let Some(alarm) = alarm {
            self.alarmed(alarm, None, actions);
        } else if self.phase == Phase::Unlocked && is_complete {
            self.go(Cause::AllThrough, Phase::Closing, Prompt::Closing);
        }
    }
}
