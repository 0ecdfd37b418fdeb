//! `kehai-tracker run` with its map, as a process that ends with the test.
//!
//! ```text
//!   kehai-tracker run ─stderr─▶ "live map at http://…" ─▶ where the map is; what follows is printed
//! ```
#![allow(dead_code, reason = "each test uses its own part of it")]

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

use host_sim::building::Building;

/// A tracker, and the address of its map.
pub struct Tracker {
    pub process: Child,
    pub map: String,
}

impl Tracker {
    /// Follows the modules of a building, with a database beside its site.
    pub fn start(site: &Path, building: &Building) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kehai-tracker"));
        command.args(["run", "--http", "127.0.0.1:0", "--no-mdns", "--site"]).arg(site);
        command.arg("--db").arg(site.with_extension("db"));
        for (_, address) in building.modules() {
            command.arg("--module").arg(address.to_string());
        }
        let mut process = command.stderr(Stdio::piped()).spawn().unwrap();
        let map = map_of(&mut process);
        Self { process, map }
    }
}

impl Drop for Tracker {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Where the map of a tracker is, whose errors are piped.
pub fn map_of(process: &mut Child) -> String {
    let mut said = BufReader::new(process.stderr.take().unwrap()).lines().map_while(Result::ok);
    let map = said
        .find_map(|line| Some(line.split_once("live map at ")?.1.trim().to_owned()))
        .expect("the tracker does not say where its map is");
    std::thread::spawn(move || said.for_each(|line| eprintln!("{line}")));
    map
}
