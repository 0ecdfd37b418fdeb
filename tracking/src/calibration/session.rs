//! A calibration under way: begun, walked, solved, accepted.
//!
//! ```text
//!   observations, backgrounds ─▶ Session ◀─ begin · solve, conclude · go_on · stop
//!                                └─────▶ Status
//! ```

use std::sync::Arc;

use super::advice::{Advice, Guide, OVERLAP_S};
use super::coverage::{Seer, coverage};
use super::held::Held;
use super::names::Names;
use super::room::Outline;
use super::status::{FoundStatus, HangStatus, ModuleStatus, Mounting, PairStatus, Status};
use super::told::{Quality, ToldAdvice, ToldRefusal};
use super::walk::Walk;
use super::{Calibration, ENOUGH_S, Placed, Refusal, words};
use crate::figures::rounded;
use crate::floor::Reading;
use crate::geometry::{Point, Pose};
use crate::observation::{Observation, View};
use crate::session::Sessions;
use crate::session::upside_down::Beams;
use crate::site::Site;

/// Between two looks at backgrounds and advice, s.
const LOOK_S: f64 = 0.5;

/// Advice to walk where two modules see the walker stands for so long, s: it is read, and followed some steps.
const STEADY_S: f64 = 6.0;

/// One calibration after the other. A clone is a picture of the moment.
#[derive(Clone, Debug, Default)]
pub struct Session {
    site: Arc<Site>,
    now_s: f64,
    active: Option<Active>,
    begin: bool,
    /// How many walks have begun.
    begun: u64,
}

/// What a walk came to. It is for that walk alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    walk: u64,
    /// The poses, or why there are none.
    pub result: Result<Calibration, Refusal>,
}

#[derive(Clone, Debug)]
struct Active {
    /// Which walk of the session it is.
    number: u64,
    site: Arc<Site>,
    walk: Walk,
    guide: Guide,
    advice: Advice,
    progress: f64,
    rooms: Vec<Option<Outline>>,
    views: Vec<Option<(View, Vec<f64>)>>,
    looked_s: f64,
    /// Modules that hang the other way up than the site has it, by the walk so far.
    turned: Vec<bool>,
    /// When the advice was another last.
    advised_s: f64,
    begun_s: f64,
    result: Option<Result<Calibration, Refusal>>,
}

impl Session {
    /// The site in use. From now on observations and readings have its numbers: where these are of other modules or floors than
    /// before, where one of them hangs the other way up, or where the one that is held has another place, a walk ends with
    /// [`Refusal::SiteChanged`], and one that has just begun begins anew.
    pub fn set_site(&mut self, site: &Arc<Site>) {
        self.site = Arc::clone(site);
        let Some(active) = self.active.as_mut().filter(|active| !active.is_of(site)) else { return };
        if active.looked_s <= active.begun_s {
            // A user who adds modules and begins at once means the site with them.
            self.begun += 1;
            *active = Active::new(site, self.begun, active.begun_s);
        } else if active.result.is_none() {
            active.result = Some(Err(Refusal::SiteChanged));
        }
    }

    /// The site in use.
    #[must_use]
    pub fn site(&self) -> &Site {
        &self.site
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
            self.begun += 1;
            self.active = Some(Active::new(&self.site, self.begun, now_s));
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
    pub fn solve(&self) -> Option<Solved> {
        let active = self.active.as_ref()?;
        Some(Solved { walk: active.number, result: self.result_of(active) })
    }

    fn result_of(&self, active: &Active) -> Result<Calibration, Refusal> {
        if !active.is_of(&self.site) {
            return Err(Refusal::SiteChanged);
        }
        let Some(held) = active.held() else {
            return Err(Refusal::Alone);
        };
        if active.walk.modules() == 1 && !active.site.is_placed(0) {
            return Ok(Calibration::of_one(held.pose));
        }
        held.calibrate(&active.walk, &active.rooms)
    }

    /// Ends the walk with its result; [`go_on`](Self::go_on) continues it. Nothing happens if another walk has begun since it
    /// was solved, or if it has ended, as by another site.
    pub fn conclude(&mut self, solved: Solved) {
        let is_of = |active: &&mut Active| active.number == solved.walk && active.result.is_none();
        if let Some(active) = self.active.as_mut().filter(is_of) {
            active.result = Some(solved.result);
        }
    }

    /// Goes on walking after a result; not in a site with other modules or floors.
    pub fn go_on(&mut self) {
        if let Some(active) = &mut self.active {
            active.result = (!active.is_of(&self.site)).then_some(Err(Refusal::SiteChanged));
        }
    }

    /// Where the site's modules and floors were found.
    #[must_use]
    pub fn mountings(&self) -> Option<Vec<Mounting>> {
        let active = self.active.as_ref()?;
        let Some(Ok(found)) = &active.result else { return None };
        let mounting = |(number, (name, placed)): (usize, (String, &Placed))| Mounting {
            name,
            pose: placed.pose,
            upside_down: active.is_upside_down(number) != placed.hang.turned,
        };
        Some(active.names().all.into_iter().zip(&found.modules).enumerate().map(mounting).collect())
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
    fn new(site: &Arc<Site>, number: u64, now_s: f64) -> Self {
        let modules = site.modules.len() + site.floors.len();
        Self {
            number,
            site: Arc::clone(site),
            walk: Walk::new(modules),
            guide: Guide::default(),
            advice: Advice::Begin,
            progress: 0.0,
            rooms: vec![None; modules],
            views: vec![None; modules],
            turned: vec![false; modules],
            looked_s: now_s,
            advised_s: now_s,
            begun_s: now_s,
            result: None,
        }
    }

    fn look(&mut self, sessions: &Sessions, now_s: f64) {
        self.looked_s = now_s;
        if self.result.is_some() {
            return;
        }
        for module in sessions.in_place() {
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
                let upside_down = self.is_upside_down(place);
                let view = View { module: place, pose, height_m, geometry: *geometry, upside_down };
                if let Some(known) = self.views.get_mut(place) {
                    *known = Some((view, empty_m));
                }
            }
        }
        let next = self.guide.advise(&self.walk, now_s);
        if !is_same(&self.advice, &next) || now_s >= self.advised_s + STEADY_S {
            (self.advice, self.advised_s) = (next, now_s);
        }
        self.progress = self.guide.progress(&self.walk);
        let hangs = self.held().map(|held| held.hangs(&self.walk)).unwrap_or_default();
        self.turned = hangs.iter().map(|hang| hang.turned).collect();
    }

    /// Whether what the walk has collected means the same in a site: it numbers the same modules and floors in the same way, has them
    /// the same way up, and the one that is held at the same place.
    fn is_of(&self, site: &Site) -> bool {
        let upside_down =
            |site: &Site| -> Vec<bool> { site.modules.iter().map(|module| module.upside_down).collect() };
        self.site.places().eq(site.places())
            && upside_down(&self.site) == upside_down(site)
            && held(&self.site) == held(site)
    }

    /// Whether the site has the module of this number head down.
    fn is_upside_down(&self, number: usize) -> bool {
        self.site.modules.get(number).is_some_and(|module| module.upside_down)
    }

    fn names(&self) -> Names {
        let (modules, floors) = (&self.site.modules, &self.site.floors);
        let names = modules.iter().map(|module| &module.name).chain(floors.iter().map(|floor| &floor.name));
        Names { all: names.cloned().collect(), modules: modules.len() }
    }

    /// Where modules and floors are by the site; of a module that is not placed none.
    fn poses(&self) -> impl Iterator<Item = Option<Pose>> {
        let (modules, floors) = (&self.site.modules, &self.site.floors);
        let modules = modules.iter().map(|module| module.placed.then(|| module.pose()));
        modules.chain(floors.iter().map(|floor| Some(floor.corner())))
    }

    /// The module that says where the site's axes are: the first that is placed, as walls, zones and doors lie where they were.
    /// While none is placed it is the first one, at the origin and turned so that the walls it has learned go along the axes.
    fn held(&self) -> Option<Held> {
        if self.site.modules.is_empty() {
            return None;
        }
        let first = || {
            let room = self.rooms.first().and_then(Option::as_ref);
            let yaw_rad = room.map_or(0.0, |room| -room.direction_rad());
            Held { module: 0, pose: Pose { at: Point::default(), yaw_rad } }
        };
        Some(held(&self.site).unwrap_or_else(first))
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
            advice: match self.walk.modules() {
                1 => "one module alone needs no walk: work it out".to_owned(),
                _ => words::advice(&self.advice.with_turned(&self.turned), &names),
            },
            advice_is: Some(ToldAdvice::of(&self.advice.with_turned(&self.turned), &names)),
            place: self.place(),
            sees: sees.into_iter().map(name).collect(),
            crowded_s: self.walk.crowded_s(),
            pairs: self.walk.pairs().into_iter().filter(|pair| pair.1 >= OVERLAP_S).map(pair).collect(),
            found: found.map(|found| self.found(found, &names)),
            refused: refused.map(|refusal| words::refusal(refusal, &names)),
            refused_is: refused.map(|refusal| ToldRefusal::of(refusal, &names)),
        }
    }

    /// Where to go, by the modules' poses from the walk so far; before there are any, by the site's.
    fn place(&self) -> Option<[f64; 2]> {
        let Advice::Together { modules: (one, _), place: Some(place), .. } =
            &self.advice.with_turned(&self.turned)
        else {
            return None;
        };
        let pose = match self.held()?.align(&self.walk.with_turned(&self.turned)) {
            Ok(poses) => *poses.get(*one)?,
            Err(_) => self.poses().nth(*one)??,
        };
        let at = pose.to_site(*place);
        Some([rounded(at.x, 100.0), rounded(at.y, 100.0)])
    }

    fn found(&self, found: &Calibration, names: &Names) -> FoundStatus {
        let held = self.held().map_or(0, |held| held.module);
        let module = |(number, (placed, before)): (usize, (&Placed, Option<Pose>))| {
            let (within_m, within_rad) = placed.bounds();
            ModuleStatus {
                name: names.of(number).to_owned(),
                x: rounded(placed.pose.at.x, 1000.0),
                y: rounded(placed.pose.at.y, 1000.0),
                yaw_deg: rounded(placed.pose.yaw_rad.to_degrees(), 100.0),
                upside_down: self.is_upside_down(number) != placed.hang.turned,
                within_m: rounded(within_m, 1000.0),
                within_deg: rounded(within_rad.to_degrees(), 100.0),
                moved_m: before.map(|before| rounded((placed.pose.at - before.at).length(), 1000.0)),
                residual_m: rounded(placed.residual_m, 1000.0),
                clock_ms: rounded(placed.clock_s * 1e3, 10.0),
                clock_within_ms: (!names.is_floor(number))
                    .then(|| rounded(placed.clock_within_s() * 1e3, 10.0)),
                hang: (number != held && !names.is_floor(number)).then(|| HangStatus {
                    turned: placed.hang.turned,
                    right_m: placed.hang.apart_m.map(|(right_m, _)| rounded(right_m, 1000.0)),
                    wrong_m: placed.hang.apart_m.map(|(_, wrong_m)| rounded(wrong_m, 1000.0)),
                }),
                text: words::placed(placed, (number, held), self.is_upside_down(number), names),
            }
        };
        let placed_views = self.views.iter().zip(&found.modules).zip(&names.all);
        let seers: Vec<Seer> = placed_views
            .filter_map(|((view, placed), name)| {
                let (view, empty_m) = view.as_ref()?;
                let (view, mut empty_m) = (View { pose: placed.pose, ..view.clone() }, empty_m.clone());
                let beams = Beams::new(view.geometry, placed.hang.turned)?;
                beams.order(&mut empty_m);
                let upside_down = view.upside_down != placed.hang.turned;
                Some((name.clone(), View { geometry: *beams.used(), upside_down, ..view }, empty_m))
            })
            .collect();
        FoundStatus {
            quality: words::quality(found),
            quality_is: Quality::of(found),
            modules: found.modules.iter().zip(self.poses()).enumerate().map(module).collect(),
            coverage: coverage(&seers),
        }
    }
}

/// The module of a site that a calibration leaves in its place; None while no module is placed.
fn held(site: &Site) -> Option<Held> {
    let module = site.modules.iter().position(|module| module.placed)?;
    Some(Held { module, pose: site.modules.get(module)?.pose() })
}

/// Whether advice is the same but for the place, which follows the walker.
fn is_same(before: &Advice, next: &Advice) -> bool {
    match (before, next) {
        (Advice::Together { .. }, Advice::Together { .. }) => true,
        _ => before == next,
    }
}
