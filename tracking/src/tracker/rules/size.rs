//! How large a person is, by devices that measure more than a plane: it tells people apart, and from what is no person.
//!
//! ```text
//!      ┌─┐ top
//!   ▒▒▒│ │    cost of a detection: how far its top and its volume are from the track's;
//!   ▒▒▒└─┘    the volume of a track is the largest of late, as another person may hide a part
//! ```
//!
//! Source: Ukyo et al. (docs/bibliography.md, D), whose cost this is in other units. The paper also trusts a place less, the
//! smaller the share of the body that is seen: that decided nothing here, and is left out. Deviations are those of segments of
//! a simulated camera: docs/accuracy.md, a depth camera at an entrance.

use super::ablation::{Idea, Ideas};
use crate::observation::{BodySize, Detection};

/// Deviation of a top, m: noise, gait, hair; and of a volume's logarithm: turning, arms.
const TOP_M: f64 = 0.06;
const VOLUME_LN: f64 = 0.7;

/// Most that one of the two adds to a cost, in squared deviations: a head may be hidden, an arm reach out.
const MOST: f64 = 4.0;

/// Scans of which a whole volume is the largest, as a share that is kept from scan to scan: half in 3 s at 5 Hz.
const FORGET: f64 = 0.955;

/// A body of this volume, litres, that is at least so high, m, is a person: a child of 0.9 m shows as much above 0.7 m.
const PERSON_L: f64 = 10.0;
const PERSON_M: f64 = 0.8;

/// What a detection of a person's size says for a birth: two of them, and the first, are enough.
const EVIDENCE: f64 = 2.0;

/// Evidence of the size of a detection for a person; none if it says nothing.
pub fn evidence(seen: &Detection, ideas: Ideas) -> Option<f64> {
    let is_person = |size: &BodySize| size.volume_l >= PERSON_L && size.top_m >= PERSON_M;
    seen.size.filter(|size| is_person(size) && ideas.has(Idea::Size)).map(|_| EVIDENCE)
}

/// What the size of a detection adds to its cost, −ln likelihood; on average nothing to that of the right one.
pub fn cost(own: Option<BodySize>, seen: &Detection, ideas: Ideas) -> f64 {
    let Some((own, seen)) = own.zip(seen.size).filter(|_| ideas.has(Idea::Size)) else { return 0.0 };
    let off = (own.top_m - seen.top_m) / TOP_M;
    let ratio = libm::log((seen.volume_l / own.volume_l.max(1.0)).max(1e-3)) / VOLUME_LN;
    0.5 * ((off * off).min(MOST) + (ratio * ratio).min(MOST)) - 1.0
}

/// The size of a body after a detection: a top is hidden more often than it is too high.
pub fn after(own: Option<BodySize>, seen: Option<BodySize>) -> Option<BodySize> {
    let (Some(own), Some(seen)) = (own, seen) else { return own.or(seen) };
    let gain = if seen.top_m > own.top_m { 0.5 } else { 0.1 };
    Some(BodySize {
        volume_l: (own.volume_l * FORGET).max(seen.volume_l),
        top_m: own.top_m + gain * (seen.top_m - own.top_m),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn size(volume_l: f64, top_m: f64) -> Option<BodySize> {
        Some(BodySize { volume_l, top_m })
    }

    #[test]
    fn a_top_rises_at_once_and_falls_slowly_and_a_volume_is_the_largest_of_late() {
        assert_eq!(after(None, size(50.0, 1.7)), size(50.0, 1.7));
        assert_eq!(after(size(50.0, 1.7), None), size(50.0, 1.7));
        let hidden = after(size(50.0, 1.7), size(10.0, 1.2)).unwrap();
        assert!((hidden.top_m - 1.65).abs() < 1e-9 && (hidden.volume_l - 47.75).abs() < 1e-9);
        let larger = after(size(50.0, 1.7), size(80.0, 1.8)).unwrap();
        assert!((larger.top_m - 1.75).abs() < 1e-9 && larger.volume_l == 80.0);
    }
}
