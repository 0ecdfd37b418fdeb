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
mod track;
mod walls;

use std::sync::Arc;

use nalgebra::{Matrix2, Vector2};

use super::{TrackState, Tracker};
use crate::geometry::{Point, distance_to_segment, inside};
use crate::sighting::{Seen, Sighting};
use crate::site::Site;
use hidden::Cloud;
use ideas::{Idea, Ideas};
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

/// Nearer than this they are one even if two candidates were seen: a torso and its arm, m.
const ONE_BODY_M: f64 = 0.25;

/// In so many scans only one of them was detected: they are one person.
const TWIN_SCANS: u32 = 12;

/// A candidate farther from a track than this is never its own, m.
const GATE_M: f64 = 0.8;

/// What is nearer to a module touches it, and has no place, mm.
const TOUCHING_MM: u16 = 80;

/// What the face of a mover is unsure by, mm.
const FACE_MM: u16 = 60;

/// Our tracker.
pub struct Kehai {
    site: Arc<Site>,
    walls: Walls,
    zones: Vec<(Vec<Point>, bool)>,
    movers: Vec<Vec<Point>>,
    ideas: Ideas,
    tracks: Vec<Track>,
    next_id: u32,
    now_s: f64,
    begun_s: Option<f64>,
}

impl Kehai {
    /// Nobody yet.
    #[must_use]
    pub fn new(site: Arc<Site>, ideas: Ideas) -> Self {
        let zones = site
            .zones
            .iter()
            .map(|zone| (zone.polygon.iter().map(|&corner| corner.into()).collect(), zone.enclosed))
            .collect();
        let corners =
            |mover: &crate::site::Mover| mover.polygon.iter().map(|&corner| corner.into()).collect();
        let movers = site.movers.iter().map(corners).collect();
        let walls = Walls::of(&site);
        Self { movers, site, walls, zones, ideas, tracks: Vec::new(), next_id: 1, now_s: 0.0, begun_s: None }
    }

    /// Whether nobody gets to a place but across an entry.
    fn is_enclosed(&self, place: Point) -> bool {
        self.zones.iter().any(|(polygon, enclosed)| *enclosed && inside(place, polygon))
    }

    /// Whether a candidate is a door leaf or a curtain: all of it where one moves.
    fn is_mover(&self, seen: &Seen) -> bool {
        self.movers.iter().any(|mover| seen.outline.iter().all(|&point| inside(point, mover)))
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

    /// Distance to the nearest entry, m.
    fn entry_m(&self, place: Point) -> f64 {
        let distance = |entry: &crate::site::Entry| {
            distance_to_segment(place, entry.line[0].into(), entry.line[1].into())
        };
        self.site.entries.iter().map(distance).fold(f64::INFINITY, f64::min)
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
        if track.is_hidden() {
            return UNASSIGNED;
        }
        let look = look::at_body(sighting, track.motion.place(sighting.start_s));
        UNASSIGNED + MISSED * (look.judged() - look.hidden)
    }

    /// Finds a candidate for each of the tracks `of`; returns which pieces were taken.
    fn associate(
        &mut self,
        of: impl Fn(&Track) -> bool,
        sighting: &Sighting,
        pieces: &[Seen],
        taken: &mut [bool],
    ) {
        let tracks: Vec<usize> = (0..self.tracks.len()).filter(|&index| of(&self.tracks[index])).collect();
        let free: Vec<usize> = (0..pieces.len()).filter(|&index| !taken[index]).collect();
        let unassigned: Vec<f64> =
            tracks.iter().map(|&index| self.unassigned(&self.tracks[index], sighting)).collect();
        let assigned = associate::assign(&unassigned, free.len(), UNASSIGNED, |row, column| {
            let (track, seen) = (&self.tracks[tracks[row]], &pieces[free[column]]);
            if track.is_hidden() && self.is_somebody_else(track, seen) {
                f64::INFINITY
            } else {
                cost(track, seen)
            }
        });
        for (row, column) in assigned.into_iter().enumerate() {
            let Some(column) = column else { continue };
            let index = free[column];
            taken[index] = true;
            self.hit(tracks[row], index, sighting, pieces, taken);
        }
    }

    /// Gives a track its candidate, and the other leg to a leg.
    fn hit(&mut self, track: usize, index: usize, sighting: &Sighting, pieces: &[Seen], taken: &mut [bool]) {
        let seen = &pieces[index];
        let track = &mut self.tracks[track];
        let (mut centre, mut noise) = (seen.centre, seen.covariance);
        if seen.candidate.narrow {
            let expected = track.place(seen.at_s).0;
            let expected = Vector2::new(expected.x, expected.y);
            let other = (0..pieces.len())
                .filter(|&other| !taken[other] && pieces[other].candidate.narrow)
                .filter(|&other| (0.08..0.45).contains(&(pieces[other].centre - seen.centre).norm()))
                .map(|other| (other, (pieces[other].centre + seen.centre) * 0.5))
                .min_by(|one, two| (one.1 - expected).norm().total_cmp(&(two.1 - expected).norm()));
            if let Some((other, middle)) = other
                && (middle - expected).norm() < (centre - expected).norm().max(0.2)
            {
                taken[other] = true;
                centre = middle;
                noise = Matrix2::identity() * (0.06 * 0.06);
            }
        }
        track.hit(seen, centre, &noise, sighting.view.module);
        if track.confirmed {
            track.existence = (track.existence + 2.0).min(SURE);
            track.reason = "seen";
        }
    }

    /// What the sighting says about everybody it did not detect.
    fn miss(&mut self, sighting: &Sighting, hit: &impl Fn(&Track) -> bool) {
        let seen_now: Vec<Point> = self
            .tracks
            .iter()
            .filter(|track| track.confirmed && !track.is_hidden())
            .map(|track| track.motion.place(sighting.start_s))
            .collect();
        let end_s = sighting.start_s + f64::from(sighting.view.geometry.period_us()) * 1e-6;
        for index in 0..self.tracks.len() {
            if hit(&self.tracks[index]) {
                continue;
            }
            let enclosed = self.is_enclosed(self.tracks[index].place(end_s).0);
            let track = &mut self.tracks[index];
            if !track.is_hidden() && end_s - track.last_hit_s > HIDDEN_S {
                let cloud = Cloud::new(end_s, &track.motion, track.last_hit_s, &self.walls, track.id);
                track.cloud = Some(cloud);
                track.reason = "hidden";
            }
            let factor = if track.known_to(sighting.view.module) { 1.0 } else { 0.2 };
            let Some(cloud) = &mut track.cloud else {
                let look = look::at_body(sighting, track.motion.place(end_s));
                if self.ideas.has(Idea::FreeSpace) && look.judged() > 0.8 && look.through > 0.7 {
                    track.existence -= 0.8 * factor;
                    track.reason = "its place is seen empty";
                }
                continue;
            };
            cloud.predict(end_s, &self.walls);
            let enters = cloud.enters();
            let left = cloud.weigh(|place| {
                let look = look::at_point(sighting, place);
                let crowded = seen_now.iter().any(|&other| (other - place).length() < 0.3);
                let beside = if !enters && self.walls.beside(place) { 0.4 } else { 1.0 };
                (1.0 - 0.8 * look.through).min(beside) * if crowded { 0.8 } else { 1.0 }
            });
            if self.ideas.has(Idea::FreeSpace) && left < 0.5 {
                track.existence += (left.max(0.1) * 2.0).ln() * factor;
                track.reason = "its place is seen empty";
            }
            // Where no module ever sees, nobody can be said to stay.
            let unseen = cloud.share(|place| !look::covers(sighting, place));
            let half_life_s = if enclosed {
                f64::INFINITY
            } else if unseen > 0.5 {
                3.0
            } else {
                15.0
            };
            let per_scan_s = f64::from(sighting.view.geometry.period_us()) * 1e-6;
            track.existence -= core::f64::consts::LN_2 * per_scan_s / half_life_s * 3.0;
            if !self.ideas.has(Idea::Persistence) && end_s - track.last_hit_s > 1.0 {
                track.existence = NOBODY;
            }
        }
    }

    /// Two tracks that are always detected one at a time at the same place are one person: who came there last
    /// is hidden somewhere about.
    fn part_twins(&mut self, now_s: f64, hit: &impl Fn(&Track) -> bool) {
        for one in 0..self.tracks.len() {
            let seen = |track: &Track| track.confirmed && !track.is_hidden();
            if !seen(&self.tracks[one]) {
                continue;
            }
            let place = self.tracks[one].motion.place(now_s);
            let nearest = (0..self.tracks.len())
                .filter(|&other| other != one && seen(&self.tracks[other]))
                .map(|other| (other, (self.tracks[other].motion.place(now_s) - place).length()))
                .min_by(|one, two| one.1.total_cmp(&two.1))
                .filter(|(_, distance_m)| *distance_m < TWINS_M);
            let Some((other, distance_m)) = nearest else {
                self.tracks[one].twin = 0;
                continue;
            };
            match (hit(&self.tracks[one]), hit(&self.tracks[other])) {
                (true, true) if distance_m > ONE_BODY_M => self.tracks[one].twin = 0,
                (false, false) => {}
                _ => self.tracks[one].twin += 1,
            }
            if self.tracks[one].twin >= TWIN_SCANS
                && self.tracks[one].emerged_s >= self.tracks[other].emerged_s
            {
                let track = &mut self.tracks[one];
                let mut motion = track.motion.clone();
                motion.covariance += nalgebra::Matrix4::identity() * (0.3 * 0.3);
                track.cloud = Some(Cloud::new(now_s, &motion, now_s, &self.walls, track.id));
                track.reason = "taken for somebody else";
                track.twin = 0;
                self.tracks[other].twin = 0;
            }
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
        self.now_s = self.now_s.max(sighting.start_s);
        self.begun_s.get_or_insert(sighting.start_s);
        let places: Vec<Point> = self
            .tracks
            .iter()
            .filter(|track| track.confirmed && !track.is_hidden())
            .map(|track| track.motion.place(sighting.start_s))
            .collect();
        let pieces: Vec<Seen> = sighting
            .seen
            .iter()
            .filter(|seen| seen.candidate.near_mm >= TOUCHING_MM && !self.is_mover(seen))
            .flat_map(|seen| {
                if self.ideas.has(Idea::Division) {
                    divide::divide(seen, &sighting.view, sighting.start_s, &places)
                } else {
                    vec![seen.clone()]
                }
            })
            .collect();
        let mut taken = vec![false; pieces.len()];
        let before: Vec<(u32, f64)> = self.tracks.iter().map(|track| (track.id, track.last_hit_s)).collect();
        self.associate(|track| track.confirmed && !track.is_hidden(), sighting, &pieces, &mut taken);
        if self.ideas.has(Idea::Limbs) {
            self.drop_limbs(sighting, &pieces, &mut taken);
        }
        self.associate(|track| track.confirmed && track.is_hidden(), sighting, &pieces, &mut taken);
        self.grow(sighting, &pieces, &mut taken);
        let hit = |track: &Track| {
            before
                .iter()
                .find(|(id, _)| *id == track.id)
                .is_none_or(|(_, last_s)| *last_s != track.last_hit_s)
        };
        self.miss(sighting, &hit);
        if self.ideas.has(Idea::Twins) {
            self.part_twins(self.now_s, &hit);
        }
        self.bury(self.now_s);
    }

    fn tracks(&mut self, at_s: f64) -> Vec<TrackState> {
        self.bury(at_s);
        self.tracks.iter().map(|track| track.state(at_s)).collect()
    }
}
