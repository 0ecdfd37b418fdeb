//! Sessions, tracker and zones together: datagrams in, what is known at a time out.
//!
//! ```text
//!   observations  │││││││││      nothing for 2 s      │││││││││││
//!   zones         ── known ──────╮ unknown            │1.5 s ╭─ known
//!   tracks        ── followed ───── after 30 s: forgotten, and initiated again
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::floor::{Floors, Reading};
use crate::jsonl::{TrackLine, TracksLine, ZoneLine};
use crate::observation::Observation;
use crate::session::datagram::Datagram;
use crate::session::{Input, Sessions};
use crate::site::Site;
use crate::site::change::SiteChange;
use crate::snapshot::FloorLine;
use crate::tracker::{LifeCycle, Model, TrackId, TrackState, Tracker};
use crate::zones::Zones;

/// No device has seen anything for so long, s: as long as zones stay known.
const GAP_S: f64 = 2.0;

/// Before this is over, not all people who stand there may have been found, s: the birth of a track takes 14 candidates of
/// a body that is cut off, at 10 Hz.
const FOUND_S: f64 = 1.5;

/// After a gap of so long, as after the host's sleep, people have gone anywhere, s: as after a restart.
const FORGOTTEN_S: f64 = 30.0;

/// What is known at one time: what doors and the database decide by, and what lines are written from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Time the tracks are predicted to, s on the host's clock.
    pub t_s: f64,
    /// All tracks, tentative ones included.
    pub tracks: Vec<TrackState>,
    /// What is known of each zone, by its name.
    pub zones: BTreeMap<String, ZoneLine>,
}

impl From<&Estimate> for TracksLine {
    fn from(estimate: &Estimate) -> Self {
        let tracks = estimate.tracks.iter().map(TrackLine::from).collect();
        Self { t: estimate.t_s, tracks, zones: estimate.zones.clone() }
    }
}

/// Follows people from what modules send.
pub struct Follower {
    site: Arc<Site>,
    sessions: Sessions,
    tracker: Box<dyn Tracker>,
    floors: Floors,
    zones: Zones,
    model: Box<dyn Model>,
    /// Added to the tracker's numbers: those of the trackers before it.
    numbers: TrackId,
    /// Added to the numbers of bodies on floors.
    floor_numbers: TrackId,
    newest: TrackId,
    /// Time of the newest observation, and of the first one since the last gap, s.
    seen_s: f64,
    begun_s: f64,
}

impl Follower {
    /// With nothing received yet.
    #[must_use]
    pub fn new(site: &Arc<Site>, model: impl Model + 'static) -> Self {
        Self {
            site: Arc::clone(site),
            sessions: Sessions::new(Arc::clone(site), model.estimator()),
            tracker: model.build(site),
            floors: Floors::default(),
            zones: Zones::new(site),
            model: Box::new(model),
            numbers: 0,
            floor_numbers: 0,
            newest: 0,
            seen_s: f64::NEG_INFINITY,
            begun_s: f64::NEG_INFINITY,
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
            self.floor_numbers = self.newest;
        }
        self.zones.change_site(&change, self.seen_s + FOUND_S);
        if !self.tracker.change_site(&change) {
            self.tracker = self.model.build(site);
            self.numbers = self.newest;
            self.begun_s = self.seen_s;
        }
    }

    /// Takes the people of a line that was given `age_s` before the start, by a process that has ended. They are hidden
    /// until a device detects them. On floors nobody is hidden: who is there is found at once, under a new number.
    pub fn restore(&mut self, line: &TracksLine, age_s: f64) {
        self.newest = line.tracks.iter().map(|track| track.id).fold(self.newest, TrackId::max);
        if !self.site.floors.is_empty() {
            self.floor_numbers = self.newest;
            return;
        }
        let sure = |track: &&TrackLine| track.state != LifeCycle::Tentative;
        let people: Vec<TrackState> = line.tracks.iter().filter(sure).map(TrackState::from).collect();
        self.tracker.restore(&people, age_s, 0.0);
    }

    /// Decodes and uses a datagram that arrived at `now_us` on the host's clock; an observation, if it was a report that
    /// counts.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) -> Option<Observation> {
        let datagram = self.sessions.decode(bytes)?;
        self.follow(&datagram, now_us)
    }

    /// The same with a datagram that is decoded already, by [`Sessions::decode`].
    pub fn follow(&mut self, datagram: &Datagram<'_>, now_us: u64) -> Option<Observation> {
        match self.sessions.accept(datagram, now_us)? {
            Input::Scan(observation) => {
                self.observe(&observation);
                Some(observation)
            }
            Input::Floor(reading) => {
                self.read(&reading);
                None
            }
        }
    }

    /// Takes a reading of a floor.
    pub fn read(&mut self, reading: &Reading) {
        if self.floors.observe(reading) {
            self.zones.read(reading);
        }
    }

    /// Takes an observation.
    pub fn observe(&mut self, observation: &Observation) {
        self.resume(observation.start_s);
        self.tracker.observe(observation);
        self.zones.observe(observation);
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
        let mut tracks = self.numbered(tracks);
        tracks.extend(self.on_floors(at_s));
        let mut zones = self.zones.lines(&tracks, at_s);
        if at_s - self.begun_s < FOUND_S {
            zones.values_mut().for_each(|zone| *zone = ZoneLine::unknown());
        }
        self.newest = tracks.iter().map(|track| track.id).fold(self.newest, TrackId::max);
        Estimate { t_s: at_s, tracks, zones }
    }

    /// The same, to be written.
    pub fn line(&mut self, at_s: f64) -> TracksLine {
        TracksLine::from(&self.estimate(at_s))
    }

    /// All tracks at `at_s` as they are known now. What lines say later does not depend on it.
    #[must_use]
    pub fn peek(&self, at_s: f64) -> Vec<TrackLine> {
        let mut tracks = self.numbered(self.tracker.peek(at_s));
        tracks.extend(self.on_floors(at_s));
        tracks.iter().map(TrackLine::from).collect()
    }

    /// What each floor that is read shows.
    #[must_use]
    pub fn floors(&self) -> Vec<FloorLine> {
        self.floors
            .lines(|number| self.site.floors.get(number).map_or_else(String::new, |floor| floor.name.clone()))
    }

    fn on_floors(&self, at_s: f64) -> impl Iterator<Item = TrackState> {
        let offset = self.floor_numbers;
        self.floors.tracks(at_s).into_iter().map(move |track| TrackState { id: track.id + offset, ..track })
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
