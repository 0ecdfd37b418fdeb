//! Which people a segment holds: every point knows whose it is.
//!
//! ```text
//!   points ─▶ clusters ─▶ a segment holds each person of whom it has more points than any other segment
//!                         ├ none, but most of its points are a person's: a part of that person
//!                         └ none, and most are a bag's or flying: no person
//! ```

use std::collections::BTreeMap;

use kehai_depth::camera::Camera;
use kehai_depth::cluster::{Density, clusters};
use kehai_depth::foreground::Point;
use kehai_depth::segment::Segment;

use super::Shot;
use super::image::Whose;

/// A segment with what it shows.
#[derive(Clone, PartialEq, Debug)]
pub struct Labelled {
    /// As a tracker gets it.
    pub segment: Segment,
    /// The people it holds: more than one are merged.
    pub holds: Vec<u16>,
    /// The person of whom it is a part, where it holds none.
    pub part_of: Option<u16>,
}

impl Labelled {
    /// All people of whom it shows something that counts.
    pub fn people(&self) -> impl Iterator<Item = u16> + '_ {
        self.holds.iter().copied().chain(self.part_of)
    }
}

/// The segments of the points above the camera's plane.
#[must_use]
pub fn labelled(points: &[Point], shot: &Shot, camera: &Camera, density: &Density) -> Vec<Labelled> {
    let upper: Vec<Point> =
        points.iter().copied().filter(|point| point.place[2] >= camera.plane_m()).collect();
    let whose = |point: &Point| {
        let ([_, row], _) = camera.pixel(point.place)?;
        shot.whose.get(row.round().max(0.0) as usize * camera.width + point.column).copied()
    };
    let mut all = Vec::new();
    let mut most: BTreeMap<u16, (usize, usize)> = BTreeMap::new();
    for (index, cluster) in clusters(&upper, density).iter().enumerate() {
        let own: Vec<Point> = cluster.iter().filter_map(|&index| upper.get(index).copied()).collect();
        let mut counts: BTreeMap<u16, usize> = BTreeMap::new();
        for point in &own {
            if let Some(Whose::Person(person)) = whose(point) {
                *counts.entry(person).or_default() += 1;
            }
        }
        for (person, count) in &counts {
            // A few pixels of a neighbour's sleeve are no person.
            let best = most.entry(*person).or_default();
            if *count >= density.least && *count > best.0 {
                *best = (*count, index);
            }
        }
        let bodies: usize = counts.values().sum();
        let largest = counts.into_iter().max_by_key(|(_, count)| *count).map(|(person, _)| person);
        let part_of = largest.filter(|_| 2 * bodies >= own.len());
        all.push(Labelled { segment: Segment::of(&own), holds: Vec::new(), part_of });
    }
    for (person, (count, index)) in most {
        if count > 0
            && let Some(labelled) = all.get_mut(index)
        {
            labelled.holds.push(person);
            labelled.part_of = None;
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use kehai_depth::foreground::{self, Limits};

    use super::super::{CAMERA, Entrance, FRAMES};
    use super::*;

    #[test]
    fn a_person_seen_whole_is_held_by_one_segment_that_is_near() {
        let entrance = Entrance::new(1);
        let background = entrance.background().unwrap();
        let low = Camera { above_m: Some(0.6), ..CAMERA };
        let (mut whole, mut held, mut far) = (0, 0, 0);
        for number in (0..FRAMES).step_by(5) {
            let shot = entrance.shot(number).unwrap();
            let points = foreground::of(&shot.frame, &background, &low, &Limits::USUAL);
            let found = labelled(&points, &shot, &low, &Density::USUAL);
            for person in shot.people.iter().filter(|one| one.is_judged && one.share > 0.9) {
                whole += 1;
                let mut own = found.iter().filter(|labelled| labelled.holds.contains(&person.person));
                let Some(labelled) = own.next() else { continue };
                held += 1;
                assert!(own.next().is_none());
                let [x, y] = labelled.segment.centre_m.map(f64::from);
                let off_m = (x - person.at.x).hypot(y - person.at.y);
                far += usize::from(labelled.holds.len() == 1 && off_m > 0.35);
            }
        }
        assert!(whole > 50 && held * 100 >= whole * 97 && far * 20 < held, "{whole} {held} {far}");
    }
}
