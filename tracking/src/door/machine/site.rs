//! How a door begins in a site, goes on in a changed one, and leaves it; and what it goes on with after a restart.
//!
//! ```text
//!   may_change? ─▶ change_site   the same door: alarms and cards stay, a passage under way ends in trouble, locked
//!                  added         a new one: locked until trouble outlasts 2 s
//!                  retire        one that is gone: locks for good
//! ```

use super::{Machine, SETTLED_S};
use crate::door::crossing::Doorway;
use crate::door::event::{Action, Seen};
use crate::door::passage::Outcome;
use crate::door::terms::{Alarm, EndsWith, Lock, Trouble};
use crate::door::transition::Phase;
use crate::site::Site;
use crate::site::door::{Door, Fail};

impl Machine {
    /// Begins at `now_s`, in a site that has changed: no change unlocks, so the door is locked until trouble outlasts 2 s.
    pub fn added(&mut self, now_s: f64) {
        self.now_s = now_s;
        self.of_before = false;
        self.trust.fail = Fail::Secure;
        self.count.not_before_s = now_s + SETTLED_S;
        self.orders.lock.set(self.wanted());
    }

    /// Goes on with an alarm that stood when the process before ended. Of several the first that must be reset stands; trouble is
    /// found out anew.
    pub fn resume(&mut self, alarm: Alarm) {
        let stands = match alarm.ends_with() {
            EndsWith::Reset => self.standing.is_none_or(|standing| standing.ends_with() != EndsWith::Reset),
            EndsWith::ShutLeaf => self.standing.is_none(),
            EndsWith::Recovery => false,
        };
        if stands {
            self.standing = Some(alarm);
        }
    }

    /// Goes on in a changed site: no match counts before the tracker has been well for 2 s. Alarms stand, cards stay inside,
    /// and the lock does not open by it: a passage under way ends in trouble, locked whatever the site says, until trouble outlasts
    /// those 2 s. A door that is to fail secure from now on locks. False without its zone: nothing has changed then.
    pub fn change_site(&mut self, door: &Door, site: &Site, actions: &mut Vec<Action>) -> bool {
        let Some(doorway) = doorway(door, site) else { return false };
        self.doorway = doorway;
        self.door = door.clone();
        self.count.not_before_s = self.now_s + SETTLED_S;
        self.seen = self.seen.take().map(|(at_s, _)| (at_s, Seen::default()));
        let is_used = !matches!(self.phase, Phase::Idle | Phase::Alarmed | Phase::Failed);
        if is_used {
            self.fail(Trouble::SiteChanged, actions);
        }
        if is_used || door.fail == Fail::Secure {
            self.trust.fail = Fail::Secure;
        }
        self.say(actions);
        true
    }

    /// Locks for good: the site has this door no more. An alarm that stands is not over by that.
    #[must_use]
    pub fn retire(&mut self) -> Vec<Action> {
        let mut actions = Vec::new();
        self.end(Outcome::Trouble, "the door was taken out of the site", &mut actions);
        self.orders.lock.set(Lock::Locked);
        self.orders.lock.ask();
        // A leaf of a door that is no more is not waited for.
        self.orders.alarm.set(self.standing.filter(|alarm| alarm.ends_with() == EndsWith::Reset));
        self.orders.say(self.now_s, &mut actions);
        actions
    }

    /// Whether the site may be changed: no passage is under way, or the door has failed and no alarm that must be reset stands
    /// beneath, or its contact has never said anything, as that of a door that has just been drawn. Not while a person has the time
    /// to leave: a door that is taken out locks.
    #[must_use]
    pub fn may_change(&self) -> bool {
        match self.phase {
            _ if self.now_s < self.exit_until_s => false,
            Phase::Idle => true,
            Phase::Failed => self.standing.is_none_or(|alarm| alarm.ends_with() != EndsWith::Reset),
            Phase::HeldOpen => self.leaf.contact.is_none(),
            Phase::Asked | Phase::Checking | Phase::Unlocked | Phase::Closing | Phase::Alarmed => false,
        }
    }
}

/// The line and the zone of a door; none without its zone.
pub(super) fn doorway(door: &Door, site: &Site) -> Option<Doorway> {
    let zone = site.zones.iter().find(|zone| zone.name == door.zone)?;
    Some(Doorway::new(door.ends(), zone.corners()))
}
