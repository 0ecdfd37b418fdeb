//! What one sample puts in the way of a scan's beams: its torso, and the arm that it stretches out.
//!
//! ```text
//!        ╭───╮
//!   ●╌╌╌╌│╌╌╌│╌╌╌     a torso alone
//!    ╲╌╌╌╌▬▬▬│╌╌╌     an arm, and the torso behind it
//!     ╲╌╌▬▬▬▬╌╌╌╌     an arm alone
//! ```

use std::ops::Range;

use super::ellipse::Opacity;
use super::sample::Sample;
use super::scan::Scan;
use super::window::Window;

/// A surface before one beam.
#[derive(Clone, Copy, Debug)]
pub struct Layer {
    pub opacity: f64,
    pub range_m: f32,
}

/// What is met by one beam, nearest first.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    pub near: Layer,
    pub far: Option<Layer>,
}

/// Room for the beams that meet an arm, kept from sample to sample.
#[derive(Default)]
pub struct Arms(Vec<(usize, Layer)>);

/// Calls `each` for those beams of a window, of some, that a sample does not let pass, counted from the window's first.
pub fn meet(
    sample: &Sample,
    (scan, window, of): (&Scan, &Window, &Range<usize>),
    opacity: Opacity,
    Arms(arms): &mut Arms,
    mut each: impl FnMut(usize, Met),
) {
    let (origin, moved) = (scan.origin(), sample.velocity * window.delay_s);
    arms.clear();
    if let Some(arm) = sample.outline_of_arm() {
        let ellipse = arm.before(origin, moved);
        ellipse.meet(&window.fan, window.covered(&arm, scan, of), opacity, |place, opacity, range_m| {
            arms.push((place, Layer { opacity, range_m }));
        });
    }
    let torso = sample.torso();
    let ellipse = torso.before(origin, moved);
    ellipse.meet(&window.fan, window.covered(&torso, scan, of), opacity, |place, opacity, range_m| {
        let own = Layer { opacity, range_m };
        let met = match arms.iter().position(|(other, _)| *other == place) {
            None => Met { near: own, far: None },
            Some(index) => {
                let (_, arm) = arms.swap_remove(index);
                let (near, far) = if arm.range_m < own.range_m { (arm, own) } else { (own, arm) };
                Met { near, far: Some(far) }
            }
        };
        each(place, met);
    });
    for &(place, near) in arms.iter() {
        each(place, Met { near, far: None });
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ::kehai::scan::{Geometry, URG_04LX};

    use super::super::body::Body;
    use super::super::cloud::Cloud;
    use super::super::sample::Arm;
    use super::super::window::window;
    use super::*;
    use crate::geometry::{Point, Pose};
    use crate::observation::View;

    #[test]
    fn an_arm_before_the_torso_is_met_first_and_one_beside_it_alone() {
        let geometry = Geometry::new(URG_04LX).unwrap();
        let pose = Pose { at: Point::default(), yaw_rad: 0.0 };
        let scan = Scan::of(&Arc::new(View { module: 0, pose, height_m: 1.0, geometry, upside_down: false }));
        // Two metres ahead, it looks at the module and reaches towards it and to one side.
        let (at, heading) = (Point::new(2.0, 0.0), Point::new(-1.0, 0.0));
        let arm = Some(Arm { hand: Point::new(0.4, 0.4), is_level: true });
        let sample = Sample { at, velocity: Point::default(), heading, size: 1.0, depth: 1.0, arm };
        let window = window(&Body::begin(1, 0.0, Cloud::new(vec![sample], 0.0)), &scan, 1).unwrap();
        let (mut both, mut alone) = (0, 0);
        meet(
            &sample,
            (&scan, &window, &(0..window.len())),
            Opacity::of(true),
            &mut Arms::default(),
            |_, met| match met.far {
                Some(far) => {
                    assert!(met.near.range_m <= far.range_m, "{met:?}");
                    both += 1;
                }
                None => alone += i32::from(met.near.range_m < 1.8),
            },
        );
        assert!(both > 0 && alone > 0, "{both} before the torso, {alone} beside it");
    }
}
