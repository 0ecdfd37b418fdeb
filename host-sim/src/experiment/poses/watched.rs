//! Is a turned or covered module named, and no other one?

use std::error::Error;
use std::sync::Arc;

use kehai::centre::Estimator;
use kehai_tracking::calibration::watch::{Finding, PoseWatch};
use kehai_tracking::geometry::Point;
use kehai_tracking::session::Sessions;
use kehai_tracking::site::Site;

use super::errand::Floor;
use super::table::Watching;
use super::{Fault, led, scene};
use crate::run::{Arrival, Options, Run, TICK_US};
use crate::world::mishap::Mishap;
use crate::world::motion::Led;
use crate::world::random::{Purpose, Stream};
use crate::world::scene::Scene;
use crate::world::variation::{Letter, Variation};

/// Learned, then walked about for a while, then it happens; and it is waited for so long, s.
const LEARNS_S: f64 = 10.0;
const BEFORE_S: f64 = 25.0;
const WAITS_S: f64 = 40.0;

/// A scene in which nothing happens is watched for so long at most, s.
const QUIET_S: f64 = 240.0;

/// A site's watch, fed with datagrams.
struct Guard {
    sessions: Sessions,
    watch: PoseWatch,
}

impl Guard {
    fn new(site: &Site) -> Self {
        let watch = PoseWatch::new(site);
        Self { sessions: Sessions::new(Arc::new(site.clone()), Estimator::default()), watch }
    }

    /// What is wrong once these have arrived.
    fn observe(&mut self, arrivals: &[Arrival], now_s: f64) -> Vec<(usize, Finding)> {
        for arrival in arrivals {
            if let Some(observation) = self.sessions.receive(&arrival.bytes, arrival.at_us) {
                self.watch.observe(&observation);
            }
        }
        for module in self.sessions.iter() {
            if let Some(place) = module.place_in_site() {
                self.watch.know_walls(place, module.walls_mm());
            }
        }
        self.watch.findings(now_s)
    }
}

/// A scene in which no module is touched.
pub fn quiet(name: &str, file: &str, people: Option<usize>, seed: u64) -> Result<Watching, Box<dyn Error>> {
    let mut scene = Scene::load(file)?;
    if people.is_some() {
        let condition = Some(if name.ends_with('H') { Letter::H } else { Letter::D });
        scene.vary(&Variation { people, condition, ..Variation::default() })?;
    }
    scene.duration_s = scene.duration_s.min(QUIET_S);
    let mut run = Run::new(&scene, seed, &Options::default());
    let mut guard = Guard::new(&scene.site);
    let mut said = Vec::new();
    for tick in 0..(run.world().duration_s() * 1e6) as u64 / TICK_US {
        let found = guard.observe(&run.until(tick * TICK_US)?, tick as f64 * TICK_US as f64 * 1e-6);
        said.extend(found.first().copied().filter(|_| said.is_empty()));
    }
    let wrong = said.first().map(|(module, finding)| format!("{module}: {finding:?}"));
    Ok(Watching { scene: name.to_owned(), what: None, named_s: None, wrong })
}

/// A person walks about, and a fault happens to a module.
pub fn mishap(room: &str, what: &str, mishap: Mishap, seed: u64) -> Result<Watching, Box<dyn Error>> {
    let scene = scene(room, seed)?;
    let from_s = LEARNS_S + BEFORE_S;
    let mishap = Mishap { from_s, ..mishap };
    let floor = Floor::of(&scene);
    let mut stream = Stream::new(seed, Purpose::Walk, [10, 0]);
    let places: Vec<Point> =
        scene.site.modules.iter().map(|module| module.pose().to_site(Point::new(1.5, 0.0))).collect();
    let mut next = || {
        let place = places[(stream.uniform() * places.len() as f64) as usize % places.len()];
        floor.near(place + Point::new(stream.between(-0.8, 0.8), stream.between(-0.8, 0.8)))
    };
    let led_by = Led::new(LEARNS_S, next());
    // All over the place in which the module is, for as long as it takes.
    while led_by.end().1 < from_s + WAITS_S + 1.0 {
        let at = led_by.end().0;
        led_by.go(&floor.way(at, next()));
    }
    let mut run = led(&scene, seed, &led_by, vec![mishap]);
    let mut guard = Guard::new(&scene.site);
    let mut result =
        Watching { scene: room.to_owned(), what: Some(what.to_owned()), named_s: None, wrong: None };
    for tick in 0..((from_s + WAITS_S) * 1e6) as u64 / TICK_US {
        let now_s = tick as f64 * TICK_US as f64 * 1e-6;
        let arrivals: Result<Vec<Arrival>, Fault> = run.until(tick * TICK_US);
        for (module, finding) in guard.observe(&arrivals?, now_s) {
            if module == mishap.module && now_s >= from_s {
                result.named_s = result.named_s.or(Some(now_s - from_s));
            } else if result.wrong.is_none() {
                result.wrong =
                    Some(format!("{module} instead of {}: {finding:?} at {now_s:.0}", mishap.module));
            }
        }
        if result.named_s.is_some_and(|named_s| now_s - from_s > named_s + 5.0) {
            break;
        }
    }
    Ok(result)
}
