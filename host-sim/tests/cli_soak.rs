//! `kehai-sim soak` from outside, and what makes it fail.

use std::process::Command;

use host_sim::soak::{Drift, NoModule, Soak, drift};
use host_sim::world::scene::Scene;

#[test]
fn half_an_hour_of_two_sensors_drifts_in_nothing() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-sim"));
    let output = command.args(["soak", "--scans", "40000"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{text}{error}");
    let last: Vec<f64> = text.lines().last().unwrap().split_whitespace().flat_map(str::parse).collect();
    // Scans, days, bytes in use and most, clock, walls elsewhere, tracks and their numbers, visits, right.
    let [scans, _, kilobytes, _, _, worst_ms, elsewhere, _, numbers, visits, right] = last[..] else {
        panic!("{text}")
    };
    assert!(scans >= 40_000.0 && kilobytes > 100.0 && visits >= 7.0 && numbers >= visits, "{text}");
    assert!(worst_ms > 0.0 && elsewhere < 2.0 && right > 99.0, "{text}");
}

#[test]
fn a_leak_of_three_bytes_a_scan_fails_it() {
    let scene = Scene::load("soak").unwrap();
    let mut soak = Soak::new(&scene, 1).unwrap();
    let leaking = std::cell::Cell::new(0);
    let heap = || {
        // Two scans a frame.
        leaking.set(leaking.get() + 6);
        600_000 + leaking.get()
    };
    let first = soak.until(4000, &heap).unwrap();
    let later = soak.until(24_000, &heap).unwrap();
    let found = drift(&first, &later, soak.size());
    assert!(matches!(found[..], [Drift::Memory(_, now, 56_000)] if now > 660_000), "{found:?} {later:?}");
}

#[test]
fn people_are_judged_in_the_zone_of_the_scene_that_counts() {
    let visits = |scene: &Scene| Soak::new(scene, 1).unwrap().until(6000, &|| 0).unwrap().visits;
    let mut scene = Scene::load("soak").unwrap();
    assert_eq!(visits(&scene), 1, "after four minutes the first one comes in");
    for zone in &mut scene.site.zones {
        zone.polygon = vec![[20.0, 0.0], [24.0, 0.0], [24.0, 3.0], [20.0, 3.0]];
    }
    assert_eq!(visits(&scene), 0, "nobody is ever there");
    scene.site.zones.clear();
    assert_eq!(visits(&scene), 3, "everywhere, all are there from the begin on");
}

#[test]
fn a_scene_without_modules_is_refused() {
    for (text, is_refused) in [
        ("[site]\n", true),
        ("[[site.module]]\nname = \"a\"\nx = 0\ny = 0\nplaced = false\n", true),
        ("[[site.module]]\nname = \"a\"\nx = 0\ny = 0\n", false),
    ] {
        let scene = Scene::parse("soak.toml", text).unwrap();
        assert_eq!(Soak::new(&scene, 1).err(), is_refused.then_some(NoModule), "{text}");
    }
    let file = std::env::temp_dir().join(format!("kehai-soak-{}.toml", std::process::id()));
    std::fs::write(&file, "[site]\n").unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-sim"));
    let output = command.arg("soak").arg("--scene").arg(&file).output().unwrap();
    std::fs::remove_file(&file).unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && error.contains("no module that has a place"), "{error}");
}
