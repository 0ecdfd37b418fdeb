//! `kehai-sim` as a running process.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// A program that is ended with the test.
pub struct Program(Child);

impl Program {
    /// Starts it; and the first line that it says on stderr with `marker` in it.
    pub fn start(arguments: &[&str], marker: &str) -> (Self, String) {
        let mut child = Command::new(env!("CARGO_BIN_EXE_kehai-sim"))
            .args(arguments)
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program runs");
        let mut lines = BufReader::new(child.stderr.take().expect("piped")).lines();
        let line = lines.find_map(|line| line.ok().filter(|line| line.contains(marker)));
        // The rest must be read, or the program blocks on a full pipe.
        std::thread::spawn(move || lines.count());
        (Self(child), line.expect("it says where it is"))
    }

    /// Ends it as Ctrl-C does; it must end well.
    pub fn interrupt(mut self) {
        let sent = Command::new("kill").args(["-INT", &self.0.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
        assert!(self.0.wait().expect("it ends").success());
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The word behind `before` in `line`.
pub fn word<'a>(line: &'a str, before: &str) -> &'a str {
    let behind = line.split_once(before).unwrap_or_else(|| panic!("{before} in {line}")).1;
    behind.split([' ', ',', ';']).next().unwrap_or(behind)
}
