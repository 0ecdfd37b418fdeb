//! What comes in over Zenoh: frames, sites, tokens that are gone; what of it is lost.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;
use std::time::Instant;

use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::keys::{What, area_of};
use super::{AreaPlace, Said, SiteSaid};
use crate::log_limit::CountLog;
use kehai_tracking::areas::{AreaFrame, AreaName};

/// Longest frame or site that is taken, bytes: a thousand modules.
const LONGEST: usize = 4 << 20;

/// What was heard.
pub(super) enum Heard {
    Frame(AreaName, u64, Box<AreaFrame>),
    Site(AreaName, Box<SiteSaid<'static>>),
    Gone(AreaName),
}

/// Messages that were lost.
#[derive(Default)]
pub(super) struct Lost {
    not_understood: AtomicU64,
    no_room: AtomicU64,
}

impl Lost {
    /// Says in the log how many were lost since the start, once in a while.
    pub fn say(&self, log: &mut CountLog<2>) {
        let counts = [&self.not_understood, &self.no_room].map(|count| count.load(Ordering::Relaxed));
        if log.is_due(counts, Instant::now()) {
            let [not_understood, no_room] = counts;
            tracing::warn!("areas: {not_understood} messages were not understood, {no_room} found no room");
        }
    }
}

/// Asks for the site of an area; the answer comes later, or never.
pub(super) fn ask(
    session: &Session,
    place: &AreaPlace,
    answered: impl Fn(Option<Heard>) + Send + Sync + 'static,
) -> Result<(), zenoh::Error> {
    let area = place.area.clone();
    session
        .get(place.key(What::Site))
        .callback(move |reply| {
            if let Ok(sample) = reply.result() {
                let said = read(sample).map(|said| Heard::Site(area.clone(), Box::new(said)));
                answered(said);
            }
        })
        .wait()
}

pub(super) fn pass(to: &SyncSender<Heard>, lost: &Lost, heard: Option<Heard>) {
    let Some(heard) = heard else {
        lost.not_understood.fetch_add(1, Ordering::Relaxed);
        return;
    };
    if to.try_send(heard).is_err() {
        lost.no_room.fetch_add(1, Ordering::Relaxed);
    }
}

pub(super) fn frame(sample: &Sample) -> Option<Heard> {
    let area = area_of(sample.key_expr().as_str())?;
    let said: Said<'_> = read(sample)?;
    Some(Heard::Frame(area, said.site_revision, Box::new(said.into())))
}

fn read<T: serde::de::DeserializeOwned>(sample: &Sample) -> Option<T> {
    let bytes = sample.payload().to_bytes();
    if bytes.len() > LONGEST {
        return None;
    }
    serde_json::from_slice(&bytes).ok()
}
