//! The module on a PC: the library's own tasks, with a PC's sockets, serial lines and files; or all of it in
//! memory, on simulated time.
//!
//! ```text
//!              real time                    simulated time
//!   sensor     `line`: TCP, serial          `crate::link::MemoryLink`
//!   network    `udp`                        `network`
//!   store      `flash`, kept in a file      `flash`, in memory, with power cuts
//!   executor   `reactor`                    `crate::simulated_time`
//!   service    `discovery`
//! ```
//!
//! `pc` puts the left column together; `host` is a client that listens to it.

pub mod amended;
pub mod blink;
pub mod device;
pub mod discovery;
pub mod flash;
pub mod floor;
pub mod host;
pub mod image;
pub mod line;
pub mod network;
pub mod reactor;
pub mod udp;

/// A watchdog that only counts.
#[derive(Clone, Debug, Default)]
pub struct Fed(std::rc::Rc<std::cell::Cell<u64>>);

impl Fed {
    /// How often it was fed.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.0.get()
    }
}

impl kehai::link::Watchdog for Fed {
    fn feed(&mut self) {
        self.0.set(self.0.get() + 1);
    }
}
