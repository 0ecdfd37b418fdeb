//! Sessions, tracker, floors and zones together: datagrams in, what is known at a time out.
//!
//! ```text
//!   observations  │││││││││      nothing for 2 s      │││││││││││
//!   zones         ── known ──────╮ unknown            │1.5 s ╭─ known
//!   tracks        ── followed ───── after 30 s: forgotten, and initiated again
//!   one module of several    ││││  nothing for 2 s  │2 s ╭─ what it sees counts as seen again
//!                            ││││ nothing for 0.5 s │2 s ╭─ where a track is being found nothing is empty
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::estimate::Estimate;
use crate::explain::glance::{Glance, Sight};
use crate::explain::person::PersonFacts;
use crate::explain::{Facts, FactsOf, Question};
use crate::explanation::Explanation;
use crate::floor::{FloorLine, Floors, Reading};
use crate::fusion::{Fusion, Ground};
use crate::geometry::inside;
use crate::jsonl::{TrackLine, TracksLine, ZoneKnown, ZoneLine};
use crate::lines::{CrossedLine, Lines, Totals};
use crate::observation::Observation;
use crate::occupancy::Total;
use crate::session::datagram::Datagram;
use crate::session::{Input, Session, Sessions};
use crate::site::Site;
use crate::site::change::SiteChange;
use crate::snapshot::ModuleLine;
use crate::stays::{DwellLine, Stays};
use crate::total::total;
use crate::tracker::{LifeCycle, Model, TrackId, TrackState, Tracker};
use crate::zones::verdict::Verdict;
use crate::zones::{SEEN_S, Zones};

/// No device has seen anything for so long, or one of them has not, s: as long as zones stay known.
const GAP_S: f64 = SEEN_S;

/// A module that has not looked for so long may have lost people, s: a person who turns round is outside the gate around
/// the predicted place. So is, after as long, a body on a silent floor.
const LOST_S: f64 = 0.5;

/// Before this is over, not all people who stand in view may have been found, s: the birth of a track takes 14 candidates
/// of a body that is cut off, at 10 Hz.
const FOUND_S: f64 = 1.5;

/// The same for a module that comes back while others look, s: a third more, as some of its scans may show none. With 1.5 s
/// a zone said *empty* for a tenth of a second in one of some tens of runs.
const BACK_S: f64 = 2.0;

/// After a gap of so long, as after the host's sleep, people have gone anywhere, s: as after a restart.
const FORGOTTEN_S: f64 = 30.0;

/// The tracker of a site: follows people by what its devices send.
pub struct SiteTracker {
    site: Arc<Site>,
    sessions: Sessions,
    tracker: Box<dyn Tracker>,
    floors: Floors,
    /// Where there are floors: pairs the tracks of modules with bodies on floors.
    fusion: Fusion,
    zones: Zones,
    lines: Lines,
    stays: Stays,
    model: Box<dyn Model>,
    /// Added to the tracker's numbers: those of the trackers before it.
    numbers: TrackId,
    newest: TrackId,
    /// Time of the newest observation, and of the first one since the last gap, s.
    seen_s: f64,
    begun_s: f64,
    /// The same of each module.
    looked: BTreeMap<usize, Looked>,
    /// The newest scan of each module.
    glances: BTreeMap<usize, Glance>,
}

/// When a module has looked, s.
#[derive(Clone, Copy, Debug)]
struct Looked {
    newest_s: f64,
    /// First since its last gap.
    begun_s: f64,
}

impl SiteTracker {
    /// With nothing received yet.
    #[must_use]
    pub fn new(site: &Arc<Site>, model: impl Model + 'static) -> Self {
        Self {
            site: Arc::clone(site),
            sessions: Sessions::new(Arc::clone(site), model.estimator()),
            tracker: model.build(site),
            floors: Floors::default(),
            fusion: Fusion::default(),
            zones: Zones::new(site),
            lines: Lines::new(site),
            stays: Stays::new(site),
            model: Box::new(model),
            numbers: 0,
            newest: 0,
            seen_s: f64::NEG_INFINITY,
            begun_s: f64::NEG_INFINITY,
            looked: BTreeMap::new(),
            glances: BTreeMap::new(),
        }
    }

    /// Goes on with another site. Clocks, backgrounds, tracks and what is known of zones stay. Where a module that was moved
    /// looked or looks nothing is known until its people can have been found. A tracker that cannot go on is built anew,
    /// under new numbers, and nothing is known of any zone for as long.
    pub fn change_site(&mut self, site: &Arc<Site>) {
        let before = std::mem::replace(&mut self.site, Arc::clone(site));
        let change = SiteChange { before: &before, now: site };
        self.sessions.change_site(Arc::clone(site));
        if before.floors != site.floors {
            (0..before.floors.len()).for_each(|floor| self.zones.forget(floor));
            self.floors.clear();
        }
        // Modules may have other numbers. What they see, they see again at once; when they looked stays theirs.
        self.glances.clear();
        let looked = std::mem::take(&mut self.looked).into_iter();
        self.looked = looked.filter_map(|(was, looked)| Some((change.number_now(was)?, looked))).collect();
        self.zones.change_site(&change, self.seen_s + FOUND_S);
        self.lines.change_site(site);
        self.stays.change_site(site);
        if !self.tracker.change_site(&change) {
            self.tracker = self.model.build(site);
            self.numbers = self.newest;
            self.begun_s = self.seen_s;
        }
    }

    /// Takes the people of a line that was given `age_s` before the start, by a process that has ended. They are hidden
    /// until a device detects them. On floors no person is hidden: all are found at once.
    pub fn restore(&mut self, line: &TracksLine, age_s: f64) {
        self.newest = line.tracks.iter().map(|track| track.id).fold(self.newest, TrackId::max);
        self.fusion.restore(line.tracks.iter().map(|track| track.id));
        if self.site.modules.is_empty() {
            return;
        }
        let sure = |track: &&TrackLine| track.state != LifeCycle::Tentative;
        let people: Vec<TrackState> = line.tracks.iter().filter(sure).map(TrackState::from).collect();
        self.tracker.restore(&people, age_s, 0.0);
    }

    /// Goes on from what an earlier process has counted at lines, by their names.
    pub fn restore_lines(&mut self, totals: &BTreeMap<String, Totals>) {
        self.lines.restore(totals);
    }

    /// Decodes and uses a datagram that arrived at `now_us` on the host's clock; an observation, if it was a report that
    /// counts.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) -> Option<Observation> {
        let datagram = self.sessions.decode(bytes)?;
        self.follow(&datagram, now_us)
    }

    /// The same with a datagram that is decoded already, by [`Sessions::decode`].
    pub fn follow(&mut self, datagram: &Datagram<'_>, now_us: u64) -> Option<Observation> {
        self.take(datagram, now_us).and_then(Input::scan)
    }

    /// The same; what is returned may be a reading of a floor, too.
    pub fn take(&mut self, datagram: &Datagram<'_>, now_us: u64) -> Option<Input> {
        let input = self.sessions.accept(datagram, now_us)?;
        match &input {
            Input::Scan(observation) => self.observe(observation),
            Input::Floor(reading) => self.read(reading),
        }
        Some(input)
    }

    /// Takes a reading of a floor.
    pub fn read(&mut self, reading: &Reading) {
        if let Some(has_found) = self.floors.observe(reading) {
            self.zones.read(reading, has_found);
        }
    }

    /// Takes an observation. What a module sees whose place is not known says nothing of the site.
    pub fn observe(&mut self, observation: &Observation) {
        if !self.site.is_placed(observation.view.module) {
            return;
        }
        self.resume(observation.start_s);
        let module = observation.view.module;
        self.glances.entry(module).or_insert_with(|| Glance::of(observation)).take(observation);
        self.tracker.observe(observation);
        if self.has_found(observation) {
            self.zones.observe(observation);
        }
    }

    /// Whether the module of an observation has looked for long enough that all in its view have been found. One that comes
    /// back after a gap sees people whom no other may have seen.
    fn has_found(&mut self, observation: &Observation) -> bool {
        let start_s = observation.start_s;
        // When all begin, nothing is said anyway.
        let begins = start_s - self.begun_s < FOUND_S;
        let never = Looked { newest_s: f64::NEG_INFINITY, begun_s: f64::NEG_INFINITY };
        let looked = self.looked.entry(observation.view.module).or_insert(never);
        let gap_s = start_s - looked.newest_s;
        if gap_s > LOST_S {
            self.zones.look_again(&observation.view, start_s + BACK_S);
        }
        if gap_s > GAP_S {
            looked.begun_s = if begins { f64::NEG_INFINITY } else { start_s };
        }
        looked.newest_s = looked.newest_s.max(start_s);
        start_s - looked.begun_s >= BACK_S
    }

    /// A gap between observations ends here, or there is none.
    fn resume(&mut self, start_s: f64) {
        let gap_s = start_s - self.seen_s;
        if gap_s > GAP_S {
            self.begun_s = start_s;
        }
        if gap_s > FORGOTTEN_S && self.seen_s.is_finite() {
            self.tracker = self.model.build(&self.site);
            self.numbers = self.newest;
        }
        self.seen_s = self.seen_s.max(start_s);
    }

    /// All tracks at `at_s`, s on the host's clock.
    pub fn tracks(&mut self, at_s: f64) -> Vec<TrackState> {
        self.tracker.tracks(at_s)
    }

    /// What is known at `at_s`, from what had arrived by then.
    pub fn estimate(&mut self, at_s: f64) -> Estimate {
        for silent in self.floors.expire(at_s) {
            self.zones.forget(silent);
        }
        let tracks = self.tracker.tracks(at_s);
        let mut fusion = std::mem::take(&mut self.fusion);
        let (tracks, explanations) = self.with_floors(&mut fusion, self.numbered(tracks), at_s);
        self.fusion = fusion;
        let mut zones = self.zones.lines(&tracks, at_s);
        let begins = self.begins(at_s);
        if begins {
            zones.values_mut().for_each(|zone| *zone = ZoneLine::unknown());
        }
        let known = self.zones.counting_lines(at_s);
        let known = known.map(|known| if begins { ZoneKnown::Unknown } else { known });
        let crossings = self.lines.observe(&tracks, known, at_s);
        let stays = self.stays.observe(&tracks, at_s);
        self.newest = tracks.iter().map(|track| track.id).fold(self.newest, TrackId::max);
        Estimate { t_s: at_s, tracks, zones, explanations, crossings, stays }
    }

    /// Whether devices have looked for so short a time, since the start or a gap, that people in their view may not have been found.
    fn begins(&self, at_s: f64) -> bool {
        at_s - self.begun_s < FOUND_S
    }

    /// How many people are in the whole site, by the line of the newest estimate and how the devices were then.
    #[must_use]
    pub fn total(&self, line: &TracksLine, modules: &[ModuleLine]) -> Total {
        if self.begins(line.t) { Total::default() } else { total(&self.site, line, modules) }
    }

    /// The same, to be written.
    pub fn line(&mut self, at_s: f64) -> TracksLine {
        TracksLine::from(&self.estimate(at_s))
    }

    /// All tracks at `at_s` as they are known now. What lines say later does not depend on it.
    #[must_use]
    pub fn peek(&self, at_s: f64) -> Vec<TrackLine> {
        let tracks = self.numbered(self.tracker.peek(at_s));
        let (tracks, _) = self.with_floors(&mut self.fusion.clone(), tracks, at_s);
        tracks.iter().map(TrackLine::from).collect()
    }

    /// What is known at `at_s`, the time of the newest estimate, to be explained; an alarm of a device is asked of the registry.
    #[must_use]
    pub fn facts(&self, question: &Question, at_s: f64) -> Facts {
        let tracks = self.numbered(self.tracker.peek(at_s));
        let mut fusion = self.fusion.clone();
        let (tracks, _) = self.with_floors(&mut fusion, tracks, at_s);
        let of = match question {
            Question::Zone(name) => self.zones.zone_facts(name, &tracks, at_s).map(|mut zone| {
                let for_s = self.begun_s + FOUND_S - at_s;
                if for_s > 0.0 {
                    let verdict = Verdict::Begins { for_s };
                    (zone.state, zone.count, zone.verdict) = (verdict.known(), None, Some(verdict));
                }
                FactsOf::Zone(zone)
            }),
            Question::Line(name) => {
                let number = self.site.lines.iter().position(|line| line.name == *name);
                number.and_then(|number| self.zones.line_facts(number, at_s)).map(FactsOf::Zone)
            }
            Question::Person(id) => tracks.iter().find(|track| track.id == *id).map(|state| {
                let own = if self.site.floors.is_empty() { Some(*id) } else { fusion.track_of(*id) };
                let history = own.and_then(|own| self.tracker.history(own.checked_sub(self.numbers)?));
                let zones = self.site.zones.iter().filter(|zone| inside(state.at, &zone.corners()));
                let zones = zones.map(|zone| zone.name.clone()).collect();
                FactsOf::Person(PersonFacts { state: *state, history, zones })
            }),
            Question::Alarm(_) | Question::Views => None,
        };
        let open_range_mm = |module: usize| {
            let is_it = |session: &&Session| session.place_in_site() == Some(module);
            self.sessions.in_place().find(is_it).map_or(0, Session::open_range_mm)
        };
        let told = |glance: &Glance| glance.clone().with_open_range(open_range_mm(glance.module()));
        let glances = self.glances.values().map(told).collect();
        Facts { at_s, site: Arc::clone(&self.site), tracks, glances, of }
    }

    /// What each floor that is read shows.
    #[must_use]
    pub fn floors(&self) -> Vec<FloorLine> {
        self.floors
            .lines(|number| self.site.floors.get(number).map_or_else(String::new, |floor| floor.name.clone()))
    }

    /// How often each counting line was crossed.
    #[must_use]
    pub fn lines(&self) -> Vec<CrossedLine> {
        self.lines.counted()
    }

    /// How long people have stayed in each zone.
    #[must_use]
    pub fn dwell(&self) -> Vec<DwellLine> {
        self.stays.dwell()
    }

    /// The tracks of the modules and the bodies on floors, as people; and where else the people may be that only floors show.
    fn with_floors(
        &self,
        fusion: &mut Fusion,
        tracks: Vec<TrackState>,
        at_s: f64,
    ) -> (Vec<TrackState>, Vec<Explanation>) {
        if self.site.floors.is_empty() {
            return (tracks, Vec::new());
        }
        let explanations = self.floors.explanations(at_s);
        let ground = Ground {
            is_floor: &|at| self.floors.tells_of(at),
            sight: &|at| {
                let sights = self.glances.values().map(|glance| glance.sight(at, at_s));
                sights.max().unwrap_or(Sight::None)
            },
        };
        let people = fusion.fuse(&tracks, &explanations, ground, at_s);
        (people, fusion.explained(explanations))
    }

    fn numbered(&self, tracks: Vec<TrackState>) -> Vec<TrackState> {
        let numbered = |track: TrackState| TrackState {
            id: track.id + self.numbers,
            origin: track.origin.renumbered(self.numbers),
            ..track
        };
        tracks.into_iter().map(numbered).collect()
    }

    /// The sessions with all devices.
    #[must_use]
    pub const fn sessions(&self) -> &Sessions {
        &self.sessions
    }

    /// The sessions with all devices, to be met and polled.
    pub const fn sessions_mut(&mut self) -> &mut Sessions {
        &mut self.sessions
    }
}

#[cfg(test)]
mod tests;
