//! Pose monitoring: a device that was turned, moved, covered or lifted is noticed as soon as a person walks.
//!
//! ```text
//!   walk     two modules see one walker at two places ─▶ which turn or shift of which module explains it?
//!   walls    what stands before a background is that background, some beams further ─▶ turned
//!   met      others see a walker where this one should: it detects · it is blocked · it sees free space there
//! ```
//!
//! Only moments with one walker count, so a crowd raises nothing where it is, nor where its place may be seen (`nearby`). What was found stays until the module agrees with the
//! others again, or the site is changed.

use std::collections::VecDeque;
use std::sync::Arc;

use crate::geometry::{Point, Pose, inside, wrapped};
use crate::observation::{Detection, Observation, View};
use crate::site::{Mover, Site};

use super::align::link;
use super::median;
use super::nearby::{Reach, nearby};
use super::turned::{MOST_RAD, TURN_RAD, Walls};
use super::walk::{Glimpse, Walk};
use super::walker::moves;

/// Seconds back that are looked at: what was before a module was moved must soon be forgotten.
const WINDOW_S: f64 = 15.0;

/// Between two judgements, s.
const JUDGE_S: f64 = 1.0;

/// Two modules are compared over at least so long a common walk, s, that spreads so far, m.
const COMPARED_S: f64 = 5.0;
const SPREAD_M: f64 = 0.4;

/// They disagree if they see the walker this far apart, m (median): bodies' shapes make 5 to 10 cm of it.
const APART_M: f64 = 0.16;

/// A turn or shift explains that if it leaves less than this share of it.
const EXPLAINS: f64 = 0.6;

/// The least shift that is reported, m: what a person carries in front, seen from one side only, makes 0.2 m of it. And
/// the least turn, `TURN_RAD`.
const SHIFT_M: f64 = 0.3;

/// Of two explanations the one with less shift is believed more: half a metre of shift weighs as one pair that agrees.
const SHIFT_COSTS: f64 = 2.0;

/// Judgements in a row, a person walking all the time, in which the walk must say about the same, rad and m.
const SURE: u32 = 6;
const LIKE_RAD: f64 = TURN_RAD;
const LIKE_M: f64 = 0.2;

/// A person is met within this distance of where others see them, m: a turn of 10° at 3 m is still met.
const MET_M: f64 = 0.6;

/// A person who stands still in a module's shadow proves nothing: a person must walk so far, m.
const WALKS_M: f64 = 0.5;

/// The newest moments, of a tenth of a second, that say that a module is blind, that it looks past people, that all is well.
const BLIND: usize = 30;
const PAST: usize = 100;
const WELL: usize = 60;

/// A walk seen twice must fit so well, as a share of it, to say anything about poses.
const FITS_SHARE: f64 = 0.7;

/// No module is moved farther than this without being noticed otherwise, m: what explains more is no move.
const FARTHEST_M: f64 = 3.0;

/// A covered module has so much of its view end before its walls.
const COVERED_SHARE: f64 = 0.5;

/// So much of it is more than any crowd hides; for so many judgements in a row it is covered, wherever people walk.
const SMOTHERED_SHARE: f64 = 0.9;
const SMOTHERED: u32 = 5;

/// What is wrong with a module's place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Finding {
    /// It looks elsewhere than the site says: turned by so much to the left, rad, and moved by so much, m.
    Moved {
        /// To the left, rad.
        turn_rad: f64,
        /// How far, m.
        shift_m: f64,
    },
    /// Something before it hides all.
    Covered,
    /// People walk where it should see them, and it sees no person there.
    Past,
}

impl Finding {
    /// Whether another is of the same kind, and a move of about the same turn and shift.
    fn is_like(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Moved { turn_rad, shift_m }, Self::Moved { turn_rad: other_rad, shift_m: other_m }) => {
                (turn_rad - other_rad).abs() < LIKE_RAD && (shift_m - other_m).abs() < LIKE_M
            }
            _ => self == other,
        }
    }
}

/// What became of a person that other modules saw in a module's view.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Outcome {
    Met,
    Blocked,
    Through,
}

/// What is remembered of one module.
#[derive(Clone, Debug, Default)]
struct Known {
    view: Option<Arc<View>>,
    /// The background that `reach` is of.
    background_mm: Arc<[u16]>,
    reach: Option<Reach>,
    walls: Walls,
    /// The turn that the walls say, rad to the left.
    turned_rad: Option<f64>,
    /// When, where and what.
    met: VecDeque<(f64, Point, Outcome)>,
    /// Share of its view that ends early.
    hidden_share: f64,
    /// In how many judgements in a row nearly all of its view was blocked.
    smothered: u32,
    finding: Option<Finding>,
    /// A walk has shown that nothing is wrong, since something was found if ever.
    is_well: bool,
}

/// Watches over the poses of a site's modules.
#[derive(Clone, Debug)]
pub struct PoseWatch {
    walk: Walk,
    known: Vec<Known>,
    movers: Vec<Vec<Point>>,
    /// The module that the walk blames, of what, and how often in a row.
    blamed: Option<(usize, Finding, u32)>,
    judged_s: f64,
    /// Whether a module may see farther than when the walk was told which are nearby, or elsewhere.
    are_other: bool,
}

impl PoseWatch {
    /// Over the modules of a site.
    #[must_use]
    pub fn new(site: &Site) -> Self {
        let modules = site.modules.len();
        let movers = site.movers.iter().map(Mover::corners).collect();
        Self {
            walk: Walk::apart(modules),
            known: vec![Known::default(); modules],
            movers,
            blamed: None,
            judged_s: 0.0,
            are_other: false,
        }
    }

    /// Takes an observation. What lies wholly where a moving fixture moves is left out.
    pub fn observe(&mut self, observation: &Observation) {
        let module = observation.view.module;
        let moves = |seen: &Detection| {
            self.movers.iter().any(|mover| seen.outline.iter().all(|place| inside(*place, mover)))
        };
        if observation.detections.iter().any(moves) {
            let detections = observation.detections.iter().filter(|seen| !moves(seen)).cloned().collect();
            self.walk.observe(&Observation { detections, ..observation.clone() });
        } else {
            self.walk.observe(observation);
        }
        let expected = self.expected(module, observation);
        let Some(known) = self.known.get_mut(module) else { return };
        known.view = Some(Arc::clone(&observation.view));
        self.are_other |= known.see(observation);
        known.hidden_share = hidden_share(observation);
        known.walls.observe(observation);
        known.met.extend(expected);
        while known.met.front().is_some_and(|(at_s, ..)| *at_s < observation.start_s - WINDOW_S) {
            known.met.pop_front();
        }
    }

    /// The wall behind every beam of a module, mm; 0 where there is none.
    pub fn know_walls(&mut self, module: usize, walls_mm: &Arc<[u16]>) {
        if let Some(known) = self.known.get_mut(module) {
            known.walls.know(walls_mm);
        }
    }

    /// A person that another module sees where this one should, and what this one makes of it.
    fn expected(&self, module: usize, observation: &Observation) -> Option<(f64, Point, Outcome)> {
        let at_s = observation.start_s;
        if self.walk.was_crowded(module, at_s) {
            return None;
        }
        let other = |other: usize| {
            let glimpse = self.walk.newest(other, at_s - 0.15)?;
            let view = self.known.get(other)?.view.as_ref()?;
            Some(view.pose.to_site(glimpse.place()))
        };
        let place = self.walk.others(module).find_map(other)?;
        let (range_m, Some(beam)) = observation.view.beam_at(place) else { return None };
        // Not at the edge of what it sees: a hand's breadth to either side, and half a metre behind.
        let aside = (0.2 / range_m.max(0.2) / f64::from(observation.view.geometry.beam_rad())) as u16;
        let clear = [beam.saturating_sub(aside), beam, beam.saturating_add(aside)]
            .iter()
            .all(|&beam| observation.background_m(beam) > range_m + 0.5);
        if !clear {
            return None;
        }
        let near = |seen: &Detection| {
            moves(&seen.candidate) && (Point::new(seen.centre.x, seen.centre.y) - place).length() < MET_M
        };
        let outcome = if observation.detections.iter().any(near) {
            Outcome::Met
        } else if observation.empty_m(beam) > range_m + 0.25 {
            Outcome::Through
        } else {
            Outcome::Blocked
        };
        Some((at_s, place, outcome))
    }

    /// What is wrong at `now_s`, by module.
    pub fn findings(&mut self, now_s: f64) -> Vec<(usize, Finding)> {
        if now_s >= self.judged_s + JUDGE_S {
            self.judged_s = now_s;
            if std::mem::take(&mut self.are_other) {
                let reaches: Vec<Option<Reach>> = self.known.iter().map(|known| known.reach).collect();
                self.walk.set_nearby(nearby(&reaches, FARTHEST_M));
            }
            self.walk.forget(now_s - WINDOW_S);
            self.judge();
        }
        let found = |(module, known): (usize, &Known)| Some((module, known.finding?));
        self.known.iter().enumerate().filter_map(found).collect()
    }

    /// Whether a walk has shown that nothing is wrong with a module's place; false also while nothing is known of it.
    #[must_use]
    pub fn is_well(&self, module: usize) -> bool {
        self.known.get(module).is_some_and(|known| known.is_well)
    }

    fn judge(&mut self) {
        for known in &mut self.known {
            known.turned_rad = known.view.as_ref().and_then(|view| known.walls.judge(view));
            known.smothered =
                if known.hidden_share > SMOTHERED_SHARE { known.smothered.saturating_add(1) } else { 0 };
        }
        let compared = self.compare();
        self.blamed = match (self.blame(&compared), self.blamed) {
            (Some((module, finding)), Some((before, was, times)))
                if module == before && finding.is_like(&was) =>
            {
                Some((module, finding, times.saturating_add(1)))
            }
            (Some((module, finding)), _) => Some((module, finding, 1)),
            // No person walks before two modules any more: what was seen stays, and proves no more than it did.
            (None, before) if compared.iter().all(|pair| !pair.fresh) => before,
            (None, _) => None,
        };
        let sure = self.blamed.filter(|(_, _, times)| *times >= SURE);
        let by_walk = sure.map(|(module, finding, _)| (module, finding));
        for (module, known) in self.known.iter_mut().enumerate() {
            let hidden = known.hidden_share > COVERED_SHARE && known.lately(BLIND, Outcome::Blocked);
            let covered = hidden || known.smothered >= SMOTHERED;
            let new = if covered {
                Some(Finding::Covered)
            } else if let Some(turn_rad) = known.turned_rad {
                Some(Finding::Moved { turn_rad, shift_m: 0.0 })
            } else if let Some((_, finding)) = by_walk.filter(|(whose, _)| *whose == module) {
                Some(finding)
            } else if known.lately(PAST, Outcome::Through) {
                Some(Finding::Past)
            } else {
                None
            };
            let own = || compared.iter().filter(|pair| pair.has(module));
            let agrees = known.lately(WELL, Outcome::Met) && own().all(|pair| !pair.apart);
            if new.is_some() || (agrees && own().next().is_some()) {
                known.finding = new;
                known.is_well = new.is_none();
            }
        }
    }

    /// Every pair with enough of a common walk.
    fn compare(&self) -> Vec<Compared> {
        let pair = |((one, other), common_s): ((usize, usize), f64)| {
            if common_s < COMPARED_S {
                return None;
            }
            let pose = |module: usize| Some(self.known.get(module)?.view.as_ref()?.pose);
            let (here, there) = (pose(one)?, pose(other)?);
            let link = link(&self.walk, one, other)?;
            if link.spread_m < SPREAD_M || link.share < FITS_SHARE {
                return None;
            }
            let apart = |to: &Pose| {
                let apart =
                    |(a, b): (Glimpse, Glimpse)| (here.to_site(a.place()) - to.to_site(b.place())).length();
                median(&mut self.walk.common(one, other).map(apart).collect::<Vec<f64>>())
            };
            let found = Pose { at: here.to_site(link.pose.at), yaw_rad: here.yaw_rad + link.pose.yaw_rad };
            let (before_m, after_m) = (apart(&there), apart(&found));
            let inverse = Pose { at: link.pose.to_sensor(Point::default()), yaw_rad: -link.pose.yaw_rad };
            let back = Pose { at: there.to_site(inverse.at), yaw_rad: there.yaw_rad + inverse.yaw_rad };
            let change =
                |from: &Pose, to: &Pose| (wrapped(to.yaw_rad - from.yaw_rad), (to.at - from.at).length());
            let changes = [change(&here, &back), change(&there, &found)];
            let told = changes.iter().any(|(turn_rad, shift_m)| {
                let within = turn_rad.abs() < MOST_RAD && *shift_m < FARTHEST_M;
                within && (turn_rad.abs() > TURN_RAD || *shift_m > SHIFT_M)
            });
            let apart = before_m > APART_M && after_m < EXPLAINS * before_m && told;
            let sees = |module: usize| self.walk.newest(module, self.judged_s - JUDGE_S).is_some();
            Some(Compared {
                modules: [one, other],
                common_s,
                apart,
                fresh: sees(one) && sees(other),
                changes,
            })
        };
        self.walk.pairs().into_iter().filter_map(pair).collect()
    }

    /// The module whose move explains best that some disagree: it disagrees with most and agrees with fewest; of two
    /// alike, the one with the smaller shift.
    fn blame(&self, compared: &[Compared]) -> Option<(usize, Finding)> {
        let candidate = |module: usize| {
            let own = || compared.iter().filter(move |pair| pair.has(module));
            let worst = own()
                .filter(|pair| pair.apart && pair.fresh)
                .max_by(|a, b| a.common_s.total_cmp(&b.common_s))?;
            let disagrees = own().map(|pair| if pair.apart { 1.0 } else { -1.0 }).sum::<f64>();
            let (turn_rad, shift_m) = worst.changes[usize::from(worst.modules[1] == module)];
            Some((module, disagrees - SHIFT_COSTS * shift_m, Finding::Moved { turn_rad, shift_m }))
        };
        let all = (0..self.known.len()).filter_map(candidate);
        all.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(module, _, finding)| (module, finding))
    }
}

/// Two modules over their common walk.
#[derive(Clone, Debug)]
struct Compared {
    modules: [usize; 2],
    common_s: f64,
    /// They see the walker at two places, and a move of either explains it.
    apart: bool,
    /// A person walks before both at this moment.
    fresh: bool,
    /// How far each one would have been turned, rad, and shifted, m, if it alone had been.
    changes: [(f64, f64); 2],
}

impl Compared {
    fn has(&self, module: usize) -> bool {
        self.modules.contains(&module)
    }
}

impl Known {
    /// Takes how far it sees from where; whether that is another reach than before.
    fn see(&mut self, observation: &Observation) -> bool {
        let at = observation.view.pose.at;
        let is_same = self.reach.is_some_and(|reach| reach.at == at);
        if is_same && Arc::ptr_eq(&self.background_mm, &observation.background_mm) {
            return false;
        }
        let farthest_mm = observation.background_mm.iter().copied().max().unwrap_or_default();
        // A background that is not known yet says nothing.
        if farthest_mm == 0 {
            return false;
        }
        self.background_mm = Arc::clone(&observation.background_mm);
        let reach = Some(Reach { at, reach_m: f64::from(farthest_mm) * 1e-3 });
        std::mem::replace(&mut self.reach, reach) != reach
    }

    /// Whether the newest so many moments ended in this way, nine of ten (to be well, half), with a person walking.
    fn lately(&self, moments: usize, wanted: Outcome) -> bool {
        let newest = || self.met.iter().rev().take(moments);
        let ended = newest().filter(|met| met.2 == wanted).count();
        let met = newest().filter(|met| met.2 == Outcome::Met).count();
        let enough = if wanted == Outcome::Met {
            met * 2 >= moments
        } else {
            ended * 10 >= moments * 9 && met * 20 <= moments
        };
        let Some((_, first, _)) = newest().next() else { return false };
        let walks = newest().any(|(_, place, _)| (*place - *first).length() > WALKS_M);
        self.met.len() >= moments && enough && walks
    }
}

/// Share of a module's view that ends before its background.
fn hidden_share(observation: &Observation) -> f64 {
    let known =
        observation.background_mm.iter().zip(&observation.empty_mm).filter(|(wall_mm, _)| **wall_mm > 300);
    let (hidden, all) = known.fold((0, 0), |(hidden, all), (wall_mm, empty_mm)| {
        (hidden + usize::from(u32::from(*empty_mm) * 10 < u32::from(*wall_mm) * 6), all + 1)
    });
    hidden as f64 / f64::from(all.max(1))
}

#[cfg(test)]
#[path = "watch_tests.rs"]
mod tests;
