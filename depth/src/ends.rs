//! What ends each bearing when nobody stands in it, and by which pixels that is seen.
//!
//! ```text
//!   ◩━━━━━━━━━━━━━━┃ wall       the pixels that meet it where the upper body of a person would hide it
//!   ◩━━━━━━━━━━━━━━┊ reach      open: the pixels that look through such a body there, and meet nothing before
//!   ◩━━━▞ counter               neither: those behind are not found, and it is not called empty
//! ```
//!
//! The farther one counts. An end is seen while half of its pixels are that show it usually: read that far, or, where nothing ever
//! returned, nothing. What is nearer is in the way, be it above all heads.

use crate::background::{Background, FRAMES};
use crate::bearings::{Bearings, NOT_SEEN};
use crate::camera::Camera;
use crate::foreground::Limits;
use crate::frame::{Frame, is_measured};
use crate::reach::{BODY_M, width_mm};

/// What stands for an open bearing: the sensor's own for a beam from which nothing returned.
pub(crate) const NO_RETURN: u32 = 0;

/// A pixel measured in fewer of the background's frames than this is no wall: stray readings are one in thousands.
const SEEN_MIN: u8 = (FRAMES / 4) as u8;

/// What ends a bearing.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
enum End {
    /// Nothing that is known: it is never empty.
    #[default]
    NotSeen,
    /// A wall at this range, mm, the farthest of its pixels: who stands between a low shelf and the wall is before it.
    Wall(u32),
    /// Nothing up to the reach.
    Open,
}

/// What is known of one bearing.
#[derive(Clone, Copy, Default, Debug)]
struct Bearing {
    end: End,
    /// How many of its sights show its end in [`FRAMES`] frames of the background.
    usual: usize,
}

/// A pixel that shows the end of its bearing, when nothing stands before it.
#[derive(Clone, Copy, Debug)]
struct Sight {
    /// Of the pixel.
    index: usize,
    bearing: usize,
    /// Such a depth or a greater one shows it, mm.
    from_mm: u16,
    /// In how many of [`FRAMES`] frames it is measured; 0: it never returns anything, and that shows the end too.
    seen: u8,
}

/// The ends of all bearings.
#[derive(Clone, Debug)]
pub(crate) struct Ends {
    bearings: Vec<Bearing>,
    sights: Vec<Sight>,
}

impl Ends {
    /// Before this background, when the foreground has these limits.
    pub fn of(bearings: &Bearings, camera: &Camera, background: &Background, limits: &Limits) -> Self {
        let pixels = background.pixels().enumerate();
        let of_pixel = |(index, pixel)| sight(bearings, camera, limits, index, pixel);
        let mut sights: Vec<(Sight, End)> = pixels.filter_map(of_pixel).collect();
        let mut ends = vec![Bearing::default(); bearings.count()];
        for (sight, end) in &sights {
            if let Some(bearing) = ends.get_mut(sight.bearing) {
                bearing.end = bearing.end.or(*end, bearings.reach_mm);
            }
        }
        sights.retain(|(sight, end)| {
            let Some(bearing) = ends.get_mut(sight.bearing) else { return false };
            let is_of_end = (bearing.end == End::Open) == (*end == End::Open);
            bearing.usual += if is_of_end { sight.usual() } else { 0 };
            is_of_end
        });
        Self { bearings: ends, sights: sights.into_iter().map(|(sight, _)| sight).collect() }
    }

    /// The range of each bearing in a frame, mm, where the nearest foreground is at `nearest_mm`.
    pub fn ranges(&self, frame: &Frame, nearest_mm: &[Option<u32>]) -> Vec<u32> {
        let mut shown = vec![0; self.bearings.len()];
        for sight in &self.sights {
            if frame.depth_mm().get(sight.index).is_some_and(|&value_mm| sight.is_shown(value_mm))
                && let Some(shown) = shown.get_mut(sight.bearing)
            {
                *shown += 1;
            }
        }
        let bearings = self.bearings.iter().zip(nearest_mm).zip(shown);
        bearings.map(|((bearing, nearest_mm), shown)| bearing.range_mm(*nearest_mm, shown)).collect()
    }

    /// How many bearings have an end.
    #[cfg(test)]
    pub fn known(&self) -> usize {
        self.bearings.iter().filter(|bearing| bearing.end != End::NotSeen).count()
    }
}

/// What a pixel of the background shows of the end of its bearing; None if nothing.
fn sight(
    bearings: &Bearings,
    camera: &Camera,
    limits: &Limits,
    index: usize,
    (value_mm, seen): (u16, u8),
) -> Option<(Sight, End)> {
    let (column, row) = (index % camera.width, index / camera.width);
    let is_of_body = |height_m: f32| (camera.plane_m()..=camera.plane_m() + BODY_M).contains(&height_m);
    let place = camera.place(column, row, value_mm.max(1));
    let (bearing, range_mm) = bearings.towards(place)?;
    let sight = |end, depth_mm: u16, seen| {
        let from_mm = depth_mm.saturating_sub(limits.nearer_mm);
        Some((Sight { index, bearing, from_mm, seen }, end))
    };
    let is_known = is_measured(value_mm) && seen >= SEEN_MIN;
    // Aside a wall may be farther than the reach and people still found before it.
    let is_within = value_mm <= limits.reach_mm && range_mm <= width_mm(bearings.step_rad());
    if is_known && is_within && is_of_body(place[2]) {
        return sight(End::Wall(range_mm), value_mm, seen);
    }
    let ends_before = is_measured(value_mm) && range_mm < bearings.reach_mm;
    let (height_m, depth_mm) = at(camera, column, row, bearings.reach_mm);
    if ends_before || !is_of_body(height_m) {
        return None;
    }
    sight(End::Open, depth_mm, if is_known { seen } else { 0 })
}

/// Height of the ray through a pixel at a horizontal range, m, and its depth there, mm.
fn at(camera: &Camera, column: usize, row: usize, range_mm: u32) -> (f32, u16) {
    let [x, y, z] = camera.ray(column, row);
    let depth_m = range_mm as f32 * 1e-3 / x.hypot(y).max(f32::MIN_POSITIVE);
    (camera.height_m + depth_m * z, (depth_m * 1000.0) as u16)
}

impl End {
    /// The farther of both: what is open ends at the reach.
    fn or(self, other: Self, reach_mm: u32) -> Self {
        match (self, other) {
            (Self::Wall(one_mm), Self::Wall(other_mm)) => Self::Wall(one_mm.max(other_mm)),
            (Self::Wall(wall_mm), Self::Open) | (Self::Open, Self::Wall(wall_mm)) if wall_mm >= reach_mm => {
                Self::Wall(wall_mm)
            }
            (Self::Open, _) | (_, Self::Open) => Self::Open,
            (Self::NotSeen, other) => other,
            (own, Self::NotSeen) => own,
        }
    }
}

impl Bearing {
    /// `shown`: how many of its sights show its end.
    fn range_mm(&self, nearest_mm: Option<u32>, shown: usize) -> u32 {
        let is_shown = 2 * shown * FRAMES >= self.usual;
        match (self.end, nearest_mm) {
            // A range behind the wall would make the wall recede to it.
            (End::Wall(wall_mm), Some(nearest_mm)) if nearest_mm > wall_mm => NOT_SEEN,
            (_, Some(nearest_mm)) => nearest_mm,
            (End::Wall(wall_mm), None) if is_shown => wall_mm,
            (End::Open, None) if is_shown => NO_RETURN,
            (_, None) => NOT_SEEN,
        }
    }
}

impl Sight {
    /// In how many of [`FRAMES`] frames it shows the end.
    fn usual(&self) -> usize {
        if self.seen == 0 { FRAMES } else { usize::from(self.seen) }
    }

    fn is_shown(&self, value_mm: u16) -> bool {
        if is_measured(value_mm) { value_mm >= self.from_mm } else { self.seen == 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::background::{Learner, still};
    use crate::camera::SMALL;
    use crate::fan::Fan;
    use crate::foreground;
    use crate::golden::{Body, background, render};

    /// The frame with nothing farther than 2.5 m.
    fn near(frame: &Frame) -> Frame {
        let values = frame.depth_mm().iter().map(|value_mm| if *value_mm < 2500 { *value_mm } else { 0 });
        Frame::new(frame.width(), frame.height(), values.collect(), 0).unwrap()
    }

    fn ring_of(frame: &Frame, camera: &Camera, background: &Background) -> Vec<u32> {
        let fan = Fan::new(camera, background, &Limits::USUAL);
        fan.ring(frame, &foreground::of(frame, background, camera, &Limits::USUAL))
    }

    #[test]
    fn an_open_door_returns_nothing_and_a_person_in_it_does() {
        let nothing = still(SMALL.width, vec![0; SMALL.width * SMALL.height]);
        let body = Body { x_m: 2.0, y_m: 0.0, radius_m: 0.2, top_m: 1.7 };
        let ring = ring_of(&near(&render(&SMALL, &[body], 0)), &SMALL, &nothing);
        assert_eq!((ring[0], ring[27], ring[54]), (NO_RETURN, 1801, NO_RETURN));
    }

    #[test]
    fn a_stray_reading_in_an_open_door_is_no_wall() {
        let mut learner = Learner::default();
        let empty = |number: usize| {
            let mut values = vec![0; SMALL.width * SMALL.height];
            for (index, value_mm) in values.iter_mut().enumerate() {
                if index % (4 * FRAMES) == number {
                    *value_mm = 3000 + 60 * (index as u16 % 7);
                }
            }
            values[0] = 1000;
            Frame::new(SMALL.width, SMALL.height, values, 0).unwrap()
        };
        let background = (0..FRAMES).find_map(|number| learner.push(empty(number))).unwrap();
        assert!(ring_of(&empty(0), &SMALL, &background).iter().all(|range_mm| *range_mm == NO_RETURN));
    }

    #[test]
    fn what_hangs_before_the_lens_above_all_heads_hides_what_is_behind() {
        let high = Camera { height_m: 2.6, pitch_deg: 10.0, ..SMALL };
        let free = render(&high, &[], 0);
        // A flag in the right half of the picture, 40 cm away: from 2.3 m up to 2.6 m.
        let mut values = free.depth_mm().to_vec();
        for (index, value_mm) in values.iter_mut().enumerate() {
            if index % high.width >= 40 {
                *value_mm = 400;
            }
        }
        let flag = Frame::new(high.width, high.height, values, 0).unwrap();
        let background = background(&high);
        let ring = ring_of(&flag, &high, &background);
        assert!(ring[..20].iter().all(|range_mm| *range_mm == NOT_SEEN), "{ring:?}");
        assert!(ring[35..].iter().all(|range_mm| *range_mm > 3900), "{ring:?}");
    }

    #[test]
    fn a_person_behind_a_screen_is_neither_at_its_place_nor_is_it_empty() {
        // A screen of 1.5 m 2 m away; over it the head of a person is seen, 3 m away.
        let screen = Body { x_m: 5.0, y_m: 0.0, radius_m: 3.0, top_m: 1.5 };
        let tall = Body { x_m: 3.0, y_m: 0.0, radius_m: 0.2, top_m: 1.95 };
        let mut learner = Learner::default();
        let hall = |number: usize| render(&SMALL, &[screen], number);
        let background = (0..FRAMES).find_map(|number| learner.push(hall(number))).unwrap();
        let ring = |bodies: &[Body]| ring_of(&render(&SMALL, bodies, 0), &SMALL, &background);
        assert!((1990..2010).contains(&ring(&[screen])[27]), "{:?}", ring(&[screen]));
        assert_eq!(ring(&[screen, tall])[27], NOT_SEEN);
    }
}
