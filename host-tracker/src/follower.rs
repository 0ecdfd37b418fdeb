//! All of it: datagrams in, what is known at a time out.

use std::sync::Arc;

use crate::intake::Intake;
use crate::jsonl::{TrackLine, TracksLine};
use crate::sighting::Sighting;
use crate::site::Site;
use crate::trackers::{Choice, LifeCycle, TrackState, Tracker};
use crate::zones::Zones;

/// Follows people from what modules send.
pub struct Follower {
    intake: Intake,
    tracker: Box<dyn Tracker>,
    zones: Zones,
    choice: Choice,
    /// Added to the tracker's numbers: those of the trackers before it.
    numbers: u64,
    newest: u64,
}

impl Follower {
    /// With nothing received yet.
    #[must_use]
    pub fn new(site: &Arc<Site>, choice: Choice) -> Self {
        Self {
            intake: Intake::new(Arc::clone(site), choice.estimator()),
            tracker: choice.build(site),
            zones: Zones::new(site),
            choice,
            numbers: 0,
            newest: 0,
        }
    }

    /// Goes on with another site. Clocks and backgrounds stay; the people are found anew, under new numbers.
    pub fn change_site(&mut self, site: &Arc<Site>) {
        self.intake.change_site(Arc::clone(site));
        self.tracker = self.choice.build(site);
        self.zones = Zones::new(site);
        self.numbers = self.newest;
    }

    /// Takes the people of a line that was given `age_s` before the start, by a process that has ended. They are hidden
    /// until somebody sees them.
    pub fn restore(&mut self, line: &TracksLine, age_s: f64) {
        let sure = |track: &&TrackLine| track.state != LifeCycle::Tentative;
        let people: Vec<TrackState> = line.tracks.iter().filter(sure).map(TrackState::from).collect();
        self.tracker.restore(&people, age_s, 0.0);
    }

    /// Takes a datagram that arrived at `now_us` on the host's clock; what was seen, if it was a report that counts.
    pub fn receive(&mut self, datagram: &[u8], now_us: u64) -> Option<Sighting> {
        let sighting = self.intake.receive(datagram, now_us)?;
        self.see(&sighting);
        Some(sighting)
    }

    /// Takes a sighting.
    pub fn see(&mut self, sighting: &Sighting) {
        self.tracker.see(sighting);
        self.zones.see(sighting);
    }

    /// Everybody at `at_s`, s on the host's clock.
    pub fn tracks(&mut self, at_s: f64) -> Vec<TrackState> {
        self.tracker.tracks(at_s)
    }

    /// What is known at `at_s`, from what had arrived by then.
    pub fn line(&mut self, at_s: f64) -> TracksLine {
        let tracks = self.tracker.tracks(at_s);
        let zones = self.zones.lines(&tracks, at_s);
        let tracks = self.numbered(&tracks);
        self.newest = tracks.iter().map(|track| track.id).fold(self.newest, u64::max);
        TracksLine { t: at_s, tracks, zones }
    }

    /// Everybody at `at_s` as they are known now. What lines say later does not depend on who looks in between.
    #[must_use]
    pub fn peek(&self, at_s: f64) -> Vec<TrackLine> {
        self.numbered(&self.tracker.peek(at_s))
    }

    fn numbered(&self, tracks: &[TrackState]) -> Vec<TrackLine> {
        let mut tracks: Vec<_> = tracks.iter().map(TrackLine::from).collect();
        tracks.iter_mut().for_each(|track| track.id += self.numbers);
        tracks
    }

    /// The modules heard of, and what was not used.
    #[must_use]
    pub const fn intake(&self) -> &Intake {
        &self.intake
    }
}
