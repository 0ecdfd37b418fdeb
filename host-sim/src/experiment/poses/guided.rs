//! A person follows the guide's advice until the guide has enough; then poses are compared with the truth.

use std::error::Error;
use std::sync::Arc;

use kehai::centre::Estimator;
use kehai_tracking::calibration::advice::{Advice, Guide, LONGEST_S};
use kehai_tracking::calibration::room::Outline;
use kehai_tracking::calibration::walk::Walk;
use kehai_tracking::calibration::{Calibration, Placed, Refusal, calibrate, upside_down};
use kehai_tracking::geometry::wrapped;
use kehai_tracking::geometry::{Point, Pose};
use kehai_tracking::session::Sessions;
use kehai_tracking::site::Site;
use kehai_tracking::site::floor::Floor as Mat;

use super::errand::Floor;
use super::mats::{self, HALF_M, Mats};
use super::table::{Error as Off, Of, Placing};
use super::{led, scene};
use crate::run::{Run, TICK_US};
use crate::world::motion::Led;
use crate::world::random::{Purpose, Stream};

/// Modules learn the empty room first, s.
const LEARNS_S: f64 = 10.0;

/// How far ahead of the time the walker's way is known, s.
const AHEAD_S: f64 = 0.6;

/// Two modules together for so long are too little, s.
const SHORT_S: f64 = 5.0;

/// A walker over a floor goes so far beyond its edge, m, and so far from straight across it, rad.
const BEYOND_M: f64 = 0.5;
const ACROSS_RAD: f64 = 0.8;

/// One seed in one scene: all its modules but the first.
pub fn place(name: &str, seed: u64) -> Result<Placing, Box<dyn Error>> {
    let scene = scene(name, seed)?;
    let truth = poses(&scene.site);
    let walked = walked(&scene, seed, &truth)?;
    let short = short(&walked.0, truth[0], SHORT_S);
    Ok(Placing { scene: name.to_owned(), of: Of::Modules, short, ..placing(&walked, &truth, 1) })
}

/// One seed in one scene with a floor before its first module: the floor alone is judged. `short` also says that a walk is refused
/// that never went there.
///
/// # Errors
/// A fault of the scene or of the simulation.
pub fn floor(name: &str, seed: u64) -> Result<Placing, Box<dyn Error>> {
    let mut scene = scene(name, seed)?;
    let first = scene.site.modules.first().ok_or("no module")?.pose();
    scene.site.floors = vec![mats::before(&first, seed)];
    let truth = poses(&scene.site);
    let walked = walked(&scene, seed, &truth)?;
    let short = [0.0, SHORT_S].into_iter().all(|seen_s| short(&walked.0, first, seen_s));
    Ok(Placing { scene: name.to_owned(), of: Of::Floor, short, ..placing(&walked, &truth, truth.len() - 1) })
}

/// What the walk says of how modules hang.
#[derive(Clone, Debug, Default)]
pub struct Hung {
    /// Which hang head down; the first never does.
    pub truth: Vec<bool>,
    /// Which do by the walk; empty: refused.
    pub found: Vec<bool>,
    /// How far apart the walks of two modules are, the wrong way up over the right one, least of all modules; 1: it does not
    /// say.
    pub clearly: f64,
    /// Of all modules but the first.
    pub off: Vec<Off>,
}

/// One seed in one scene, some modules but the first hanging head down without anybody having said so.
///
/// # Errors
/// A fault of the scene or of the simulation.
pub fn hung(name: &str, seed: u64) -> Result<Hung, Box<dyn Error>> {
    let mut scene = scene(name, seed)?;
    let mut stream = Stream::new(seed, Purpose::Network, [6, 1]);
    // None, some, or all of the others.
    let share = stream.uniform();
    for module in scene.site.modules.iter_mut().skip(1) {
        module.upside_down = stream.chance(share);
    }
    let truth: Vec<bool> = scene.site.modules.iter().map(|module| module.upside_down).collect();
    let poses = poses(&scene.site);
    let (walk, rooms) = walked(&scene, seed, &poses)?;
    let Ok(found) = calibrate(&walk, poses[0], &rooms) else { return Ok(Hung { truth, ..Hung::default() }) };
    let clearly = |placed: &Placed| placed.hang.apart_m.map_or(1.0, |(right_m, wrong_m)| wrong_m / right_m);
    let others = || found.modules.iter().skip(1);
    Ok(Hung {
        truth,
        found: found.modules.iter().map(|placed| placed.hang.turned).collect(),
        clearly: others().map(clearly).fold(f64::INFINITY, f64::min),
        off: others().zip(poses.iter().skip(1)).map(|(placed, truth)| off(placed, truth)).collect(),
    })
}

/// What the walk makes of modules and floors from number `judged` on.
fn placing((walk, rooms): &Walked, truth: &[Pose], judged: usize) -> Placing {
    let plain = calibrate(walk, truth[0], &[]);
    let with_rooms = calibrate(walk, truth[0], rooms);
    let errors = |found: &Result<Calibration, Refusal>| -> Option<Vec<Off>> {
        let found = found.as_ref().ok()?;
        Some(found.modules.iter().zip(truth).skip(judged).map(|(placed, truth)| off(placed, truth)).collect())
    };
    Placing {
        modules: truth.len(),
        walked_s: walk.span_s() - LEARNS_S,
        by_walk: errors(&plain),
        by_both: errors(&with_rooms),
        refusal: plain.err().map(|refusal| format!("{refusal:?}")),
        ..Placing::default()
    }
}

/// Where modules and floors are.
fn poses(site: &Site) -> Vec<Pose> {
    let modules = site.modules.iter().map(|module| module.pose());
    modules.chain(site.floors.iter().map(Mat::corner)).collect()
}

fn off(placed: &Placed, truth: &Pose) -> Off {
    let (bound_m, bound_rad) = placed.bounds();
    let metres = (placed.pose.at - truth.at).length();
    let radians = wrapped(placed.pose.yaw_rad - truth.yaw_rad).abs();
    Off { metres, radians, bound_m, bound_rad }
}

/// The walk and the backgrounds of one seed.
type Walked = (Walk, Vec<Option<Outline>>);

fn walked(scene: &crate::world::scene::Scene, seed: u64, truth: &[Pose]) -> Result<Walked, Box<dyn Error>> {
    let floor = Floor::of(scene);
    let modules = scene.site.modules.len();
    let stream = Stream::new(seed, Purpose::Walk, [9, 0]);
    let mut walker = Walker { floor, modules, truth, stream, turn: 0 };
    let start = walker.before(0);
    let led_by = Led::new(LEARNS_S, start);
    let mut run: Run = led(scene, seed, &led_by, Vec::new());
    // Where modules are is not known: each in its own frame.
    let mut site: Site = scene.site.clone();
    for module in &mut site.modules {
        (module.x, module.y, module.yaw_deg) = (0.0, 0.0, 0.0);
        module.upside_down = false;
    }
    let mut mats = Mats::new(&site, run.world().people().len());
    let mut sessions = Sessions::new(Arc::new(site), Estimator::default());
    let mut walk = Walk::new(truth.len());
    let mut guide = Guide::default();
    let mut tick = 0;
    loop {
        let now_s = tick as f64 * TICK_US as f64 * 1e-6;
        for arrival in run.until(tick * TICK_US)? {
            if let Some(observation) = sessions.receive(&arrival.bytes, arrival.at_us) {
                walk.observe(&observation);
            }
        }
        for reading in mats.until(&run, tick * TICK_US) {
            walk.read(modules + reading.floor, &reading);
        }
        tick += 1;
        let (at, end_s) = led_by.end();
        if end_s - now_s > AHEAD_S {
            continue;
        }
        let advice = guide.advise(&walk, now_s);
        if (advice == Advice::Enough && now_s > LEARNS_S) || now_s > LEARNS_S + LONGEST_S {
            break;
        }
        let turned: Vec<bool> = upside_down::find(&walk).iter().map(|hang| hang.turned).collect();
        let to = walker.follow(&advice.with_turned(&turned), at);
        led_by.go(&walker.floor.way(at, to));
    }
    let rooms = |index: usize| {
        let module = sessions.iter().find(|module| module.place_in_site() == Some(index))?;
        let geometry = module.geometry()?;
        let beam = |(beam, range_mm): (usize, &u16)| {
            let bearing_rad = geometry.bearing_rad(u16::try_from(beam).unwrap_or(u16::MAX));
            (f64::from(bearing_rad), f64::from(*range_mm) * 1e-3)
        };
        Some(Outline::of(module.walls_mm().iter().enumerate().map(beam)))
    };
    Ok((walk, (0..truth.len()).map(rooms).collect()))
}

/// The person that follows the advice. They can see the modules, so the true poses are known to them.
struct Walker<'a> {
    floor: Floor,
    /// The others are floors.
    modules: usize,
    truth: &'a [Pose],
    stream: Stream,
    turn: usize,
}

impl Walker<'_> {
    /// A step and a half before a module.
    fn before(&self, module: usize) -> Point {
        let pose = self.truth[module];
        self.floor.near(pose.to_site(Point::new(1.4, 0.0)))
    }

    /// Beyond a floor, from `at` about straight across it.
    fn across(&mut self, mat: usize, at: Point) -> Point {
        let middle = mats::middle(&self.truth[mat]);
        let away_m = HALF_M + BEYOND_M;
        let ahead_rad = (middle - at).angle_rad() + self.stream.between(-ACROSS_RAD, ACROSS_RAD);
        self.floor.near(middle + Point::towards(ahead_rad) * away_m)
    }

    /// Where to go from `at`.
    fn follow(&mut self, advice: &Advice, at: Point) -> Point {
        self.turn += 1;
        match advice {
            Advice::Together { modules: (_, mat), .. } if *mat >= self.modules => {
                return self.across(*mat, at);
            }
            Advice::Reach { module } if *module >= self.modules => return self.across(*module, at),
            _ => {}
        }
        let mut about = |place: Point, by_m: f64| {
            place + Point::new(self.stream.between(-by_m, by_m), self.stream.between(-by_m, by_m))
        };
        match advice {
            Advice::Together { modules: (one, _), place: Some(place), .. } => {
                about(self.truth[*one].to_site(*place), 0.3)
            }
            Advice::Reach { module } if self.turn.is_multiple_of(2) => self.before(*module),
            // And back to the others: to the nearest of them.
            Advice::Reach { module } => {
                let from = self.truth[*module].at;
                let others = (0..self.truth.len()).filter(|other| other != module);
                let nearest = others.min_by(|a, b| {
                    let far = |other: &usize| (self.truth[*other].at - from).length();
                    far(a).total_cmp(&far(b))
                });
                nearest.map_or(at, |nearest| self.before(nearest))
            }
            _ => {
                let place = self.truth[0].to_site(Point::new(1.8, 0.0));
                about(place, 0.8)
            }
        }
    }
}

/// Whether a walk in which the last module has seen the walker for so long only is refused, and the module named.
fn short(walk: &Walk, first: Pose, seen_s: f64) -> bool {
    let last = walk.modules() - 1;
    let mut cut = Walk::new(walk.modules());
    let mut left = (seen_s / kehai_tracking::calibration::walk::SLOT_S) as usize;
    for glimpse in &walk.glimpses() {
        if glimpse.module == last {
            if left == 0 {
                continue;
            }
            left -= 1;
        }
        cut.add(*glimpse);
    }
    let refused = calibrate(&cut, first, &[]);
    matches!(refused, Err(Refusal::Short { modules, .. }) if modules.0 == last || modules.1 == last)
        || refused == Err(Refusal::Apart { module: last })
}
