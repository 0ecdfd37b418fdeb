//! A module in memory: an emulated sensor, the library's driver and its pipeline, on simulated time.
//!
//! ```text
//! source ─▶ Urg ─▶ SCIP bytes ─▶ Driver ─▶ Scan ─▶ Pipeline ─▶ Judgement
//!           └────── MemoryLink ──────┘ └── the very code of the board ──┘
//! ```

use kehai::background::Fingerprint;
use kehai::pipeline::{Judgement, Pipeline, Settings};
use kehai::scan::{Geometry, MAX_BEAMS, ScanTime};
use kehai::sensor::driver::{Driver, Outcome};
use kehai::sensor::{SensorSettings, SensorState};

use crate::link::{LinkOptions, MemoryLink};
use crate::simulated_time::{SimulatedClock, Stuck, block_on_until};
use crate::source::RangeSource;
use crate::urg::{Config, Urg};
