//! People who walk to and fro over the border of two areas, each of which sees them a metre beyond its own ground.
//!
//! ```text
//!            2 m    border    2 m
//!   west ─────┤◀──────┼──────▶├───── east        from the border 2 m to the east, back, 2 m to the west, back:
//!     seen by the west ──┤                       each is handed over every 3 s
//!                ├── seen by the east
//! ```

use kehai_tracking::geometry::Point;

use super::world::HALL_M;

/// How far from the border they turn, m.
const TURNS_M: f64 = 2.0;

/// Each area sees so far beyond its border, m: two metres of floor that both see.
const BEYOND_M: f64 = 1.0;

/// How fast they walk.
const WALKS_MPS: f64 = 1.3;

/// Way from the border back to it, in the same direction.
const ROUND_M: f64 = 4.0 * TURNS_M;

/// One of them.
#[derive(Clone, Copy, Debug)]
pub struct Stroller {
    /// The area west of the border.
    pub west: usize,
    /// Its number at this border.
    pub number: usize,
}

/// Where a stroller is, and how it moves.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// m.
    pub at: Point,
    /// m/s, along the row of areas.
    pub vx: f64,
}

impl Stroller {
    /// The way that was walked until then, m. Every one begins elsewhere.
    fn way_m(self, t_s: f64) -> f64 {
        // The golden section spreads any number of them.
        t_s * WALKS_MPS + ROUND_M * (self.number as f64 * 0.618 + self.west as f64 * 0.382).fract()
    }

    /// Where it is.
    #[must_use]
    pub fn place(self, t_s: f64) -> Place {
        let way_m = self.way_m(t_s) % ROUND_M;
        let (off_m, vx) = match way_m {
            _ if way_m < TURNS_M => (way_m, WALKS_MPS),
            _ if way_m < 3.0 * TURNS_M => (2.0 * TURNS_M - way_m, -WALKS_MPS),
            _ => (way_m - ROUND_M, WALKS_MPS),
        };
        let border_m = (self.west + 1) as f64 * HALL_M;
        // Each has a lane, so no two meet.
        Place { at: Point::new(border_m + off_m, (self.number as f64 + 0.5) * HALL_M), vx }
    }

    /// How often it has crossed the border.
    #[must_use]
    pub fn crossings(self, t_s: f64) -> u64 {
        (self.way_m(t_s) / (2.0 * TURNS_M)) as u64
    }

    /// How often the area west of the border, or east of it, has begun to see it; none while it does not.
    #[must_use]
    pub fn visit(self, is_west: bool, t_s: f64) -> Option<u64> {
        // It leaves the view of the west on its way east, that of the east half a round later.
        let leaves_m = if is_west { BEYOND_M } else { 2.0 * TURNS_M + BEYOND_M };
        let hidden_m = 2.0 * (TURNS_M - BEYOND_M);
        let since_m = self.way_m(t_s) + ROUND_M - leaves_m;
        (since_m % ROUND_M >= hidden_m).then_some((since_m / ROUND_M) as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_seen_by_both_areas_near_the_border_and_always_by_one() {
        let stroller = Stroller { west: 2, number: 1 };
        for moment in 0..1000 {
            let t_s = f64::from(moment) * 0.01;
            let off_m = stroller.place(t_s).at.x - 3.0 * HALL_M;
            if (off_m.abs() - BEYOND_M).abs() > 0.02 {
                assert_eq!(stroller.visit(true, t_s).is_some(), off_m < BEYOND_M, "{t_s} {off_m}");
                assert_eq!(stroller.visit(false, t_s).is_some(), off_m > -BEYOND_M, "{t_s} {off_m}");
            }
            assert!(stroller.visit(true, t_s).or(stroller.visit(false, t_s)).is_some());
            assert!(off_m.abs() <= TURNS_M);
        }
    }

    #[test]
    fn each_crossing_is_counted() {
        let stroller = Stroller { west: 0, number: 0 };
        let off_m = |moment: u32| stroller.place(f64::from(moment) * 0.01).at.x - HALL_M;
        let crossed =
            (1..2000).filter(|&moment| off_m(moment - 1).signum() != off_m(moment).signum()).count();
        let counted = stroller.crossings(19.99) - stroller.crossings(0.0);
        assert_eq!(crossed as u64, counted);
        assert_eq!(counted, 6, "26 m, four each");
    }
}
