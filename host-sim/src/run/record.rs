//! A whole run in a file, so that the same datagrams can be replayed without a new simulation.
//!
//! ```text
//!   "kehai run 2\n"   then the record in postcard's encoding, the site in it as the text of its file
//! ```

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{Arrival, ModuleName, Moment, Options, Run, TICK_US};
use crate::world::Events;
use crate::world::scene::Scene;
use crate::world::site::Site;
use kehai_emulator::simulated_time::Stuck;

/// First bytes of the file.
const MAGIC: &[u8] = b"kehai run 2\n";

/// A run: all that a tracker and its scorer need.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Record {
    /// The seed.
    pub seed: u64,
    /// How long it took, in seconds of the world.
    pub duration_s: f64,
    /// The site: poses, walls, zones, entries, movers.
    #[serde(with = "as_text")]
    pub site: Site,
    /// The modules, in the order of the site.
    pub modules: Vec<ModuleName>,
    /// The times of the door scenario, if the scene has one.
    pub events: Option<Events>,
    /// All datagrams, in order of arrival.
    pub arrivals: Vec<Arrival>,
    /// Truth, every 0.1 s from 0 on.
    pub truth: Vec<Moment>,
}

/// Why a record cannot be read or written.
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

/// A site as the text of its file: empty fields may be left out there, which postcard cannot represent.
mod as_text {
    use serde::de::{Deserialize, Deserializer, Error as _};
    use serde::ser::{Error as _, Serialize, Serializer};

    use crate::world::site::Site;

    pub fn serialize<S: Serializer>(site: &Site, to: S) -> Result<S::Ok, S::Error> {
        toml::to_string(site).map_err(S::Error::custom)?.serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Site, D::Error> {
        toml::from_str(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_comes_back_from_its_file_with_and_without_doors() {
        for name in ["empty", "door-area"] {
            let mut scene = Scene::load(name).unwrap();
            scene.duration_s = 0.1;
            scene.gathering = None;
            let record = Record::of(&scene, 1, &Options::default()).unwrap();
            let path = std::env::temp_dir().join(format!("kehai-record-{}-{name}.run", std::process::id()));
            record.save(&path).unwrap();
            let loaded = Record::load(&path).unwrap();
            fs::remove_file(&path).unwrap();
            assert_eq!(loaded, record);
        }
    }
}
