//! An edited site: bodies, notes and what modules that still stand have measured stay.
//!
//! ```text
//!   modules   0 left ─▶ 1     1 right ─▶ 0, moved: it begins anew      by their names
//!   zones     0 hall ─▶ 0     1 study ─▶ –, gone: its people may have left
//! ```

use super::Rendering;
use crate::site::Site;
use crate::site::change::SiteChange;
use crate::tracker::floor_plan::FloorPlan;

impl Rendering {
    /// Goes on in a site that was edited.
    pub(super) fn edit(&mut self, change: &SiteChange<'_>) {
        let numbers = change.numbers_before();
        self.terrain.plan = FloorPlan::of(change.now);
        self.terrain.modules.renumber(&numbers);
        self.notes.renumber(&numbers);
        let (before, now) = (enclosed(change.before), enclosed(change.now));
        for body in &mut self.bodies {
            let Some(zone) = body.sighting.inside else { continue };
            body.sighting.inside =
                before.get(zone).and_then(|name| now.iter().position(|other| other == name));
        }
    }
}

/// The names of the enclosed zones, in the order of their numbers.
fn enclosed(site: &Site) -> Vec<&str> {
    site.enclosed_zones().map(|zone| zone.name.as_str()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::Bench;
    use super::super::{LifeCycle, Tracker};
    use super::*;
    use crate::geometry::Point;

    const ZONE: &str =
        "[[zone]]\nname = 'hall'\npolygon = [[0, -3], [3.9, -3], [3.9, 3], [0, 3]]\nenclosed = true\n";

    fn site(text: &str) -> Site {
        toml::from_str(text).unwrap()
    }

    fn module(name: &str, x: f64) -> String {
        format!("[[module]]\nname = '{name}'\nx = {x:?}\ny = 0\nyaw_deg = 0\n")
    }

    #[test]
    fn a_module_goes_on_under_its_new_number_and_its_people_keep_theirs() {
        let mut bench = Bench::within(ZONE);
        (0..40).for_each(|_| bench.shows(&[(2.0, 0.0)]));
        bench.tracker.terrain.modules.place(0, &bench.scan);
        bench.tracker.terrain.modules.put(0, bench.scan.clone());
        let before = bench.tracks();
        assert_eq!(before.len(), 1);
        let was = site(&(module("m", 0.0) + ZONE));
        let other = "[[zone]]\nname = 'first'\npolygon = [[9, 9], [10, 9], [10, 10]]\nenclosed = true\n";
        let now = site(&(module("new", 9.0) + &module("m", 0.0) + other + ZONE));
        assert!(bench.tracker.change_site(&SiteChange { before: &was, now: &now }));
        assert_eq!(bench.tracker.bodies[0].sighting.inside, Some(1), "the zone has another number");
        let modules = &mut bench.tracker.terrain.modules;
        assert!(modules.take(0).is_none());
        let scan = modules.take(1).expect("it stands where it stood");
        assert!(scan.covers(Point::new(3.0, 0.0)));
        bench.tracker.update(1, &scan, bench.now_s);
        assert_eq!(bench.tracker.peek(bench.now_s)[0].id, before[0].id);
    }

    #[test]
    fn what_a_module_measured_before_it_was_moved_is_forgotten() {
        let mut bench = Bench::new();
        bench.tracker.terrain.modules.put(0, bench.scan.clone());
        let (was, now) = (site(&module("m", 0.0)), site(&module("m", 1.0)));
        assert!(bench.tracker.change_site(&SiteChange { before: &was, now: &now }));
        assert!(bench.tracker.terrain.modules.take(0).is_none());
    }

    #[test]
    fn who_was_in_a_zone_that_is_gone_may_have_left() {
        let mut bench = Bench::within(ZONE);
        (0..40).for_each(|_| bench.shows(&[(2.0, 0.0)]));
        assert_eq!(bench.tracker.bodies[0].sighting.inside, Some(0));
        let (was, now) = (site(&(module("m", 0.0) + ZONE)), site(&module("m", 0.0)));
        assert!(bench.tracker.change_site(&SiteChange { before: &was, now: &now }));
        let body = &bench.tracker.bodies[0];
        assert!(body.sighting.inside.is_none());
        assert_eq!(bench.tracks()[0].state, LifeCycle::Confirmed);
    }
}
