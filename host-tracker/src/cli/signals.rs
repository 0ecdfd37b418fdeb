//! What the system asks of a command that runs until it is told to end.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::register;

/// The signals that `run` takes.
pub(super) struct Signals {
    /// True once the tracker is to end.
    pub(super) end: Arc<AtomicBool>,
    /// True once the site is to be read anew, until it is.
    pub(super) hang_up: Arc<AtomicBool>,
}

impl Signals {
    /// From now on they do nothing but this.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn taken() -> io::Result<Self> {
        let signals = Self { end: end()?, hang_up: Arc::default() };
        #[cfg(unix)]
        register(signal_hook::consts::SIGHUP, Arc::clone(&signals.hang_up))?;
        // A limit on the size of files is an error of the file, not the tracker's death.
        #[cfg(unix)]
        register(signal_hook::consts::SIGXFSZ, Arc::default())?;
        Ok(signals)
    }
}

/// True once the command is to end, by Ctrl-C or by its supervisor.
///
/// # Errors
/// What the system says.
pub(super) fn end() -> io::Result<Arc<AtomicBool>> {
    let end = Arc::default();
    for signal in [SIGINT, SIGTERM] {
        register(signal, Arc::clone(&end))?;
    }
    Ok(end)
}
