//! The life of a body: confirmed, taken for one that was hidden, deleted.
//!
//! ```text
//!   begun ─▶ confirmed ─▶ unseen ─▶ deleted
//!      └──── in an enclosed zone: the unseen body that is most likely there comes into view
//! ```

use super::birth::began_inside;
use super::body::{Body, SURE};
use super::ground::Passage;
use super::missing::DENSITY;
use super::sample::Sample;
use super::scan::Scan;
use super::{Part, Rendering};
use crate::geometry::Point;

/// Existence from which a body is confirmed, and below which it is deleted: log odds of 0.9 and 0.3.
const CONFIRMED: f64 = 2.197;
const DELETED: f64 = -0.847;

/// A tentative body is deleted below the log odds it began with, less this.
const TENTATIVE: f64 = 1.5;

/// Hazard of having left for a sample of an unseen body outside enclosed zones, 1/s; and where no module would see it
/// if it stood alone: forgotten within a second.
const LEAVES: f64 = 0.5;
const GONE: f64 = 10.0;

/// Hazard of the weight of a sample outside, when its body was last seen in an enclosed zone, 1/s: a hundredth is left after
/// a scan of two modules, 0.05 s.
const STRAYED: f64 = 92.0;

/// Most that this takes from the existence of such a body, 1/s: it is inside, where its samples are not. A tenth in 0.05 s.
const KEPT: f64 = 2.1;

/// A tentative body nearer than this to a confirmed one is in its company, m: a stretched arm. Half of the people in a
/// dense crowd have a neighbour who is nearer.
const COMPANY_M: f64 = 0.5;

/// For so long it must have been elsewhere to be a person, s: five scans of a module.
const ALONE_S: f64 = 0.5;

/// What begins inside an enclosed zone, a stride from its entries, waits so long for an unseen body to be it, s.
const WAITS_S: f64 = 2.0;

impl Rendering {
    /// Deletes what is not believed any more. The number of a body that vanishes inside an enclosed zone goes to a
    /// tentative one there.
    pub(super) fn forget(&mut self, concerned: &[usize], newest: &Scan, start_s: f64) {
        for &index in concerned {
            if self.bodies[index].is_unseen(start_s) {
                self.doubt_outside(index, newest, start_s);
            }
        }
        let mut vanished: Vec<(u64, Point)> = Vec::new();
        self.missing.forget(start_s);
        let is_deleted =
            |index: &usize| self.bodies.get(*index).is_some_and(|body| !is_believed(body, start_s));
        let deleted: Vec<usize> = (0..self.bodies.len()).filter(is_deleted).collect();
        for &index in &deleted {
            let body = &self.bodies[index];
            let mean = body.cloud.moments().at;
            match self.terrain.plan.enclosed.hold(mean) {
                true if body.confirmed => vanished.push((body.id, mean)),
                false if self.model.has(Part::Missing) => {
                    self.missing.note(mean, self.chance_missing(body), start_s);
                }
                _ => {}
            }
        }
        for &index in deleted.iter().rev() {
            self.bodies.remove(index);
        }
        self.fields.retain(|(index, _)| !deleted.contains(index));
        if self.model.has(Part::Conservation) {
            for (id, at) in vanished {
                self.hand_on(id, at);
            }
        }
    }

    /// Probability that a body that is deleted outside enclosed zones is a person on the way in, behind others. A tentative one was not
    /// seen for long enough to say where it walks; in company it may have been an arm, and aboard a vehicle a side of it.
    fn chance_missing(&self, body: &Body) -> f64 {
        if body.confirmed {
            return if body.sighting.comes_in { 1.0 } else { 0.0 };
        }
        let is_alone = self.confirmed_near(body, COMPANY_M).next().is_none();
        if is_alone && !self.notes.is_aboard(body.id) { body.existence() } else { 0.0 }
    }

    /// An unseen body may have left where its samples are outside enclosed zones: their weight falls, and existence with it.
    fn doubt_outside(&mut self, index: usize, newest: &Scan, start_s: f64) {
        let (enclosed, modules) = (&self.terrain.plan.enclosed, &self.terrain.modules);
        let has_inside = self.model.has(Part::Inside);
        let body = &mut self.bodies[index];
        let step_s = (start_s - body.doubted_s.max(body.supported_s)).max(0.0);
        body.doubted_s = start_s;
        let stays = has_inside && body.sighting.inside.is_some() && body.sighting.passage != Passage::Through;
        let stays_there = |sample: &Sample| {
            if enclosed.hold(sample.at) {
                return 1.0;
            }
            let hazard = if modules.cover(sample.at, newest) { LEAVES } else { GONE };
            libm::exp(-step_s * (hazard + if stays { STRAYED } else { 0.0 }))
        };
        let left = body.cloud.thin(stays_there);
        let kept = if stays { left.max(libm::exp(-step_s * KEPT)) } else { left };
        body.log_odds = (body.log_odds + libm::log(kept.max(1e-9))).clamp(-SURE, SURE);
    }

    /// Who vanishes inside an enclosed zone has not left it: the nearest tentative body there is that person.
    fn hand_on(&mut self, id: u64, at: Point) {
        let enclosed = &self.terrain.plan.enclosed;
        let distance_m = |body: &Body| (body.cloud.moments().at - at).length();
        let is_there = |place: Point| enclosed.around(at).any(|zone| enclosed.is_in(zone, place));
        let heirs = self.bodies.iter_mut().filter(|body| {
            !body.confirmed && body.log_odds >= CONFIRMED && is_there(body.cloud.moments().at)
        });
        if let Some(heir) = heirs.min_by(|one, other| distance_m(one).total_cmp(&distance_m(other))) {
            heir.id = id;
            heir.confirmed = true;
        }
    }

    /// Whether a body is in the company of an older one, or was until a moment ago: it may be an arm.
    fn is_accompanied(&mut self, index: usize, start_s: f64) -> bool {
        if !self.model.has(Part::Company) {
            return false;
        }
        if self.has_elder(index, COMPANY_M) {
            self.bodies[index].accompanied_s = start_s;
        }
        start_s - self.bodies[index].accompanied_s < ALONE_S
    }

    /// Confirms bodies. Inside an enclosed zone a new one is an unseen one that comes into view, or waits.
    pub(super) fn confirm(&mut self, start_s: f64) {
        for index in 0..self.bodies.len() {
            let body = &self.bodies[index];
            if body.confirmed || body.log_odds < CONFIRMED {
                continue;
            }
            let at = body.cloud.moments().at;
            let begins_inside = began_inside(body);
            let waits = begins_inside && start_s - body.begun_s <= WAITS_S;
            // Other sides of a vehicle come into view when it turns.
            let is_side = begins_inside && self.notes.is_aboard(body.id);
            if self.is_accompanied(index, start_s) || is_side {
                continue;
            }
            if !self.terrain.plan.enclosed.hold(at) || !self.model.has(Part::Conservation) {
                self.bodies[index].confirmed = true;
                self.missing.find(at, start_s);
                continue;
            }
            let ghosts = self.bodies.iter().enumerate();
            let enclosed = &self.terrain.plan.enclosed;
            // One who is hidden in another zone is not this one.
            let may_be_here =
                |ghost: &Body| ghost.sighting.inside.is_none_or(|zone| enclosed.is_in(zone, at));
            let ghosts = ghosts.filter(|(other, ghost)| {
                *other != index && ghost.confirmed && ghost.is_unseen(start_s) && may_be_here(ghost)
            });
            // A person who was lost on the way in, unless one that is hidden is likelier there.
            let least = if begins_inside { 0.0 } else { self.missing.chance_at(at, start_s) * DENSITY };
            let best = ghosts
                .map(|(other, ghost)| (other, ghost.cloud.density(at, ghost.kernel_m(start_s))))
                .max_by(|one, other| one.1.total_cmp(&other.1));
            match best {
                Some((ghost, density)) if density > least => {
                    let id = self.bodies[ghost].id;
                    let body = &mut self.bodies[index];
                    body.confirmed = true;
                    body.id = id;
                    self.bodies.remove(ghost);
                    return;
                }
                _ if !waits => {
                    self.bodies[index].confirmed = true;
                    self.missing.find(at, start_s);
                }
                _ => {}
            }
        }
    }
}

/// Whether a body is believed in still: a tentative one as long as it is seen.
fn is_believed(body: &Body, start_s: f64) -> bool {
    let least = if body.confirmed { DELETED } else { body.prior - TENTATIVE };
    body.log_odds > least && (body.confirmed || !body.is_unseen(start_s))
}

#[cfg(test)]
mod tests {
    use super::super::cloud::Cloud;
    use super::super::note::Note;
    use super::super::notes::Notes;
    use super::super::tests::Bench;
    use super::*;

    /// A tentative body here, as likely as not.
    fn body(x: f64, y: f64) -> Body {
        let sample = Sample::new(Point::new(x, y), Point::default(), Point::new(0.0, 1.0));
        Body::begin(1, 0.0, Cloud::new(vec![sample], 0.0))
    }

    #[test]
    fn a_tentative_body_is_missing_as_likely_as_it_was_there_and_not_in_company() {
        let tracker = &mut Bench::within("").tracker;
        let mut lost = body(3.4, 0.0);
        assert_eq!(tracker.chance_missing(&lost), 0.5);
        tracker.bodies.push(Body { confirmed: true, ..body(3.4, 0.6) });
        assert_eq!(tracker.chance_missing(&lost), 0.5);
        tracker.bodies.push(Body { confirmed: true, ..body(3.4, 0.4) });
        assert_eq!(tracker.chance_missing(&lost), 0.0);
        // Of a track it is known whether it was on its way in.
        lost.confirmed = true;
        assert_eq!(tracker.chance_missing(&lost), 0.0);
        lost.sighting.comes_in = true;
        assert_eq!(tracker.chance_missing(&lost), 1.0);
    }

    /// Number 1 was seen beside a vehicle, or alone.
    fn notes(is_aboard: bool) -> Notes {
        let mut note = Note::new(1, Point::default(), Point::default(), 0.0);
        note.tow.aboard = is_aboard.then_some(9);
        Notes::of(vec![note])
    }

    #[test]
    fn a_side_of_a_vehicle_that_is_lost_is_not_a_missing_person() {
        for (is_aboard, chance) in [(false, 0.5), (true, 0.0)] {
            let tracker = &mut Bench::within("").tracker;
            tracker.notes = notes(is_aboard);
            assert_eq!(tracker.chance_missing(&body(3.4, 0.0)), chance);
        }
    }

    #[test]
    fn a_side_of_a_vehicle_that_appears_inside_is_not_confirmed() {
        const ROOM: &str =
            "[[zone]]\nname = 'a'\npolygon = [[0, -2], [3, -2], [3, 2], [0, 2]]\nenclosed = true";
        for (prior, is_aboard, confirmed) in [(-6.0, false, true), (-6.0, true, false), (-2.0, true, true)] {
            let tracker = &mut Bench::within(ROOM).tracker;
            tracker.notes = notes(is_aboard);
            tracker.bodies.push(Body { prior, log_odds: SURE, ..body(1.5, 0.0) });
            tracker.confirm(WAITS_S + 0.1);
            assert_eq!(tracker.bodies[0].confirmed, confirmed, "{prior} {is_aboard}");
        }
    }
}
