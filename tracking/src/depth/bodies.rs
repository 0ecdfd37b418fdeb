//! The tracks, and what a frame says of each.

use nalgebra::{Matrix2, Vector2};

use super::seen::{Seen, Sight};
use crate::assignment::{Alone, assign};
use crate::geometry::Point;
use crate::tracker::TrackId;
use crate::tracker::kalman::Kinematics;

/// Deviation of a segment's middle from the body's when all of it is seen, m: it is that of its front.
const WHOLE_M: f64 = 0.06;

/// By so much more when nothing of it is seen, m: half a body's width.
const PART_M: f64 = 0.25;

/// Deviation of a segment that several share from where their middle was expected, m.
const SHARED_M: f64 = 0.15;

/// Deviation of a top, m: a row of pixels and the noise at 4 m, and gait; and of a volume's logarithm: half or twice as much
/// is usual, by turning, arms and a person who stands before it.
const TOP_M: f64 = 0.04;
const VOLUME_LN: f64 = 0.7;

/// Most that one of the two sizes adds to a cost, three deviations: a head may be hidden, an arm reach out.
const SIZE_MOST: f64 = 9.0;

/// Cost of a track without a segment: 99.9 % of the right segments are nearer, with the sizes' usual part.
const ALONE: f64 = 13.8 + 2.0;

/// A segment within this of a body's place may hold it, m.
const INSIDE_M: f64 = 0.25;

/// What is nearer to a body than the first, m, and smaller than the second share of its volume, is a part of it: what
/// another person's shoulder leaves of a chest; a hand at arm's length, and what it carries. A child of 0.9 m who walks beside
/// an adult shows a tenth of the adult's volume above 0.7 m.
const PARTS: [(f64, f64); 2] = [(0.35, 0.5), (0.65, 0.05)];

/// A body stays hidden for so long, s: behind a person who walks the same way; without anything before it, for one frame
/// of five a second.
const OCCLUDED_S: f64 = 3.0;
const UNSEEN_S: f64 = 0.3;

/// Frames of which a body's whole volume is the largest, as a share that is kept from frame to frame: half in 3 s.
const FORGET: f64 = 0.955;

/// Speed of a body that has just come, m/s, one sigma along each axis: 1 m/s one way or the other; spectral density
/// of a walker's acceleration, m²/s³.
const SPEED_MPS: f64 = 0.7;
const PROCESS_NOISE: f64 = 0.5;

/// Most bodies: what stands side by side in a camera's view.
const BODIES_MAX: usize = 32;

/// Which ideas are used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Ideas {
    /// Top and volume are a part of the cost.
    pub has_size: bool,
    /// The measurement's covariance follows the share that is seen.
    pub has_gain: bool,
}

/// Where a track is in a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Where {
    /// In this segment, alone.
    Own(usize),
    /// In this segment, with others.
    Shared(usize),
    /// In none.
    Unseen,
}

/// A track.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Followed {
    /// Never used for another.
    pub id: TrackId,
    /// m
    pub at: Point,
    /// What the last frame says of it.
    pub is: Where,
}

#[derive(Clone, Debug)]
struct Body {
    id: TrackId,
    motion: Kinematics,
    top_m: f64,
    /// Volume when all of it is seen, litres.
    whole_l: f64,
    seen_s: f64,
    is: Where,
}

/// The people before a depth camera.
#[derive(Clone, Debug)]
pub struct Bodies {
    ideas: Ideas,
    sight: Sight,
    bodies: Vec<Body>,
    newest: TrackId,
}

impl Bodies {
    /// Without tracks yet.
    #[must_use]
    pub const fn new(ideas: Ideas, sight: Sight) -> Self {
        Self { ideas, sight, bodies: Vec::new(), newest: 0 }
    }

    /// Takes the segments of a frame at `at_s`; frames come in the order of time.
    pub fn observe(&mut self, seen: &[Seen], at_s: f64) {
        self.bodies.iter_mut().for_each(|body| body.motion.predict(at_s));
        let own = assign(self.bodies.len(), seen.len(), &Alone::all(ALONE), |row, column| {
            self.cost(self.bodies.get(row)?, seen.get(column)?, at_s)
        });
        for (body, own) in self.bodies.iter_mut().zip(&own) {
            body.is = own.map_or(Where::Unseen, Where::Own);
        }
        self.share(seen);
        self.unite();
        self.update(seen, at_s);
        let sight = self.sight;
        self.bodies.retain(|body| body.stays(seen, &sight, at_s));
        self.begin(seen, at_s);
    }

    /// All tracks after the last frame.
    #[must_use]
    pub fn followed(&self) -> Vec<Followed> {
        let followed =
            |body: &Body| Followed { id: body.id, at: body.motion.place(body.motion.at_s), is: body.is };
        self.bodies.iter().map(followed).collect()
    }

    /// −2 ln likelihood of a segment, given the body.
    fn cost(&self, body: &Body, seen: &Seen, at_s: f64) -> Option<f64> {
        let noise = round(WHOLE_M + 0.5 * PART_M);
        let (square, determinant) = body.motion.distance(at_s, Vector2::new(seen.at.x, seen.at.y), &noise);
        let mut cost = square + determinant - libm::log(noise.determinant());
        if square > 13.8 {
            return None;
        }
        if self.ideas.has_size {
            // The upper edge of the image cuts those who are near.
            let edge_m = self.sight.lens_m + self.sight.up * seen.at.x;
            let off_m = body.top_m.min(edge_m) - seen.top_m.min(edge_m);
            let ratio = libm::log(seen.volume_l.max(0.1) / body.whole_l.max(0.1));
            cost += (off_m / TOP_M).powi(2).min(SIZE_MOST) + (ratio / VOLUME_LN).powi(2).min(SIZE_MOST);
        }
        Some(cost)
    }

    /// Looks for bodies without a segment in those of others.
    fn share(&mut self, seen: &[Seen]) {
        for index in 0..self.bodies.len() {
            let Some(body) = self.bodies.get(index) else { continue };
            if body.is != Where::Unseen {
                continue;
            }
            let place = body.motion.place(body.motion.at_s);
            let off = |segment: usize| seen.get(segment).map_or(f64::INFINITY, |seen| seen.off_m(place));
            let taken = self.bodies.iter().filter_map(|other| match other.is {
                Where::Own(segment) | Where::Shared(segment) => Some(segment),
                Where::Unseen => None,
            });
            let near = taken.filter(|segment| off(*segment) < INSIDE_M);
            let Some(segment) = near.min_by(|one, other| off(*one).total_cmp(&off(*other))) else { continue };
            // A segment as small as its owner alone hides a person behind it, and does not show that person.
            let owner = self.bodies.iter().find(|other| other.is == Where::Own(segment));
            let is_large =
                |owner: &Body| seen.get(segment).is_some_and(|seen| seen.volume_l > 1.3 * owner.whole_l);
            if owner.is_none_or(is_large) {
                for other in &mut self.bodies {
                    if other.is == Where::Own(segment) {
                        other.is = Where::Shared(segment);
                    }
                }
                if let Some(body) = self.bodies.get_mut(index) {
                    body.is = Where::Shared(segment);
                }
            }
        }
    }

    /// Ends tracks that were parts: what shares a segment with a body and has never been more than an arm.
    fn unite(&mut self) {
        let [_, (_, arm)] = PARTS;
        let shared: Vec<(Where, f64)> = self.bodies.iter().map(|body| (body.is, body.whole_l)).collect();
        self.bodies.retain(|body| {
            let is_larger = |(is, whole_l): &(Where, f64)| *is == body.is && body.whole_l < arm * whole_l;
            !matches!(body.is, Where::Shared(_)) || !shared.iter().any(is_larger)
        });
    }

    fn update(&mut self, seen: &[Seen], at_s: f64) {
        let expected: Vec<Point> = (0..seen.len())
            .map(|segment| {
                let sharing = self.bodies.iter().filter(|body| body.is == Where::Shared(segment));
                let (sum, count) = sharing.fold((Point::default(), 0.0), |(sum, count), body| {
                    (sum + body.motion.place(at_s), count + 1.0)
                });
                sum * (1.0 / f64::max(count, 1.0))
            })
            .collect();
        for body in &mut self.bodies {
            match body.is {
                Where::Own(segment) => {
                    let Some(seen) = seen.get(segment) else { continue };
                    body.whole_l = (body.whole_l * FORGET).max(seen.volume_l);
                    let share = if self.ideas.has_gain { seen.volume_l / body.whole_l.max(0.1) } else { 1.0 };
                    let noise = round(WHOLE_M + PART_M * (1.0 - share));
                    body.motion.update(at_s, Vector2::new(seen.at.x, seen.at.y), &noise);
                    // A top is hidden more often than it is too high.
                    let gain = if seen.top_m > body.top_m { 0.5 } else { 0.1 };
                    body.top_m += gain * (seen.top_m - body.top_m);
                    body.seen_s = at_s;
                }
                Where::Shared(segment) => {
                    let Some((seen, expected)) = seen.get(segment).zip(expected.get(segment)) else {
                        continue;
                    };
                    let place = seen.nearest(body.motion.place(at_s) + (seen.at - *expected));
                    body.motion.update(at_s, Vector2::new(place.x, place.y), &round(SHARED_M));
                    body.seen_s = at_s;
                }
                Where::Unseen => {}
            }
        }
    }

    /// Begins tracks on segments that no body has and that are part of none.
    fn begin(&mut self, seen: &[Seen], at_s: f64) {
        for (segment, one) in seen.iter().enumerate() {
            let is_taken = |body: &Body| body.is == Where::Own(segment) || body.is == Where::Shared(segment);
            let is_part = |body: &Body| {
                let place = body.motion.place(at_s);
                let is_within = |(within_m, share): (f64, f64)| {
                    (place - one.at).length() < within_m && one.volume_l < share * body.whole_l
                };
                body.is != Where::Unseen && PARTS.into_iter().any(is_within)
            };
            if self.bodies.iter().any(|body| is_taken(body) || is_part(body))
                || self.bodies.len() >= BODIES_MAX
            {
                continue;
            }
            self.newest += 1;
            let place = Vector2::new(one.at.x, one.at.y);
            self.bodies.push(Body {
                id: self.newest,
                motion: Kinematics::new(
                    at_s,
                    place,
                    &round(WHOLE_M + 0.5 * PART_M),
                    SPEED_MPS,
                    PROCESS_NOISE,
                ),
                top_m: one.top_m,
                whole_l: one.volume_l,
                seen_s: at_s,
                is: Where::Own(segment),
            });
        }
    }
}

impl Body {
    /// Whether it is kept: seen, or hidden for a while.
    fn stays(&self, seen: &[Seen], sight: &Sight, at_s: f64) -> bool {
        let place = self.motion.place(at_s);
        let is_outside = place.x <= 0.0 || place.y.abs() > sight.aside * place.x;
        let is_occluded = seen.iter().any(|seen| seen.hides(place));
        let most_s = if is_occluded && !is_outside { OCCLUDED_S } else { UNSEEN_S };
        at_s - self.seen_s < most_s
    }
}

fn round(deviation_m: f64) -> Matrix2<f64> {
    Matrix2::identity() * (deviation_m * deviation_m)
}
