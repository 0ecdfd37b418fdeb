//! One way to explain all patches so far: which body has set which foot.
//!
//! ```text
//!            ┌─ A has set ◖ ── …        a new patch ◖ makes one hypothesis of each body that could have set it, and one
//!   ◖ ──────┼─ B has set ◖ ── …        of a body that has come; each keeps the sum of its surprises, and the next steps
//!            └─ C has come  ── …        of both bodies tell which was right
//! ```
//!
//! Source: multiple hypothesis tracking, Reid 1979 (docs/bibliography.md).

use super::super::patches::Patch;
use super::BODIES_MAX;
use super::body::Body;
use super::print::Print;
use crate::explanation::{ELDERS_MAX, Explanation};
use crate::geometry::Point;
use crate::tracker::TrackId;

/// Fewer panels that touch a foot and are not its own are its edge, not another foot.
const EDGE: usize = 2;

/// Two new patches nearer than this are the feet of one body, m: nearer than two people walk.
const FEET_M: f64 = 0.65;

/// A body without its own patch shares one that is nearer to it than this, m: two people foot by foot.
const SHARED_M: f64 = 0.5;

/// A running step flies for less, and a walking foot is never alone in the air, s.
const GONE_S: f64 = 0.6;

/// Bodies that come, per m² and reading: on a floor of 4 m² one in a minute.
const COMES: f64 = 0.0005;

/// Parts of the readings in which a body on the floor has no patch of its own, as its feet touch another's or as it is in
/// the air; and of the bodies without one, in which it has left.
const SHARES: f64 = 0.1;
const FLIES: f64 = 0.02;
const LEAVES: f64 = 0.001;

/// The number of a body that has come with this patch.
pub(super) type Number<'a> = &'a mut dyn FnMut(usize) -> TrackId;

/// An explanation.
#[derive(Clone, Debug)]
pub(super) struct Hypothesis {
    pub bodies: Vec<Body>,
    /// Negative logarithm of its likelihood.
    pub surprise: f64,
    /// Time of the last reading, s.
    read_s: f64,
    /// Its number, and those that it grew out of, the newest first.
    line: Vec<u64>,
}

impl Default for Hypothesis {
    fn default() -> Self {
        Self { bodies: Vec::new(), surprise: 0.0, read_s: 0.0, line: vec![0] }
    }
}

/// Of a reading: which patches are new, and which body has set them.
#[derive(Clone)]
struct Steps {
    bodies: Vec<Option<Print>>,
    come: Vec<(usize, Print)>,
    surprise: f64,
}

impl Hypothesis {
    /// What may have happened in a reading: at most `most`, the likeliest.
    pub(super) fn grow(mut self, patches: &[Patch], at_s: f64, most: usize, number: Number<'_>) -> Vec<Self> {
        let new = self.stand(patches, at_s);
        let steps = self.steps(&new, at_s, most);
        let grown = |steps: Steps| {
            let mut next = self.clone();
            next.take(steps, patches, at_s, number);
            next
        };
        steps.into_iter().map(grown).collect()
    }

    /// Feet stay where they are; what they leave of each patch is a foot that has been set.
    fn stand(&mut self, patches: &[Patch], at_s: f64) -> Vec<(usize, Print)> {
        let mut own = vec![<[Vec<Point>; 3]>::default(); self.bodies.len()];
        let mut new = Vec::new();
        for (number, patch) in patches.iter().enumerate() {
            let mut left = Vec::new();
            for panel in &patch.panels {
                let foot = |(index, body): (usize, &Body)| {
                    body.stands_at(*panel, self.read_s).map(|(away_m, foot)| (away_m, index, foot))
                };
                let feet = self.bodies.iter().enumerate().filter_map(foot);
                let nearest = feet.min_by(|one, other| one.0.total_cmp(&other.0));
                let own = nearest.and_then(|(_, index, foot)| own.get_mut(index)?.get_mut(foot));
                own.unwrap_or(&mut left).push(*panel);
            }
            let is_edge = left.len() < EDGE && left.len() < patch.panels.len();
            if let Some(left) = Patch::of(left).filter(|_| !is_edge) {
                new.push((number, Print::of(&Patch { coarse_m: patch.coarse_m, ..left })));
            }
        }
        for (body, own) in self.bodies.iter_mut().zip(&own) {
            body.stand(own, at_s);
        }
        self.read_s = at_s;
        new
    }

    /// Which body may have set which new patch, one a body; the likeliest come first.
    fn steps(&self, new: &[(usize, Print)], at_s: f64, most: usize) -> Vec<Steps> {
        let bodies = vec![None; self.bodies.len()];
        let mut all = vec![Steps { bodies, come: Vec::new(), surprise: self.surprise }];
        for (patch, print) in new {
            let densities: Vec<_> = self.bodies.iter().map(|body| body.steps_to(print, at_s)).collect();
            let mut longer = Vec::new();
            for steps in &all {
                for (number, density) in densities.iter().enumerate() {
                    let has_none = steps.bodies.get(number).is_some_and(Option::is_none);
                    let Some(density) = density.filter(|_| has_none) else { continue };
                    let mut with = steps.clone();
                    with.surprise -= libm::log(density.max(f64::MIN_POSITIVE));
                    if let Some(foot) = with.bodies.get_mut(number) {
                        *foot = Some(*print);
                    }
                    longer.push(with);
                }
                let mut with = steps.clone();
                with.come.push((*patch, *print));
                with.surprise -= libm::log(COMES);
                longer.push(with);
            }
            longer.sort_by(|one, other| one.surprise.total_cmp(&other.surprise));
            longer.truncate(most);
            all = longer;
        }
        all
    }

    fn take(&mut self, steps: Steps, patches: &[Patch], at_s: f64, number: &mut dyn FnMut(usize) -> TrackId) {
        self.surprise = steps.surprise;
        for (body, foot) in self.bodies.iter_mut().zip(steps.bodies) {
            if let Some(foot) = foot {
                body.lands(foot, at_s);
            }
        }
        for body in self.bodies.iter_mut().filter(|body| body.seen_s < at_s) {
            let place = body.place(at_s);
            if patches.iter().any(|patch| (patch.middle - place).length() < SHARED_M) {
                body.seen_s = at_s;
                self.surprise -= libm::log(SHARES);
            } else {
                self.surprise -= libm::log(FLIES);
            }
        }
        let before = self.bodies.len();
        self.bodies.retain(|body| at_s - body.seen_s < GONE_S);
        self.surprise -= (before - self.bodies.len()) as f64 * libm::log(LEAVES);
        self.begin(steps.come, at_s, number);
    }

    /// New bodies: of each patch that no body has set, with a second one beside it.
    fn begin(&mut self, mut come: Vec<(usize, Print)>, at_s: f64, number: Number<'_>) {
        while let Some((patch, first)) = come.pop() {
            if self.bodies.len() >= BODIES_MAX {
                return;
            }
            let away_m = |(_, print): &(usize, Print)| (print.at - first.at).length();
            let away = come.iter().map(away_m).enumerate().filter(|(_, away_m)| *away_m < FEET_M);
            let nearest = away.min_by(|one, other| one.1.total_cmp(&other.1));
            let second = nearest.map(|(index, _)| come.swap_remove(index).1);
            self.bodies.push(Body::new(number(patch), first, second, at_s));
        }
    }

    /// It is another one from here on.
    pub(super) fn branch(&mut self, number: u64) {
        self.line.insert(0, number);
        self.line.truncate(1 + ELDERS_MAX);
    }

    /// As an explanation of who is where at `at_s`.
    pub(super) fn explanation(&self, at_s: f64) -> Explanation {
        let people = self.bodies.iter().map(|body| body.track(at_s)).collect();
        Explanation { line: self.line.clone(), surprise: self.surprise, people }
    }

    /// Both go on alike: the same feet of the same bodies.
    pub(super) fn is_as(&self, other: &Self) -> bool {
        self.bodies.len() == other.bodies.len()
            && self.bodies.iter().zip(&other.bodies).all(|(one, other)| one.is_as(other))
    }
}
