//! Our tracker: hidden people are believed in until their place has been seen empty.
//!
//! ```text
//!   sighting ─▶ divide ─▶ associate ─▶ update ──────────────▶ seen
//!               wide       seen people first,   no candidate ─▶ look: through, at, hidden
//!               candidates then hidden, then    left over ────▶ limb of somebody? appearance? birth
//!                          tentative
//! ```
//!
//! Every idea is a setting of its own, so that its worth stays measured.

mod associate;
mod birth;
mod divide;
mod hidden;
pub mod ideas;
mod look;
mod parts;
mod reflection;
mod restore;
#[cfg(test)]
mod tests;
mod track;
mod twins;
mod walls;

use nalgebra::{Matrix2, Vector2};

use super::{TrackState, Tracker};
use crate::geometry::{Point, inside};
use crate::sighting::{Seen, Sighting};
use crate::site::{Mover, Site, Zone};
use hidden::Cloud;
use ideas::{Idea, Ideas};
use reflection::Reflection;
use track::{HIDDEN_S, NOBODY, SURE, Track};
use walls::Walls;

/// Spectral density of a pedestrian's acceleration, m²/s³: who turns or stops does so within half a second.
const AGILITY: f64 = 0.4;

/// Cost of a track without a candidate, −ln per m²: about four deviations of a well known place.
const UNASSIGNED: f64 = 5.0;

/// What is added to that for somebody in full view, and taken off for somebody hidden: e², about seven times less likely.
const MISSED: f64 = 2.0;

/// Two tracks nearer than this are at the same place, m: two bodies cannot be.
const TWINS_M: f64 = 0.33;

/// A candidate farther from a track than this is never its own, m.
const GATE_M: f64 = 0.8;

/// Between the middles of two legs, m.
const STRIDE_M: core::ops::Range<f64> = 0.08..0.45;

/// Deviation of the middle between two legs from their owner's, m.
const LEGS_M: f64 = 0.06;

/// What is nearer to a module touches it, and has no place, mm.
const TOUCHING_MM: u16 = 80;

/// What the face of a mover is unsure by, mm.
const FACE_MM: u16 = 60;

/// Evidence of a module that never detected somebody, against that of one that did: beams pass over children.
const UNKNOWN: f64 = 0.2;

/// For so long after a module began, whoever is inside was there before, s.
const BEGINNING_S: f64 = 10.0;

/// A module that was silent for so long begins anew, s.
const SILENT_S: f64 = 2.0;

/// Who has moved so far is no thing, m.
const MOVED_M: f64 = 0.3;

/// Two who came as one have parted at this distance, m: a thing is not carried farther away.
const PARTED_M: f64 = 1.0;

/// Who is faster than this walks, m/s: half a slow walk, and more than a place jumps between the legs of a chair.
const WALKING_MPS: f64 = 0.5;

/// Who has not moved for so long rests, s.
const RESTS_S: f64 = 1.0;

/// Somebody unseen is doubted after so long without a module that looks there, s.
const UNCOVERED_S: f64 = 0.5;

/// Half-life of somebody hidden in the open, s, and where no module looks.
const HALF_LIFE_S: (f64, f64) = (15.0, 3.0);

/// What one such half-life takes, as log-odds: from sure to nobody in three.
const HALVES: f64 = 4.2;

/// Our tracker.
pub struct Kehai {
    walls: Walls,
    enclosed: Vec<Vec<Point>>,
    movers: Vec<Vec<Point>>,
    ideas: Ideas,
    tracks: Vec<Track>,
    reflections: Vec<Reflection>,
    next_id: u32,
    now_s: f64,
    /// Number of the sighting.
    scan: u64,
    modules: Vec<Heard>,
}

/// When a module was heard.
#[derive(Clone, Copy)]
struct Heard {
    since_s: f64,
    last_s: f64,
}

impl Kehai {
    /// Nobody yet.
    #[must_use]
    pub fn new(site: &Site, ideas: Ideas) -> Self {
        let enclosed = site.zones.iter().filter(|zone| zone.enclosed).map(Zone::corners).collect();
        let movers = site.movers.iter().map(Mover::corners).collect();
        let heard = Heard { since_s: f64::NEG_INFINITY, last_s: f64::NEG_INFINITY };
        Self {
            walls: Walls::of(site),
            enclosed,
            movers,
            ideas,
            tracks: Vec::new(),
            reflections: Vec::new(),
            next_id: 1,
            now_s: 0.0,
            scan: 0,
            modules: vec![heard; site.modules.len()],
        }
    }

    /// Notes that a module was heard, and who is within its reach.
    fn note(&mut self, sighting: &Sighting) {
        self.now_s = self.now_s.max(sighting.start_s);
        self.scan += 1;
        if let Some(heard) = self.modules.get_mut(sighting.view.module) {
            if sighting.start_s - heard.last_s > SILENT_S {
                heard.since_s = sighting.start_s;
            }
            heard.last_s = heard.last_s.max(sighting.start_s);
        }
        let farthest_mm = sighting.background_mm.iter().copied().max().unwrap_or(0);
        let nearest_mm = sighting.seen.iter().map(|seen| seen.candidate.near_mm).max().unwrap_or(0);
        let reach_m = f64::from(farthest_mm.max(nearest_mm)) * 0.001 + GATE_M;
        for track in &mut self.tracks {
            let (middle, radius_m) = match &track.cloud {
                Some(cloud) => cloud.around(),
                None => (track.motion.place(sighting.start_s), 0.0),
            };
            if (middle - sighting.view.pose.at).length() < reach_m + radius_m {
                track.near_in = self.scan;
            }
        }
    }

    /// Whether people may have been inside before the module of this sighting began.
    fn is_beginning(&self, sighting: &Sighting) -> bool {
        let heard = self.modules.get(sighting.view.module);
        heard.is_none_or(|heard| sighting.start_s - heard.since_s < BEGINNING_S)
    }

    /// Where those are whom the module sees.
    fn seen_places(&self, at_s: f64) -> Vec<(u32, Point)> {
        let seen = self.tracks.iter().filter(|track| track.near_in == self.scan && track.is_seen());
        seen.map(|track| (track.id, track.motion.place(at_s))).collect()
    }

    /// Whether nobody gets to a place but across an entry.
    fn is_enclosed(&self, place: Point) -> bool {
        self.enclosed.iter().any(|polygon| inside(place, polygon))
    }

    /// Whether a candidate is a door leaf or a curtain: all of it where one moves.
    fn is_mover(&self, seen: &Seen) -> bool {
        self.movers.iter().any(|mover| seen.outline.iter().all(|&point| inside(point, mover)))
    }

    /// Whether a door leaf or a curtain moves at a place.
    fn moves_there(&self, place: Point) -> bool {
        self.movers.iter().any(|mover| inside(place, mover))
    }

    /// The sighting with everything before a door leaf or a curtain taken as empty, up to its outline: of a body
    /// only its nearest point says what is empty, of a leaf its whole face does. None without one.
    fn before_movers(&self, sighting: &Sighting) -> Option<Sighting> {
        if self.movers.is_empty() || !sighting.seen.iter().any(|seen| self.is_mover(seen)) {
            return None;
        }
        let mut cleared = sighting.clone();
        for seen in sighting.seen.iter().filter(|seen| self.is_mover(seen)) {
            let geometry = &sighting.view.geometry;
            let candidate = &seen.candidate;
            for beam in geometry.beam(candidate.first_step)..=geometry.beam(candidate.last_step) {
                let face_mm = divide::range_mm(candidate, geometry.step(beam)).saturating_sub(FACE_MM);
                if let Some(empty_mm) = cleared.empty_mm.get_mut(usize::from(beam)) {
                    *empty_mm = face_mm.max(*empty_mm);
                }
            }
        }
        Some(cleared)
    }

    /// Whether a candidate belongs to an appearance that was there while the hidden `track` was still seen.
    fn is_somebody_else(&self, track: &Track, seen: &Seen) -> bool {
        self.tracks.iter().filter(|other| !other.confirmed && other.was_beside(track)).any(|other| {
            let place = other.motion.place(seen.at_s);
            (seen.centre - Vector2::new(place.x, place.y)).norm() < TWINS_M
        })
    }

    /// What it costs to leave a track without a candidate: little where it is hidden.
    fn unassigned(&self, track: &Track, sighting: &Sighting) -> f64 {
        if !track.is_seen() {
            return UNASSIGNED;
        }
        let look = look::at_body(sighting, track.motion.place(sighting.start_s));
        UNASSIGNED + MISSED * (look.judged() - look.hidden)
    }

    /// Finds a candidate for each of the tracks `of` within reach; returns which of them got which,
    /// and whether it was one of two legs.
    fn associate(
        &mut self,
        of: impl Fn(&Track) -> bool,
        sighting: &Sighting,
        pieces: &[Seen],
        taken: &mut [bool],
    ) -> Vec<(usize, usize, bool)> {
        let free: Vec<usize> = (0..pieces.len()).filter(|&index| !taken[index]).collect();
        let costs = |track: &Track| -> Vec<f64> {
            let cost = |&index: &usize| {
                let seen = &pieces[index];
                let other = track.is_hidden() && self.is_somebody_else(track, seen);
                if other { f64::INFINITY } else { cost(track, seen) }
            };
            free.iter().map(cost).collect()
        };
        // Whoever is far from every candidate needs no place in the matrix.
        let rows: Vec<(usize, Vec<f64>)> = (0..self.tracks.len())
            .filter(|&index| self.tracks[index].near_in == self.scan && of(&self.tracks[index]))
            .map(|index| (index, costs(&self.tracks[index])))
            .filter(|(_, costs)| costs.iter().any(|cost| *cost < UNASSIGNED))
            .collect();
        let unassigned: Vec<f64> =
            rows.iter().map(|(index, _)| self.unassigned(&self.tracks[*index], sighting)).collect();
        let assigned =
            associate::assign(&unassigned, free.len(), UNASSIGNED, |row, column| rows[row].1[column]);
        let pair = |((track, _), column): (&(usize, _), Option<usize>)| Some((*track, free[column?]));
        let mut hits: Vec<(usize, usize, bool)> =
            rows.iter().zip(assigned).filter_map(pair).map(|(track, index)| (track, index, false)).collect();
        for (_, index, _) in &hits {
            taken[*index] = true;
        }
        for (track, index, is_pair) in &mut hits {
            *is_pair = self.hit(*track, *index, sighting, pieces, taken);
        }
        hits
    }

    /// Gives a track its candidate, and the other leg to a leg; returns whether there was one.
    fn hit(
        &mut self,
        track: usize,
        index: usize,
        sighting: &Sighting,
        pieces: &[Seen],
        taken: &mut [bool],
    ) -> bool {
        let seen = &pieces[index];
        let (mut centre, mut noise) = (seen.centre, seen.covariance);
        let legs = if seen.candidate.narrow {
            let expected = self.tracks[track].place(seen.at_s).0;
            let own = self.tracks[track].id;
            let others = self.seen_places(seen.at_s);
            let is_own = |leg: &Seen| {
                let far_m = |place: Point| (leg.centre - Vector2::new(place.x, place.y)).norm();
                others.iter().all(|(id, place)| *id == own || far_m(*place) > far_m(expected))
            };
            let expected = Vector2::new(expected.x, expected.y);
            other_leg(index, expected, pieces, |other| !taken[other] && is_own(&pieces[other]))
                .filter(|(_, middle)| (middle - expected).norm() < (centre - expected).norm().max(0.2))
        } else {
            None
        };
        let track = &mut self.tracks[track];
        if let Some((other, middle)) = legs {
            taken[other] = true;
            centre = middle;
            noise = Matrix2::identity() * (LEGS_M * LEGS_M);
            track.width_m = track.width_m.max((pieces[other].centre - seen.centre).norm() + seen.width_m);
        }
        track.hit(seen, centre, &noise, sighting.view.module);
        track.hit_in = self.scan;
        if track.confirmed {
            track.existence = (track.existence + 2.0).min(SURE);
            track.reason = "seen";
        }
        legs.is_some()
    }

    /// What the sighting says about everybody within reach whom it did not detect.
    fn miss(&mut self, sighting: &Sighting) {
        let seen_now = self.seen_places(sighting.start_s);
        let end_s = sighting.start_s + f64::from(sighting.view.geometry.period_us()) * 1e-6;
        let free_space = self.ideas.has(Idea::FreeSpace);
        for track in &mut self.tracks {
            if track.hit_in == self.scan || track.near_in != self.scan {
                continue;
            }
            let known = track.known_to(sighting.view.module);
            let factor = if known { 1.0 } else { UNKNOWN };
            let Some(cloud) = &mut track.cloud else {
                let look = look::at_body(sighting, track.motion.place(end_s));
                if free_space && look.judged() > 0.8 && look.through > 0.7 {
                    track.existence -= 0.8 * factor;
                    track.reason = "its place is seen empty";
                }
                continue;
            };
            cloud.predict(end_s, &self.walls);
            let enters = cloud.enters();
            let mut covered = 0;
            let left = cloud.weigh(|place| {
                covered += usize::from(look::covers(sighting, place));
                let look = look::at_point(sighting, place);
                let crowded = seen_now.iter().any(|(_, other)| (*other - place).length() < 0.3);
                let beside = if !enters && self.walls.beside(place) { 0.4 } else { 1.0 };
                (1.0 - 0.8 * look.through).min(beside) * if crowded { 0.8 } else { 1.0 }
            });
            if free_space && left < 0.5 {
                track.existence += (left.max(0.1) * 2.0).ln() * factor;
                track.reason = "its place is seen empty";
            }
            if 2 * covered >= hidden::PLACES {
                track.covered_s = track.covered_s.max(end_s);
            }
        }
    }

    /// Whoever was seen last some time ago is hidden, and in the open believed in less and less.
    fn fade(&mut self, now_s: f64) {
        for index in 0..self.tracks.len() {
            let track = &mut self.tracks[index];
            let Some(cloud) = &track.cloud else {
                if track.near_in == self.scan && now_s - track.last_hit_s > HIDDEN_S {
                    let cloud = Cloud::new(now_s, &track.motion, track.last_hit_s, &self.walls, track.id);
                    track.cloud = Some(cloud);
                    track.reason = "hidden";
                    track.faded_s = now_s;
                    track.covered_s = now_s;
                }
                continue;
            };
            let (middle, _) = cloud.around();
            let (faded_s, covered) = (track.faded_s, now_s - track.covered_s < UNCOVERED_S);
            if !self.is_enclosed(middle) {
                let half_life_s = if covered { HALF_LIFE_S.0 } else { HALF_LIFE_S.1 };
                self.tracks[index].existence -= HALVES * (now_s - faded_s).max(0.0) / half_life_s;
            }
            let track = &mut self.tracks[index];
            track.faded_s = faded_s.max(now_s);
            if !self.ideas.has(Idea::Persistence) && now_s - track.last_hit_s > 1.0 {
                track.existence = NOBODY;
            }
        }
    }

    /// Whoever walks is explained. If of two that came as one the one walks out, it was it who came in: the other
    /// may be a thing, and has to move first.
    fn explain(&mut self) {
        for index in 0..self.tracks.len() {
            let track = &self.tracks[index];
            if track.hit_in != self.scan || track.is_hidden() {
                continue;
            }
            let place = track.motion.place(track.last_hit_s);
            let is_inside = self.is_enclosed(place);
            let track = &mut self.tracks[index];
            track.is_inside = is_inside;
            if (place - track.rest.0).length() > MOVED_M {
                track.rest = (place, if track.walks() { track.last_hit_s } else { track.rest.1 });
            }
            if track.walks() && track.unexplained.is_some_and(|from| (place - from).length() > MOVED_M) {
                track.unexplained = None;
            }
            self.let_go(index);
            let track = &self.tracks[index];
            if track.confirmed && track.beside.is_some() {
                self.part(index);
            }
        }
    }

    /// Looks whether somebody who appeared beside another has parted from him, and who of the two walked.
    fn part(&mut self, index: usize) {
        let track = &self.tracks[index];
        let Some(other) = self.tracks.iter().position(|other| track.beside == Some(other.id)) else {
            self.tracks[index].beside = None;
            return;
        };
        let place = |index: usize| self.tracks[index].place(self.now_s).0;
        if (place(index) - place(other)).length() < PARTED_M {
            return;
        }
        let rests = |index: usize| self.now_s - self.tracks[index].rest.1 > RESTS_S;
        let is_inside = |index: usize| self.tracks[index].is_inside;
        for (walks, stays) in [(index, other), (other, index)] {
            if !is_inside(walks) && is_inside(stays) && rests(stays) {
                let rest = self.tracks[stays].rest.0;
                self.tracks[stays].unexplained.get_or_insert(rest);
                // What came with the one came with the other.
                let (walks, stays) = (self.tracks[walks].id, self.tracks[stays].id);
                for track in self.tracks.iter_mut().filter(|track| track.beside == Some(stays)) {
                    track.beside = (track.id != walks).then_some(walks);
                }
                return;
            }
        }
        let walks = |track: &Track| track.walks() && track.motion.velocity().length() > WALKING_MPS;
        if walks(&self.tracks[index]) && walks(&self.tracks[other]) {
            self.tracks[index].beside = None;
        }
    }

    fn bury(&mut self, now_s: f64) {
        self.tracks.retain(|track| {
            if track.confirmed {
                track.existence > NOBODY
            } else {
                now_s - track.last_hit_s < birth::PATIENCE_S && track.existence > NOBODY
            }
        });
    }
}

/// The free narrow candidate that is a pair of legs with a narrow one, and the middle of both: nearest to where
/// their owner is expected.
fn other_leg(
    index: usize,
    expected: Vector2<f64>,
    pieces: &[Seen],
    is_free: impl Fn(usize) -> bool,
) -> Option<(usize, Vector2<f64>)> {
    let seen = pieces.get(index).filter(|seen| seen.candidate.narrow)?;
    (0..pieces.len())
        .filter(|&other| other != index && pieces[other].candidate.narrow && is_free(other))
        .filter(|&other| STRIDE_M.contains(&(pieces[other].centre - seen.centre).norm()))
        .map(|other| (other, (pieces[other].centre + seen.centre) * 0.5))
        .min_by(|one, two| (one.1 - expected).norm().total_cmp(&(two.1 - expected).norm()))
}

/// −ln likelihood of a candidate, given a track.
fn cost(track: &Track, seen: &Seen) -> f64 {
    if let Some(cloud) = &track.cloud {
        let density = cloud.density(seen.centre, &seen.covariance);
        return if density > 1e-6 { -density.ln() } else { f64::INFINITY };
    }
    let place = track.motion.place(seen.at_s);
    if (seen.centre - Vector2::new(place.x, place.y)).norm() > GATE_M {
        return f64::INFINITY;
    }
    let (distance, log_determinant) = track.motion.distance(seen.at_s, seen.centre, &seen.covariance);
    0.5 * distance + 0.5 * log_determinant + core::f64::consts::TAU.ln()
}

impl Tracker for Kehai {
    fn see(&mut self, sighting: &Sighting) {
        let with_movers = self.before_movers(sighting);
        let sighting = with_movers.as_ref().unwrap_or(sighting);
        self.note(sighting);
        let places: Vec<Point> =
            self.seen_places(sighting.start_s).into_iter().map(|(_, place)| place).collect();
        let at = sighting.view.pose.at;
        let is_thing = |seen: &&Seen| seen.candidate.near_mm < TOUCHING_MM || self.is_mover(seen);
        let stands_out = sighting.seen.iter().filter(|seen| !is_thing(seen));
        let (reflected, real): (Vec<&Seen>, Vec<&Seen>) =
            stands_out.partition(|seen| self.is_reflection(at, seen));
        self.reflect(reflected.into_iter());
        let divided = |seen: &Seen| {
            if self.ideas.has(Idea::Division) {
                divide::divide(seen, &sighting.view, sighting.start_s, &places)
            } else {
                vec![seen.clone()]
            }
        };
        let pieces: Vec<Seen> = real.into_iter().flat_map(divided).collect();
        let mut taken = vec![false; pieces.len()];
        for (track, index, _) in self.associate(Track::is_seen, sighting, &pieces, &mut taken) {
            if self.tracks[track].company.is_some() {
                self.compare(track, &pieces[index]);
                self.judge(track);
            }
        }
        if self.ideas.has(Idea::Limbs) {
            self.drop_limbs(sighting, &pieces, &mut taken);
        }
        self.associate(|track| track.confirmed && track.is_hidden(), sighting, &pieces, &mut taken);
        self.grow(sighting, &pieces, &mut taken);
        self.miss(sighting);
        self.fade(self.now_s);
        self.explain();
        if self.ideas.has(Idea::Twins) {
            self.part_twins(self.now_s);
        }
        self.bury(self.now_s);
    }

    fn tracks(&mut self, at_s: f64) -> Vec<TrackState> {
        self.fade(at_s);
        self.bury(at_s);
        let reflections = self.reflections.iter().filter(|reflection| reflection.lasts(at_s));
        let somebody = self.tracks.iter().map(|track| track.state(at_s));
        somebody.chain(reflections.map(|reflection| reflection.state(at_s))).collect()
    }

    fn restore(&mut self, people: &[TrackState], age_s: f64, at_s: f64) {
        self.take_back(people, age_s, at_s);
    }
}
