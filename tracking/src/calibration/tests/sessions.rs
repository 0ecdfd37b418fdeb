//! A calibration under way: what the walker is told, and what ends a walk.

use std::sync::Arc;

use super::super::advice::{Advice, Guide};
use super::*;
use crate::site::{Module, Site};

#[test]
fn the_guide_asks_for_what_is_missing_and_ends() {
    let mut guide = Guide::default();
    assert_eq!(guide.advise(&Walk::new(3), 0.0), Advice::Begin);
    let nothing = guide.progress(&Walk::new(3));
    assert!(nothing == 0.0 && nothing.is_sign_positive(), "{nothing}");
    let mut two = Walk::new(3);
    walk(12, 0.0, 0.0, 1)
        .glimpses()
        .into_iter()
        .filter(|seen| seen.module < 2)
        .for_each(|seen| two.add(seen));
    assert_eq!(guide.advise(&two, 12.0), Advice::Reach { module: 2 });
    assert!(guide.progress(&two) > 0.2 && guide.progress(&two) < 0.6, "{}", guide.progress(&two));
    let short = walk(12, 0.0, 0.0, 1);
    let Advice::Together { place: Some(place), .. } = guide.advise(&short, 13.0) else { panic!("a pair") };
    assert!(place.length() > 0.5);
    let long = walk(25, 0.0, 0.0, 1);
    assert_eq!(guide.advise(&long, 25.0), Advice::Enough);
    assert!(guide.progress(&long) > 0.99);
}

#[test]
fn a_single_module_without_a_place_needs_no_walk_and_no_module_is_refused() {
    use crate::session::Sessions;
    let session = |modules: Vec<Module>| {
        let site = Arc::new(Site { modules, ..Site::default() });
        let mut session = session::Session::default();
        session.set_site(&site);
        session.begin();
        session.tick(&Sessions::new(site, kehai::centre::Estimator::default()), 1.0);
        let solved = session.solve().unwrap();
        session.conclude(solved);
        session
    };
    let alone = session(vec![Module::unplaced("hall".into())]);
    let origin = Pose { at: Point::default(), yaw_rad: 0.0 };
    let found = status::Mounting { name: "hall".to_owned(), pose: origin, upside_down: false };
    assert_eq!(alone.mountings(), Some(vec![found]));
    assert_eq!(alone.status().found.unwrap().modules[0].moved_m, None);
    for modules in [vec![], vec![Module { placed: true, ..Module::unplaced("hall".into()) }]] {
        assert!(session(modules).status().refused.is_some(), "it says why");
    }
}

/// A calibration in a site of these modules, begun at 1 s.
fn begun(names: &[&str]) -> (session::Session, crate::session::Sessions) {
    let site = site_of(names);
    let sessions = crate::session::Sessions::new(Arc::clone(&site), kehai::centre::Estimator::default());
    let mut session = session::Session::default();
    session.set_site(&site);
    session.begin();
    session.tick(&sessions, 1.0);
    (session, sessions)
}

fn site_of(names: &[&str]) -> Arc<Site> {
    let modules = names.iter().map(|name| Module::unplaced((*name).to_owned())).collect();
    Arc::new(Site { modules, ..Site::default() })
}

#[test]
fn a_walk_ends_with_a_reason_where_the_site_has_other_modules_or_another_order() {
    for names in [&["kitchen", "hall"][..], &["hall"], &["hall", "kitchen", "study"], &["hall", "bath"]] {
        let (mut session, sessions) = begun(&["hall", "kitchen"]);
        session.tick(&sessions, 2.0);
        session.set_site(&site_of(names));
        assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged), "{names:?}");
        session.go_on();
        assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged), "{names:?}");
        let solved = session.solve().unwrap();
        assert_eq!(solved.result, Err(Refusal::SiteChanged), "{names:?}");
    }
}

#[test]
fn what_a_walk_came_to_is_not_the_result_of_one_that_began_while_it_was_solved() {
    let (mut session, sessions) = begun(&["hall"]);
    let solved = session.solve().unwrap();
    session.begin();
    session.tick(&sessions, 3.0);
    session.conclude(solved);
    assert_eq!(session.mountings(), None);
    let solved = session.solve().unwrap();
    session.conclude(solved);
    assert!(session.mountings().is_some(), "its own");
}

#[test]
fn a_walk_that_another_site_has_ended_while_it_was_solved_stays_ended() {
    let (mut session, sessions) = begun(&["hall"]);
    session.tick(&sessions, 2.0);
    let solved = session.solve().unwrap();
    session.set_site(&site_of(&["bath"]));
    session.conclude(solved);
    assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged));
    assert_eq!(session.mountings(), None);
}

#[test]
fn a_walk_goes_on_where_only_places_have_changed_and_one_that_has_just_begun_begins_anew() {
    let (mut session, sessions) = begun(&["hall", "kitchen"]);
    session.tick(&sessions, 2.0);
    let mut site = (*site_of(&["hall", "kitchen"])).clone();
    site.modules[1].x = 3.0;
    session.set_site(&Arc::new(site));
    assert_eq!(session.status().refused, None);
    let (mut session, sessions) = begun(&["hall"]);
    session.set_site(&site_of(&["hall", "kitchen"]));
    session.tick(&sessions, 2.0);
    let status = session.status();
    assert_eq!((status.refused, status.since_s), (None, 1.0));
    assert!(status.advice.contains("hall"), "of two modules: {}", status.advice);
}

#[test]
fn a_walk_ends_where_a_module_hangs_the_other_way_up_or_the_first_one_is_moved() {
    let begun = || {
        let (mut session, sessions) = begun(&["hall", "kitchen"]);
        let mut site = (*site_of(&["hall", "kitchen"])).clone();
        site.modules[0].placed = true;
        session.set_site(&Arc::new(site.clone()));
        session.tick(&sessions, 2.0);
        (session, site)
    };
    let (mut session, mut site) = begun();
    site.modules[1].upside_down = true;
    session.set_site(&Arc::new(site));
    assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged), "turned over");
    let (mut session, mut site) = begun();
    site.modules[0].x = 1.0;
    session.set_site(&Arc::new(site));
    assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged), "moved");
}

#[test]
fn the_first_module_that_is_placed_is_held() {
    let (mut session, sessions) = begun(&["hall", "kitchen"]);
    let mut site = (*site_of(&["hall", "kitchen"])).clone();
    (site.modules[1].placed, site.modules[1].x) = (true, 3.0);
    session.set_site(&Arc::new(site.clone()));
    session.tick(&sessions, 2.0);
    site.modules[0].x = 1.0;
    session.set_site(&Arc::new(site.clone()));
    assert_eq!(session.status().refused_is, None, "the first one has no place");
    site.modules[1].x = 4.0;
    session.set_site(&Arc::new(site));
    assert_eq!(session.status().refused_is, Some(told::ToldRefusal::SiteChanged));
}

#[test]
fn no_progress_is_nought() {
    let (mut session, sessions) = begun(&["hall", "kitchen"]);
    session.tick(&sessions, 2.0);
    assert_eq!(serde_json::to_value(session.status()).unwrap()["progress"].to_string(), "0.0");
}
