//! A whole run in a file, so that the same datagrams can be fed again and again without simulating anew.
//!
//! ```text
//!   "kehai run 1\n"   then the record in postcard's encoding
//! ```

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Arrival, ModuleName, Moment, Options, Run, TICK_US};
use crate::simulated_time::Stuck;
use crate::world::Events;
use crate::world::scene::Scene;
use crate::world::site::Site;

/// First bytes of the file.
const MAGIC: &[u8] = b"kehai run 1\n";

/// Everything about a run that a tracker and its judge need.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Record {
    /// The seed.
    pub seed: u64,
    /// How long it took, in seconds of the world.
    pub duration_s: f64,
    /// The site: poses, walls, zones, entries, movers.
    pub site: Site,
    /// The modules, in the order of the site.
    pub modules: Vec<ModuleName>,
    /// What happened when, if the scene has a gathering.
    pub events: Option<Events>,
    /// All datagrams, in order of arrival.
    pub arrivals: Vec<Arrival>,
    /// Truth, every 0.1 s from 0 on.
    pub truth: Vec<Moment>,
}

/// Why a record cannot be had from a file.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be read or written.
    #[error(transparent)]
    File(#[from] std::io::Error),
    /// It is not a record, or one of another version of this program.
    #[error("not a recorded run of this version")]
    Foreign,
}

impl Record {
    /// Runs the scene under `seed`, to its end.
    ///
    /// # Errors
    /// [`Stuck`]: a fault of the simulation.
    pub fn of(scene: &Scene, seed: u64, options: &Options) -> Result<Self, Stuck> {
        let mut run = Run::new(scene, seed, options);
        let duration_s = run.world().duration_s();
        let (mut arrivals, mut truth) = (Vec::new(), Vec::new());
        for tick in 0..=(duration_s * 1e6) as u64 / TICK_US {
            arrivals.extend(run.until(tick * TICK_US)?);
            truth.push(run.moment(tick * TICK_US));
        }
        Ok(Self {
            seed,
            duration_s,
            site: scene.site.clone(),
            modules: run.modules().to_vec(),
            events: run.world().events(),
            arrivals,
            truth,
        })
    }

    /// Writes it to a file.
    ///
    /// # Errors
    /// [`RecordError::File`].
    pub fn save(&self, path: &Path) -> Result<(), RecordError> {
        let bytes = postcard::to_extend(self, MAGIC.to_vec()).map_err(|_| RecordError::Foreign)?;
        Ok(fs::write(path, bytes)?)
    }

    /// Reads it from a file.
    ///
    /// # Errors
    /// [`RecordError`].
    pub fn load(path: &Path) -> Result<Self, RecordError> {
        let bytes = fs::read(path)?;
        let record = bytes.strip_prefix(MAGIC).ok_or(RecordError::Foreign)?;
        postcard::from_bytes(record).map_err(|_| RecordError::Foreign)
    }
}
