//! A tracker that renders what it believes: the likelihood of a scan, given bodies, decides everything.
//!
//! ```text
//!   bodies ─▶ predict ─▶ rays of the scan ─┬▶ body by body: weigh, resample    twice: coarse, then fine
//!      ▲                                   ├▶ existence: does any place fit?
//!      └──── births ◀── what no body explains
//! ```
//!
//! A body is a cloud of samples and the odds that it is there (`body`); one formula says how likely a ray is, given
//! all bodies (`ray`). While a body is updated, the others enter as averages over their clouds (mean field), one
//! after another (Gauss–Seidel): what one has explained, the next need not explain.

mod aboard;
mod apart;
mod beams;
mod birth;
mod body;
mod cloud;
mod edit;
mod ellipse;
mod exchange;
mod field;
mod ground;
mod life;
mod limb;
mod missing;
mod model;
mod modules;
mod note;
mod notes;
mod openings;
mod packet;
mod put_down;
mod random;
mod ray;
mod restore;
mod sample;
mod scan;
mod split;
mod tow;
mod weigh;
mod window;

use crate::geometry::Point;
use crate::observation::{Detection, Observation};
use crate::site::Site;
use crate::site::change::SiteChange;
use crate::tracker::history::History;
use crate::tracker::reflections::Reflections;
use crate::tracker::{LifeCycle, Origin, TrackId, TrackState, Tracker};
use body::{Body, SURE, UNHEARD_S};
use cloud::Moments;
use ellipse::Edge;
use exchange::{Before, rename};
use field::{Field, render};
use ground::{Passage, Sighting, Terrain};
use missing::Missing;
pub use model::{Detail, Part, RenderingModel, UnknownVariant};
use notes::Notes;
use random::Random;
use sample::{Manner, strayed_m2};
use scan::{Measured, Scan};
use weigh::{Look, Looked};
use window::{Window, window};

/// A scan speaks for a body from this log likelihood ratio on, and against it below its negative.
const SPEAKS: f64 = 0.7;

/// Most that one scan says for existence, and against what may be a limb of another body.
const FOR: f64 = 2.5;

/// Most that one scan says against any other body: the rest may be an error of the model. In 1.2 s all is forgotten.
const AGAINST: f64 = -0.6;

/// Where a body was seen is known if its cloud deviates by less, m: half its width.
const PLACED_M: f64 = 0.3;

/// Deviation of where the middle of a body in view is from where its outline says, m: of adults half the breadth of the
/// shoulders deviates by 2.0 cm and half the depth of the chest by 1.5 cm (0.37–0.50 and 0.20–0.30 m from the 5th to the
/// 95th percentile, DIN 33402-2), and which of them is seen depends on the heading: √(2.0² + 1.5²). It is the same in every
/// scan, so a cloud that takes scans for independent does not contain it.
const SHAPE_M: f64 = 0.025;

/// Most bodies.
pub(crate) const BODIES: usize = 1024;

/// See the module.
pub struct Rendering {
    model: RenderingModel,
    terrain: Terrain,
    bodies: Vec<Body>,
    /// What the bodies put in the way that the newest scan concerns, by their places among all.
    fields: Vec<(usize, Field)>,
    notes: Notes,
    reflections: Reflections,
    missing: Missing,
    next_id: u64,
    /// When the scan began that is being taken, s.
    scan_s: f64,
    random: Random,
    edge: Edge,
}

impl Rendering {
    /// A tracker without tracks.
    #[must_use]
    pub fn new(site: &Site, model: RenderingModel) -> Self {
        Self {
            model,
            terrain: Terrain::of(site),
            bodies: Vec::new(),
            fields: Vec::new(),
            notes: Notes::default(),
            reflections: Reflections::default(),
            missing: Missing::default(),
            next_id: 1,
            scan_s: 0.0,
            random: Random::new(model.seed),
            edge: Edge::of(model.has(Part::SoftEdge)),
        }
    }

    /// Updates the bodies that one scan of a module concerns, and begins new ones.
    fn update(&mut self, module: usize, scan: &Scan, start_s: f64) {
        self.scan_s = start_s;
        let Terrain { modules, plan, .. } = &mut self.terrain;
        let bodies = self.bodies.iter().map(Body::whereabouts);
        let concerned = modules.concern(module, scan, start_s, bodies, &plan.walls);
        let ground = self.terrain.ground(self.model, scan);
        for &index in &concerned {
            let body = &mut self.bodies[index];
            body.hidden = self.model.has(Part::Standing) && body.is_hidden(start_s);
            let way = body.way(ground, start_s);
            if body.is_unseen(start_s) {
                body.cloud.spread(way, &mut self.random);
            }
            let manner = Manner { stands: body.hidden, deepens: self.model.has(Part::Depth) };
            body.cloud.predict(start_s, manner, way, &mut self.random);
        }
        let mut before: Vec<Before> =
            concerned.iter().map(|&index| Before::of(index, &self.bodies[index])).collect();
        let windows: Vec<Option<Window>> =
            concerned.iter().map(|&index| self.window(&self.bodies[index], scan)).collect();
        let rendered = concerned.iter().zip(&windows).map(|(&index, window)| {
            let field = window.as_ref().map(|window| render(&self.bodies[index], scan, window, self.edge));
            (index, field.unwrap_or_default())
        });
        self.fields = rendered.collect();
        let order = self.order(&concerned);
        let mut looked = vec![Looked::default(); concerned.len()];
        let looks =
            if self.model.has(Part::Annealing) { &[Look::Coarse, Look::Fine][..] } else { &[Look::Fine] };
        for &look in looks {
            for &place in &order {
                let (Some(window), index) = (&windows[place], concerned[place]) else { continue };
                let waits = look == Look::Coarse && self.bodies[index].hidden;
                if !looked[place].done && !waits {
                    looked[place] = self.look(index, scan, window, look);
                    if looked[place].changed {
                        self.fields[place].1 = render(&self.bodies[index], scan, window, self.edge);
                    }
                }
            }
        }
        let against: Vec<f64> = concerned.iter().map(|&index| self.against(index)).collect();
        let ground = self.terrain.ground(self.model, scan);
        let mut passing = Vec::new();
        for ((&index, against), Looked { evidence, .. }) in concerned.iter().zip(against).zip(&looked) {
            let body = &mut self.bodies[index];
            body.log_odds += evidence.clamp(against, FOR);
            body.log_odds = body.log_odds.clamp(-SURE, SURE);
            if *evidence >= SPEAKS {
                body.supported_s = body.supported_s.max(start_s);
                let moments = body.cloud.moments();
                // A scan may speak for a part of a wide cloud, whose mean is in the shadow.
                if moments.variance_m2() < PLACED_M * PLACED_M {
                    let Moments { at, velocity, .. } = *moments;
                    body.sighting = ground.sighting(at, velocity);
                    let Sighting { inside, passage, .. } = body.sighting;
                    if body.confirmed && passage == Passage::Through && inside.is_some() {
                        passing.push(at);
                    }
                }
            } else if *evidence < -SPEAKS && self.model.has(Part::Surprise) {
                body.cloud.surprise(body.hidden, body.way(ground, start_s), &mut self.random);
            }
        }
        self.terrain.openings.note(passing, start_s);
        if self.model.has(Part::Names) {
            rename(&mut self.bodies, &mut before);
        }
        self.forget(&concerned, scan, start_s);
        self.begin(scan, start_s);
        self.confirm(start_s);
    }

    /// Most that a scan says against a body.
    fn against(&self, index: usize) -> f64 {
        if self.may_be_limb(index) { -FOR } else { AGAINST }
    }

    /// The beams that a body may concern.
    fn window(&self, body: &Body, scan: &Scan) -> Option<Window> {
        let mut window = window(body, scan, self.model.detail.divisor())?;
        // A scan that arrives after a younger one saw the body where it was.
        window.delay_s -= (body.cloud.at_s() - self.scan_s).max(0.0);
        if !self.model.has(Part::Datum) {
            window.weight = 1.0;
        }
        Some(window)
    }

    /// The places among `of`, of compact and confirmed bodies first: what they explain, the others need not.
    fn order(&self, of: &[usize]) -> Vec<usize> {
        let spread =
            |body: &Body| body.cloud.moments().variance_m2() + if body.confirmed { 0.0 } else { 100.0 };
        let mut order: Vec<(f64, usize)> =
            of.iter().enumerate().map(|(place, &index)| (spread(&self.bodies[index]), place)).collect();
        order.sort_unstable_by(|one, other| one.0.total_cmp(&other.0));
        order.into_iter().map(|(_, place)| place).collect()
    }

    fn state(&self, body: &Body, at_s: f64) -> TrackState {
        let Moments { at, covariance_m2: [xx, xy, yy], velocity } = *body.cloud.moments();
        let seen = body.is_in_view(at_s);
        let origin = self.notes.origin(body.id);
        let ahead_s = if seen { (at_s - body.cloud.at_s()).clamp(0.0, UNHEARD_S) } else { 0.0 };
        let error_m2 = if seen { SHAPE_M * SHAPE_M + strayed_m2(ahead_s) } else { 0.0 };
        TrackState {
            id: body.id,
            at: at + velocity * ahead_s,
            velocity: if seen { velocity } else { Point::default() },
            covariance_m2: [xx + error_m2, xy, yy + error_m2],
            state: match (body.confirmed && origin == Origin::Entered, seen) {
                (false, _) => LifeCycle::Tentative,
                (true, true) => LifeCycle::Confirmed,
                (true, false) => LifeCycle::Occluded,
            },
            existence: body.existence(),
            reason: match origin {
                Origin::PartOf(_) if self.notes.is_aboard(body.id) => {
                    "a side of a vehicle: appeared beside a box"
                }
                Origin::PartOf(_) => "a part of a person: looks like a box and keeps its place",
                Origin::Unexplained => "unexplained: stayed behind, and has not stirred since",
                Origin::Entered if seen => "seen",
                // No scan has spoken for it since it began.
                Origin::Entered if body.supported_s < body.begun_s => {
                    "known before a restart, not seen since"
                }
                Origin::Entered => "not in view",
            },
            origin,
        }
    }
}

impl Tracker for Rendering {
    fn observe(&mut self, observation: &Observation) {
        let view = &observation.view;
        if !self.terrain.modules.has(view.module) {
            return;
        }
        let known = self.terrain.modules.take(view.module).filter(|scan| scan.is_of(view));
        let is_moved = known.is_none();
        let mut scan = known.unwrap_or_else(|| Scan::of(view));
        let plan = &self.terrain.plan;
        let from = plan.walls.seen_from(&view.pose);
        let is_reflection = |seen: &Detection| plan.is_reflection(from, seen);
        scan.measure(observation, |seen: &Detection| {
            if plan.is_mover(seen) {
                Measured::Swept
            } else if is_reflection(seen) {
                Measured::Free
            } else {
                Measured::Hit
            }
        });
        let reflected =
            observation.detections.iter().filter(|seen| !plan.is_mover(seen) && is_reflection(seen));
        self.reflections.follow(reflected, observation.start_s, || {
            self.next_id += 1;
            self.next_id - 1
        });
        if is_moved {
            self.terrain.modules.place(view.module, &scan);
        }
        self.update(view.module, &scan, observation.start_s);
        self.terrain.modules.put(view.module, scan);
        self.notes.update(&self.bodies, observation, &self.terrain.plan.enclosed, self.model);
    }

    fn tracks(&mut self, at_s: f64) -> Vec<TrackState> {
        self.peek(at_s)
    }

    fn history(&self, id: TrackId) -> Option<History> {
        self.notes.history(id)
    }

    fn restore(&mut self, people: &[TrackState], age_s: f64, at_s: f64) {
        self.take_back(people, age_s, at_s);
    }

    fn change_site(&mut self, change: &SiteChange<'_>) -> bool {
        self.edit(change);
        true
    }

    fn peek(&self, at_s: f64) -> Vec<TrackState> {
        let bodies = self.bodies.iter().map(|body| self.state(body, at_s));
        bodies.chain(self.reflections.states(at_s)).collect()
    }
}

#[cfg(test)]
mod exact;
#[cfg(test)]
mod still;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tests_observed;
