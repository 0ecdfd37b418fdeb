//! An emulated sensor on a terminal that QEMU opens as the image's serial line: its speed matters.
//!
//! ```text
//! image sets   9600  19 200  38 400  57 600  115 200  250 000  500 000  750 000
//! QEMU sets    9600  19 200  38 400  57 600  115 200  230 400  460 800  921 600     and is understood as above
//! ```
//!
//! QEMU knows only the speeds of old PCs and takes the first that is not more than 9 % too slow.
//!
//! Source: QEMU 7.2, chardev/char-serial.c, `tty_serial_init`.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::JoinHandle;
use std::time::Instant;

use super::{LOOK_AGAIN, PATIENCE};
use crate::serve::{Control, serve_terminal};
use crate::urg::Urg;

/// What QEMU sets, and what the image has asked for.
const RATES: [(u32, u32); 3] = [(230_400, 250_000), (460_800, 500_000), (921_600, 750_000)];

/// A running sensor, in a thread of its own. It ends when dropped.
pub struct TerminalSensor {
    link: PathBuf,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

impl TerminalSensor {
    /// Serves `sensor` on a new terminal. The sensor's time starts at 0 with this call.
    ///
    /// # Errors
    /// No terminal is to be had.
    pub fn start(sensor: Urg) -> io::Result<Self> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let link = std::env::temp_dir().join(format!("kehai-sensor-{}-{number}", std::process::id()));
        let stop = Arc::new(AtomicBool::new(false));
        let (own_link, stopped) = (link.clone(), Arc::clone(&stop));
        let thread = std::thread::Builder::new().name("sensor".into()).spawn(move || {
            let mut control = Control { stop: &stopped, on_status: &mut |_| {} };
            serve_terminal(&own_link, sensor, asked_for, &mut control)
        })?;
        let sensor = Self { link, stop, thread: Some(thread) };
        let begin = Instant::now();
        while !sensor.link.exists() {
            if begin.elapsed() > PATIENCE {
                return Err(io::ErrorKind::TimedOut.into());
            }
            std::thread::sleep(LOOK_AGAIN);
        }
        Ok(sensor)
    }

    /// The terminal, for [`Line::Terminal`](super::Line::Terminal).
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.link
    }
}

impl Drop for TerminalSensor {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A sensor that has failed has been silent, which shows.
            let _ = thread.join();
        }
    }
}

/// The speed the image has asked for when QEMU has set `rate_baud`.
fn asked_for(rate_baud: u32) -> u32 {
    RATES.iter().find(|(set, _)| *set == rate_baud).map_or(rate_baud, |&(_, asked)| asked)
}
