//! A walked path in few bytes: points such that straight, even motion from each to the next is never more than 3 cm
//! from where the person was at that time.
//!
//! ```text
//!   walked   ·  ·  · ·  ·  ·  ·               kept while every point since the last kept one lies within
//!   kept     ●──────────●╲                    3 cm of the even walk from that one to the newest
//!                         ╲●
//!
//!   bytes    per point: time since the one before, ms · x, y less the one before's, mm · hidden?
//!            all as variable-length integers, signed ones zigzag: 4 to 7 bytes
//! ```
//!
//! Source: N. Meratnia, R. A. de By, "Spatiotemporal compression techniques for moving point objects"
//! (EDBT 2004): opening window with synchronous distance.

/// How far a stored path may be from the walked one at any time, mm.
pub const TOLERANCE_MM: f64 = 30.0;

/// Most points looked at again for one new: a minute of lines. A person who stands for longer gets a point a minute.
const WINDOW: usize = 600;

/// A person's position at a time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Place {
    /// Milliseconds since 1970.
    pub at_ms: u64,
    /// mm.
    pub x_mm: i32,
    /// mm.
    pub y_mm: i32,
    /// Occluded: no module detected the person there; the tracker estimated it.
    pub hidden: bool,
}

impl Place {
    /// mm between this place and where an even walk from `from` to `to` is at the same time.
    fn off_mm(self, from: Self, to: Self) -> f64 {
        let whole_ms = to.at_ms.saturating_sub(from.at_ms).max(1) as f64;
        let share = self.at_ms.saturating_sub(from.at_ms) as f64 / whole_ms;
        let between = |a: i32, b: i32| f64::from(a) + share * (f64::from(b) - f64::from(a));
        let (x_mm, y_mm) = (between(from.x_mm, to.x_mm), between(from.y_mm, to.y_mm));
        libm::hypot(f64::from(self.x_mm) - x_mm, f64::from(self.y_mm) - y_mm)
    }
}

/// A path as it grows.
#[derive(Clone, Debug, Default)]
pub struct Path {
    kept: Vec<Place>,
    /// Since the last kept one, the newest last.
    since: Vec<Place>,
}

impl Path {
    /// One that begins at `first`.
    #[must_use]
    pub fn beginning(first: Place) -> Self {
        Self { kept: vec![first], since: Vec::new() }
    }

    /// Goes on to `place`. A time that does not advance is passed over.
    pub fn add(&mut self, place: Place) {
        let Some(&from) = self.kept.last() else {
            self.kept.push(place);
            return;
        };
        let newest = *self.since.last().unwrap_or(&from);
        if place.at_ms <= newest.at_ms {
            return;
        }
        let turned = place.hidden != newest.hidden || self.since.len() >= WINDOW;
        let strayed = || self.since.iter().any(|between| between.off_mm(from, place) > TOLERANCE_MM);
        if !self.since.is_empty() && (turned || strayed()) {
            self.kept.push(newest);
            self.since.clear();
        }
        self.since.push(place);
    }

    /// Its points, the newest place last.
    pub fn places(&self) -> impl Iterator<Item = Place> {
        self.kept.iter().chain(self.since.last()).copied()
    }

    /// When it begins and when it ends, ms since 1970.
    #[must_use]
    pub fn span_ms(&self) -> (u64, u64) {
        let begun_ms = self.kept.first().map_or(0, |first| first.at_ms);
        (begun_ms, self.last().map_or(begun_ms, |last| last.at_ms))
    }

    /// Where it ends.
    #[must_use]
    pub fn last(&self) -> Option<Place> {
        self.since.last().or(self.kept.last()).copied()
    }
}

/// Bytes of these places.
#[must_use]
pub fn encode(places: impl Iterator<Item = Place>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut before = Place { at_ms: 0, x_mm: 0, y_mm: 0, hidden: false };
    for place in places {
        let flagged_ms = place.at_ms.saturating_sub(before.at_ms) << 1 | u64::from(place.hidden);
        put(&mut bytes, flagged_ms);
        put(&mut bytes, zigzag(i64::from(place.x_mm) - i64::from(before.x_mm)));
        put(&mut bytes, zigzag(i64::from(place.y_mm) - i64::from(before.y_mm)));
        before = place;
    }
    bytes
}

/// The places of these bytes, as far as they can be understood.
#[must_use]
pub fn decode(bytes: &[u8]) -> Vec<Place> {
    let mut rest = bytes.iter();
    let mut places = Vec::new();
    let mut before = Place { at_ms: 0, x_mm: 0, y_mm: 0, hidden: false };
    while let (Some(flagged_ms), Some(x), Some(y)) =
        (read_number(&mut rest), read_number(&mut rest), read_number(&mut rest))
    {
        let moved = |from: i32, by: u64| i32::try_from(i64::from(from).saturating_add(unzigzag(by))).ok();
        let (Some(x_mm), Some(y_mm)) = (moved(before.x_mm, x), moved(before.y_mm, y)) else { break };
        let at_ms = before.at_ms.saturating_add(flagged_ms >> 1);
        before = Place { at_ms, x_mm, y_mm, hidden: flagged_ms & 1 == 1 };
        places.push(before);
    }
    places
}

const fn zigzag(value: i64) -> u64 {
    (value << 1 ^ value >> 63).cast_unsigned()
}

const fn unzigzag(value: u64) -> i64 {
    (value >> 1).cast_signed() ^ -(value & 1).cast_signed()
}

/// Seven bits a byte, the lowest first; the top bit says that more follow.
fn put(bytes: &mut Vec<u8>, mut value: u64) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

fn read_number<'a>(bytes: &mut impl Iterator<Item = &'a u8>) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = *bytes.next()?;
        value |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The place of a stored path at a time.
    fn at(places: &[Place], at_ms: u64) -> (f64, f64) {
        let behind = places.iter().position(|place| place.at_ms >= at_ms).unwrap();
        let (from, to) = (places[behind.saturating_sub(1)], places[behind]);
        let share = (at_ms - from.at_ms) as f64 / (to.at_ms - from.at_ms).max(1) as f64;
        let between = |a: i32, b: i32| f64::from(a) + share * f64::from(b - a);
        (between(from.x_mm, to.x_mm), between(from.y_mm, to.y_mm))
    }

    proptest! {
        #[test]
        fn a_stored_path_is_within_3_cm_of_the_walked_one_at_every_time(
            steps in prop::collection::vec((-150..150_i32, -150..150_i32, 1..40_u64, prop::bool::weighted(0.05)), 1..400)
        ) {
            let mut walked = vec![Place { at_ms: 1_700_000_000_000, x_mm: 0, y_mm: 0, hidden: false }];
            for (dx, dy, hundredths, turn) in steps {
                let from = *walked.last().unwrap();
                walked.push(Place {
                    at_ms: from.at_ms + 10 * hundredths,
                    x_mm: from.x_mm + dx,
                    y_mm: from.y_mm + dy,
                    hidden: from.hidden ^ turn,
                });
            }
            let mut path = Path::beginning(walked[0]);
            walked[1..].iter().for_each(|&place| path.add(place));
            let stored: Vec<Place> = path.places().collect();
            prop_assert_eq!(decode(&encode(stored.iter().copied())), stored.clone());
            prop_assert_eq!(path.span_ms(), (walked[0].at_ms, walked.last().unwrap().at_ms));
            for place in &walked {
                let (x_mm, y_mm) = at(&stored, place.at_ms);
                let off_mm = libm::hypot(x_mm - f64::from(place.x_mm), y_mm - f64::from(place.y_mm));
                prop_assert!(off_mm <= TOLERANCE_MM + 1e-6, "{off_mm} mm at {}", place.at_ms);
            }
        }

        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode(&bytes);
        }
    }

    #[test]
    fn an_even_walk_is_two_points_and_a_turn_one_more() {
        let mut path = Path::default();
        for tenth in 0..100 {
            let (x, y) = if tenth < 50 { (tenth, 0) } else { (50, tenth - 50) };
            path.add(Place {
                at_ms: 1000 + 100 * tenth,
                x_mm: 120 * x as i32,
                y_mm: 120 * y as i32,
                hidden: false,
            });
        }
        let places: Vec<Place> = path.places().collect();
        assert_eq!(places.len(), 3, "{places:?}");
        // The first holds the date, the others less.
        assert!(encode(places.into_iter()).len() < 8 + 2 * 7);
    }
}
