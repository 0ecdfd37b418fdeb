//! A scene through sensors, modules and network: the datagrams at the host, and the truth.
#![allow(missing_docs, reason = "a test program")]

use host_sim::run::{Arrival, Conditions, Options, Outage, Record, Run};
use host_sim::world::geometry::Point;
use host_sim::world::scene::Scene;
use host_sim::world::variation::{Letter, Variation};
use kehai::centre::{Estimator, centre};
use kehai::scan::Geometry;
use kehai::wire::{Message, Report, Subscribed};

fn door_area(people: usize, letter: Letter) -> Scene {
    let mut scene = Scene::load("door-area").unwrap();
    let (people, condition) = (Some(people), Some(letter));
    scene.vary(&Variation { people, condition, ..Variation::default() }).unwrap();
    scene
}

fn with(conditions: Conditions) -> Options {
    Options { conditions, ..Options::default() }
}

/// What `pick` wants of the datagrams of a module, and when they came.
fn all<T>(arrivals: &[Arrival], module: u16, pick: impl Fn(&Message<'_>) -> Option<T>) -> Vec<(u64, T)> {
    let own = arrivals.iter().filter(|arrival| arrival.module == module);
    own.filter_map(|arrival| Some((arrival.at_us, pick(&Message::decode(&arrival.bytes).unwrap().1)?)))
        .collect()
}

fn geometry(arrivals: &[Arrival], module: u16) -> Geometry {
    let told = all(arrivals, module, |message| match message {
        Message::Info(info) => info.sensor?.geometry().ok(),
        _ => None,
    });
    told.last().unwrap().1
}

fn reports<T>(arrivals: &[Arrival], module: u16, pick: impl Fn(&Report<'_>) -> T) -> Vec<(u64, T)> {
    all(arrivals, module, |message| match message {
        Message::Report(report) => Some(pick(report)),
        _ => None,
    })
}

fn exchanges(arrivals: &[Arrival], module: u16) -> Vec<(u64, Subscribed)> {
    all(arrivals, module, |message| match message {
        Message::Subscribed(subscribed) => Some(*subscribed),
        _ => None,
    })
}

#[test]
fn the_same_seed_gives_the_same_bytes_however_time_is_cut() {
    let scene = door_area(2, Letter::H);
    let run = |seed: u64, step_us: usize| {
        let mut run = Run::new(&scene, seed, &with(Conditions::DISTURBED));
        let arrivals: Vec<Arrival> =
            (0..=15_000_000).step_by(step_us).flat_map(|until_us| run.until(until_us).unwrap()).collect();
        (arrivals, run.moment(15_000_000))
    };
    let (first, again) = (run(3, 100_000), run(3, 7_500_000));
    assert!(first == again);
    assert!(first.0.is_sorted_by_key(|arrival| arrival.at_us));
    assert!(first.0 != run(4, 100_000).0);
}

/// Without any delay an answer comes at the moment of its request: a host that asks again at once never stops.
#[test]
fn time_goes_on_without_any_delay_whatever_comes_first() {
    for seed in 0..8 {
        let mut run = Run::new(&door_area(5, Letter::H), seed, &with(Conditions::IDEAL));
        let arrivals = run.until(3_000_000).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        for module in [0, 1] {
            let infos = all(&arrivals, module, |message| match message {
                Message::Info(_) => Some(()),
                _ => None,
            });
            assert!((1..=3).contains(&infos.len()), "seed {seed}: {} infos in 3 s", infos.len());
        }
    }
}

#[test]
fn a_background_is_known_and_told_before_anybody_comes() {
    for conditions in [Conditions::IDEAL, Conditions::LAN, Conditions::DISTURBED] {
        let mut run = Run::new(&door_area(3, Letter::D), 5, &with(conditions));
        let arrivals = run.until(13_000_000).unwrap();
        assert!(run.moment(9_900_000).people.is_empty());
        for module in [0, 1] {
            let known = reports(&arrivals, module, |report| report.head.background_version);
            let (since_us, _) = known.iter().find(|(_, version)| *version > 0).unwrap();
            assert!(*since_us < 10_000_000, "learned at {since_us}");
            let mut parts = all(&arrivals, module, |message| match message {
                Message::ProfilePart(part) => Some((part.head.object, part.head.part, part.beams.len())),
                _ => None,
            });
            parts.sort_by_key(|(_, part)| *part);
            parts.dedup_by_key(|(_, part)| *part);
            let beams: usize = parts.iter().map(|(_, (.., beams))| beams).sum();
            assert_eq!(beams, 682, "{parts:?}");
        }
    }
}

#[test]
fn clocks_can_be_compared_by_the_exchanges() {
    for (conditions, tolerance_us) in
        [(Conditions::IDEAL, 1), (Conditions::LAN, 200), (Conditions::DISTURBED, 4_000)]
    {
        let record = Record::of(&door_area(1, Letter::D), 9, &with(conditions)).unwrap();
        for module in [0, 1] {
            let exchanges = exchanges(&record.arrivals, module);
            assert!(exchanges.len() > 20, "{}", exchanges.len());
            let offset_us = |(t4_us, told): &(u64, Subscribed)| {
                let t1_us = u64::from_le_bytes(told.t1);
                let there = told.t2_us.cast_signed() - t1_us.cast_signed();
                let back = told.t3_us.cast_signed() - t4_us.cast_signed();
                (t4_us - t1_us, (there + back) / 2)
            };
            let (.., best_us) =
                exchanges.iter().map(offset_us).min().map(|(_, offset_us)| ((), offset_us)).unwrap();
            // Stamps of reports, put on the host's clock, lie shortly before their arrival.
            let late_us = reports(&record.arrivals, module, |report| report.head.stamp_us)
                .iter()
                .map(|(at_us, stamp_us)| at_us.cast_signed() - (stamp_us.cast_signed() - best_us))
                .min()
                .unwrap();
            assert!((100_000 - tolerance_us..280_000).contains(&late_us), "{late_us} µs after the stamp");
        }
    }
}

#[test]
fn a_person_who_is_seen_is_reported_where_they_are() {
    let record = Record::of(&door_area(1, Letter::D), 2, &with(Conditions::IDEAL)).unwrap();
    let site = &record.site.modules[0];
    let geometry = geometry(&record.arrivals, 0);
    let (mut near, mut seen) = (0, 0);
    for (at_us, places) in reports(&record.arrivals, 0, |report| {
        let place = |candidate| centre(&candidate, &geometry, Estimator::default());
        report
            .candidates
            .iter()
            .map(place)
            .map(|at| Point::new(at.x_m.into(), at.y_m.into()))
            .collect::<Vec<Point>>()
    }) {
        // The middle of the scan is a scan and a transmission before.
        let moment = &record.truth[(at_us as usize - 130_000) / 100_000];
        let Some(person) = moment.people.iter().find(|person| person.beams >= 10) else { continue };
        let there = Point::new(person.x, person.y);
        if (there - site.pose().at).length() > 2.0 {
            continue;
        }
        seen += 1;
        let distance_m = |at: &Point| (site.pose().to_site(*at) - there).length();
        near += usize::from(places.iter().any(|at| distance_m(at) < 0.25));
    }
    assert!(seen > 120 && near * 100 > seen * 95, "{near} of {seen}");
}

#[test]
fn a_module_that_loses_its_power_comes_back_with_another_start_and_its_background() {
    let outage = Outage { module: 1, from_s: 14.0, until_s: Some(17.0) };
    let options = Options { outages: vec![outage], ..Options::default() };
    let mut run = Run::new(&door_area(1, Letter::D), 6, &options);
    let arrivals = run.until(26_000_000).unwrap();
    let boot = |arrival: &Arrival| Message::decode(&arrival.bytes).unwrap().0.identity.boot;
    let own: Vec<&Arrival> = arrivals.iter().filter(|arrival| arrival.module == 1).collect();
    let (before, after): (Vec<&Arrival>, Vec<&Arrival>) =
        own.into_iter().partition(|arrival| arrival.at_us < 14_010_000);
    assert!(
        before.iter().all(|arrival| boot(arrival) == 1) && after.iter().all(|arrival| boot(arrival) == 2)
    );
    assert!(after.iter().all(|arrival| arrival.at_us > 17_000_000));
    let again = reports(&arrivals, 1, |report| report.head.background_version);
    let (back_us, version) = again.iter().find(|(at_us, _)| *at_us > 17_000_000).unwrap();
    assert!(*back_us < 21_000_000 && *version > 0, "{back_us} {version}");
    let never =
        Options { outages: vec![Outage { module: 0, from_s: 12.0, until_s: None }], ..Options::default() };
    let arrivals = Run::new(&door_area(1, Letter::D), 6, &never).until(20_000_000).unwrap();
    assert!(arrivals.iter().any(|arrival| arrival.module == 1 && arrival.at_us > 19_800_000));
    assert!(arrivals.iter().all(|arrival| arrival.module == 1 || arrival.at_us < 12_010_000));
}

#[test]
fn a_run_is_the_same_after_it_was_kept_in_a_file() {
    let record = Record::of(&door_area(2, Letter::T), 1, &Options::default()).unwrap();
    let path = std::env::temp_dir().join(format!("kehai-run-{}.bin", std::process::id()));
    record.save(&path).unwrap();
    let loaded = Record::load(&path).unwrap();
    std::fs::write(&path, b"something else").unwrap();
    let foreign = Record::load(&path).unwrap_err().to_string();
    std::fs::remove_file(&path).unwrap();
    assert!(loaded == record);
    assert_eq!(foreign, "not a recorded run of this version");
}
