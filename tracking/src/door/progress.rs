//! A passage under way: which tracks have gone through, and which are too many.
//!
//! ```text
//!   let in 2      zone ● ●   │            in the zone + through ≤ 2
//!                 zone ●     │ ●          one of them beyond the line: through = 1
//!                 zone ● ○   │ ●          ○ is one too many: ran in
//!                 zone ○     │ ● ●        through = 2: lock
//!                            │ ● ● ○      through = 3: followed
//! ```

use super::crossing::{Crossing, Doorway};
use super::event::{Body, Presence};
use super::passage::{Outcome, Passage};
use super::terms::{Alarm, Card};

/// One person too many must be seen in the zone for so long, s: three lines. A false track lives shorter.
const EXTRA_S: f64 = 0.25;

/// A person of the group must be seen outside the zone for so long to have left it, s.
const LEFT_S: f64 = 0.3;

/// A person so far before the zone has left it, m.
const LEFT_M: f64 = 0.15;

/// A person has turned back who came back across the line and then walks away from it for so long, s, faster than this,
/// m/s, or stays before it for so long, s. In the doorway two people who walk in file hide each other, and their tracks
/// may swap: the one that jumps back then walks in again.
const BACK_S: f64 = 0.6;
const BACK_M_S: f64 = 0.2;
const STAYS_S: f64 = 2.0;

/// A track that was through, and is before the line again.
#[derive(Clone, Copy, Debug)]
struct Back {
    id: u64,
    since_s: f64,
    /// Since when they walk away from the door.
    away_since_s: Option<f64>,
}

/// A group from its card on.
#[derive(Clone, Debug)]
pub struct Progress {
    /// The record so far.
    pub passage: Passage,
    /// People let in; 0 before it is unlocked.
    pub let_in: usize,
    /// People who came out from inside: not of the group, and free to leave.
    leavers: Vec<u64>,
    /// Tracks that have come back across the line.
    backs: Vec<Back>,
    /// Lost in the doorway before the line, and perhaps found again beyond it.
    lost: usize,
    /// Since when one too many is seen, s.
    extra_since_s: Option<f64>,
    /// Since when a person of the group is outside the zone, s.
    left_since_s: Option<f64>,
}

impl Progress {
    /// Begins with a card, or with a person who went in without one.
    #[must_use]
    pub fn new(door: &str, number: u64, now_s: f64, card: Option<Card>) -> Self {
        let passage = Passage {
            door: door.to_owned(),
            number,
            begun_s: now_s,
            ended_s: now_s,
            card,
            entered: 0,
            tries: 0,
            count_p: Vec::new(),
            seen_share: 0.0,
            group: Vec::new(),
            through: Vec::new(),
            outcome: Outcome::GaveUp,
            alarm: None,
            reason: String::new(),
        };
        let (leavers, backs) = (Vec::new(), Vec::new());
        Self { passage, let_in: 0, leavers, backs, lost: 0, extra_since_s: None, left_since_s: None }
    }

    /// The door is unlocked for `people`.
    pub fn unlock(&mut self, people: u32, bodies: &[Body], doorway: &Doorway) {
        self.let_in = people as usize;
        let in_zone = bodies.iter().filter(|body| body.is_sure() && doorway.in_zone(body.at));
        self.passage.group = in_zone.map(|body| body.id).collect();
    }

    /// How many have gone through.
    #[must_use]
    pub const fn through(&self) -> usize {
        self.passage.through.len()
    }

    /// Whether all have gone through, as far as can be told: a track lost in the doorway has gone through it.
    #[must_use]
    pub const fn is_complete(&self) -> bool {
        self.through() + self.lost >= self.let_in
    }

    /// Counts crossings; the alarm they are, if they are one.
    pub fn cross(&mut self, crossings: &[Crossing], now_s: f64) -> Option<Alarm> {
        for crossing in crossings {
            match *crossing {
                Crossing::Inward(id) | Crossing::Shade(id) => {
                    self.leavers.retain(|leaver| *leaver != id);
                    self.went_in(id);
                }
                // With one of the group it went in; with a person inside it was there.
                Crossing::Parted { id, owner } => {
                    if self.passage.through.contains(&owner) {
                        self.went_in(id);
                    }
                }
                Crossing::Found(id) => {
                    // A track lost before the line comes out beyond it under another number.
                    self.lost = self.lost.saturating_sub(1);
                    self.went_in(id);
                }
                Crossing::Lost(id) => {
                    if !self.leavers.contains(&id) {
                        self.lost += 1;
                    }
                }
                Crossing::Outward(id) => {
                    if self.passage.through.contains(&id) {
                        self.passage.through.retain(|known| *known != id);
                        self.backs.push(Back { id, since_s: now_s, away_since_s: None });
                    } else {
                        self.leavers.push(id);
                    }
                }
            }
        }
        (self.through() > self.let_in).then_some(Alarm::Followed)
    }

    /// Whether a person who came back across the line has turned back; a track that has gone does not count.
    pub fn came_back(&mut self, bodies: &[Body], doorway: &Doorway, now_s: f64) -> Option<Alarm> {
        self.backs.retain(|back| bodies.iter().any(|body| body.id == back.id));
        let mut turned = false;
        for back in &mut self.backs {
            let Some(body) = bodies.iter().find(|body| body.id == back.id) else { continue };
            if doorway.inward_m_s(body.velocity) < -BACK_M_S {
                let since_s = *back.away_since_s.get_or_insert(now_s);
                turned |= now_s - since_s >= BACK_S;
            } else {
                back.away_since_s = None;
            }
            turned |= now_s - back.since_s >= STAYS_S;
        }
        turned.then_some(Alarm::TurnedBack)
    }

    fn went_in(&mut self, id: u64) {
        self.backs.retain(|back| back.id != id);
        if !self.passage.through.contains(&id) {
            self.passage.through.push(id);
        }
    }

    /// Checks whether a person is too many, or has left the zone.
    pub fn watch(&mut self, bodies: &[Body], doorway: &Doorway, now_s: f64) -> Option<Alarm> {
        // Of the group, those that are unexplained by now are still there.
        let there = |body: &Body| {
            let is_unexplained = body.presence == Presence::Unexplained;
            body.is_seen || (is_unexplained && self.passage.group.contains(&body.id))
        };
        let before =
            |body: &&Body| there(body) && doorway.in_zone(body.at) && !self.leavers.contains(&body.id);
        let in_zone = bodies.iter().filter(before).count();
        let since = |since_s: &mut Option<f64>, is: bool| {
            if !is {
                *since_s = None;
                return 0.0;
            }
            now_s - *since_s.get_or_insert(now_s)
        };
        let too_many = in_zone + self.through() > self.let_in;
        let left = |body: &&Body| {
            body.is_seen
                && self.passage.group.contains(&body.id)
                && doorway.beyond_m(body.at) < 0.0
                && !doorway.is_near_zone(body.at, LEFT_M)
        };
        let has_left = bodies.iter().any(|body| left(&body));
        let shades = doorway.shades(bodies, now_s);
        let shaded = shades > 0 && in_zone + self.through() + shades > self.let_in;
        if shaded || since(&mut self.extra_since_s, too_many) >= EXTRA_S {
            return Some(Alarm::RanIn);
        }
        (since(&mut self.left_since_s, has_left) >= LEFT_S).then_some(Alarm::TurnedBack)
    }
}
