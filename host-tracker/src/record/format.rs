//! What a recording holds, and why there is none.

use std::path::PathBuf;

use kehai::wire::ModuleId;
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::site::Site;
use serde::{Deserialize, Serialize};

pub(super) const SITE: &str = "/site";
pub(super) const DATAGRAMS: &str = "/datagrams";
pub(super) const ELSEWHERE: &str = "/elsewhere";
pub(super) const LINES: &str = "/lines";
pub(super) const LOST: &str = "/lost";

/// What is recorded, with its time on the tracker's clock, µs.
pub(super) enum Message {
    Told(u64, Box<Told>),
    Datagram(u64, Box<[u8]>),
    Elsewhere(u64, ModuleId),
    Line(u64, Box<TracksLine>),
}

/// Messages that should be here and are not.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Lost {
    pub messages: u64,
}

/// The configuration of the tracker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// The tracker's name.
    pub tracker: String,
    /// The site.
    pub site: Site,
    /// What it took back at its start from a process that had ended, and how long before that was known, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub restored: Option<(TracksLine, f64)>,
}

/// Why there is no recording.
#[derive(Debug, thiserror::Error)]
#[error("{}: {error}", file.display())]
pub struct RecordError {
    pub(super) file: PathBuf,
    pub(super) error: Cause,
}

#[derive(Debug, thiserror::Error)]
pub(super) enum Cause {
    #[error("{0}")]
    Io(#[from] std::io::Error),
    #[error("{0}")]
    Mcap(mcap::McapError),
    #[error("{0}")]
    Json(#[from] serde_json::Error),
    #[error("it does not begin with a site: is it a recording of kehai-tracker?")]
    Foreign,
    #[error("it is no recording: kehai-tracker run --record FILE.mcap makes one")]
    NoMcap,
    #[error("it is damaged: its lengths contradict each other")]
    Damaged,
    #[error("its site: {0}")]
    Site(String),
    #[error("{0}")]
    Tracker(#[from] kehai_tracking::tracker::UnknownTracker),
}

impl From<mcap::McapError> for Cause {
    fn from(error: mcap::McapError) -> Self {
        match error {
            mcap::McapError::BadMagic => Self::NoMcap,
            error => Self::Mcap(error),
        }
    }
}
