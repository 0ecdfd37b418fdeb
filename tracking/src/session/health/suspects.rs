//! Shapes of people in a module's background: where they are, and which of them are furniture.
//!
//! ```text
//!    first_step  last_step
//!         ╲  ╭─╮  ╱         bearing: of the middle step, degrees from the front to the left
//!          ╲ ╰─╯ ╱          range: to the nearest point, m
//!           ╲ │ ╱
//!            ╲│╱            both in the sensor's own sense: a module that hangs head down has its left on its right
//!             ● sensor
//! ```
//!
//! Nothing in a scan tells a chair from a person who stood still while the module learned: a person has to say so, once. What was
//! said is kept in the site ([`Module::furniture`](crate::site::Module::furniture)) and holds for the next background, too, as long
//! as the module stays where it is.

use kehai::background::{SUSPECTS, Suspect};
use kehai::scan::Geometry;

/// What a module's health lists.
pub(super) type Suspects = heapless::Vec<Suspect, SUSPECTS>;

/// How far apart a shape and what was said of it may be, m: a person's radius. Learned anew, the middle of a shape moves by a beam or
/// two, and a person who stands as near is in front of the furniture, and would be another shape.
const SAME_M: f64 = 0.25;

/// What is known to be furniture in the background of a module: bearing, degrees, and range, m.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Furniture(pub(super) Vec<[f64; 2]>);

impl Furniture {
    /// Whether what is there is known.
    pub(super) fn has(&self, place: [f64; 2]) -> bool {
        self.0.iter().any(|known| apart_m(*known, place) < SAME_M)
    }
}

/// Where a shape is: bearing, degrees, and range, m.
pub(super) fn place(suspect: &Suspect, geometry: &Geometry) -> [f64; 2] {
    let (first, last) = (geometry.beam(suspect.first_step), geometry.beam(suspect.last_step));
    let bearing_rad = geometry.bearing_rad(first + last.saturating_sub(first) / 2);
    let tenth = |degrees: f64| (degrees * 10.0).round() / 10.0;
    [tenth(f64::from(bearing_rad).to_degrees()), f64::from(suspect.near_mm) * 1e-3]
}

/// How far two places are from each other: the law of cosines.
fn apart_m([bearing_deg, range_m]: [f64; 2], [other_deg, other_m]: [f64; 2]) -> f64 {
    let between = libm::cos((bearing_deg - other_deg).to_radians());
    libm::sqrt((range_m * range_m + other_m * other_m - 2.0 * range_m * other_m * between).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_said_of_a_shape_holds_for_one_as_near_as_a_radius_and_no_other() {
        let furniture = Furniture(vec![[90.0, 2.0], [-30.0, 1.0]]);
        assert!(furniture.has([90.0, 2.0]) && furniture.has([-30.0, 1.0]));
        assert!(furniture.has([90.0, 2.24]) && furniture.has([86.0, 2.1]));
        assert!(!furniture.has([90.0, 2.26]), "behind it");
        assert!(!furniture.has([82.0, 2.0]), "28 cm beside it");
        assert!(!furniture.has([-90.0, 2.0]), "on the other side");
        assert!(!Furniture::default().has([90.0, 2.0]));
    }

    #[test]
    fn a_shape_is_where_its_middle_beam_points() {
        let geometry = Geometry::new(kehai::scan::GeometryParts {
            steps_per_turn: 1024,
            first_step: 44,
            last_step: 725,
            front_step: 384,
            cluster: 1,
            period_us: 100_000,
            range_min_mm: 20,
            range_max_mm: 5600,
        })
        .unwrap();
        let suspect = |first_step, last_step| Suspect { first_step, last_step, near_mm: 2420 };
        assert_eq!(place(&suspect(374, 394), &geometry), [0.0, 2.42]);
        assert_eq!(place(&suspect(630, 650), &geometry), [90.0, 2.42], "a quarter of a turn to the left");
        assert_eq!(place(&suspect(118, 138), &geometry), [-90.0, 2.42]);
        let odd = place(&suspect(700, 60_000), &geometry);
        assert!(odd.iter().all(|number| number.is_finite()), "no step of the sensor: {odd:?}");
    }
}
