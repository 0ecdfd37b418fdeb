//! `kehai-tracker`: the tracker's commands, not built yet.

use std::process::ExitCode;

fn main() -> ExitCode {
    eprintln!("kehai-tracker: not built yet; `kehai-sim demo` and `kehai-sim replay` show what modules see");
    ExitCode::FAILURE
}
