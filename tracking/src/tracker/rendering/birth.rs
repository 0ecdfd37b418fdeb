//! Births: foreground that no body explains begins a tentative one.
//!
//! ```text
//!   beams   · · ▓ ▓ ▓ ▓ ▓ · ·      a run of hits of which clutter explains more than all bodies,
//!                ╰─┬─╯             as long as half a torso is deep
//!                  ◌ cloud behind the contour
//! ```

use super::body::Body;
use super::cloud::{BEHIND_M, Cloud, SAMPLES, behind};
use super::field::Field;
use super::ray::{Mixture, Surface};
use super::sample::Sample;
use super::scan::{Measured, Scan};
use super::{BODIES, Rendering};
use crate::geometry::Point;

/// Fewest beams, and least arc, of a run that begins a body, m.
const BEAMS: usize = 3;
const ARC_M: f64 = 0.09;

/// No other tentative body is nearer, m.
const APART_M: f64 = 0.3;

/// Two beams of one run differ by less, m: half a body's depth and an arm.
const STEP_M: f64 = 0.2;

/// Deviation of a new body's velocity, m/s: a slow walk.
const SPEED_MPS: f64 = 0.6;

/// What begins nearer to an entry than this may have come in unseen, m: a stride, and half of a body's depth.
const STRIDE_M: f64 = 0.35;

/// Existence of a new body outside enclosed zones, and inside, where no person begins: log odds of 0.1 and of 0.003. Where a person is
/// missing the odds are the probability of that: it is one half where that is sure.
const OUTSIDE: f64 = -2.197;
const INSIDE: f64 = -5.806;

/// Whether a body began where no person begins, and none was missing.
pub fn began_inside(body: &Body) -> bool {
    body.prior <= INSIDE
}

impl Rendering {
    /// Begins bodies where hits are not explained.
    pub(super) fn begin(&mut self, scan: &Scan, start_s: f64) {
        let fields: Vec<&Field> =
            self.fields.iter().map(|(_, field)| field).filter(|field| !field.is_empty()).collect();
        let mut surfaces: Vec<Surface> = Vec::new();
        let mut run: Vec<Point> = Vec::new();
        let mut runs: Vec<Vec<Point>> = Vec::new();
        let mut last_m = 0.0;
        for beam in 0..scan.beams() {
            let measured = scan.measured(beam);
            let unexplained = match measured {
                Measured::Hit(range_m) => {
                    let met = || fields.iter().filter_map(|field| field.at(beam));
                    // Most hits lie on a known body.
                    let held = met().any(|surface| surface.holds(range_m));
                    surfaces.clear();
                    surfaces.extend(met().copied().take_while(|_| !held));
                    (!held && Mixture::new(measured, &mut surfaces).is_clutter()).then_some(range_m)
                }
                _ => None,
            };
            match unexplained {
                Some(range_m) => {
                    if !run.is_empty() && (range_m - last_m).abs() > STEP_M {
                        runs.push(std::mem::take(&mut run));
                    }
                    run.push(scan.origin() + scan.towards(beam) * range_m);
                    last_m = range_m;
                }
                None if !run.is_empty() => runs.push(std::mem::take(&mut run)),
                None => {}
            }
        }
        runs.push(run);
        for run in runs {
            let (Some(first), Some(last)) = (run.first(), run.last()) else { continue };
            if run.len() >= BEAMS && (*last - *first).length() >= ARC_M {
                self.begin_at(run[run.len() / 2], scan.origin(), start_s);
            }
        }
    }

    /// Begins a body behind a place of a contour, unless a tentative one is near.
    fn begin_at(&mut self, contour: Point, origin: Point, start_s: f64) {
        let way = contour - origin;
        let way = way * (1.0 / way.length().max(1e-6));
        let middle = contour + way * (0.5 * (BEHIND_M.0 + BEHIND_M.1));
        let near = |body: &Body| !body.confirmed && (body.cloud.moments().at - middle).length() < APART_M;
        let plan = &self.terrain.plan;
        if plan.excluded.hold(middle)
            || plan.movers.hold(contour)
            || self.bodies.len() >= BODIES
            || self.bodies.iter().any(near)
        {
            return;
        }
        let random = &mut self.random;
        let sample = |_| {
            let at = behind(contour, origin, random);
            let (x, y) = random.pair();
            let heading = random.uniform() * core::f64::consts::TAU;
            Sample::new(at, Point::new(x, y) * SPEED_MPS, Point::towards(heading))
        };
        let samples: Vec<Sample> = (0..SAMPLES / self.model.detail.divisor()).map(sample).collect();
        let is_inside = plan.enclosed.hold(middle) && plan.walls.entry_m(middle) > STRIDE_M;
        let prior = match is_inside {
            false => OUTSIDE,
            true => libm::log(self.missing.chance_at(middle, start_s)).max(INSIDE),
        };
        let id = self.next_id;
        self.next_id += 1;
        self.bodies.push(Body::begin(id, prior, Cloud::new(samples, start_s)));
    }
}
