//! The pages name files and folders of this repository: each of them exists, and each link between pages leads somewhere.
//!
//! ```text
//!   `tracking/src/zones.rs`          a path in code marks, below a folder of the repository ─▶ exists
//!   [design](design.md#the-core)     a link without a scheme                                ─▶ exists, heading included
//!   | … | `file` | `name`, … | … |   a row of "Where do I change" in CONTRIBUTING.md        ─▶ the file has the names
//! ```

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Folders whose paths are checked.
const FOLDERS: [&str; 17] = [
    "src/",
    "emulator/",
    "depth/",
    "tracking/",
    "host-tracker/",
    "host-sim/",
    "structure/",
    "test-support/",
    "packaging/",
    "tests/",
    "docs/",
    "benches/",
    "proofs/",
    "fuzz/",
    "examples/",
    "clients/",
    ".ci/",
];

fn pages() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let docs = std::fs::read_dir(root.join("docs")).expect("the folder docs/");
    let docs = docs.map(|entry| entry.expect("an entry of docs/").path());
    ["README.md", "CONTRIBUTING.md"]
        .map(|page| root.join(page))
        .into_iter()
        .chain(docs.filter(|path| path.extension().is_some_and(|extension| extension == "md")))
        .collect()
}

/// Texts between code marks, outside of code blocks.
fn in_code_marks(page: &str) -> Vec<&str> {
    let mut in_block = false;
    let lines = page.lines().filter(|line| {
        let fence = line.trim_start().starts_with("```");
        in_block ^= fence;
        !in_block && !fence
    });
    lines.flat_map(|line| line.split('`').skip(1).step_by(2)).collect()
}

/// The targets of Markdown links.
fn links(page: &str) -> Vec<&str> {
    page.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target).collect()
}

/// The anchors of a page's headings, as GitHub makes them.
fn anchors(page: &str) -> BTreeSet<String> {
    let headings = page.lines().filter(|line| line.starts_with('#'));
    headings
        .map(|line| {
            let kept = line.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
            kept.chars().filter(|letter| letter.is_alphanumeric() || "-_".contains(*letter)).collect()
        })
        .collect()
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn files_that_the_pages_name_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut missing = Vec::new();
    for path in pages() {
        let page = read(&path);
        for text in in_code_marks(&page) {
            let named = FOLDERS.iter().any(|folder| text.starts_with(folder));
            let is_pattern = text.contains(['<', '*', '{', ' ', '…']);
            if named && !is_pattern && !root.join(text).exists() {
                missing.push(format!("{}: `{text}`", path.display()));
            }
        }
    }
    assert!(missing.is_empty(), "pages name files that do not exist:\n{}", missing.join("\n"));
}

#[test]
fn links_between_pages_lead_somewhere() {
    let mut broken = Vec::new();
    for path in pages() {
        let page = read(&path);
        for target in links(&page).into_iter().filter(|target| !target.contains("://")) {
            let (file, anchor) =
                target.split_once('#').map_or((target, None), |(file, anchor)| (file, Some(anchor)));
            let folder = path.parent().expect("a page lies in a folder");
            let other = if file.is_empty() { path.clone() } else { folder.join(file) };
            let leads = other.exists() && anchor.is_none_or(|anchor| anchors(&read(&other)).contains(anchor));
            if !leads {
                broken.push(format!("{}: ({target})", path.display()));
            }
        }
    }
    assert!(broken.is_empty(), "links that lead nowhere:\n{}", broken.join("\n"));
}

/// The rows of a page's tables, cell by cell; `\|` is no end of a cell.
fn rows(page: &str) -> Vec<Vec<String>> {
    let lines = page.lines().filter(|line| line.starts_with("| "));
    let cells = |line: &str| {
        let line = line.replace("\\|", "¦");
        line.trim_matches('|').split('|').map(|cell| cell.trim().replace('¦', "|")).collect()
    };
    lines.map(cells).collect()
}

#[test]
fn what_users_stumbled_over_is_gone_as_the_page_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = read(&root.join("docs/frictions.md"));
    let (mut wrong, mut gone, mut open) = (Vec::new(), 0, 0);
    for row in rows(&page) {
        let [friction, status, shown] = &row[..] else { panic!("three cells: {row:?}") };
        let is_open = status.starts_with("open");
        if friction == "stumbled over" {
            continue;
        }
        open += u32::from(is_open);
        gone += u32::from(status.starts_with("gone"));
        if !is_open && !status.starts_with("gone") && !status.starts_with("partly") {
            wrong.push(format!("{friction}: {status:?} is neither gone, partly nor open"));
        }
        // A file, and then names of tests in it, or what one of its tests waits for.
        let mut file = None;
        let mut named = 0;
        for text in in_code_marks(shown) {
            if FOLDERS.iter().any(|folder| text.starts_with(folder)) {
                file = root.join(text).exists().then(|| (text, read(&root.join(text))));
                if file.is_none() {
                    wrong.push(format!("{friction}: there is no {text}"));
                }
            } else if let Some((name, code)) = &file {
                named += 1;
                let (test, step) = (format!("fn {text}("), format!("\"{text}\""));
                if !code.contains(&test) && !code.contains(&step) {
                    wrong.push(format!("{friction}: {name} has no {text}"));
                }
            }
        }
        // That pictures exist is checked with all links.
        named += links(shown).iter().filter(|target| target.starts_with("images/")).count();
        if !is_open && named == 0 {
            wrong.push(format!("{friction}: nothing shows it"));
        }
    }
    println!("{gone} gone, {open} open");
    assert!(gone >= 40, "{gone} rows");
    assert!(wrong.is_empty(), "docs/frictions.md:\n{}", wrong.join("\n"));
}

#[test]
fn the_drop_of_the_sensors_supply_is_ohms_law() {
    let page = read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/wiring.md"));
    let (_, rest) = page.split_once("<!-- table: drop -->").expect("the table");
    let (table, _) = rest.split_once("<!-- end: drop -->").expect("its end");
    let rows: Vec<Vec<f64>> = table
        .lines()
        .filter(|line| line.starts_with("| AWG"))
        .map(|line| line.split('|').skip(2).filter_map(|cell| cell.trim().parse().ok()).collect())
        .collect();
    assert_eq!(rows.len(), 3, "{table}");
    let (start_a, plug_ohm, least_v) = (0.8, 0.03, 4.75);
    for row in rows {
        let [milliohm, a_metre_v, from_5, from_49, longest_5_m, longest_49_m] = row[..] else {
            panic!("six numbers: {row:?}")
        };
        let drop_v = 2.0 * milliohm * 1e-3 * start_a;
        let left_v = |from_v: f64, metres: f64| from_v - start_a * plug_ohm - drop_v * metres;
        assert!((a_metre_v - drop_v).abs() < 0.0006, "{row:?}: {drop_v}");
        assert!(
            (from_5 - left_v(5.0, 1.0)).abs() < 0.006 && (from_49 - left_v(4.9, 1.0)).abs() < 0.006,
            "{row:?}"
        );
        // Rounded down: what is written still leaves enough.
        for (from_v, longest_m) in [(5.0, longest_5_m), (4.9, longest_49_m)] {
            assert!(
                left_v(from_v, longest_m) >= least_v && left_v(from_v, longest_m + 0.1) < least_v,
                "{row:?}"
            );
        }
    }
}

#[test]
fn where_to_change_what_is_as_contributing_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = read(&root.join("CONTRIBUTING.md"));
    let (_, section) = page.split_once("## Where do I change").expect("the section of CONTRIBUTING.md");
    let rows: Vec<Vec<&str>> = section
        .lines()
        .filter(|line| line.starts_with('|') && line.contains('`'))
        .map(|line| line.split('|').map(str::trim).collect())
        .collect();
    assert!(rows.len() >= 20, "the table has {} rows", rows.len());
    let mut stale = Vec::new();
    for row in rows {
        let [_, _, file, names, ..] = row[..] else { panic!("a row with fewer than three cells: {row:?}") };
        let file = file.trim_matches('`');
        let text = read(&root.join(file));
        for name in in_code_marks(names).into_iter().filter(|name| !text.contains(name)) {
            stale.push(format!("{name} is not in {file}"));
        }
    }
    assert!(stale.is_empty(), "CONTRIBUTING.md is out of date:\n{}", stale.join("\n"));
}
