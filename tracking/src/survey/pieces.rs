//! Straight pieces of wall in one background.
//!
//! ```text
//!   ends of beams   ·  ·  ·  ·  ·  ·        split where the farthest point is off the straight line by more
//!                                   ·       than the noise of a learned wall, again and again
//!   pieces          ────────────────╮
//!                                   │       a line fitted to each: the axis of least squares
//! ```
//!
//! Iterative end-point fit (Ramer 1972; Nguyen and others 2007 compare it for range finders).

use super::Background;
use crate::geometry::Point;

/// Neighbouring ends are of one surface within this distance, m, or this share of their range: beams 0.36° apart meet a wall
/// on which the module hangs at 2.4°. What is not straight is split anyway.
const TOGETHER_M: f64 = 0.12;
const TOGETHER_SHARE: f64 = 0.15;

/// Farthest that a point of a straight piece is off it, m: three σ of a learned wall, 12 mm.
const OFF_M: f64 = 0.036;

/// Fewest points of a piece, and its least length, m: a leg of a table or a lamp is no wall.
const POINTS: usize = 5;
const LEAST_M: f64 = 0.15;

/// A straight piece: sums over its points, its ends, and the side from which it was seen.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    count: f64,
    sum: Point,
    /// Sums of xx, xy and yy.
    squares: [f64; 3],
    /// Its ends.
    pub from: Point,
    /// See `from`.
    pub to: Point,
    /// The unit vector across it, to the side from which it was seen.
    pub facing: Point,
}

impl Piece {
    /// Through these points, seen from `eye`; none of too few.
    fn of(points: &[Point], eye: Point) -> Option<Self> {
        let (&first, &last) = (points.first()?, points.last()?);
        let mut piece = Self {
            count: 0.0,
            sum: Point::default(),
            squares: [0.0; 3],
            from: first,
            to: last,
            facing: eye - first,
        };
        for point in points {
            piece.count += 1.0;
            piece.sum = piece.sum + *point;
            let [xx, xy, yy] = &mut piece.squares;
            (*xx, *xy, *yy) = (*xx + point.x * point.x, *xy + point.x * point.y, *yy + point.y * point.y);
        }
        piece.lay([first, last]);
        (points.len() >= POINTS && piece.length() >= LEAST_M).then_some(piece)
    }

    /// One wall of two pieces of it.
    pub fn joined(&self, other: &Self) -> Self {
        let squares = [0, 1, 2].map(|index| self.squares[index] + other.squares[index]);
        let (count, sum) = (self.count + other.count, self.sum + other.sum);
        let mut joined = Self { count, sum, squares, ..self.clone() };
        joined.lay([self.from, self.to, other.from, other.to]);
        joined
    }

    /// Fits the line to the sums, and puts the ends where the outermost of `ends` are beside it.
    fn lay<const N: usize>(&mut self, ends: [Point; N]) {
        let middle = self.middle();
        let [xx, xy, yy] = self.squares.map(|sum| sum / self.count);
        let (xx, xy, yy) = (xx - middle.x * middle.x, xy - middle.x * middle.y, yy - middle.y * middle.y);
        let along = Point::towards(0.5 * libm::atan2(2.0 * xy, xx - yy));
        let across = along.left();
        self.facing = if across.dot(self.facing) < 0.0 { across * -1.0 } else { across };
        let shares = ends.map(|end| (end - middle).dot(along));
        let (low, high) = shares
            .into_iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
        (self.from, self.to) = (middle + along * low, middle + along * high);
    }

    fn middle(&self) -> Point {
        self.sum * (1.0 / self.count)
    }

    /// The unit vector from one end to the other.
    pub fn along(&self) -> Point {
        let way = self.to - self.from;
        way * (1.0 / way.length().max(1e-9))
    }

    /// How long it is, m.
    pub fn length(&self) -> f64 {
        (self.to - self.from).length()
    }

    /// How far a place is off its line, m.
    pub fn off(&self, place: Point) -> f64 {
        (place - self.from).dot(self.facing).abs()
    }

    /// How long the gap is between it and another, along it, m; negative where they lie beside each other.
    pub fn gap(&self, other: &Self) -> f64 {
        let at = |place: Point| (place - self.from).dot(self.along());
        let (one, two) = (at(other.from), at(other.to));
        (one.min(two) - self.length()).max(-one.max(two))
    }

    /// The ends of the gap between it and another: the nearest two.
    pub fn between(&self, other: &Self) -> (Point, Point) {
        let pairs =
            [self.from, self.to].into_iter().flat_map(|own| [other.from, other.to].map(|its| (own, its)));
        pairs
            .min_by(|one, two| (one.1 - one.0).length().total_cmp(&(two.1 - two.0).length()))
            .unwrap_or((self.to, other.from))
    }
}

/// The straight pieces that a module has learned, in the site.
pub(super) fn pieces(background: &Background) -> Vec<Piece> {
    let view = &background.view;
    let (forward, eye) = (view.forward(), view.pose.at);
    let mut runs: Vec<Vec<Point>> = vec![Vec::new()];
    let mut last: Option<(Point, f64)> = None;
    for (beam, &range_mm) in (0_u16..).zip(background.walls_mm.iter()) {
        let range_m = f64::from(range_mm) * 1e-3;
        let at = view.place_ahead(forward, f64::from(view.geometry.bearing_rad(beam)), range_m);
        let is_near = last.is_some_and(|(last, last_m)| {
            (at - last).length() < TOGETHER_M.max(TOGETHER_SHARE * last_m.min(range_m))
        });
        if !is_near {
            runs.push(Vec::new());
        }
        last = (range_mm > 0).then_some((at, range_m));
        if let (Some(run), Some(_)) = (runs.last_mut(), last) {
            run.push(at);
        }
    }
    let mut found = Vec::new();
    let mut open: Vec<&[Point]> = runs.iter().rev().map(Vec::as_slice).collect();
    while let Some(run) = open.pop() {
        match corner(run) {
            Some(corner) => {
                open.push(&run[corner..]);
                open.push(&run[..=corner]);
            }
            None => found.extend(Piece::of(run, eye)),
        }
    }
    found
}

/// The point of a run that is farthest off the line between its ends, if that is farther than a wall's points are; never an
/// end.
fn corner(run: &[Point]) -> Option<usize> {
    let (first, last) = (*run.first()?, *run.last()?);
    let way = last - first;
    let across = way.left() * (1.0 / way.length().max(1e-9));
    let inner = run.iter().enumerate().skip(1).take(run.len().saturating_sub(2));
    let off = inner.map(|(index, point)| (index, (*point - first).dot(across).abs()));
    let (index, off_m) = off.max_by(|one, other| one.1.total_cmp(&other.1))?;
    (off_m > OFF_M).then_some(index)
}
