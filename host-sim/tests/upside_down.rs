//! Sensors that hang head down: people are followed as well as with upright ones, and a walk says which of them do.
#![allow(missing_docs, reason = "a test program")]

use host_sim::baselines::Choice;
use host_sim::experiment::plan::Case;
use host_sim::experiment::poses::{self, Hung};
use host_sim::experiment::runner::judge;
use host_sim::experiment::table::Row;
use host_sim::run::{Options, Record};
use host_sim::world::variation::Letter;
use kehai_tracking::site::Module;

const SEEDS: std::ops::Range<u64> = 0..8;

/// The door area with five people who gather close to the door, its modules mounted in some way.
fn counted(mount: impl Fn(&mut Module)) -> Row {
    let case = Case::door(Letter::H, 5, &[Choice::default()]);
    let mut scene = case.build().unwrap();
    scene.site.modules.iter_mut().for_each(mount);
    let run =
        |seed| (seed, judge(&Record::of(&scene, seed, &Options::default()).unwrap(), Choice::default()));
    Row::new(case.cell(Choice::default(), scene.site.modules.len()), &SEEDS.map(run).collect::<Vec<_>>())
}

#[test]
fn one_of_two_modules_head_down_counts_as_well() {
    let upright = counted(|_| {});
    for (which, hung) in [
        ("one", counted(|module| module.upside_down = module.name == "right")),
        ("both", counted(|module| module.upside_down = true)),
    ] {
        println!(
            "{which} head down: {} of {} right, IDF1 {:.3}, {:.3} m; upright {} right, IDF1 {:.3}, {:.3} m",
            hung.successes,
            hung.runs,
            hung.idf1.unwrap(),
            hung.rms_visible_m.unwrap(),
            upright.successes,
            upright.idf1.unwrap(),
            upright.rms_visible_m.unwrap()
        );
        assert_eq!(hung.runs, upright.runs);
        // Each within the interval of the other.
        let share = |row: &Row| row.successes as f64 / row.runs as f64;
        assert!((hung.success_low..=hung.success_high).contains(&share(&upright)), "{hung:?}");
        assert!((upright.success_low..=upright.success_high).contains(&share(&hung)), "{hung:?}");
        assert!((hung.idf1.unwrap() - upright.idf1.unwrap()).abs() < 0.03, "{hung:?}");
        assert!((hung.rms_visible_m.unwrap() - upright.rms_visible_m.unwrap()).abs() < 0.01, "{hung:?}");
    }
}

#[test]
fn a_walk_says_which_modules_hang_head_down() {
    let seeds = 1000..1012;
    for scene in ["home", "flat"] {
        let all: Vec<(u64, Hung)> =
            seeds.clone().map(|seed| (seed, poses::hung(scene, seed).unwrap())).collect();
        for (seed, hung) in &all {
            println!("{scene} {seed}: {hung:?}");
        }
        let right = all.iter().filter(|(_, hung)| hung.found == hung.truth).count();
        let refused = all.iter().filter(|(_, hung)| hung.found.is_empty()).count();
        let hung: usize = all.iter().flat_map(|(_, hung)| &hung.truth).filter(|down| **down).count();
        let clearly = all.iter().map(|(_, hung)| hung.clearly).filter(|times| *times > 0.0);
        println!(
            "{scene}: {right} of {} walks right, {refused} refused, {hung} modules head down; the wrong way up at least {:.1} \
             times as far apart",
            all.len(),
            clearly.fold(f64::INFINITY, f64::min)
        );
        assert_eq!(right + refused, all.len(), "{scene}");
        assert!(refused <= 1 && hung > 0, "{scene}");
        for (seed, hung) in &all {
            assert!(hung.off.iter().all(|off| off.metres < 0.1), "{scene}, {seed}: {hung:?}");
        }
    }
}
