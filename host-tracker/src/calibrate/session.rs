//! A calibration under way: begun, walked, judged, accepted. The terminal and the map share it.
//!
//! ```text
//!   tracking thread ─ sightings, backgrounds ─▶ Session ◀─ begin · finish · stop ─ terminal or browser
//!                                                  └─────── Status ─────────────▶
//! ```
//!
//! The tracking thread only puts sightings in; the equations are solved by whoever asks.

use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;

use super::advice::{Advice, Guide, OVERLAP_S};
use super::coverage::{Coverage, Seer, coverage};
use super::room::Outline;
use super::walk::Walk;
use super::{Calibration, ENOUGH_S, Refusal, align, calibrate, words};
use crate::geometry::{Point, Pose};
use crate::intake::Intake;
use crate::sighting::{Sighting, View};
use crate::site::Site;

/// Between two looks at backgrounds and advice, s.
const LOOK_S: f64 = 0.5;

/// A handle: clones are the same calibration.
#[derive(Clone, Debug, Default)]
pub struct Session(Arc<Mutex<Inner>>);

#[derive(Debug, Default)]
struct Inner {
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
    /// Whether somebody has begun one.
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
    /// What is seen by whom from there.
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
    pub fn set_site(&self, site: &Arc<Site>) {
        let mut inner = self.lock();
        inner.site = Arc::clone(site);
    }

    /// Takes a sighting. Without a calibration under way it costs a lock.
    pub fn see(&self, sighting: &Sighting) {
        if let Some(active) = &mut self.lock().active
            && active.result.is_none()
        {
            active.walk.see(sighting);
        }
    }

    /// Looks at backgrounds, and where to walk next.
    pub fn tick(&self, intake: &Intake, now_s: f64) {
        let mut inner = self.lock();
        inner.now_s = now_s;
        if std::mem::take(&mut inner.begin) {
            inner.active = Some(Active::new(&inner.site, now_s));
        }
        let Some(active) = inner.active.as_mut().filter(|active| now_s >= active.looked_s + LOOK_S) else {
            return;
        };
        active.looked_s = now_s;
        if active.result.is_some() {
            return;
        }
        for module in intake.modules().values() {
            let (Some(place), Some(geometry)) = (module.place_in_site(), module.geometry()) else { continue };
            let bearing =
                |beam: usize| f64::from(geometry.bearing_rad(u16::try_from(beam).unwrap_or(u16::MAX)));
            let beams = || module.walls_mm().iter().enumerate();
            if let Some(room) = active.rooms.get_mut(place)
                && room.is_none()
                && !module.walls_mm().is_empty()
            {
                *room = Some(Outline::of(beams().map(|(beam, mm)| (bearing(beam), f64::from(*mm) * 1e-3))));
                let empty_m: Vec<f64> = beams().map(|(_, mm)| f64::from(*mm) * 1e-3).collect();
                let height_m = active.site.modules.get(place).map_or(0.0, |module| module.height_m);
                let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
                let view = View { module: place, pose, height_m, geometry: *geometry };
                if let Some(known) = active.views.get_mut(place) {
                    *known = Some((view, empty_m));
                }
            }
        }
        active.advice = active.guide.advise(&active.walk, now_s);
        active.progress = active.guide.progress(&active.walk);
    }

    /// Begins a new one, whatever was.
    pub fn begin(&self) {
        self.lock().begin = true;
    }

    /// Ends it; nothing has changed.
    pub fn stop(&self) {
        let mut inner = self.lock();
        (inner.active, inner.begin) = (None, false);
    }

    /// Works out the poses from what was walked so far; walking on begins where it was, with [`go_on`](Self::go_on).
    pub fn finish(&self) {
        let Some(active) = self.lock().active.clone() else { return };
        let Some(first) = active.site.modules.first().map(crate::site::Module::pose) else { return };
        // Some tenths of a second: not while the tracking thread waits.
        let result = calibrate(&active.walk, first, &active.rooms);
        if let Some(active) = &mut self.lock().active {
            active.result = Some(result);
        }
    }

    /// Goes on walking after a result.
    pub fn go_on(&self) {
        if let Some(active) = &mut self.lock().active {
            active.result = None;
        }
    }

    /// The poses found, by the names of the site's modules.
    #[must_use]
    pub fn poses(&self) -> Option<Vec<(String, Pose)>> {
        let inner = self.lock();
        let active = inner.active.as_ref()?;
        let Some(Ok(found)) = &active.result else { return None };
        let pose =
            |(module, placed): (&crate::site::Module, &super::Placed)| (module.name.clone(), placed.pose);
        Some(active.site.modules.iter().zip(&found.modules).map(pose).collect())
    }

    /// How far it is.
    #[must_use]
    pub fn status(&self) -> Status {
        let (active, now_s) = {
            let inner = self.lock();
            match &inner.active {
                Some(active) => (active.clone(), inner.now_s),
                None => return Status { active: inner.begin, ..Status::default() },
            }
        };
        active.status(now_s)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Active {
    fn new(site: &Arc<Site>, now_s: f64) -> Self {
        let modules = site.modules.len();
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

    fn names(&self) -> Vec<String> {
        self.site.modules.iter().map(|module| module.name.clone()).collect()
    }

    fn status(&self, now_s: f64) -> Status {
        let names = self.names();
        let name = |module: usize| names.get(module).cloned().unwrap_or_default();
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

    /// Where to go, as the walk so far has the modules; before that, as the site has them.
    fn place(&self) -> Option<[f64; 2]> {
        let Advice::Together { modules: (one, _), place: Some(place), .. } = &self.advice else {
            return None;
        };
        let first = self.site.modules.first()?.pose();
        let pose = match align::all(&self.walk, first) {
            Ok(poses) => *poses.get(*one)?,
            Err(_) => self.site.modules.get(*one)?.pose(),
        };
        let at = pose.to_site(*place);
        Some([rounded(at.x, 100.0), rounded(at.y, 100.0)])
    }

    fn found(&self, found: &Calibration, names: &[String]) -> FoundStatus {
        let module = |((placed, module), name): ((&super::Placed, &crate::site::Module), &String)| {
            let (within_m, within_rad) = placed.bounds();
            ModuleStatus {
                name: name.clone(),
                x: rounded(placed.pose.at.x, 1000.0),
                y: rounded(placed.pose.at.y, 1000.0),
                yaw_deg: rounded(placed.pose.yaw_rad.to_degrees(), 100.0),
                within_m: rounded(within_m, 1000.0),
                within_deg: rounded(within_rad.to_degrees(), 100.0),
                moved_m: rounded((placed.pose.at - module.pose().at).length(), 1000.0),
                residual_m: rounded(placed.residual_m, 1000.0),
                clock_ms: rounded(placed.clock_s * 1e3, 10.0),
                text: words::placed(placed, name),
            }
        };
        let placed_views = self.views.iter().zip(&found.modules).zip(names);
        let seers: Vec<Seer> = placed_views
            .filter_map(|((view, placed), name)| {
                let (view, empty_m) = view.as_ref()?;
                Some((name.clone(), View { pose: placed.pose, ..view.clone() }, empty_m.clone()))
            })
            .collect();
        FoundStatus {
            quality: words::quality(found),
            modules: found.modules.iter().zip(&self.site.modules).zip(names).map(module).collect(),
            coverage: coverage(&seers),
        }
    }
}

fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}
