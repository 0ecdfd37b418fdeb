//! The session with Zenoh: opened by its own configuration, again each second until that succeeds.

use std::fmt;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::Duration;

use zenoh::{Config, Session, Wait};

use super::Network;

/// Between two tries.
const AGAIN: Duration = Duration::from_secs(1);

/// How long the end of the program may be waited for at most.
const LOOK: Duration = Duration::from_millis(100);

/// Why there is no session.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The file cannot be used.
    #[error("{file}: {error}")]
    File {
        /// Which.
        file: String,
        /// What Zenoh says.
        error: String,
    },
    /// Zenoh does not open.
    #[error("Zenoh: {0}")]
    Open(String),
}

impl Network {
    /// Reads the configuration, so that a wrong one is said before anything begins.
    ///
    /// # Errors
    /// [`LinkError::File`].
    pub fn config(&self) -> Result<Config, LinkError> {
        match self {
            Self::Found => Ok(Config::default()),
            Self::File(file) => Config::from_file(file)
                .map_err(|error| LinkError::File { file: shown(file), error: one_line(&error) }),
        }
    }
}

fn shown(file: &Path) -> String {
    file.display().to_string()
}

/// An error of Zenoh, without its places in the source.
pub(crate) fn one_line(error: &(impl fmt::Display + ?Sized)) -> String {
    error.to_string().lines().map(str::trim).collect::<Vec<_>>().join(" ")
}

/// The newest of what waits, `first` the oldest: what came while there was no session is not told as of now.
pub(crate) fn newest<T>(first: T, waiting: &Receiver<T>) -> T {
    waiting.try_iter().last().unwrap_or(first)
}

/// A session; none if the program ends before. `say` is told why there is none, each time that changes.
pub(crate) fn open(config: &Config, stop: &AtomicBool, say: impl Fn(&str)) -> Option<Session> {
    let mut told = String::new();
    while !stop.load(Ordering::Relaxed) {
        match zenoh::open(config.clone()).wait() {
            Ok(session) => return Some(session),
            Err(error) => {
                let why = LinkError::Open(one_line(&error)).to_string();
                if why != told {
                    say(&why);
                    told = why;
                }
            }
        }
        let mut waited = Duration::ZERO;
        while waited < AGAIN && !stop.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
            waited += LOOK;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_what_waited_for_a_session_only_the_newest_is_told() {
        let (tell, waiting) = std::sync::mpsc::channel();
        (1..=5).for_each(|number| tell.send(number).unwrap());
        let first = waiting.recv().unwrap();
        assert_eq!(newest(first, &waiting), 5);
        assert_eq!(newest(6, &waiting), 6, "nothing else waits");
    }
}
