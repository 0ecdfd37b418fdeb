//! A calibration under way: begun, walked, solved, accepted.
//!
//! ```text
//!   observations, backgrounds ─▶ Session ◀─ begin · solve, conclude · go_on · stop
//!                                └─────▶ Status
//! ```

use std::sync::Arc;

use serde::Serialize;

use super::advice::{Advice, Guide, OVERLAP_S};
use super::coverage::{Coverage, Seer, coverage};
use super::room::Outline;
use super::walk::Walk;
use super::words::Names;
use super::{Calibration, ENOUGH_S, Refusal, align, calibrate, words};
use crate::floor::Reading;
use crate::geometry::{Point, Pose};
use crate::observation::{Observation, View};
use crate::session::Sessions;
use crate::site::floor::Floor;
use crate::site::{Module, Site};

/// Between two looks at backgrounds and advice, s.
const LOOK_S: f64 = 0.5;

/// One calibration after the other. A clone is a picture of the moment.
#[derive(Clone, Debug, Default)]
pub struct Session {
    site: Arc<Site>,
    now_s: f64,
    active: Option<Active>,
    begin: bool,
}

#[derive(Clone, Debug)]
struct Active {
    site: Arc<Site>,
    walk: Walk,
    guide: Guide,
    advice: Advice,
    progress: f64,
    rooms: Vec<Option<Outline>>,
    views: Vec<Option<(View, Vec<f64>)>>,
    looked_s: f64,
    begun_s: f64,
    result: Option<Result<Calibration, Refusal>>,
}

/// How far it is.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Status {
    /// Whether a calibration has begun.
    pub active: bool,
    /// How long ago, s.
    pub since_s: f64,
    /// How much of what is needed is there, 0 to 1.
    pub progress: f64,
    /// Whether the guide says that it is enough.
    pub enough: bool,
    /// What to do now, in words.
    pub advice: String,
    /// A place to go to, in the site as it was before.
    pub place: Option<[f64; 2]>,
    /// Modules that see the walker now.
    pub sees: Vec<String>,
    /// For how long several people were in view; those moments are not used, s.
    pub crowded_s: f64,
    /// Every pair that has seen the walker together.
    pub pairs: Vec<PairStatus>,
    /// What was found, after `finish`.
    pub found: Option<FoundStatus>,
    /// Why nothing was found, after `finish`.
    pub refused: Option<String>,
}

/// A pair of modules.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PairStatus {
    /// Their names.
    pub modules: [String; 2],
    /// How long they have seen the walker together, s.
    pub common_s: f64,
    /// How long they should, s.
    pub needed_s: f64,
    /// How far apart they see the walker, m; after `finish`.
    pub residual_m: Option<f64>,
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FoundStatus {
    /// How good it is, in a sentence.
    pub quality: String,
    /// Each module's place.
    pub modules: Vec<ModuleStatus>,
    /// Which modules see what from there.
    pub coverage: Coverage,
}

/// A module's place.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ModuleStatus {
    /// Its name.
    pub name: String,
    /// Its place, m, and direction, degrees.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// See `x`.
    pub yaw_deg: f64,
    /// Within which it is with 95 %, m.
    pub within_m: f64,
    /// The same for its direction, degrees.
    pub within_deg: f64,
    /// How far that is from where the site had it, m.
    pub moved_m: f64,
    /// How far what it saw is from the walk, m: median.
    pub residual_m: f64,
    /// How far its clock is behind, ms.
    pub clock_ms: f64,
    /// All that in words.
    pub text: String,
}

impl Session {
    /// The site in use.
    pub fn set_site(&mut self, site: &Arc<Site>) {
        self.site = Arc::clone(site);
    }

    /// Adds an observation to the walk, if a calibration is under way.
    pub fn observe(&mut self, observation: &Observation) {
        if let Some(active) = self.active.as_mut().filter(|active| active.result.is_none()) {
            active.walk.observe(observation);
        }
    }

    /// The same with a reading of a floor.
    pub fn read(&mut self, reading: &Reading) {
        if let Some(active) = self.active.as_mut().filter(|active| active.result.is_none()) {
            active.walk.read(active.site.modules.len() + reading.floor, reading);
        }
    }

    /// Looks at backgrounds, and where to walk next.
    pub fn tick(&mut self, sessions: &Sessions, now_s: f64) {
        self.now_s = now_s;
        if std::mem::take(&mut self.begin) {
            self.active = Some(Active::new(&self.site, now_s));
        }
        let due = |active: &&mut Active| now_s >= active.looked_s + LOOK_S;
        if let Some(active) = self.active.as_mut().filter(due) {
            active.look(sessions, now_s);
        }
    }

    /// Begins a new one at the next tick, whatever was.
    pub fn begin(&mut self) {
        self.begin = true;
    }

    /// Ends it; nothing has changed.
    pub fn stop(&mut self) {
        (self.active, self.begin) = (None, false);
    }

    /// Computes the poses from the walk so far, which needs some tenths of a second: on a clone, while the walk goes
    /// on. None while no calibration is under way. [`conclude`](Self::conclude) stores the result.
    #[must_use]
    pub fn solve(&self) -> Option<Result<Calibration, Refusal>> {
        let active = self.active.as_ref()?;
        let Some(first) = active.site.modules.first() else {
            return (!active.site.floors.is_empty()).then_some(Err(Refusal::Alone));
        };
        let first = first.pose();
        Some(calibrate(&active.walk, first, &active.rooms))
    }

    /// Ends the walk with this result; [`go_on`](Self::go_on) continues it.
    pub fn conclude(&mut self, result: Result<Calibration, Refusal>) {
        if let Some(active) = &mut self.active {
            active.result = Some(result);
        }
    }

    /// Goes on walking after a result.
    pub fn go_on(&mut self) {
        if let Some(active) = &mut self.active {
            active.result = None;
        }
    }

    /// The poses found, by the names of the site's modules and floors; of a floor that of its outer corner.
    #[must_use]
    pub fn poses(&self) -> Option<Vec<(String, Pose)>> {
        let active = self.active.as_ref()?;
        let Some(Ok(found)) = &active.result else { return None };
        Some(active.names().all.into_iter().zip(found.modules.iter().map(|placed| placed.pose)).collect())
    }

    /// How far it is. After a result it says which beams see what, which takes some time: on a clone, too.
    #[must_use]
    pub fn status(&self) -> Status {
        match &self.active {
            Some(active) => active.status(self.now_s),
            None => Status { active: self.begin, ..Status::default() },
        }
    }
}

impl Active {
    fn new(site: &Arc<Site>, now_s: f64) -> Self {
        let modules = site.modules.len() + site.floors.len();
        Self {
            site: Arc::clone(site),
            walk: Walk::new(modules),
            guide: Guide::default(),
            advice: Advice::Begin,
            progress: 0.0,
            rooms: vec![None; modules],
            views: vec![None; modules],
            looked_s: now_s,
            begun_s: now_s,
            result: None,
        }
    }

    fn look(&mut self, sessions: &Sessions, now_s: f64) {
        self.looked_s = now_s;
        if self.result.is_some() {
            return;
        }
        for module in sessions.iter() {
            let (Some(place), Some(geometry)) = (module.place_in_site(), module.geometry()) else { continue };
            let bearing =
                |beam: usize| f64::from(geometry.bearing_rad(u16::try_from(beam).unwrap_or(u16::MAX)));
            let beams = || module.walls_mm().iter().enumerate();
            if let Some(room) = self.rooms.get_mut(place)
                && room.is_none()
                && !module.walls_mm().is_empty()
            {
                *room = Some(Outline::of(beams().map(|(beam, mm)| (bearing(beam), f64::from(*mm) * 1e-3))));
                let empty_m: Vec<f64> = beams().map(|(_, mm)| f64::from(*mm) * 1e-3).collect();
                let height_m = self.site.modules.get(place).map_or(0.0, |module| module.height_m);
                let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
                let view = View { module: place, pose, height_m, geometry: *geometry };
                if let Some(known) = self.views.get_mut(place) {
                    *known = Some((view, empty_m));
                }
            }
        }
        self.advice = self.guide.advise(&self.walk, now_s);
        self.progress = self.guide.progress(&self.walk);
    }

    fn names(&self) -> Names {
        let (modules, floors) = (&self.site.modules, &self.site.floors);
        let names = modules.iter().map(|module| &module.name).chain(floors.iter().map(|floor| &floor.name));
        Names { all: names.cloned().collect(), modules: modules.len() }
    }

    /// Where modules and floors are by the site.
    fn poses(&self) -> impl Iterator<Item = Pose> {
        let (modules, floors) = (&self.site.modules, &self.site.floors);
        modules.iter().map(Module::pose).chain(floors.iter().map(Floor::corner))
    }

    fn status(&self, now_s: f64) -> Status {
        let names = self.names();
        let name = |module: usize| names.of(module).to_owned();
        let found = self.result.as_ref().and_then(|result| result.as_ref().ok());
        let pair = |((one, other), common_s): ((usize, usize), f64)| PairStatus {
            modules: [name(one), name(other)],
            common_s: rounded(common_s, 10.0),
            needed_s: ENOUGH_S,
            residual_m: found.and_then(|found| {
                let pair = found.pairs.iter().find(|pair| pair.modules == (one, other))?;
                Some(rounded(pair.residual_m, 1000.0))
            }),
        };
        let (sees, _) = self.walk.now(now_s);
        let refused = self.result.as_ref().and_then(|result| result.as_ref().err());
        Status {
            active: true,
            since_s: rounded(now_s - self.begun_s, 10.0),
            progress: rounded(self.progress, 100.0),
            enough: self.advice == Advice::Enough,
            advice: words::advice(&self.advice, &names),
            place: self.place(),
            sees: sees.into_iter().map(name).collect(),
            crowded_s: self.walk.crowded().0,
            pairs: self.walk.pairs().into_iter().filter(|pair| pair.1 >= OVERLAP_S).map(pair).collect(),
            found: found.map(|found| self.found(found, &names)),
            refused: refused.map(|refusal| words::refusal(refusal, &names)),
        }
    }

    /// Where to go, by the modules' poses from the walk so far; before there are any, by the site's.
    fn place(&self) -> Option<[f64; 2]> {
        let Advice::Together { modules: (one, _), place: Some(place), .. } = &self.advice else {
            return None;
        };
        let first = self.site.modules.first()?.pose();
        let pose = match align::all(&self.walk, first) {
            Ok(poses) => *poses.get(*one)?,
            Err(_) => self.poses().nth(*one)?,
        };
        let at = pose.to_site(*place);
        Some([rounded(at.x, 100.0), rounded(at.y, 100.0)])
    }

    fn found(&self, found: &Calibration, names: &Names) -> FoundStatus {
        let module = |(number, (placed, before)): (usize, (&super::Placed, Pose))| {
            let (within_m, within_rad) = placed.bounds();
            ModuleStatus {
                name: names.of(number).to_owned(),
                x: rounded(placed.pose.at.x, 1000.0),
                y: rounded(placed.pose.at.y, 1000.0),
                yaw_deg: rounded(placed.pose.yaw_rad.to_degrees(), 100.0),
                within_m: rounded(within_m, 1000.0),
                within_deg: rounded(within_rad.to_degrees(), 100.0),
                moved_m: rounded((placed.pose.at - before.at).length(), 1000.0),
                residual_m: rounded(placed.residual_m, 1000.0),
                clock_ms: rounded(placed.clock_s * 1e3, 10.0),
                text: words::placed(placed, number, names),
            }
        };
        let placed_views = self.views.iter().zip(&found.modules).zip(&names.all);
        let seers: Vec<Seer> = placed_views
            .filter_map(|((view, placed), name)| {
                let (view, empty_m) = view.as_ref()?;
                Some((name.clone(), View { pose: placed.pose, ..view.clone() }, empty_m.clone()))
            })
            .collect();
        FoundStatus {
            quality: words::quality(found),
            modules: found.modules.iter().zip(self.poses()).enumerate().map(module).collect(),
            coverage: coverage(&seers),
        }
    }
}

fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}
