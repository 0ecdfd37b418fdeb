//! The camera of an entrance as the source of a device's ranges: a frame whenever the device takes one.
//!
//! ```text
//!   revolution at t ─▶ Camera ─ t ─▶ Moments: the frame at t ─▶ FanSource: foreground, fan, sizes ─▶ ranges
//! ```

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use kehai_depth::camera::Camera;
use kehai_depth::device::FanSource;
use kehai_depth::frame::Frame;
use kehai_depth::sizes::Sizes;
use kehai_depth::source::{BadFrame, Frames};
use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry, SourceScan};
use kehai_emulator::urg::Config;

use super::{CAMERA, Entrance};

/// Our camera: a child of 0.9 m is seen above this, and what hangs from a hand is not.
pub const LOW: Camera = Camera { above_m: Some(0.7), ..CAMERA };

/// The frames of an entrance at the time that is wanted.
struct Moments {
    entrance: Arc<Entrance>,
    begins_s: f64,
    now_us: Arc<AtomicU64>,
    taken: u64,
}

impl Frames for Moments {
    fn next_frame(&mut self) -> Option<Result<Frame, BadFrame>> {
        let at_s = self.now_us.load(Ordering::Relaxed) as f64 * 1e-6 - self.begins_s;
        self.taken += 1;
        self.entrance.frame_at(at_s, self.taken).map(Ok)
    }
}

/// The camera.
pub struct DepthCamera {
    source: FanSource,
    now_us: Arc<AtomicU64>,
}

impl DepthCamera {
    /// Before this entrance, whose first frame is `begins_s` after the device's time 0; until then it is empty. None if
    /// the background cannot be learned.
    #[must_use]
    pub fn new(entrance: &Arc<Entrance>, begins_s: f64) -> Option<Self> {
        let now_us = Arc::new(AtomicU64::new(0));
        let background = entrance.background()?;
        let frames =
            Moments { entrance: Arc::clone(entrance), begins_s, now_us: Arc::clone(&now_us), taken: 0 };
        let source = FanSource::new(Box::new(frames), LOW, background, Box::new(|_| {}));
        Some(Self { source, now_us })
    }

    /// The emulated sensor.
    #[must_use]
    pub fn config(&self) -> Config {
        self.source.config()
    }

    /// The sizes for its reports.
    #[must_use]
    pub fn sizes(&self) -> Arc<Sizes> {
        self.source.sizes()
    }
}

impl RangeSource for DepthCamera {
    fn geometry(&self) -> SensorGeometry {
        self.source.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        self.now_us.store(revolution.start_us, Ordering::Relaxed);
        self.source.scan(revolution)
    }

    fn latest(&mut self, revolution: Revolution) -> Option<SourceScan> {
        self.source.latest(revolution)
    }
}
