//! Our tracker counts the people before a door, through sensors, modules and network, in every one of ten seeds. The
//! figures themselves are in `docs/accuracy.md`; `cargo figures check` runs some of their seeds again.
#![allow(missing_docs, reason = "a test program")]

use host_sim::baselines::Choice;
use host_sim::experiment::jobs::Runs;
use host_sim::experiment::plan::Case;
use host_sim::experiment::runner;
use host_sim::experiment::table::Row;
use host_sim::run::{Conditions, Options, Outage, Record};
use host_sim::world::scene::Scene;
use host_sim::world::variation::Letter;
use kehai_tracking::jsonl::{TracksLine, ZoneKnown};
use kehai_tracking::tracker::LifeCycle;

fn rows(cases: &[Case], options: &Options) -> Vec<Row> {
    runner::run("counts", cases, &(0..=9), options, &Runs::default()).unwrap().0
}

#[test]
fn people_are_counted_before_a_door() {
    let trackers = ["kehai", "lee"].map(|name| name.parse::<Choice>().unwrap());
    let cases = [(Letter::D, 1), (Letter::D, 3), (Letter::D, 6), (Letter::H, 3), (Letter::H, 6)]
        .map(|(condition, people)| Case::door(condition, people, &trackers));
    for pair in rows(&cases, &Options::default()).chunks(2) {
        let [ours, lee] = pair else { panic!("two trackers") };
        println!(
            "{}, {} people: {} of {} right, {} steady, {} emptied; lee {} right",
            ours.scene, ours.people, ours.successes, ours.runs, ours.steady, ours.emptied, lee.successes
        );
        assert_eq!((ours.runs, ours.successes, ours.emptied), (10, 10, 10), "{ours:?}");
        assert!(ours.successes >= lee.successes, "{lee:?}");
        assert!(ours.idf1.unwrap() > 0.92 && ours.rms_visible_m.unwrap() < 0.08, "{ours:?}");
    }
}

#[test]
fn a_disturbed_network_and_wrong_clocks_cost_next_to_nothing() {
    let case = [Case::door(Letter::H, 5, &[Choice::default()])];
    let idf1 = |conditions| {
        let options = Options { conditions, ..Options::default() };
        rows(&case, &options)[0].idf1.unwrap()
    };
    let [lan, disturbed] = [Conditions::LAN, Conditions::DISTURBED].map(idf1);
    println!("IDF1 {lan:.3} on a LAN, {disturbed:.3} disturbed");
    assert!(disturbed > lan - 0.03);
}

/// The area's count ten seconds before the end of a scene, when all people that leave have left.
fn count_near_the_end(scene: &str, seed: u64) -> u32 {
    let scene = Scene::load(scene).unwrap();
    let record = Record::of(&scene, seed, &Options::default()).unwrap();
    let end_s = record.duration_s - 10.0;
    let lines = record.tracks_lines(Choice::default());
    lines.iter().rfind(|line| line.t <= end_s).unwrap().zones["area"].count().unwrap()
}

#[test]
fn a_chair_left_behind_is_no_person_and_a_second_person_is_one() {
    // Seeds at which the chair kept its carrier's track, or was born as a pair of legs.
    for (scene, seeds, count) in [
        ("chair-back", [0, 3, 18], 0),
        ("chair-legs", [5, 13, 14], 0),
        ("touching", [0, 1, 2], 1),
        ("one-of-two", [0, 1, 2], 1),
    ] {
        for seed in seeds {
            assert_eq!(count_near_the_end(scene, seed), count, "{scene}, seed {seed}");
        }
    }
}

fn record(options: &Options) -> Record {
    let case = Case::door(Letter::D, 2, &[]);
    Record::of(&case.build().unwrap(), 3, options).unwrap()
}

/// Lines every 0.1 s, from the datagrams that arrived up to `until_s`.
fn lines(record: &Record, until_s: f64) -> Vec<String> {
    let mut cut = record.clone();
    cut.arrivals.retain(|arrival| arrival.at_us as f64 * 1e-6 <= until_s);
    let lines = cut.tracks_lines(Choice::default());
    lines.iter().map(|line| serde_json::to_string(line).unwrap()).collect()
}

#[test]
fn what_arrives_later_changes_nothing_said_before() {
    let record = record(&Options::default());
    let [whole, cut] = [f64::INFINITY, 20.0].map(|until_s| lines(&record, until_s));
    let before = record.truth.iter().filter(|moment| moment.t <= 20.0).count();
    assert_eq!(whole[..before], cut[..before]);
    assert_ne!(whole[before..], cut[before..]);
}

#[test]
fn without_modules_nothing_is_known_of_a_zone() {
    let outage = |module| Outage { module, from_s: 18.0, until_s: Some(24.0) };
    let options = Options { outages: vec![outage(0), outage(1)], ..Options::default() };
    let record = record(&options);
    let lines = record.tracks_lines(Choice::default());
    let at = |time_s: f64| lines.iter().find(|line| line.t >= time_s).unwrap().zones["area"].state();
    assert_eq!(at(17.5), ZoneKnown::Known);
    assert_eq!(at(22.0), ZoneKnown::Unknown, "silence is never an empty zone");
    assert_eq!(at(30.0), ZoneKnown::Known, "both have started anew");
}

/// The ids of the tracks that are not tentative, for each line from `from_s` to `until_s`.
fn there(lines: &[TracksLine], from_s: f64, until_s: f64) -> Vec<Vec<u64>> {
    let within = lines.iter().filter(|line| (from_s..until_s).contains(&line.t));
    let sure = |line: &TracksLine| {
        let known = line.tracks.iter().filter(|track| track.state != LifeCycle::Tentative);
        known.map(|track| track.id).collect()
    };
    within.map(sure).collect()
}

#[test]
fn what_a_dead_module_saw_is_not_seen_rather_than_empty_and_it_breaks_nothing_when_it_comes_back() {
    let (from_s, until_s) = (18.0, 22.0);
    let outage = |until_s| {
        let outages = vec![Outage { module: 1, from_s, until_s }];
        record(&Options { outages, ..Options::default() })
    };
    let whole = record(&Options::default());
    let events = whole.events.unwrap();
    assert!(events.all_in_s < from_s && events.door_opens_s > 26.0, "{events:?}");
    let share = |lines: &[TracksLine]| {
        let during = lines.iter().filter(|line| (from_s + 2.5..until_s).contains(&line.t));
        let shares: Vec<f64> = during.map(|line| line.zones["area"].seen_share()).collect();
        shares.iter().sum::<f64>() / shares.len() as f64
    };
    let seen = share(&whole.tracks_lines(Choice::default()));
    for until_s in [Some(until_s), None] {
        let lines = outage(until_s).tracks_lines(Choice::default());
        println!("seen of the area {seen:.3}, with one module {:.3}", share(&lines));
        assert!(share(&lines) < seen - 0.01, "its shadow is taken for seen");
        let before = there(&lines, from_s - 0.5, from_s);
        assert!(before.iter().all(|ids| *ids == before[0]) && before[0].len() == 2, "{before:?}");
        let after = there(&lines, from_s, events.door_opens_s);
        assert!(after.iter().all(|ids| *ids == before[0]), "a track was lost or born: {after:?}");
    }
}
