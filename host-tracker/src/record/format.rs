//! What a recording holds, and why there is none.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use kehai::wire::ModuleId;
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::site::Site;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::alarm_handle::AlarmChange;
use crate::scans::Scan;

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
    Scan(u64, Box<Scan>),
    Alarm(u64, Box<AlarmChange>),
}

impl Message {
    pub(super) const fn at_us(&self) -> u64 {
        match *self {
            Self::Told(at_us, _)
            | Self::Datagram(at_us, _)
            | Self::Elsewhere(at_us, _)
            | Self::Line(at_us, _)
            | Self::Scan(at_us, _)
            | Self::Alarm(at_us, _) => at_us,
        }
    }

    /// Whether it is only shown: without it the recording can be followed again all the same.
    pub(super) const fn is_shown(&self) -> bool {
        match self {
            Self::Scan(..) | Self::Alarm(..) => true,
            Self::Told(..) | Self::Datagram(..) | Self::Elsewhere(..) | Self::Line(..) => false,
        }
    }
}

/// Messages that should be here and are not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub(super) struct Lost {
    /// Without which the recording cannot be followed again.
    pub messages: u64,
    /// Scans and alarms, which are only shown.
    #[serde(default)]
    pub shown: u64,
}

/// The same, counted where they are lost. Clones are the same count.
#[derive(Clone, Debug, Default)]
pub(super) struct Losses(Arc<(AtomicU64, AtomicU64)>);

impl Losses {
    /// A message that is only shown, or not, is lost.
    pub(super) fn add(&self, is_shown: bool) {
        let count = if is_shown { &self.0.1 } else { &self.0.0 };
        count.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn so_far(&self) -> Lost {
        let (messages, shown) = &*self.0;
        Lost { messages: messages.load(Ordering::Relaxed), shown: shown.load(Ordering::Relaxed) }
    }
}

/// The configuration of the tracker.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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
