//! `kehai-sim plan` as a process.
#![allow(missing_docs, reason = "a test program")]

use std::path::PathBuf;
use std::process::{Command, Output};

use kehai_tracking::site::Site;

const OFFICE: &str = include_str!("../sites/office.toml");

fn plan(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kehai-sim")).arg("plan").args(arguments).output().unwrap()
}

/// A folder of its own with a site file in it, and that file.
fn site(name: &str, text: &str) -> (PathBuf, String) {
    let folder = std::env::temp_dir().join(format!("kehai-plan-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("site.toml");
    std::fs::write(&file, text).unwrap();
    (folder, file.to_str().unwrap().to_owned())
}

#[test]
fn a_plan_is_a_site_file_and_a_picture_the_same_every_time() {
    let (folder, file) = site("office", OFFICE);
    let run = |name: &str| {
        let (out, svg) = (folder.join(format!("{name}.toml")), folder.join(format!("{name}.svg")));
        let paths = ["--out", out.to_str().unwrap(), "--svg", svg.to_str().unwrap(), "--json"];
        let output = plan(
            &[&[file.as_str(), "--modules", "2", "--people", "3", "--seeds", "0-3"], &paths[..]].concat(),
        );
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        (output.stdout, std::fs::read_to_string(out).unwrap(), std::fs::read_to_string(svg).unwrap())
    };
    let (json, text, picture) = run("one");
    assert_eq!((&json, &text, &picture), (&run("two").0, &run("three").1, &run("four").2));
    let planned = Site::parse("planned.toml", &text).unwrap();
    let given = Site::parse("site.toml", OFFICE).unwrap();
    assert_eq!(
        (&planned.walls, &planned.zones, &planned.entries),
        (&given.walls, &given.zones, &given.entries)
    );
    assert_eq!(planned.modules.len(), 2);
    assert!(
        planned.modules.iter().all(|module| (0.0..8.0).contains(&module.x) && (0.0..5.0).contains(&module.y))
    );
    let plan: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let layouts = plan["layouts"].as_array().unwrap();
    let exact: Vec<f64> = layouts.iter().map(|layout| layout["exact"].as_f64().unwrap()).collect();
    assert!(layouts.len() == 3 && exact.is_sorted_by(|one, other| one >= other), "{exact:?}");
    assert_eq!(layouts[0]["modules"].as_array().unwrap().len(), 2);
    assert!(picture.contains("planned 2") && picture.contains("</svg>"));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn modules_that_stay_are_kept_and_new_ones_added() {
    let given =
        format!("{OFFICE}\n[[module]]\nname = \"shelf\"\nx = 0.05\ny = 4.9\nyaw_deg = -45\nheight_m = 0.7\n");
    let (folder, file) = site("keep", &given);
    let out = folder.join("out.toml");
    let names = |more: &[&str]| -> Vec<String> {
        let arguments =
            [&[file.as_str(), "--modules", "1", "--seeds", "0-1", "--out", out.to_str().unwrap()], more]
                .concat();
        let output = plan(&arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let site = Site::parse("out.toml", &std::fs::read_to_string(&out).unwrap()).unwrap();
        site.modules.into_iter().map(|module| module.name).collect()
    };
    assert_eq!(names(&["--keep"]), ["shelf", "planned 1"]);
    assert_eq!(names(&[]), ["planned 1"]);
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_module_without_a_place_sees_nothing_and_is_named() {
    let given = format!("{OFFICE}\n[[module]]\nname = \"boxed\"\nx = 2.0\ny = 2.0\nplaced = false\n");
    let (folder, file) = site("unplaced", &given);
    let out = folder.join("out.toml");
    let run = |more: &[&str]| {
        let output = plan(&[&[file.as_str(), "--keep", "--modules", "1", "--seeds", "0-0"], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let (_, bare) = site("unplaced-bare", OFFICE);
    let alone = plan(&[&bare, "--modules", "1", "--seeds", "0-0", "--json"]);
    let alone: serde_json::Value = serde_json::from_slice(&alone.stdout).unwrap();
    let kept: serde_json::Value =
        serde_json::from_str(&run(&["--json", "--out", out.to_str().unwrap()])).unwrap();
    assert_eq!(kept["steps"], alone["steps"], "it adds nothing to what is seen");
    assert_eq!((&kept["layouts"], &kept["left_out"]), (&alone["layouts"], &serde_json::json!(["boxed"])));
    assert!(run(&[]).contains("left out, as they have no place: boxed\n"));
    let site = Site::parse("out.toml", &std::fs::read_to_string(&out).unwrap()).unwrap();
    let modules: Vec<(&str, bool)> =
        site.modules.iter().map(|module| (module.name.as_str(), module.placed)).collect();
    assert_eq!(modules, [("planned 1", true), ("boxed", false)], "it stays in the file");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_cannot_be_planned_is_refused_in_one_line() {
    let (folder, file) = site("office-again", OFFICE);
    let (_, empty) = site("empty", "");
    let (_, open) = site("open", "[[zone]]\nname = \"a\"\npolygon = [[0, 0], [3, 0], [3, 3]]\n");
    let across = OFFICE.replace(
        "[[zone]]\nname = \"office\"",
        "[[wall]]\npoints = [[0.6, 0.0], [1.6, 0.0]]\n\n[[zone]]\nname = \"office\"",
    );
    let (_, shut) = site("shut", &across);
    let cases: [(&[&str], &str); 7] = [
        (&["nowhere.toml"], "nowhere.toml: "),
        (&[&empty], "has no zone"),
        (&[&open], "no wall from which a zone is seen"),
        (&[&file, "--out", &file], "is the site itself"),
        (&[&file, "--seeds", "0-0", "--modules", "1", "--svg", &file], "is the site itself"),
        (&[&shut, "--modules", "1", "--seeds", "0-0"], "no way leads from entry \"corridor\""),
        (&[&file, "--seeds", "0-0", "--modules", "1", "--svg", "/dev/null/x"], "/dev/null/x: "),
    ];
    for (arguments, expected) in cases {
        let output = plan(arguments);
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && text.lines().count() == 1, "{arguments:?}: {text}");
        assert!(text.contains(expected), "{text}");
    }
    let wrong = plan(&[&file, "--sensor", "urg"]);
    assert!(String::from_utf8(wrong.stderr).unwrap().contains("one of urg-04lx, "));
    for name in ["office-again", "empty", "open", "shut"] {
        let _ = std::fs::remove_dir_all(
            folder.with_file_name(format!("kehai-plan-{name}-{}", std::process::id())),
        );
    }
}
