//! What comes in over Zenoh: frames, sites, tokens that are gone; what of it is lost.

use std::sync::mpsc::SyncSender;
use std::time::Instant;

use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use super::keys::{What, area_of};
use super::{AreaPlace, Said, SiteSaid};
use crate::area_losses::AreaLosses;
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

/// Says in the log how many messages were lost since the start, once in a while.
pub(super) fn say_lost(lost: &AreaLosses, log: &mut CountLog<4>) {
    let counts = lost.counts().map(|(_, count)| count);
    if log.is_due(counts, Instant::now()) {
        let [not_understood, no_room, late, crowded] = counts;
        tracing::warn!(
            "areas: {not_understood} messages were not understood, {no_room} found no room, {late} came late, {crowded} were of areas that are too many"
        );
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

pub(super) fn pass(to: &SyncSender<Heard>, lost: &AreaLosses, heard: Option<Heard>) {
    let Some(heard) = heard else {
        lost.not_understood.add(1);
        return;
    };
    if to.try_send(heard).is_err() {
        lost.no_room.add(1);
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
