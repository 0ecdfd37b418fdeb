//! A browser that stays open on the demo for an hour does not grow.
//!
//! ```text
//!   the demo's building, tracker and frames for some seconds ─▶ over and over, each time under new numbers,
//!   an hour of it as fast as the page can take it ─▶ the map's server ─▶ Chromium: heap, nodes, listeners after 15 and 60 minutes
//! ```
//!
//! The ten minutes that the time line keeps are full by the first look. The page understands at least one frame in
//! [`STEP`]: it misses the others, as a page on a slow machine does.

mod chromium;

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use chromium::Page;
use host_sim::building::Building;
use host_sim::world::scene::Scene;
use host_tracker::service::{Options, Service};
use host_tracker::site_file::SiteFile;
use host_tracker::store::{Keep, Store};
use host_tracker::web::{Server, ServerContext};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use serde_json::{Value, json};
use tokio::sync::watch;

/// What is recorded of the demo, s of its time: from when people are there.
const RECORDED_S: (f64, f64) = (13.0, 25.0);

/// Frames of an hour.
const HOUR: u64 = 36_000;

/// Frames before the first look: a quarter of an hour.
const FIRST: u64 = 9_000;

/// Between two frames of the demo, ms of its time.
const FRAME_MS: u64 = 100;

/// The page has understood something new after so many frames, before there are more: two seconds of the demo's time.
const STEP: u64 = 20;

/// A wait longer than this is a failure, not slowness.
const PATIENCE: Duration = Duration::from_secs(150);

/// Frames that stand still while the page is measured.
const STILL: u64 = 12;

/// What a page of 2 MB may grow in three quarters of an hour: what is left of it goes up and down by 0.2 MB. One that
/// keeps the tracks of every frame it understands grows by more.
const HEAP_BYTES: f64 = 0.5e6;

/// Nodes come and go with the people; those of the same moment are the same but for a text or two.
const NODES: f64 = 30.0;

/// Counts what the page has understood.
const COUNT: &str = "window.understood = 0; const parse = JSON.parse; \
                     JSON.parse = (...all) => { window.understood += 1; return parse(...all); };";

#[test]
fn a_browser_left_open_for_an_hour_of_the_demo_does_not_grow() {
    let Some(mut page) = chromium::start() else { return };
    let scene = Scene::load("building").unwrap();
    let frames = recorded(&scene);
    let folder = tempfile::tempdir().unwrap();
    let show = Show::new(&scene.site, folder.path());
    page.call("Page.addScriptToEvaluateOnNewDocument", json!({ "source": COUNT }));
    page.size(1440, 900, 1);
    page.open(&format!("http://{}/", show.server.address()));
    let begun_ms = unix_ms() - HOUR * FRAME_MS;
    let mut player = Player { show: &show, frames: &frames, begun_ms, next: 0, understood: 0.0 };
    player.until(1, None);
    page.wait("the map is live", "document.querySelector('#link').dataset.state === 'live'");
    player.until(FIRST, Some(&mut page));
    let early = player.look(&mut page);
    player.until(HOUR, Some(&mut page));
    let late = player.look(&mut page);
    let understood = page.value("window.understood").as_f64().unwrap();
    println!("{} frames of {}, {understood} messages understood", player.next, frames.len());
    println!("after 15 minutes {early:?}, after 60 {late:?}");
    assert_eq!(page.errors, Vec::<String>::new());
    assert!(late.heap_bytes - early.heap_bytes < HEAP_BYTES);
    assert!((late.nodes - early.nodes).abs() < NODES);
    assert!(late.listeners <= early.listeners);
}

/// What the demo's own server would show.
fn recorded(scene: &Scene) -> Vec<Snapshot> {
    let building = Building::start(scene, scene.seed).unwrap();
    let service = Service::start(Options {
        site: scene.site.clone(),
        modules: building.modules().iter().map(|(_, address)| *address).collect(),
        ..Options::default()
    })
    .unwrap();
    let queue = service.queue();
    let mut frames = Vec::new();
    while building.now_s() < RECORDED_S.1 {
        let frame = queue.recv().unwrap();
        if building.now_s() >= RECORDED_S.0 {
            frames.push((*frame).clone());
        }
    }
    let most = frames.iter().map(|frame| frame.line.tracks.len()).max();
    assert!(most >= Some(2), "no second person came in: {most:?}");
    frames
}

/// The map's server, with frames of this test, and a database.
struct Show {
    server: Server,
    frames: watch::Sender<Arc<Snapshot>>,
    store: Store,
}

impl Show {
    fn new(site: &Site, folder: &Path) -> Self {
        let (file, database) = (folder.join("building.toml"), folder.join("building.db"));
        std::fs::write(&file, toml::to_string(site).unwrap()).unwrap();
        let (frames, newest) = watch::channel(Arc::default());
        let store = Store::open(&database, &Arc::new(site.clone()), Keep::USUAL).unwrap();
        let context = ServerContext {
            database: Some(database),
            ..ServerContext::alone(newest, SiteFile::load(&file).unwrap())
        };
        let server = Server::start(SocketAddr::from(([127, 0, 0, 1], 0)), context).unwrap();
        Self { server, frames, store }
    }
}

/// What a page holds, after its garbage was collected.
#[derive(Clone, Copy, Debug)]
struct Held {
    heap_bytes: f64,
    nodes: f64,
    listeners: f64,
}

impl Held {
    fn least(self, other: &Self) -> Self {
        Self {
            heap_bytes: self.heap_bytes.min(other.heap_bytes),
            nodes: self.nodes.min(other.nodes),
            listeners: self.listeners.min(other.listeners),
        }
    }
}

struct Player<'a> {
    show: &'a Show,
    frames: &'a [Snapshot],
    begun_ms: u64,
    /// Number of the next frame.
    next: u64,
    /// Messages that the page had understood when it was last asked.
    understood: f64,
}

impl Player<'_> {
    /// Shows frame `of` of the recording now.
    fn show(&mut self, of: usize, round: u64) {
        let mut frame = self.frames[of].clone();
        frame.unix_ms = self.begun_ms + self.next * FRAME_MS;
        frame.line.t = self.next as f64 * 0.1;
        frame.line.tracks.iter_mut().for_each(|track| track.id += 1000 * round);
        let frame = Arc::new(frame);
        self.show.frames.send_replace(Arc::clone(&frame));
        self.show.store.record(frame);
        self.next += 1;
    }

    fn place(&self) -> (usize, u64) {
        let all = self.frames.len() as u64;
        ((self.next % all) as usize, self.next / all)
    }

    /// Goes on up to that frame, as fast as the page understands, and then to the end of the recording.
    fn until(&mut self, number: u64, mut page: Option<&mut Page>) {
        while self.next < number || self.place().0 != self.frames.len() - 1 {
            let (of, round) = self.place();
            self.show(of, round);
            if self.next.is_multiple_of(STEP)
                && let Some(page) = &mut page
            {
                self.understands_more(page);
            }
        }
    }

    /// Waits for it: the newest frame always comes.
    fn understands_more(&mut self, page: &mut Page) {
        let (begun, before) = (Instant::now(), self.understood);
        while self.understood <= before {
            assert!(begun.elapsed() < PATIENCE, "the page understands nothing: {:?}", page.errors);
            std::thread::sleep(Duration::from_millis(1));
            self.understood = page.value("window.understood").as_f64().unwrap();
        }
    }

    /// Stands still at the recording's last frame, at life's speed, and looks at the page some times: the least it holds.
    /// What is just being drawn, or was and is not yet collected, is not what stays.
    fn look(&mut self, page: &mut Page) -> Held {
        let round = self.place().1;
        let mut held: Option<Held> = None;
        for still in 0..STILL {
            self.show(self.frames.len() - 1, round);
            std::thread::sleep(Duration::from_millis(FRAME_MS));
            if still >= STILL / 2 {
                let now = hold(page);
                held = Some(held.map_or(now, |before| before.least(&now)));
            }
        }
        // On with the recording's beginning.
        while self.place().0 != 0 {
            self.show(self.frames.len() - 1, round);
        }
        held.unwrap()
    }
}

fn hold(page: &mut Page) -> Held {
    page.call("HeapProfiler.enable", json!({}));
    page.call("Performance.enable", json!({}));
    for _ in 0..3 {
        page.call("HeapProfiler.collectGarbage", json!({}));
    }
    let heap_bytes = page.call("Runtime.getHeapUsage", json!({}))["usedSize"].as_f64().unwrap();
    let metrics = page.call("Performance.getMetrics", json!({}));
    let metric = |name: &str| {
        let all = metrics["metrics"].as_array().unwrap();
        let found = all.iter().find(|metric| metric["name"] == name).map(|metric: &Value| &metric["value"]);
        found.and_then(Value::as_f64).unwrap_or_else(|| panic!("no {name}"))
    };
    Held { heap_bytes, nodes: metric("Nodes"), listeners: metric("JSEventListeners") }
}
