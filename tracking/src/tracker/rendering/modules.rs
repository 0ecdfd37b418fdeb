//! The modules of a site, each with its newest rays: which of them a scan of one, and a body, may concern.
//!
//! ```text
//!     ╭───────╮                 ○ newest: asked are A, whose circle of view touches its own, and itself
//!     │ A ╭───┼───╮   ╭─────╮
//!     ╰───┼───╯ ○ │   │  B  │     · a body in the circle is concerned, unless a wall of the site hides all of it
//!         │  ·    │   ╰─────╯
//!         ╰───────╯             a body that no scan has concerned for half a second is updated by the next scan of any
//!                                       module, and asked are those, too, whose views it may be in
//! ```
//!
//! So the cost of a report does not grow with the site, nor the cost of a second with the reports that are lost.

use super::scan::Scan;
use crate::geometry::Point;
use crate::tracker::walls::Walls;

/// A body that no module has concerned for so long is looked after at any scan, s: five scans of a module. It may have left
/// where no module looks, or its module may be silent.
const STALE_S: f64 = 0.5;

/// A cloud reaches so many deviations beyond its mean, and a body so far beyond a sample, m: half its width and an arm.
const DEVIATIONS: f64 = 3.0;
const BODY_M: f64 = 0.75;

/// Where a body is, as far as it is known.
#[derive(Clone, Copy, Debug)]
pub struct Whereabouts {
    /// Mean of its cloud.
    pub at: Point,
    /// Variance over both directions, m².
    pub variance_m2: f64,
    /// When that was, s.
    pub at_s: f64,
}

impl Whereabouts {
    /// No part of it is farther from the middle, m.
    fn radius_m(&self) -> f64 {
        DEVIATIONS * self.variance_m2.sqrt() + BODY_M
    }

    /// Whether a part of it may be where a module looks.
    fn may_be_in_view(&self, scan: &Scan) -> bool {
        let reach_m = scan.reach_m() + self.radius_m();
        let off = self.at - scan.origin();
        off.dot(off) < reach_m * reach_m
    }
}

/// See the module.
#[derive(Default)]
pub struct Modules {
    /// The newest rays of each, by its number.
    scans: Vec<Option<Scan>>,
    /// For each, the others whose views its own may touch.
    near: Vec<Vec<usize>>,
    /// Those that are asked about the bodies of the scan that is being taken.
    asked: Vec<usize>,
}

impl Modules {
    /// Of a site with so many.
    pub fn of(count: usize) -> Self {
        Self { scans: vec![None; count], near: vec![Vec::new(); count], asked: Vec::new() }
    }

    /// Takes a module's rays out, so that they are measured anew; none if it has none.
    pub fn take(&mut self, module: usize) -> Option<Scan> {
        self.scans.get_mut(module)?.take()
    }

    /// Whether the site has a module of this number.
    pub fn has(&self, module: usize) -> bool {
        module < self.scans.len()
    }

    /// Notes which views a module's may touch, since it looks from elsewhere than before.
    pub fn place(&mut self, module: usize, scan: &Scan) {
        let touches =
            |other: &Scan| (other.origin() - scan.origin()).length() < other.reach_m() + scan.reach_m();
        let others = self.scans.iter().enumerate().filter(|(number, _)| *number != module);
        let near = others.filter(|(_, other)| other.as_ref().is_some_and(touches));
        let near: Vec<usize> = near.map(|(number, _)| number).collect();
        for (number, others) in self.near.iter_mut().enumerate() {
            others.retain(|other| *other != module);
            if near.contains(&number) {
                others.push(module);
            }
        }
        if let Some(others) = self.near.get_mut(module) {
            *others = near;
        }
    }

    /// The modules have other numbers: by each number now, the one before. What the others measured is forgotten.
    pub fn renumber(&mut self, before: &[Option<usize>]) {
        let mut was = std::mem::take(&mut self.scans);
        *self = Self::of(before.len());
        for (number, before) in before.iter().enumerate() {
            if let Some(scan) = before.and_then(|before| was.get_mut(before)?.take()) {
                let scan = scan.numbered(number);
                self.place(number, &scan);
                self.put(number, scan);
            }
        }
    }

    /// Puts a module's rays in.
    pub fn put(&mut self, module: usize, scan: Scan) {
        if let Some(slot) = self.scans.get_mut(module) {
            *slot = Some(scan);
        }
    }

    /// Which of some bodies a scan concerns, by their places among them; from then on the modules are asked that these concern.
    pub fn concern(
        &mut self,
        module: usize,
        scan: &Scan,
        start_s: f64,
        bodies: impl Iterator<Item = Whereabouts>,
        walls: &Walls,
    ) -> Vec<usize> {
        let from = walls.seen_from(scan.pose());
        let mut concerned = Vec::new();
        let mut stale = Vec::new();
        for (index, body) in bodies.enumerate() {
            if start_s - body.at_s > STALE_S {
                stale.push(body);
                concerned.push(index);
            } else if body.may_be_in_view(scan) && !walls.hides(from, body.at, body.radius_m()) {
                concerned.push(index);
            }
        }
        self.asked.clear();
        self.asked.extend(self.near.get(module).into_iter().flatten());
        if !stale.is_empty() {
            let may_see = |scan: &Scan| stale.iter().any(|body| body.may_be_in_view(scan));
            let others = self.scans.iter().enumerate();
            let others = others.filter(|(_, other)| other.as_ref().is_some_and(may_see));
            self.asked.extend(others.map(|(number, _)| number));
            self.asked.sort_unstable();
            self.asked.dedup();
        }
        concerned
    }

    /// The rays of the modules that are asked, but of the newest scan's.
    pub fn asked(&self) -> impl Iterator<Item = &Scan> {
        self.asked.iter().filter_map(|&number| self.scans.get(number)?.as_ref())
    }

    /// Whether one of them, or `newest`, sees a place when nothing stands before it.
    pub fn cover(&self, place: Point, newest: &Scan) -> bool {
        newest.covers(place) || self.asked().any(|scan| scan.covers(place))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use ::kehai::scan::{Geometry, URG_04LX};

    use super::*;
    use crate::geometry::Pose;
    use crate::observation::View;

    /// A module at x, that looks 4 m far; its view reaches to what is possible.
    fn scan(module: usize, x_m: f64) -> Scan {
        let pose = Pose { at: Point::new(x_m, 0.0), yaw_rad: 0.0 };
        let geometry = Geometry::new(URG_04LX).unwrap();
        let mut scan =
            Scan::of(&Arc::new(View { module, pose, height_m: 1.0, geometry, upside_down: false }));
        scan.reach(4000);
        scan
    }

    fn body(x_m: f64, at_s: f64) -> Whereabouts {
        Whereabouts { at: Point::new(x_m, 0.0), variance_m2: 0.0, at_s }
    }

    /// Three modules, of which the first two are near each other.
    fn modules() -> Modules {
        let mut modules = Modules::of(3);
        for (number, x_m) in [0.0, 5.0, 40.0].into_iter().enumerate() {
            let scan = scan(number, x_m);
            modules.place(number, &scan);
            modules.put(number, scan);
        }
        modules
    }

    #[test]
    fn a_scan_concerns_the_bodies_that_its_module_may_see() {
        let mut modules = modules();
        let newest = modules.take(0).unwrap();
        let bodies = [body(1.0, 9.9), body(20.0, 9.9), body(4.0, 9.9)];
        assert_eq!(modules.concern(0, &newest, 10.0, bodies.into_iter(), &Walls::default()), [0, 2]);
    }

    #[test]
    fn a_body_behind_a_wall_of_the_site_is_not_concerned() {
        let mut modules = modules();
        let newest = modules.take(0).unwrap();
        let site = toml::from_str("[[wall]]\npoints = [[1.5, -9], [1.5, 9]]").unwrap();
        let bodies = [body(0.0, 9.9), body(1.0, 9.9), body(2.0, 9.9), body(4.0, 9.9)];
        let concerned = modules.concern(0, &newest, 10.0, bodies.into_iter(), &Walls::of(&site));
        assert_eq!(concerned, [0, 1, 2], "the third is beside the wall");
    }

    #[test]
    fn only_modules_whose_views_touch_are_asked() {
        let mut modules = modules();
        let newest = modules.take(0).unwrap();
        modules.concern(0, &newest, 10.0, [body(1.0, 9.9)].into_iter(), &Walls::default());
        assert_eq!(modules.asked().map(|scan| scan.origin().x).collect::<Vec<_>>(), [5.0]);
        let far = Point::new(42.0, 0.0);
        assert!(!modules.cover(far, &newest));
    }

    #[test]
    fn a_body_that_no_module_concerns_is_not_forgotten_and_those_near_it_are_asked() {
        let mut modules = modules();
        let newest = modules.take(0).unwrap();
        let bodies = [body(1.0, 9.9), body(42.0, 9.0)];
        assert_eq!(modules.concern(0, &newest, 10.0, bodies.into_iter(), &Walls::default()), [0, 1]);
        assert!(modules.cover(Point::new(42.0, 0.0), &newest));
        let bodies = [body(1.0, 9.9), body(80.0, 9.0)];
        assert_eq!(modules.concern(0, &newest, 10.0, bodies.into_iter(), &Walls::default()), [0, 1]);
        assert_eq!(modules.asked().count(), 1, "the module at 40 m cannot see 80 m");
    }

    #[test]
    fn a_module_that_was_moved_is_near_others_than_before() {
        let mut modules = modules();
        for (x_m, near) in [(2.0, 2), (60.0, 1)] {
            modules.place(2, &scan(2, x_m));
            let newest = modules.take(0).unwrap();
            modules.concern(0, &newest, 10.0, std::iter::empty(), &Walls::default());
            assert_eq!(modules.asked().count(), near, "{x_m}");
            modules.put(0, newest);
        }
    }
}
