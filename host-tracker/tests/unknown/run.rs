//! A random run: what happens to the room, its modules, the tracker, the site and the clock; after each step all surfaces are
//! looked at.
//!
//! ```text
//!   step ─▶ people, modules, site, clock, tracker ─▶ tenths of a second ─▶ Snapshot ─┬─▶ truth
//!                                                                                    └─▶ surfaces ─▶ judge
//! ```
//!
//! The tracker's own time is simulated. Only the database's thread and the map's server run by themselves; both are asked what
//! they know, whenever that was.

use std::path::PathBuf;
use std::sync::Arc;

use host_tracker::metrics;
use host_tracker::record::Recorder;
use host_tracker::store::pose::Source;
use host_tracker::store::{Keep, Store, counted_before, known_before};
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;
use kehai_tracking::total::total;
use kehai_tracking::tracker::Selected;

use super::edits::edit;
use super::judge::{Judge, When};
use super::kept;
use super::live::{self, Broker};
use super::map::Map;
use super::truth::Truth;
use super::world::{Random, SITE, TENTH_US, World};

/// When runs begin, ms since 1970, and that day: long enough ago that all of it is past, two minutes before an hour.
const BEGIN_MS: u64 = 1_749_549_480_000;
pub const DAY: &str = "2025-06-10";

/// Whatever the clock of this machine says, nothing is too old.
const KEEP: Keep = Keep { days: 36_500, card_days: 36_500 };

/// Steps of a run.
const STEPS: usize = 28;

/// Of a calm time the wall's clock makes as long steps as a snapshot holds, so that it takes as many of the tracker's seconds as
/// it has minutes.
const CALM_MS: u64 = 2900;

pub struct Run {
    random: Random,
    site: Arc<Site>,
    world: World,
    truth: Truth,
    judge: Judge,
    folder: tempfile::TempDir,
    life: u32,
    broker: Broker,
    /// While the tracker runs.
    parts: Option<Parts>,
    /// By how much the wall's clock was changed, ms.
    wall_ms: i64,
    /// Time without a snapshot, ms.
    silent_ms: u64,
    newest: Arc<Snapshot>,
    /// What happened, for the search for the reason of a false empty.
    steps: Vec<String>,
}

/// What runs and ends with the tracker.
struct Parts {
    map: Map,
    store: Store,
    recorder: Recorder,
}

impl Run {
    pub fn new(seed: u64) -> Self {
        let site: Arc<Site> = Arc::new(toml::from_str(SITE).unwrap());
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("home.toml"), SITE).unwrap();
        let mut run = Self {
            random: Random(seed),
            world: World::new(&site),
            truth: Truth::default(),
            judge: Judge::default(),
            folder,
            life: 0,
            broker: Broker::new(&site),
            parts: None,
            wall_ms: 0,
            silent_ms: 0,
            newest: Arc::default(),
            steps: Vec::new(),
            site,
        };
        run.begin(false);
        run
    }

    fn database(&self) -> PathBuf {
        self.folder.path().join("home.db")
    }

    fn recording(&self) -> PathBuf {
        self.folder.path().join(format!("{}.mcap", self.life))
    }

    fn unix_ms(&self) -> u64 {
        (BEGIN_MS + self.world.now_us / 1000).saturating_add_signed(self.wall_ms)
    }

    /// The tracker starts, as the daemon does.
    fn begin(&mut self, is_restored: bool) {
        self.life += 1;
        let (database, now_ms) = (self.database(), self.unix_ms());
        let known = if is_restored { known_before(&database, now_ms).0 } else { None };
        let age_s = |unix_ms: u64| now_ms.saturating_sub(unix_ms) as f64 * 1e-3;
        let restored: Option<(TracksLine, f64)> = known.map(|known| (known.line, age_s(known.unix_ms)));
        self.world.begin(&self.site, restored.as_ref(), &counted_before(&database));
        let store = Store::open(&database, &self.site, KEEP).unwrap();
        // It has begun by this machine's clock, and not by the run's.
        let begun = rusqlite::Connection::open(&database).unwrap();
        begun.busy_timeout(std::time::Duration::from_secs(60)).unwrap();
        let change = "UPDATE run SET begun_ms = ?1, ended_ms = ?1 WHERE run = (SELECT MAX(run) FROM run)";
        begun.execute(change, [now_ms as i64]).unwrap();
        let begun_ns = now_ms * 1_000_000;
        let tracker = Selected::default();
        let recorder = Recorder::create(&self.recording(), begun_ns, tracker, &self.site, restored).unwrap();
        let map = Map::new(&self.folder.path().join("home.toml"), &database);
        self.broker.begin(&self.site);
        self.parts = Some(Parts { map, store, recorder });
    }

    /// The tracker ends, and what is left of it is looked at.
    fn end(&mut self) {
        let Some(Parts { map, store, recorder }) = self.parts.take() else { return };
        drop((store, recorder));
        let recording = self.recording();
        let database = self.database();
        let Self { judge, truth, random, folder, .. } = self;
        for _ in 0..6 {
            kept::asked(judge, truth, &map, &database, random);
        }
        kept::history(judge, truth, &map);
        kept::recorded(judge, truth, &recording, self.life);
        kept::exported(judge, truth, &database, &folder.path().join("tables"));
    }

    /// As the tracking loop makes it.
    fn snapshot(&mut self) -> Snapshot {
        let (now_us, unix_ms) = (self.world.now_us, self.unix_ms());
        let site_tracker = &mut self.world.site_tracker;
        let estimate = site_tracker.estimate(now_us as f64 * 1e-6);
        let line = TracksLine::from(&estimate);
        let modules = self.world.registry.update_lines(site_tracker.sessions_mut(), now_us);
        Snapshot {
            unix_ms,
            tracks: estimate.tracks,
            total: total(&self.site, &line, &modules),
            lines: site_tracker.lines(),
            dwell: site_tracker.dwell(),
            modules,
            line,
            ..Snapshot::default()
        }
    }

    /// A tenth of a second with a tracker that runs.
    fn tenth(&mut self) {
        self.world.tenth();
        let snapshot = Arc::new(self.snapshot());
        self.truth.note(&snapshot, &self.site, self.life);
        self.newest = Arc::clone(&snapshot);
        self.silent_ms = 0;
        let Some(Parts { map, store, recorder }) = &self.parts else { return };
        map.show(&snapshot);
        store.see_waiting(Arc::clone(&snapshot));
        recorder.line(self.world.now_us, &snapshot.line);
        let Self { judge, truth, broker, site, .. } = self;
        broker.tenth(judge, truth, &snapshot, self.world.now_us / 1000);
        let when = When::At(truth.newest());
        live::frame(judge, "snapshot", &serde_json::to_value(&*snapshot).unwrap(), when);
        live::metrics(judge, truth, &metrics::text(&snapshot, site, metrics::Losses::default()));
    }

    /// A tenth of a second in which the tracker does nothing; while it is not there, its broker knows that.
    fn pass(&mut self) {
        self.world.pass();
        self.silent_ms += TENTH_US / 1000;
        if self.parts.is_some() {
            let Self { judge, truth, broker, .. } = self;
            broker.silent(judge, truth, self.silent_ms, self.world.now_us / 1000);
        }
    }

    /// Everything that says something now.
    fn look(&mut self) {
        let database = self.database();
        let Some(Parts { map, .. }) = &mut self.parts else { return };
        let Self { judge, truth, random, .. } = self;
        let t_s = self.newest.line.t;
        let [pushed, asked] = map.newest(t_s);
        let when = When::At(truth.newest());
        live::frame(judge, "WebSocket", &pushed, when);
        live::frame(judge, "API", &asked, when);
        live::metrics(judge, truth, &map.text("/metrics"));
        live::reasons(judge, truth, &self.world.site_tracker, &self.site, t_s);
        kept::asked(judge, truth, map, &database, random);
    }

    /// Something happens, and then some time passes.
    fn step(&mut self) {
        let now_us = self.world.now_us;
        let until_us = |random: &mut Random, tenths: u64| now_us + TENTH_US * (1 + random.below(tenths));
        let what = match self.random.below(20) {
            0..4 => {
                self.world.comes(&mut self.random);
                "a person comes"
            }
            4 => {
                self.world.moves(&mut self.random);
                "a person goes elsewhere"
            }
            5..7 => {
                self.world.leaves();
                "a person leaves"
            }
            7..9 => {
                let number = self.random.below(3) as usize;
                self.world.modules[number].silent_until_us = until_us(&mut self.random, 80);
                "a module is lost"
            }
            9 => {
                let silent_until_us = until_us(&mut self.random, 60);
                self.world.modules.iter_mut().for_each(|module| module.silent_until_us = silent_until_us);
                "all modules are lost"
            }
            10 => {
                let module = &mut self.world.modules[self.random.below(3) as usize];
                (module.fake.identity.boot, module.fake.sequence) = (module.fake.identity.boot + 1, 0);
                module.silent_until_us = until_us(&mut self.random, 40);
                "a module starts anew"
            }
            11..16 => {
                let mut site = (*self.site).clone();
                let what = edit(&mut site, &mut self.random);
                self.save(&site);
                what
            }
            16 => {
                let tenths = 1 + self.random.below(60);
                (0..tenths).for_each(|_| self.pass());
                "the tracker sleeps"
            }
            17 => {
                let long = [1000, 4000, 60_000, 5_000_000][self.random.below(4) as usize];
                self.wall_ms += (1 + self.random.below(long)) as i64;
                "the clock is set forward"
            }
            18 => {
                let long = [500, 4000, 60_000][self.random.below(3) as usize];
                self.wall_ms -= (1 + self.random.below(long)) as i64;
                "the clock is set back"
            }
            _ => {
                self.end();
                let tenths = 5 + self.random.below(3).pow(4) * 25;
                (0..tenths).for_each(|_| self.pass());
                let is_restored = self.random.below(4) > 0;
                self.begin(is_restored);
                "the tracker starts anew"
            }
        };
        self.steps.push(format!("{what} at {} ms", self.unix_ms()));
        let tenths = 5 + self.random.below(40);
        for tenth in 0..tenths {
            self.tenth();
            // The first looks are before anything has been found again.
            if tenth < 2 || tenth.is_multiple_of(6) {
                self.look();
            }
        }
    }

    fn save(&mut self, site: &Site) {
        let Some(Parts { map, store, recorder }) = &self.parts else { return };
        let site = Arc::new(map.save(site));
        recorder.told(self.world.now_us, &site);
        while !store.set_site(&site, Source::Map) {
            std::thread::yield_now();
        }
        self.world.change_site(&site);
        self.broker.change_site(&site);
        self.site = site;
    }

    /// All steps, and what the surfaces have said.
    pub fn play(mut self) -> Judge {
        (0..80).for_each(|_| self.tenth());
        (0..STEPS).for_each(|_| self.step());
        self.finish()
    }

    /// Nothing happens for two hours, of which a report can say so.
    pub fn play_calm(mut self) -> Judge {
        (0..80).for_each(|_| self.tenth());
        for tenth in 0..2 * 3_600_000 / CALM_MS {
            self.wall_ms += (CALM_MS - TENTH_US / 1000) as i64;
            self.tenth();
            if tenth.is_multiple_of(200) {
                self.look();
            }
        }
        self.finish()
    }

    fn finish(mut self) -> Judge {
        self.end();
        let database = self.database();
        kept::reported(&mut self.judge, &self.truth, &database);
        if self.judge.falsehoods().is_some() {
            eprintln!("{}", self.steps.join("\n"));
        }
        self.judge
    }
}
