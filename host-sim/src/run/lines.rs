//! A run as JSON lines: candidates, tracks, truth.
//!
//! ```text
//!   arrivals ─┬─▶ sessions ─▶ candidates.jsonl     every report used, at its own time on the host's clock
//!             └─▶ tracker ─▶ tracks.jsonl        every 0.1 s, from what had arrived by then
//!   truth ─────────────────▶ truth.jsonl         the same times
//! ```

use std::sync::Arc;

use crate::baselines::Choice;
use kehai::centre::Estimator;
use kehai::wire::Message;
use kehai_tracking::jsonl::{PersonLine, TracksLine, TruthLine};
use kehai_tracking::session::Sessions;
use kehai_tracking::site_tracker::SiteTracker;

use super::{Moment, Record};
use crate::jsonl::CandidatesLine;

impl From<&Moment> for TruthLine {
    fn from(moment: &Moment) -> Self {
        let person = |person: &super::SeenPerson| PersonLine {
            id: u64::from(person.id),
            x: person.x,
            y: person.y,
            beams: Some(person.beams),
        };
        Self { t: moment.t, people: moment.people.iter().map(person).collect() }
    }
}

impl Record {
    /// Truth, every 0.1 s.
    pub fn truth_lines(&self) -> impl Iterator<Item = TruthLine> {
        self.truth.iter().map(TruthLine::from)
    }

    /// Feeds a site's tracker, and lets `look` at it at every moment of the truth: by then it has received what had
    /// arrived by then, and nothing else.
    pub fn follow<T>(&self, tracker: Choice, mut look: impl FnMut(&mut SiteTracker, &Moment) -> T) -> Vec<T> {
        let mut site_tracker = SiteTracker::new(&Arc::new(self.site.clone()), tracker);
        let mut arrivals = self.arrivals.iter().peekable();
        let mut seen = Vec::with_capacity(self.truth.len());
        for moment in &self.truth {
            let until_us = (moment.t * 1e6).round() as u64;
            while let Some(arrival) = arrivals.next_if(|arrival| arrival.at_us <= until_us) {
                site_tracker.receive(&arrival.bytes, arrival.at_us);
            }
            seen.push(look(&mut site_tracker, moment));
        }
        seen
    }

    /// The tracks of the tracker of this name, computed from the datagrams every 0.1 s.
    #[must_use]
    pub fn tracks_lines(&self, tracker: Choice) -> Vec<TracksLine> {
        self.follow(tracker, |site_tracker, moment| site_tracker.line(moment.t))
    }

    /// The candidates of every report that a host can use, in the site's frame.
    #[must_use]
    pub fn candidates_lines(&self) -> Vec<CandidatesLine> {
        let mut sessions = Sessions::new(Arc::new(self.site.clone()), Estimator::default());
        let mut line = |arrival: &super::Arrival| {
            let datagram = sessions.decode(&arrival.bytes)?;
            let observation = sessions.accept(&datagram, arrival.at_us)?.scan()?;
            let Message::Report(report) = &datagram.message else { return None };
            let name = &self.modules.get(usize::from(arrival.module))?.name;
            Some(CandidatesLine::of_observation(name, &observation, report))
        };
        self.arrivals.iter().filter_map(&mut line).collect()
    }
}
