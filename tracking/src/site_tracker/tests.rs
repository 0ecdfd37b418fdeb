//! The tracker of a site by itself.

use kehai::floor::{Bits, Fault};
use kehai::wire::FaultyPanel;

use super::*;
use crate::floor::Plan;
use crate::observation::View;
use crate::snapshot::{DeviceState, ModuleLine};
use crate::tracker::Selected;

/// Of modules at these places, with a zone that only one at the origin sees.
fn site(modules: &[(&str, f64)]) -> Arc<Site> {
    let module = |(name, x): &(&str, f64)| format!("[[module]]\nname = \"{name}\"\nx = {x:?}\ny = 0.0\n");
    let modules: String = modules.iter().map(module).collect();
    let zone = "[[zone]]\nname = \"hall\"\npolygon = [[1, -0.5], [2, -0.5], [2, 0.5], [1, 0.5]]\n";
    Arc::new(toml::from_str(&format!("{modules}{zone}")).unwrap())
}

/// Each module sees 4 m, and nothing in it.
fn look(tracker: &mut SiteTracker, at_s: f64) {
    let modules = Arc::clone(&tracker.site);
    for (number, module) in modules.modules.iter().enumerate() {
        let view = Arc::new(View { module: number, pose: module.pose(), ..View::at_origin() });
        let all_mm = vec![4000; usize::from(view.geometry.beams())];
        let (empty_mm, background_mm) = (all_mm.clone(), all_mm.into());
        let detections = Vec::new();
        tracker.observe(&Observation { view, start_s: at_s, detections, empty_mm, background_mm });
    }
}

#[test]
fn a_module_that_takes_the_number_of_another_has_not_looked_yet() {
    let mut tracker = SiteTracker::new(&site(&[("left", 60.0), ("right", 50.0)]), Selected::default());
    let states = |tracker: &mut SiteTracker, tenths: std::ops::Range<u32>| -> Vec<ZoneKnown> {
        let state = |tenth: u32| {
            let at_s = f64::from(tenth) * 0.1;
            look(tracker, at_s);
            tracker.estimate(at_s).zones["hall"].state()
        };
        tenths.map(state).collect()
    };
    let unseen = states(&mut tracker, 0..50);
    assert!(unseen.iter().all(|state| *state == ZoneKnown::Unknown), "{unseen:?}");
    tracker.change_site(&site(&[("right", 50.0), ("new", 0.0)]));
    let begins = states(&mut tracker, 50..69);
    assert!(begins.iter().all(|state| *state == ZoneKnown::Unknown), "{begins:?}");
    assert_eq!(states(&mut tracker, 69..75).last(), Some(&ZoneKnown::Known));
    // Under its new number it goes on looking.
    tracker.change_site(&site(&[("new", 0.0), ("right", 50.0)]));
    let goes_on = states(&mut tracker, 75..100);
    assert!(goes_on.iter().all(|state| *state == ZoneKnown::Known), "{goes_on:?}");
}

#[test]
fn of_a_site_without_zones_nothing_is_known_before_its_people_can_have_been_found() {
    let site = Site { zones: Vec::new(), ..(*site(&[("left", 0.0)])).clone() };
    let mut tracker = SiteTracker::new(&Arc::new(site), Selected::default());
    let (name, state) = ("left".to_owned(), DeviceState::Watching);
    let watching = ModuleLine { name, state, unused_s: Some(0.0), ..ModuleLine::default() };
    let mut total = |tenth: u32| {
        let at_s = f64::from(tenth) * 0.1;
        look(&mut tracker, at_s);
        let line = tracker.line(at_s);
        tracker.total(&line, std::slice::from_ref(&watching)).count
    };
    let first: Vec<Option<u32>> = (0..15).map(&mut total).collect();
    assert_eq!(first, [None; 15]);
    assert_eq!(total(15), Some(0));
    assert_eq!((total(40), total(54), total(55)), (None, None, Some(0)), "after a gap");
}

#[test]
fn a_panel_that_did_not_work_as_its_floor_began_is_seen_a_second_after_it_works() {
    let floor = "[[floor]]\nname = \"mat\"\nx = 0.0\ny = 0.0\ncolumns = 24\nrows = 24\n";
    let zone = "[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1.92, 0], [1.92, 1.92], [0, 1.92]]\n";
    let site: Arc<Site> = Arc::new(toml::from_str(&format!("{floor}{zone}")).unwrap());
    let plan = Plan::from(&site.floors[0]);
    let mut tracker = SiteTracker::new(&site, Selected::default());
    let mut share = |tenth: u32| {
        let at_s = f64::from(tenth) * 0.1;
        let dead = (tenth <= 9).then_some(FaultyPanel { panel: 0, fault: Fault::Dead });
        let faulty = dead.into_iter().collect();
        tracker.read(&Reading { floor: 0, plan, at_s, down: Bits::default(), faulty });
        tracker.estimate(at_s).zones["hall"].seen_share()
    };
    let begins: Vec<f64> = (0..10).map(&mut share).collect();
    assert_eq!(begins, [0.0; 10], "nobody can have been found yet");
    let shares: Vec<f64> = (10..19).map(&mut share).collect();
    assert!(shares.iter().all(|share| (0.98..1.0).contains(share)), "one cell of a hundred: {shares:?}");
    share(19);
    assert_eq!(share(20), 1.0);
}
