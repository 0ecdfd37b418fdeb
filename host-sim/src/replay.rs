//! Recorded scans as the module would have judged them: sent as SCIP bytes by an emulated sensor,
//! read by the library's driver, judged by its pipeline. The same recording gives the same result.

use std::path::Path;

use kehai::background::{BeamState, LEARN_SCANS, LearnRequest};
use kehai::pipeline::Settings;
use kehai::scan::GeometryError;
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::tracker::LifeCycle;
use serde::Serialize;

use crate::jsonl::CandidatesLine;
use crate::picture::{Picture, exposure};
use kehai_emulator::chain::{Chain, ChainError};
use kehai_emulator::recording::{Recording, RecordingSource};
use kehai_emulator::source::{RangeSource, SensorGeometry};
use kehai_emulator::urg::Config;
use kehai_emulator::urg::model::URG_04LX;

/// The scans from which the background is learned.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Learn {
    /// As the module does it: from this many first scans, in which no person may move.
    Scans(u16),
    /// From the whole recording, people and all, before it is judged from its start.
    All,
}

impl Default for Learn {
    fn default() -> Self {
        Self::Scans(LEARN_SCANS)
    }
}

/// Why a recording cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// Its numbers do not describe a sensor.
    #[error("impossible geometry: {0}")]
    Geometry(#[from] GeometryError),
    /// The chain stopped.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// A recording's name is no module of the site.
    #[error("the site has no module \"{name}\"; it has: {known}")]
    NoModule {
        /// The recording's name.
        name: String,
        /// Those of the site.
        known: String,
    },
    /// They are not of one clock.
    #[error("the recordings are more than a week apart: their stamps must be of one clock, in µs")]
    Apart,
    /// A module cannot have this name.
    #[error("\"{0}\" is too long for a module's name: 32 bytes at most")]
    LongName(String),
    /// The background learned beforehand does not fit the module's flash.
    #[error("what was learned does not fit the module's flash")]
    NotStored,
}

/// Results of a recording.
#[derive(Clone, Debug)]
pub struct Replay {
    /// One line a scan, in order.
    pub lines: Vec<CandidatesLine>,
    /// The whole of it to look at.
    pub picture: Picture,
    /// The figures.
    pub summary: Summary,
}

/// The figures of a replay.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Summary {
    /// Scans in the recording.
    pub recorded: usize,
    /// Scans that came through sensor, link and driver.
    pub decoded: usize,
    /// Scans judged with a learned background.
    pub judged: usize,
    /// Beams that know a wall, at the end.
    pub wall_beams: usize,
    /// Beams that are open, at the end.
    pub open_beams: usize,
    /// Beams that are not judged, at the end.
    pub unknown_beams: usize,
    /// Judged scans with a wide candidate.
    pub with_wide: usize,
    /// Judged scans with any candidate.
    pub with_any: usize,
    /// Most wide candidates at once.
    pub most_wide: usize,
    /// Most wide candidates at once that three scans in a row had.
    pub most_wide_in_three: usize,
    /// Most candidates at once.
    pub most_any: usize,
}

impl Replay {
    /// Plays `recording` under the name `module`. `progress` is told how many scans are done, of how many.
    ///
    /// # Errors
    /// [`ReplayError`].
    pub fn run(
        recording: &Recording,
        module: &str,
        learn: Learn,
        mut progress: impl FnMut(usize, usize),
    ) -> Result<Self, ReplayError> {
        kehai::scan::Geometry::new(recording.geometry)?;
        let scans = recording.scans.len();
        let passes = if learn == Learn::All { 2 } else { 1 };
        let request = match learn {
            Learn::Scans(scans) => LearnRequest { scans, even_if_moving: false },
            Learn::All => LearnRequest { scans: scans.try_into().unwrap_or(u16::MAX), even_if_moving: true },
        };
        let source = || Box::new(RecordingSource::new(recording.clone()));
        let sensor = sensor(source().geometry());
        let settings = Settings { learn: request, ..Settings::default() };
        let mut chain = Chain::new(source(), sensor.clone(), settings);
        if passes == 2 {
            let mut done = 0;
            while chain.next_scan()?.is_some() {
                done += 1;
                progress(done, passes * scans);
            }
            chain.restart(source(), sensor);
        }
        let done_before = (passes - 1) * scans;
        let mut replay = Self {
            lines: Vec::with_capacity(scans),
            picture: Picture::default(),
            summary: Summary::default(),
        };
        for (index, recorded) in recording.scans.iter().enumerate() {
            let Some(judged) = chain.next_scan()? else { break };
            let t_s = recorded.stamp_us as f64 / 1e6;
            let line = CandidatesLine::new(t_s, module, judged.scan.geometry, judged.judgement);
            replay.lines.push(CandidatesLine { seq: index as u32 + 1, ..line });
            replay.picture.scans.push(exposure::scan(t_s, &judged.scan, judged.judgement));
            replay.summary.judged += usize::from(judged.judgement.background_version != 0);
            progress(done_before + index + 1, passes * scans);
        }
        replay.summarise(recording, &chain);
        replay.picture.title = format!("{module}: {} scans", replay.summary.decoded);
        replay.picture.subtitle = replay.summary.in_words();
        Ok(replay)
    }

    fn summarise(&mut self, recording: &Recording, chain: &Chain) {
        let model: Vec<_> = chain.pipeline().background().model().collect();
        let beams = |state| model.iter().filter(|beam| beam.state == state).count();
        let wide: Vec<_> =
            self.lines.iter().map(|line| line.candidates.iter().filter(|c| !c.narrow).count()).collect();
        let any = || self.lines.iter().map(|line| line.candidates.len());
        self.summary = Summary {
            recorded: recording.scans.len(),
            decoded: self.lines.len(),
            judged: self.summary.judged,
            wall_beams: beams(BeamState::Wall),
            open_beams: beams(BeamState::Open),
            unknown_beams: beams(BeamState::Unknown),
            with_wide: wide.iter().filter(|&&count| count > 0).count(),
            with_any: any().filter(|&count| count > 0).count(),
            most_wide: wide.iter().copied().max().unwrap_or(0),
            most_wide_in_three: wide
                .windows(3)
                .filter_map(|three| three.iter().copied().min())
                .max()
                .unwrap_or(0),
            most_any: any().max().unwrap_or(0),
        };
        if let Some(geometry) = chain.geometry() {
            self.picture.background = exposure::background(geometry, model.iter().copied());
        }
    }
}

impl Summary {
    /// The figures in one line.
    #[must_use]
    pub fn in_words(&self) -> String {
        format!(
            "{} beams wall, {} open, {} unknown · {} scans judged, {} with a wide candidate, {} with any · at most {} wide, {} in all at once",
            self.wall_beams,
            self.open_beams,
            self.unknown_beams,
            self.judged,
            self.with_wide,
            self.with_any,
            self.most_wide,
            self.most_any,
        )
    }
}

/// The name of a recording's module: the file's name without its ending.
#[must_use]
pub fn module_name(path: &Path) -> String {
    path.file_stem().map_or_else(|| "recording".into(), |stem| stem.to_string_lossy().into_owned())
}

/// A track that was confirmed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Identity {
    /// The track's.
    pub id: u64,
    /// First time as confirmed, s.
    pub first_s: f64,
    /// Last time as confirmed, s.
    pub last_s: f64,
    /// For how long as confirmed, s.
    pub confirmed_s: f64,
}

/// All tracks that were ever confirmed, from lines `step_s` apart, in order of appearance.
#[must_use]
pub fn identities(lines: &[TracksLine], step_s: f64) -> Vec<Identity> {
    let mut found: Vec<Identity> = Vec::new();
    for line in lines {
        for track in line.tracks.iter().filter(|track| track.state == LifeCycle::Confirmed) {
            match found.iter_mut().find(|identity| identity.id == track.id) {
                Some(identity) => {
                    identity.last_s = line.t;
                    identity.confirmed_s += step_s;
                }
                None => {
                    let (first_s, last_s) = (line.t, line.t);
                    found.push(Identity { id: track.id, first_s, last_s, confirmed_s: step_s });
                }
            }
        }
    }
    found
}

/// A sensor that could have taken a recording, on a line that is never too slow.
pub(crate) fn sensor(geometry: SensorGeometry) -> Config {
    Config { paced: false, ..Config::new(URG_04LX.with_geometry(geometry)) }
}
