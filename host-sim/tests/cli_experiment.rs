//! `kehai-sim experiment` as a process.
#![allow(missing_docs, reason = "a test program")]

use std::process::{Command, Output};

fn experiment(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kehai-sim")).arg("experiment").args(arguments).output().unwrap()
}

#[test]
fn a_table_goes_to_its_files_and_into_its_page_the_same_every_time() {
    let folder = std::env::temp_dir().join(format!("kehai-experiment-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let page = folder.join("page.md");
    let run = || {
        std::fs::write(&page, "before\n<!-- table: leaving -->\nold\n<!-- end: leaving -->\nafter\n")
            .unwrap();
        let (out, page) = (folder.to_str().unwrap(), page.to_str().unwrap());
        let output =
            experiment(&["leaving", "--seeds", "0-1", "--tracker", "lee", "--out", out, "--docs", page]);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        ["leaving.csv", "leaving-runs.csv", "leaving.md", "page.md"]
            .map(|file| std::fs::read_to_string(folder.join(file)).unwrap())
    };
    let files = run();
    assert_eq!(files, run());
    std::fs::remove_dir_all(&folder).unwrap();
    let [figures, runs, table, page] = files;
    assert!(
        figures.starts_with("trial,tracker,figure,value,low,high,of\nof two one leaves,lee,"),
        "{figures}"
    );
    assert_eq!(runs.lines().count(), 1 + 2 * 2 * (figures.lines().count() - 1) / 2);
    assert!(
        table.contains("| of two one leaves | lee | 2 |") && table.ends_with("\nSeeds from 0 on.\n"),
        "{table}"
    );
    assert_eq!(
        page,
        format!("before\n<!-- table: leaving -->\n{}\n<!-- end: leaving -->\nafter\n", table.trim_end())
    );
}

#[test]
fn a_page_without_a_place_is_refused_before_anything_runs() {
    let page = std::env::temp_dir().join(format!("kehai-page-{}.md", std::process::id()));
    std::fs::write(&page, "nothing\n").unwrap();
    let output = experiment(&["all", "--docs", page.to_str().unwrap()]);
    std::fs::remove_file(&page).unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(!output.status.success() && text.lines().count() == 1, "{text}");
    assert!(text.contains("no place for door: add <!-- table: door --> and <!-- end: door -->"), "{text}");
    let output = experiment(&["leaving", "--seeds", "7-3"]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("first and last seed"));
}
