//! `kehai-sim` as a running process.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

/// A program that is ended with the test.
pub struct Program {
    child: Child,
    /// What it says later.
    lines: Receiver<String>,
}

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
        let (tell, told) = channel();
        std::thread::spawn(move || lines.map_while(Result::ok).for_each(|line| drop(tell.send(line))));
        (Self { child, lines: told }, line.expect("it says where it is"))
    }

    /// The next line that it says with `marker` in it.
    #[allow(dead_code, reason = "most tests need the first line only")]
    pub fn says(&self, marker: &str) -> String {
        self.lines.iter().find(|line| line.contains(marker)).expect("it says so")
    }

    /// Ends it as Ctrl-C does; it must end well.
    pub fn interrupt(mut self) {
        let sent = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status();
        assert!(sent.expect("kill runs").success());
        assert!(self.child.wait().expect("it ends").success());
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The word behind `before` in `line`.
pub fn word<'a>(line: &'a str, before: &str) -> &'a str {
    let behind = line.split_once(before).unwrap_or_else(|| panic!("{before} in {line}")).1;
    behind.split([' ', ',', ';']).next().unwrap_or(behind)
}
