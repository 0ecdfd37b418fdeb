//! Instructions of a run of this very program, counted by valgrind: the same in every run.

use std::process::Command as Process;

/// Instructions of this program with these arguments; None if valgrind is not installed. With `only`, those within functions
/// whose names hold it: such a function is not inlined, and does not call itself.
pub fn instructions(arguments: &[&str], only: Option<&str>) -> Option<u64> {
    let mut valgrind = Process::new("valgrind");
    valgrind.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    if let Some(function) = only {
        valgrind.arg(format!("--toggle-collect=*{function}*"));
    }
    let output = valgrind.arg(std::env::current_exe().ok()?).args(arguments).output().ok()?;
    let text = String::from_utf8_lossy(&output.stderr);
    text.lines().find_map(|line| line.split("Collected : ").nth(1)?.trim().parse().ok())
}

/// A count for a table.
pub fn shown(count: Option<u64>) -> String {
    count.map_or("–".into(), |count| count.to_string())
}
