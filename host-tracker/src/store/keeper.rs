//! What of a stream of frames is worth keeping: frames in, rows out.
//!
//! ```text
//!   Snapshot ─▶ tracks   ─▶ path parts, simplified, five minutes each; the open part again at every batch
//!         ├▶ zones    ─▶ counts, when they change          ─▶ enter, leave
//!         ├▶ modules  ─▶ health once a minute              ─▶ alarm, cleared, state
//!   Site  ─▶ poses    ─▶ where modules are, when that changes
//!         └▶ itself   ─▶ snapshot, the newest only
//! ```
//!
//! It does no I/O. Rows that could not be written stay here and are handed out again.

use std::collections::{BTreeMap, BTreeSet};

use super::card::CardHash;
use super::path::{Path, Place, encode};
use super::pose::{PoseRow, Source};
use kehai_tracking::alarm::AlarmKind;
use kehai_tracking::door::doors::Passed;
use kehai_tracking::geometry::{Point, distance_to_segment, inside};
use kehai_tracking::jsonl::ZoneKnown;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{DeviceState, ModuleLine, Snapshot};
use kehai_tracking::tracker::{LifeCycle, TrackState};

/// Longest part of a path, ms: what is asked for by time is found in parts that began at most this long before.
pub const PART_MS: u64 = 300_000;

/// Between two rows of a module's health, ms.
const HEALTH_MS: u64 = 60_000;

/// How far into a zone, or out of it, a person must be to have crossed its edge, m: half a body. Noise is less.
const CROSSED_M: f64 = 0.15;

/// Between two counts of a zone, ms, however often it changes.
const COUNT_MS: u64 = 1000;

/// Most rows kept while the database cannot be written: an hour of three people in a home, some MB. Older ones
/// are dropped, and counted.
const ROWS_MAX: usize = 50_000;

/// Something to be kept, beside paths.
#[derive(Clone, Debug, PartialEq)]
pub enum Row {
    /// How many people are in a zone from now on.
    Count {
        /// Its name.
        zone: String,
        /// ms since 1970.
        at_ms: u64,
        /// People.
        count: u32,
        /// How far that can be trusted.
        state: ZoneKnown,
    },
    /// Something happened.
    Event(Event),
    /// A group went through a door, or did not.
    Passage(Box<Passed>),
    /// How a module was.
    Health {
        /// ms since 1970.
        at_ms: u64,
        /// The module.
        module: Box<ModuleLine>,
    },
    /// Where a module is from now on.
    Pose(PoseRow),
    /// The card of a passage, kept for a time of its own.
    Card {
        /// When the passage began, ms since 1970.
        at_ms: u64,
        /// The door's name.
        place: String,
        /// What may be kept of the card.
        hash: CardHash,
    },
}

/// A part of a person's path; it replaces what was written of that part before.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathRow {
    /// Its first time, ms since 1970.
    pub begun_ms: u64,
    /// Its last.
    pub ended_ms: u64,
    /// As [`encode`] makes them.
    pub points: Vec<u8>,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Event {
    /// ms since 1970.
    pub at_ms: u64,
    /// `started`, `restored`, `discarded`, `enter`, `leave`, `alarm`, `cleared`, `state`, `passage`, `door-alarm`.
    pub kind: String,
    /// Zone or module.
    pub subject: String,
    /// The track, if the event is about one.
    pub track: Option<u64>,
    /// In words.
    pub text: String,
}

#[derive(Debug)]
struct Walk {
    part: u32,
    path: Path,
    zones: BTreeSet<usize>,
    changed: bool,
    seen_ms: u64,
}

#[derive(Debug, Default)]
struct Known {
    state: Option<DeviceState>,
    alarms: BTreeMap<AlarmKind, String>,
    health_ms: u64,
    /// Start and number of its newest event.
    newest: (u32, u32),
}

/// Keeps what frames say.
#[derive(Debug, Default)]
pub struct Keeper {
    zones: Vec<(String, Vec<Point>)>,
    walks: BTreeMap<u64, Walk>,
    /// And when that was kept, ms since 1970.
    counts: BTreeMap<String, (u32, ZoneKnown, u64)>,
    modules: BTreeMap<String, Known>,
    poses: BTreeMap<String, [f64; 3]>,
    rows: Vec<Row>,
    /// By track and part, from 0.
    paths: BTreeMap<(u64, u32), PathRow>,
    dropped: u64,
}

impl Keeper {
    /// One for this site, as its file says at `now_ms`.
    #[must_use]
    pub fn new(site: &Site, now_ms: u64) -> Self {
        let mut keeper = Self::default();
        keeper.set_site(site, now_ms, Source::File);
        keeper
    }

    /// Sets the site, which has changed at `now_ms`, and the source of the change.
    pub fn set_site(&mut self, site: &Site, now_ms: u64, source: Source) {
        for row in PoseRow::of(site, now_ms, source) {
            let pose = [row.x_m, row.y_m, row.yaw_deg];
            if self.poses.insert(row.module.clone(), pose) != Some(pose) {
                self.rows.push(Row::Pose(row));
            }
        }
        let corners = |corners: &[[f64; 2]]| corners.iter().map(|&corner| corner.into()).collect();
        self.zones = site.zones.iter().map(|zone| (zone.name.clone(), corners(&zone.polygon))).collect();
        self.walks.values_mut().for_each(|walk| walk.zones.clear());
    }

    /// Takes a frame.
    pub fn record(&mut self, frame: &Snapshot) {
        let at_ms = frame.unix_ms;
        for track in &frame.tracks {
            if track.state != LifeCycle::Tentative {
                self.walk(track, at_ms);
            }
        }
        let gone: Vec<u64> =
            self.walks.iter().filter(|(_, walk)| walk.seen_ms < at_ms).map(|(&id, _)| id).collect();
        for id in gone {
            if let Some(mut walk) = self.walks.remove(&id) {
                self.paths.extend(walk.row(id));
                for &zone in &walk.zones {
                    self.crossed("leave", zone, id, walk.seen_ms);
                }
            }
        }
        for (name, zone) in &frame.line.zones {
            let (count, state) = (zone.count, zone.state);
            let due = self.counts.get(name).is_none_or(|&(before, known, kept_ms)| {
                (before, known) != (count, state) && at_ms.saturating_sub(kept_ms) >= COUNT_MS
            });
            if due {
                self.counts.insert(name.clone(), (count, state, at_ms));
                self.rows.push(Row::Count { zone: name.clone(), at_ms, count, state });
            }
        }
        for module in &frame.modules {
            self.module(module, at_ms);
        }
        let over = self.rows.len().saturating_sub(ROWS_MAX);
        self.rows.drain(..over);
        self.dropped += over as u64;
        while self.paths.len() > ROWS_MAX {
            self.paths.pop_first();
            self.dropped += 1;
        }
    }

    /// Notes that something happened.
    pub fn happened(&mut self, event: Event) {
        self.rows.push(Row::Event(event));
    }

    /// Notes a passage, and that it happened; its card apart from it.
    pub fn passed(&mut self, mut passed: Passed) {
        if let Some(card) = passed.passage.card.take() {
            let (at_ms, place) = (passed.begun_ms, passed.passage.door.clone());
            self.rows.push(Row::Card { at_ms, place, hash: CardHash::from(card) });
        }
        let passage = &passed.passage;
        let kind = if passage.alarm.is_some() { "door-alarm" } else { "passage" };
        self.happened(Event {
            at_ms: passed.ended_ms,
            kind: kind.into(),
            subject: passage.door.clone(),
            track: passage.through.first().copied(),
            text: format!("{} of {} went in: {}", passage.through.len(), passage.entered, passage.reason),
        });
        self.rows.push(Row::Passage(Box::new(passed)));
    }

    /// All that is to be written: rows, and parts of paths by track and part, the open ones included. Until
    /// [`written`](Self::written) is called it is handed out again.
    pub fn rows(&mut self) -> (&[Row], &BTreeMap<(u64, u32), PathRow>) {
        let open = self.walks.iter_mut().filter_map(|(&id, walk)| walk.row(id));
        self.paths.extend(open);
        (&self.rows, &self.paths)
    }

    /// What was handed out last is safe.
    pub fn written(&mut self) {
        self.rows.clear();
        self.paths.clear();
    }

    /// Rows that were dropped because the database could not be written for so long.
    #[must_use]
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }

    fn walk(&mut self, track: &TrackState, at_ms: u64) {
        let place = Place {
            at_ms,
            x_mm: (track.at.x * 1e3) as i32,
            y_mm: (track.at.y * 1e3) as i32,
            hidden: track.state == LifeCycle::Occluded,
        };
        let walk = self.walks.entry(track.id).or_insert_with(|| Walk {
            part: 0,
            path: Path::beginning(place),
            zones: BTreeSet::new(),
            changed: true,
            seen_ms: at_ms,
        });
        walk.seen_ms = at_ms;
        walk.path.add(place);
        walk.changed = true;
        let (begun_ms, _) = walk.path.span_ms();
        if at_ms.saturating_sub(begun_ms) >= PART_MS {
            self.paths.extend(walk.row(track.id));
            walk.part += 1;
            walk.path = Path::beginning(place);
        }
        let at = track.at;
        let before = walk.zones.clone();
        let within: BTreeSet<usize> = (0..)
            .zip(&self.zones)
            .filter(|(zone, (_, corners))| {
                let inside = inside(at, corners);
                if edge_m(at, corners) > CROSSED_M { inside } else { before.contains(zone) }
            })
            .map(|(zone, _)| zone)
            .collect();
        walk.zones.clone_from(&within);
        for &zone in within.difference(&before) {
            self.crossed("enter", zone, track.id, at_ms);
        }
        for &zone in before.difference(&within) {
            self.crossed("leave", zone, track.id, at_ms);
        }
    }

    fn crossed(&mut self, kind: &str, zone: usize, track: u64, at_ms: u64) {
        let Some((name, _)) = self.zones.get(zone) else { return };
        self.rows.push(Row::Event(Event {
            at_ms,
            kind: kind.into(),
            subject: name.clone(),
            track: Some(track),
            text: String::new(),
        }));
    }

    fn module(&mut self, module: &ModuleLine, at_ms: u64) {
        let known = self.modules.entry(module.name.clone()).or_default();
        let mut event = |at_ms: u64, kind: &str, text: &str| {
            self.rows.push(Row::Event(Event {
                at_ms,
                kind: kind.into(),
                subject: module.name.clone(),
                track: None,
                text: text.into(),
            }));
        };
        if known.state != Some(module.state) {
            event(at_ms, "state", module.state.name());
            known.state = Some(module.state);
        }
        let alarms: BTreeMap<AlarmKind, String> =
            module.alarms.iter().map(|alarm| (alarm.kind, alarm.text.clone())).collect();
        for (name, text) in alarms.iter().filter(|(name, _)| !known.alarms.contains_key(*name)) {
            event(at_ms, "alarm", &format!("{name}: {text}"));
        }
        for kind in known.alarms.keys().filter(|kind| !alarms.contains_key(*kind)) {
            event(at_ms, "cleared", kind.name());
        }
        known.alarms = alarms;
        for told in module.events.iter().filter(|told| (told.boot, told.number) > known.newest) {
            event(at_ms.saturating_sub((told.ago_s * 1e3) as u64), told.kind.name(), &told.text);
        }
        let newest = module.events.last().map_or(known.newest, |told| (told.boot, told.number));
        known.newest = known.newest.max(newest);
        if at_ms.saturating_sub(known.health_ms) >= HEALTH_MS {
            known.health_ms = at_ms;
            self.rows.push(Row::Health { at_ms, module: Box::new(module.clone()) });
        }
    }
}

/// Distance to the nearest side of a polygon, m.
fn edge_m(at: Point, corners: &[Point]) -> f64 {
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    sides.map(|(&from, &to)| distance_to_segment(at, from, to)).fold(f64::INFINITY, f64::min)
}

impl Walk {
    /// The part that is open, if it has changed since it was asked for last.
    fn row(&mut self, track: u64) -> Option<((u64, u32), PathRow)> {
        let (begun_ms, ended_ms) = self.path.span_ms();
        std::mem::take(&mut self.changed)
            .then(|| ((track, self.part), PathRow { begun_ms, ended_ms, points: encode(self.path.places()) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::alarm::AlarmLine;
    use kehai_tracking::jsonl::{TrackLine, TracksLine, ZoneLine};
    use kehai_tracking::snapshot::{DeviceEvent, EventLine};

    fn site() -> Site {
        toml::from_str("[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [4, 0], [4, 4], [0, 4]]").unwrap()
    }

    fn track(id: u64, x: f64) -> TrackLine {
        let text = format!("{{\"id\":{id},\"x\":{x},\"y\":1.0,\"state\":\"confirmed\"}}");
        serde_json::from_str(&text).unwrap()
    }

    fn frame(unix_ms: u64, tracks: Vec<TrackLine>) -> Snapshot {
        Snapshot::of(unix_ms, TracksLine { tracks, ..TracksLine::default() })
    }

    #[test]
    fn whoever_walks_through_a_zone_enters_it_and_leaves_it() {
        let mut keeper = Keeper::new(&site(), 0);
        for tenth in 0..60 {
            keeper.record(&frame(1000 + 100 * tenth, vec![track(7, -1.0 + 0.1 * tenth as f64)]));
        }
        keeper.record(&frame(8000, vec![]));
        let (rows, paths) = keeper.rows();
        let events: Vec<&str> = rows
            .iter()
            .filter_map(|row| match row {
                Row::Event(event) if event.track == Some(7) && event.subject == "hall" => Some(&*event.kind),
                _ => None,
            })
            .collect();
        assert_eq!(events, ["enter", "leave"]);
        let path = &paths[&(7, 0)];
        assert_eq!((path.begun_ms, path.ended_ms), (1000, 6900));
        assert_eq!(super::super::path::decode(&path.points).len(), 2);
    }

    #[test]
    fn what_was_not_written_is_handed_out_again_and_nothing_twice() {
        let mut keeper = Keeper::new(&site(), 0);
        keeper.record(&frame(1000, vec![track(1, 1.0)]));
        let before = (keeper.rows().0.to_vec(), keeper.rows().1.clone());
        assert_eq!((keeper.rows().0.to_vec(), keeper.rows().1.clone()), before);
        keeper.written();
        assert!(keeper.rows().0.is_empty() && keeper.rows().1.is_empty());
        keeper.record(&frame(1100, vec![track(1, 1.0)]));
        assert_eq!(keeper.rows().1.len(), 1, "the open part, longer than before");
    }

    #[test]
    fn a_long_stay_is_parts_that_meet() {
        let mut keeper = Keeper::new(&site(), 0);
        for second in 0..700 {
            keeper.record(&frame(1000 * second, vec![track(1, 1.0)]));
        }
        let spans: Vec<_> = keeper.rows().1.values().map(|row| (row.begun_ms, row.ended_ms)).collect();
        assert_eq!(spans, [(0, 300_000), (300_000, 600_000), (600_000, 699_000)]);
    }

    #[test]
    fn counts_and_alarms_are_kept_when_they_change() {
        let mut keeper = Keeper::new(&site(), 0);
        for second in 0..10_u64 {
            let mut frame = frame(1000 * second, vec![]);
            let (count, state) = (u32::from(second > 4), ZoneKnown::Known);
            frame.line.zones.insert("hall".into(), ZoneLine { count, p: vec![], seen_share: 1.0, state });
            let alarm = AlarmLine::new(AlarmKind::Silent, "no datagram for 3 s");
            let alarms = if (3..6).contains(&second) { vec![alarm] } else { vec![] };
            frame.modules.push(ModuleLine { name: "left".into(), alarms, ..ModuleLine::default() });
            keeper.record(&frame);
        }
        let (rows, _) = keeper.rows();
        let counts = rows.iter().filter(|row| matches!(row, Row::Count { .. })).count();
        let kinds: Vec<&str> = rows
            .iter()
            .filter_map(|row| if let Row::Event(event) = row { Some(&*event.kind) } else { None })
            .collect();
        assert_eq!((counts, kinds), (2, vec!["state", "alarm", "cleared"]));
    }

    #[test]
    fn what_a_module_learned_or_absorbed_is_kept_once_and_of_each_start() {
        let mut keeper = Keeper::new(&site(), 0);
        let event =
            |boot, number, kind, ago_s| EventLine { boot, number, ago_s, kind, ..EventLine::default() };
        let frames = [
            (1000, vec![event(1, 1, DeviceEvent::Learned, 0.5)]),
            (1100, vec![event(1, 1, DeviceEvent::Learned, 0.6), event(1, 2, DeviceEvent::Absorbed, 0.0)]),
            (9000, vec![event(2, 1, DeviceEvent::LearnStarted, 0.0)]),
        ];
        for (unix_ms, events) in frames {
            let module = ModuleLine { name: "left".into(), events, ..ModuleLine::default() };
            keeper.record(&Snapshot { modules: vec![module], ..frame(unix_ms, vec![]) });
        }
        let kept: Vec<(u64, &str, &str)> = keeper
            .rows()
            .0
            .iter()
            .filter_map(|row| if let Row::Event(event) = row { Some(event) } else { None })
            .map(|event| (event.at_ms, &*event.kind, &*event.subject))
            .collect();
        assert_eq!(
            kept,
            [
                (1000, "state", "left"),
                (500, "learned", "left"),
                (1100, "absorbed", "left"),
                (9000, "learn-started", "left")
            ]
        );
    }

    #[test]
    fn a_module_s_place_is_kept_when_it_changes_and_by_whom() {
        let mut site = site();
        site.modules = vec![toml::from_str("name = \"left\"\nx = 1.0\ny = 2.0").unwrap()];
        let mut keeper = Keeper::new(&site, 1000);
        keeper.set_site(&site, 2000, Source::Map);
        site.modules[0].yaw_deg = 45.0;
        keeper.set_site(&site, 3000, Source::Map);
        let poses: Vec<(u64, f64, Source)> = keeper
            .rows()
            .0
            .iter()
            .filter_map(|row| match row {
                Row::Pose(pose) => Some((pose.at_ms, pose.yaw_deg, pose.source)),
                _ => None,
            })
            .collect();
        assert_eq!(poses, [(1000, 0.0, Source::File), (3000, 45.0, Source::Map)]);
    }

    #[test]
    fn a_database_that_cannot_be_written_for_long_costs_rows_and_says_how_many() {
        let mut keeper = Keeper::new(&site(), 0);
        for number in 0..ROWS_MAX as u64 + 10 {
            keeper.happened(Event {
                at_ms: number,
                kind: "state".into(),
                subject: String::new(),
                track: None,
                text: String::new(),
            });
        }
        keeper.record(&frame(1, vec![]));
        assert_eq!((keeper.rows().0.len(), keeper.dropped()), (ROWS_MAX, 10));
    }
}
