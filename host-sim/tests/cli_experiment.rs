//! `kehai-sim experiment` as a process.
#![allow(missing_docs, reason = "a test program")]

use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

const ACCURACY: &str = "before\n<!-- table: leaving -->\nold\n<!-- end: leaving -->\nafter\n";

/// A folder that is gone with its test.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn read(&self, file: &str) -> String {
        std::fs::read_to_string(self.path().join(file)).unwrap()
    }

    fn write(&self, file: &str, text: &str) {
        let path = self.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }

    fn git(&self, arguments: &[&str]) {
        let output = Command::new("git").current_dir(self.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

fn experiment(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-sim"));
    command.current_dir(folder).arg("experiment").args(arguments).output().unwrap()
}

fn out(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn err(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

#[test]
fn a_table_goes_to_its_files_the_same_every_time() {
    let folder = Folder::new();
    let run = || {
        let output =
            experiment(folder.path(), &["leaving", "--seeds", "0-1", "--tracker", "lee", "--out", "tables"]);
        assert!(output.status.success(), "{}", err(&output));
        ["leaving.csv", "leaving-runs.csv", "leaving.md"].map(|file| folder.read(&format!("tables/{file}")))
    };
    let files = run();
    assert_eq!(files, run());
    let [figures, runs, table] = files;
    let heading = "commit,row,tracker,first_seed,last_seed,runs,figure,value,low,high,of,printed";
    assert!(figures.starts_with(&format!("{heading}\n,of two one leaves,lee,0,1,2,")), "{figures}");
    // Two trials with five figures each, and of each figure two runs.
    assert_eq!((figures.lines().count(), runs.lines().count()), (1 + 2 * 5, 1 + 2 * 5 * 2));
    assert!(table.contains("| of two one leaves | 2 |"), "{table}");
    let output = experiment(folder.path(), &["leaving", "--seeds", "7-3"]);
    assert!(err(&output).contains("first and last seed"));
}

#[test]
fn pages_name_their_commit_and_the_check_finds_what_is_otherwise() {
    let folder = Folder::new();
    folder.write("docs/accuracy.md", "nothing\n");
    folder.write("docs/door.md", "nothing\n");
    folder.write("docs/calibration.md", "nothing\n");
    folder.write("source", "1");
    folder.write(".gitignore", "/target\n");
    folder.git(&["init", "--quiet"]);
    folder.git(&["add", "."]);
    folder.git(&[
        "-c",
        "user.name=test",
        "-c",
        "user.email=test@localhost",
        "commit",
        "--quiet",
        "-m",
        "one",
    ]);
    let pages = || experiment(folder.path(), &["pages", "leaving", "--seeds", "0-1"]);
    let check = || experiment(folder.path(), &["check", "leaving", "--seeds", "0-1", "--every", "1"]);

    // A page without a place is refused before anything runs.
    let output = pages();
    assert!(!output.status.success() && err(&output).lines().count() == 1, "{}", err(&output));
    assert!(err(&output).contains("no place for leaving: add <!-- table: leaving -->"), "{}", err(&output));
    // So is a working tree that is no commit.
    folder.write("docs/accuracy.md", ACCURACY);
    folder.write("source", "2");
    assert!(err(&pages()).contains("source is in no commit"), "{}", err(&pages()));
    folder.write("source", "1");

    let output = pages();
    assert!(output.status.success(), "{}", err(&output));
    let page = folder.read("docs/accuracy.md");
    let summary = page.strip_prefix("before\n<!-- table: leaving -->\n").unwrap();
    let summary = summary.strip_suffix("\n<!-- end: leaving -->\nafter\n").unwrap();
    assert!(summary.contains("| of two one leaves | 2 |"), "{page}");
    assert!(
        summary.contains("` by `cargo figures pages`; seeds 0 to 1; every figure: [leaving.csv]"),
        "{page}"
    );
    let files = ["docs/accuracy.md", "docs/tables/leaving.csv", "docs/tables/leaving-seeds.csv"];
    let written = files.map(|file| folder.read(file));
    // The second run reads the kept results, and writes the same output.
    assert!(pages().status.success());
    assert_eq!(files.map(|file| folder.read(file)), written);
    assert!(check().status.success(), "{}", out(&check()));

    // A run of the page came out otherwise.
    let last = written[2].trim_end().rsplit(['"', ' ', ',']).next().unwrap().to_owned();
    let other = if last == "0000" { "0001" } else { "0000" };
    folder.write(files[2], &written[2].replace(&last, other));
    let output = check();
    assert!(!output.status.success());
    assert!(out(&output).contains("1 of 2 runs are otherwise (seeds 1)"), "{}", out(&output));
    folder.write(files[2], &written[2]);
    // A figure was improved by hand.
    folder.write(files[0], &written[0].replace("100 [34–100]", "100 [98–100]"));
    assert!(out(&check()).contains("is not what tables/leaving.csv says"), "{}", out(&check()));
    folder.write(files[0], &written[0]);
    assert!(check().status.success());
}
