//! A small hall with three modules in which four people walk, and `kehai-tracker run` as a process beside it.
//!
//! ```text
//!   hall ─SCIP▶ modules ─UDP▶ kehai-tracker run ─┬─ stdout ─▶ a line every 0.1 s
//!                                                └─ stderr ─▶ what is wrong, in words
//! ```
#![allow(dead_code, reason = "each test uses its own part of it")]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use host_sim::building::Building;
use host_sim::world::scene::Scene;
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::tracker::LifeCycle;

/// A hundred times what a loaded machine needs.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// Eight seconds of an empty hall first: time to learn it. Each person crosses from one zone to the other and back.
const SCENE: &str = r#"
[[site.module]]
name = "south"
x = 0.1
y = 0.1
yaw_deg = 45.0

[[site.module]]
name = "east"
x = 4.9
y = 0.1
yaw_deg = 135.0

[[site.module]]
name = "north"
x = 2.5
y = 4.9
yaw_deg = -90.0

[[site.wall]]
points = [[0, 0], [5, 0], [5, 5], [0, 5], [0, 0]]

[[site.zone]]
name = "left"
polygon = [[0, 0], [2.5, 0], [2.5, 5], [0, 5]]
count = true

[[site.zone]]
name = "right"
polygon = [[2.5, 0], [5, 0], [5, 5], [2.5, 5]]
count = true

[[person]]
route = [[1.0, 1.0], [4.0, 1.2]]
repeat = "back-and-forth"
from_s = 8

[[person]]
route = [[4.2, 2.0], [0.9, 2.2]]
repeat = "back-and-forth"
speed_m_s = 0.9
from_s = 8

[[person]]
route = [[0.8, 3.0], [4.0, 3.1]]
repeat = "back-and-forth"
speed_m_s = 1.2
from_s = 8

[[person]]
route = [[3.9, 4.0], [1.0, 3.9]]
repeat = "back-and-forth"
speed_m_s = 1.0
from_s = 8
"#;

/// The hall, a folder, and in it the site's file and the place of a database.
pub struct Hall {
    pub building: Building,
    pub site: PathBuf,
    pub database: PathBuf,
    pub folder: tempfile::TempDir,
}

impl Hall {
    pub fn new(seed: u64) -> Self {
        let scene = Scene::parse("hall", SCENE).unwrap();
        let building = Building::start(&scene, seed).unwrap();
        Self::of(&scene, building)
    }

    /// Another scene's building.
    pub fn of(scene: &Scene, building: Building) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let site = folder.path().join("hall.toml");
        std::fs::write(&site, toml::to_string(&scene.site).unwrap()).unwrap();
        let database = folder.path().join("hall.db");
        Self { building, site, database, folder }
    }

    /// The arguments with which `kehai-tracker` follows the people of this hall, and keeps that in `database`.
    pub fn arguments(&self, database: &Path) -> Vec<String> {
        let mut arguments: Vec<String> =
            ["run", "--no-mdns", "--tracks-out", "-", "--site"].map(String::from).into();
        arguments.push(self.site.display().to_string());
        arguments.extend(["--db".to_owned(), database.display().to_string()]);
        for (_, address) in self.building.modules() {
            arguments.extend(["--module".to_owned(), address.to_string()]);
        }
        arguments
    }

    /// The tracker, with its database here.
    pub fn tracker(&self) -> Tracker {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.args(self.arguments(&self.database));
        Tracker::start(command)
    }
}

/// A tracker, or a shell that runs one. It ends with the test.
pub struct Tracker {
    pub process: Child,
    lines: Receiver<TracksLine>,
    said: Arc<Mutex<Vec<String>>>,
    readers: Vec<JoinHandle<()>>,
}

impl Tracker {
    pub fn start(mut command: Command) -> Self {
        let mut process = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (tell, lines) = mpsc::channel();
        let stdout = BufReader::new(process.stdout.take().unwrap());
        let reading = std::thread::spawn(move || {
            // The last line of a process that is killed may be cut off.
            let whole = |line: String| {
                serde_json::from_str(&line).ok().inspect(|_| crate::described::as_document("tracks", &line))
            };
            stdout.lines().map_while(Result::ok).filter_map(whole).for_each(|line| drop(tell.send(line)));
        });
        let said = Arc::new(Mutex::new(Vec::new()));
        let (stderr, words) = (BufReader::new(process.stderr.take().unwrap()), Arc::clone(&said));
        let hearing = std::thread::spawn(move || {
            stderr.lines().map_while(Result::ok).for_each(|line| words.lock().unwrap().push(line));
        });
        Self { process, lines, said, readers: vec![reading, hearing] }
    }

    /// All that it has said so far.
    pub fn said(&self) -> Vec<String> {
        self.said.lock().unwrap().clone()
    }

    /// What follows `marker` in the first line with it.
    #[track_caller]
    pub fn says(&self, marker: &str) -> String {
        let begun = Instant::now();
        loop {
            let said = self.said();
            if let Some((_, rest)) = said.iter().find_map(|line| line.split_once(marker)) {
                return rest.trim().to_owned();
            }
            assert!(begun.elapsed() < PATIENCE, "it does not say \"{marker}\": {said:#?}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// The next line.
    #[track_caller]
    pub fn line(&self) -> TracksLine {
        self.lines.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("no line: {:#?}", self.said()))
    }

    /// Every line until a track is confirmed, that one included.
    #[track_caller]
    pub fn until_a_person(&self) -> Vec<TracksLine> {
        let begun = Instant::now();
        let mut lines = vec![self.line()];
        while !lines.last().unwrap().tracks.iter().any(|track| track.state == LifeCycle::Confirmed) {
            assert!(begun.elapsed() < PATIENCE, "no person comes: {:#?}", self.said());
            lines.push(self.line());
        }
        lines
    }

    /// Kills it, and returns the lines that have not been read yet.
    pub fn kill(mut self) -> Vec<TracksLine> {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
        self.readers.drain(..).for_each(|reader| reader.join().unwrap());
        self.lines.try_iter().collect()
    }
}

impl Drop for Tracker {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
