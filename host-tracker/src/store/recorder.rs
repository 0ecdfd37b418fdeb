//! What of a stream of frames is worth keeping: frames in, rows out.
//!
//! ```text
//!   Snapshot ─▶ tracks   ─▶ path parts, simplified, five minutes each; the open part again at every batch
//!         ├▶ zones    ─▶ counts, when they change          ─▶ enter, leave
//!         │              at once when less is known or a zone is no longer empty, else at most once a second
//!         ├▶ lines    ─▶ crossings, and whether each line is seen, when that changes
//!         ├▶ names    ─▶ which track each ID has, when that changes or ends
//!         ├▶ modules  ─▶ health once a minute              ─▶ alarm, cleared, state
//!   Site  ─▶ poses    ─▶ where modules are, when that changes
//!         ├▶ zones    ─▶ which of them make the total, when that changes
//!         └▶ itself   ─▶ snapshot, the newest only
//! ```
//!
//! It does no I/O. Rows that could not be written stay here and are handed out again. What a row says holds until the next
//! one of the same zone; so where frames are missing, or rows are dropped, a row says that nothing is known.

use std::collections::BTreeMap;

use super::card::CardHash;
use super::event::{Event, EventKind};
use super::path::Place;
use super::pose::{PoseRow, Source};
use super::row::{PathRow, Row};
use super::walks::Walks;
use kehai_tracking::alarm::AlarmKind;
use kehai_tracking::alarm_list::ListedAlarm;
use kehai_tracking::card::Card;
use kehai_tracking::door::doors::Passed;
use kehai_tracking::jsonl::ZoneKnown;
use kehai_tracking::lines::{CrossedLine, Direction, Totals};
use kehai_tracking::names::{Likelihood, NameLine};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{DeviceState, EventLine, ModuleLine, STALE_MS, Snapshot};
use kehai_tracking::stays::Stays;
use kehai_tracking::tracker::{LifeCycle, TrackState};

/// Between two rows of a module's health, ms.
pub const HEALTH_MS: u64 = 60_000;

/// Between two counts of a zone, ms, however often it changes; but for those that take back what the one before says.
const COUNT_MS: u64 = 1000;

/// An ID has a track that is likelier than this.
const LIKELY: f64 = 0.5;

/// An ID keeps its track until that is less likely than this: one that is about as likely as not does not come and go
/// with each frame.
const UNLIKELY: f64 = 0.4;

/// Most rows kept while the database cannot be written: an hour of three people in a home, some MB. Older ones
/// are dropped, and counted.
const ROWS_MAX: usize = 50_000;

/// Of what something is known or not.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Counted {
    Zone,
    Line,
}

#[derive(Debug, Default)]
struct Known {
    state: Option<DeviceState>,
    alarms: BTreeMap<AlarmKind, String>,
    health_ms: u64,
    /// Start and number of each event that its newest frame showed. An event is shown for a minute, once: which are new is not told
    /// by their numbers, as a module that was reset to factory settings counts its starts from 1 again.
    events: Vec<(u32, u32)>,
}

/// Keeps what frames say.
#[derive(Debug, Default)]
pub struct ChangeRecorder {
    stays: Stays,
    walks: Walks,
    /// And when that was kept, ms since 1970.
    counts: BTreeMap<String, (Option<u32>, ZoneKnown, u64)>,
    /// What was kept last of each counting line, and when its state was, ms since 1970.
    lines: BTreeMap<String, (Totals, ZoneKnown, u64)>,
    modules: BTreeMap<String, Known>,
    poses: BTreeMap<String, [f64; 3]>,
    /// The zones that make the total, in order, and whether that was kept.
    total: Vec<String>,
    is_total_kept: bool,
    /// The track that each ID has, as was kept last; without an ID that has none.
    names: BTreeMap<Card, u64>,
    /// When the newest frame was made, ms since 1970.
    newest_ms: Option<u64>,
    /// The latest time of a frame, and whether the clock was set back and is still before it.
    latest_ms: u64,
    is_behind: bool,
    rows: Vec<Row>,
    /// By track and part, from 0.
    paths: BTreeMap<(u64, u32), PathRow>,
    dropped: u64,
}

impl ChangeRecorder {
    /// One for this site, as its file says at `now_ms`.
    #[must_use]
    pub fn new(site: &Site, now_ms: u64) -> Self {
        let mut recorder = Self::default();
        recorder.set_site(site, now_ms, Source::File);
        recorder
    }

    /// Sets the site, which has changed at `now_ms`, and the source of the change.
    pub fn set_site(&mut self, site: &Site, now_ms: u64, source: Source) {
        for row in PoseRow::of(site, now_ms, source) {
            let pose = [row.x_m, row.y_m, row.yaw_deg];
            if self.poses.insert(row.module.clone(), pose) != Some(pose) {
                self.rows.push(Row::Pose(row));
            }
        }
        let mut total: Vec<String> = site.counted().map(|zone| zone.name.clone()).collect();
        total.sort_unstable();
        self.is_total_kept &= self.total == total;
        self.total = total;
        self.stays.change_site(site);
    }

    /// Takes a frame.
    pub fn record(&mut self, frame: &Snapshot) {
        let at_ms = frame.unix_ms;
        for track in &frame.tracks {
            if track.state != LifeCycle::Tentative {
                self.walk(track, at_ms);
            }
        }
        self.paths.extend(self.walks.end_unseen(at_ms));
        for change in self.stays.observe(&frame.tracks, at_ms as f64 * 1e-3) {
            let at_ms = (change.at_s * 1e3).round() as u64;
            let kind = if change.since_s.is_some() { EventKind::Leave } else { EventKind::Enter };
            let event = Event::new(at_ms, kind, change.zone, "").of(Some(change.track));
            self.rows.push(Row::Event(event));
        }
        if let Some(newest_ms) = self.newest_ms
            && at_ms.saturating_sub(newest_ms) > STALE_MS
        {
            self.forget(newest_ms + STALE_MS, |_, _| true);
            self.forget_names(newest_ms + STALE_MS);
        }
        self.newest_ms = Some(at_ms);
        self.is_behind |= at_ms < self.latest_ms;
        if self.is_behind && at_ms > self.latest_ms {
            // The times that two runs tell of are over: what is said of them is not read (`lives`).
            self.is_behind = false;
            self.say_again();
        }
        self.latest_ms = self.latest_ms.max(at_ms);
        if !self.is_total_kept {
            // By the frame's clock: counts are kept by it, too.
            self.is_total_kept = true;
            self.rows.push(Row::Total { at_ms, zones: self.total.clone() });
        }
        let has_zone = |name: &str| frame.line.zones.contains_key(name);
        let has_line = |name: &str| frame.lines.iter().any(|line| line.name == name);
        self.forget(at_ms, |kind, name| match kind {
            Counted::Zone => !has_zone(name),
            Counted::Line => !has_line(name),
        });
        for (name, zone) in &frame.line.zones {
            let (count, state) = (zone.count(), zone.state());
            let due = self.counts.get(name).is_none_or(|&(before, known, kept_ms)| {
                let takes_back = (count.is_none() || before == Some(0)) && before != count;
                let less = known == ZoneKnown::Known && state != known;
                (before, known) != (count, state)
                    && (takes_back || less || at_ms.saturating_sub(kept_ms) >= COUNT_MS)
            });
            if due {
                self.counts.insert(name.clone(), (count, state, at_ms));
                self.rows.push(Row::Count { zone: name.clone(), at_ms, count, state });
            }
        }
        for line in &frame.lines {
            self.line(line, at_ms);
        }
        self.counts.retain(|name, _| has_zone(name));
        self.lines.retain(|name, _| has_line(name));
        for module in &frame.modules {
            self.module(module, at_ms);
        }
        self.names(&frame.names, at_ms);
        self.make_room();
        while self.paths.len() > ROWS_MAX {
            self.paths.pop_first();
            self.dropped += 1;
        }
    }

    /// When the newest frame was made, ms since 1970; none before the first.
    #[must_use]
    pub const fn newest_ms(&self) -> Option<u64> {
        self.newest_ms
    }

    /// The clock was set: what was going on ends here, and all is said again by the next frame.
    pub fn clock_set(&mut self) {
        self.paths.extend(self.walks.end_all());
        // By the clock of before, the next row would be due only when the clock has caught up.
        self.modules.values_mut().for_each(|module| module.health_ms = 0);
        self.say_again();
    }

    /// The next frame says of every zone and line what is known, and of which zones the total is made.
    fn say_again(&mut self) {
        self.is_total_kept = false;
        self.counts.clear();
        self.lines.values_mut().for_each(|kept| (kept.1, kept.2) = (ZoneKnown::Unknown, 0));
    }

    /// Keeps that from `at_ms` on nothing is known of those zones and lines.
    fn forget(&mut self, at_ms: u64, is_forgotten: impl Fn(Counted, &str) -> bool) {
        let unknown = ZoneKnown::Unknown;
        for (zone, kept) in self.counts.iter_mut().filter(|(zone, _)| is_forgotten(Counted::Zone, zone)) {
            if kept.1 != unknown {
                *kept = (None, unknown, at_ms);
                self.rows.push(Row::Count { zone: zone.clone(), at_ms, count: None, state: unknown });
            }
        }
        for (name, kept) in self.lines.iter_mut().filter(|(name, _)| is_forgotten(Counted::Line, name)) {
            if kept.1 != unknown {
                (kept.1, kept.2) = (unknown, at_ms);
                self.rows.push(Row::Line { name: name.clone(), at_ms, totals: kept.0, state: unknown });
            }
        }
    }

    /// Keeps that from `at_ms` on no ID has a track; the next frame says again which has one.
    fn forget_names(&mut self, at_ms: u64) {
        let over = |(card, track): (Card, u64)| {
            let hash = CardHash::from(card);
            Row::Name { at_ms, track, hash, probability: 0.0 }
        };
        self.rows.extend(std::mem::take(&mut self.names).into_iter().map(over));
    }

    /// Drops the oldest rows of too many. From the first of them on nothing is known of its zone, line or ID.
    fn make_room(&mut self) {
        let over = self.rows.len().saturating_sub(ROWS_MAX);
        let mut unknown: BTreeMap<(Counted, String), Row> = BTreeMap::new();
        let mut unnamed: BTreeMap<CardHash, Row> = BTreeMap::new();
        let state = ZoneKnown::Unknown;
        for row in self.rows.drain(..over) {
            match row {
                Row::Count { zone, at_ms, .. } => {
                    let key = (Counted::Zone, zone.clone());
                    unknown.entry(key).or_insert(Row::Count { zone, at_ms, count: None, state });
                }
                Row::Line { name, at_ms, totals, .. } => {
                    let key = (Counted::Line, name.clone());
                    unknown.entry(key).or_insert(Row::Line { name, at_ms, totals, state });
                }
                Row::Name { at_ms, track, hash, .. } => {
                    // If it still has one, the next frame says it again.
                    self.names.remove(&Card::from(hash));
                    unnamed.entry(hash).or_insert(Row::Name { at_ms, track, hash, probability: 0.0 });
                }
                // The next frame says it again.
                Row::Total { .. } => self.is_total_kept = false,
                _ => {}
            }
        }
        self.dropped += (over - unknown.len() - unnamed.len()) as u64;
        self.rows.splice(0..0, unknown.into_values().chain(unnamed.into_values()));
    }

    /// Notes that something happened.
    pub fn happened(&mut self, event: Event) {
        self.rows.push(Row::Event(event));
    }

    /// Notes an alarm as it is now.
    pub fn alarm(&mut self, alarm: ListedAlarm) {
        self.rows.push(Row::Alarm(Box::new(alarm)));
    }

    /// Notes the alarms that stand, for a file that may have been begun anew: before what is still to be written, which is newer.
    pub fn stand(&mut self, alarms: &[ListedAlarm]) {
        self.rows.splice(0..0, alarms.iter().map(|alarm| Row::Alarm(Box::new(alarm.clone()))));
    }

    /// Notes a passage, and that it happened; its card apart from it.
    pub fn passed(&mut self, mut passed: Passed) {
        if let Some(card) = passed.passage.card.take() {
            let (at_ms, place) = (passed.begun_ms, passed.passage.door.clone());
            self.rows.push(Row::Card { at_ms, place, hash: CardHash::from(card) });
        }
        let passage = &passed.passage;
        let kind = if passage.alarm.is_some() { EventKind::DoorAlarm } else { EventKind::Passage };
        let text = format!("{} of {} went in: {}", passage.through.len(), passage.entered, passage.reason);
        let event = Event::new(passed.ended_ms, kind, &*passage.door, text);
        self.happened(event.of(passage.through.first().copied()));
        self.rows.push(Row::Passage(Box::new(passed)));
    }

    /// All that is to be written: rows, and parts of paths by track and part, the open ones included. Until
    /// [`written`](Self::written) is called it is handed out again.
    pub fn rows(&mut self) -> (&[Row], &BTreeMap<(u64, u32), PathRow>) {
        self.paths.extend(self.walks.open());
        (&self.rows, &self.paths)
    }

    /// What was handed out last is safe.
    pub fn written(&mut self) {
        self.rows.clear();
        self.paths.clear();
    }

    /// Drops all that is still to be written, and says how many rows and parts of paths that were.
    pub fn give_up(&mut self) -> u64 {
        let (rows, paths) = self.rows();
        let unwritten = (rows.len() + paths.len()) as u64;
        self.written();
        self.dropped += unwritten;
        unwritten
    }

    /// Rows that were dropped because the database could not be written for so long.
    #[must_use]
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Keeps each ID that has another track than before, once that is more likely than not, and each that has none any
    /// more.
    fn names(&mut self, names: &[NameLine], at_ms: u64) {
        let Self { names: kept, rows, .. } = self;
        kept.retain(|card, track| {
            let name = names.iter().find(|name| name.card == Some(*card));
            let tracks = name.map_or(&[][..], |name| name.tracks.as_slice());
            // It is still this one, or the row of the next one ends it.
            if tracks.first().is_some_and(|likeliest| likeliest.probability > LIKELY) {
                return true;
            }
            let own = tracks.iter().find(|likelihood| likelihood.track == *track);
            let probability = own.map_or(0.0, |likelihood| likelihood.probability);
            let is_over = probability < UNLIKELY;
            if is_over {
                rows.push(Row::Name { at_ms, track: *track, hash: CardHash::from(*card), probability });
            }
            !is_over
        });
        for name in names {
            let Some((card, likeliest)) = name.card.zip(name.tracks.first()) else { continue };
            let Likelihood { track, probability } = *likeliest;
            if probability > LIKELY && kept.insert(card, track) != Some(track) {
                rows.push(Row::Name { at_ms, track, hash: CardHash::from(card), probability });
            }
        }
    }

    fn walk(&mut self, track: &TrackState, at_ms: u64) {
        let place = Place {
            at_ms,
            x_mm: (track.at.x * 1e3) as i32,
            y_mm: (track.at.y * 1e3) as i32,
            hidden: track.state == LifeCycle::Occluded,
        };
        self.paths.extend(self.walks.see(track.id, place));
    }

    /// Keeps each crossing since the frame before, by the counts: frames may be missed. The first frame says what was counted
    /// before this process.
    fn line(&mut self, line: &CrossedLine, at_ms: u64) {
        let known = self.lines.get(&line.name).copied();
        let (before, state, kept_ms) = known.unwrap_or((line.totals().unwrap_or_default(), line.state, 0));
        let totals = line.totals().unwrap_or(before);
        for (direction, more) in [
            (Direction::In, totals.inward.saturating_sub(before.inward)),
            (Direction::Out, totals.outward.saturating_sub(before.outward)),
        ] {
            let row = || Row::Crossing { line: line.name.clone(), at_ms, direction };
            self.rows.extend((0..more.min(ROWS_MAX as u64)).map(|_| row()));
        }
        let is_due =
            line.state != state && (state == ZoneKnown::Known || at_ms.saturating_sub(kept_ms) >= COUNT_MS);
        let (state, kept_ms) = if is_due { (line.state, at_ms) } else { (state, kept_ms) };
        if known.is_none() || is_due || totals != before {
            self.rows.push(Row::Line { name: line.name.clone(), at_ms, totals, state });
        }
        self.lines.insert(line.name.clone(), (totals, state, kept_ms));
    }

    fn module(&mut self, module: &ModuleLine, at_ms: u64) {
        let known = self.modules.entry(module.name.clone()).or_default();
        let mut happened = |event: Event| self.rows.push(Row::Event(event));
        if known.state != Some(module.state) {
            happened(Event::state(at_ms, &module.name, module.state));
            known.state = Some(module.state);
        }
        let alarms: BTreeMap<AlarmKind, String> =
            module.alarms.iter().map(|alarm| (alarm.kind, alarm.text.clone())).collect();
        for (kind, text) in alarms.iter().filter(|(kind, _)| !known.alarms.contains_key(*kind)) {
            happened(Event::alarm(at_ms, &module.name, *kind, text));
        }
        for kind in known.alarms.keys().filter(|kind| !alarms.contains_key(*kind)) {
            happened(Event::cleared(at_ms, &module.name, *kind));
        }
        known.alarms = alarms;
        let number = |told: &EventLine| (told.boot, told.number);
        for told in module.events.iter().filter(|told| !known.events.contains(&number(told))) {
            let at_ms = at_ms.saturating_sub((told.ago_s * 1e3) as u64);
            happened(Event::new(at_ms, EventKind::Device(told.kind), &*module.name, &*told.text));
        }
        known.events = module.events.iter().map(number).collect();
        if at_ms.saturating_sub(known.health_ms) >= HEALTH_MS {
            known.health_ms = at_ms;
            self.rows.push(Row::Health { at_ms, module: Box::new(module.clone()) });
        }
    }
}

#[cfg(test)]
mod tests;
