//! Names over areas: what an area said of its tracks when it read an ID, and where these persons have gone since.
//!
//! ```text
//!   frame of east   a11ce000, read 0.3 s ago: 7 ─╮   by east's own clock: a new reading, or the one that was taken already
//!   frame of west   a11ce000, read 4.0 s ago: 3 ─┤   by when the frames came: which of the two areas read it last
//!                                                ╰─▶ person 12: 0.9, kept among the persons from then on
//! ```
//!
//! A frame that comes late says no new reading: its area's own clock tells. The clocks of two areas are never compared.

use std::collections::{BTreeMap, BTreeSet};

use super::persons::Persons;
use super::tracks::Key;
use super::{AreaFrame, AreaName};
use crate::figures::rounded;
use crate::geometry::Point;
use crate::jsonl::TrackLine;
use crate::names::line::zones_at;
use crate::names::{Carried, Likelihood, NameLine};
use crate::site::Site;

/// Of a name that no area tells any more nothing is kept longer than trackers keep it, µs: an hour.
const NAMED_US: u64 = 3_600_000_000;

/// A reading of an area is another one if that was so much later by its own clock, s: areas say it in tenths of a second.
const ANEW_S: f64 = 0.25;

/// An area has read an ID after another one if that was so much later by when their frames came, µs: frames are a tenth of a second
/// apart, and some of them are late or lost.
const AFTER_US: u64 = 500_000;

/// A tracker: its area, and which of its starts.
type Start = (AreaName, u64);

/// The last reading of an ID by an area.
#[derive(Debug)]
struct Reading {
    /// When, s on the area's own clock.
    own_s: f64,
    /// When, µs: by the frame of it that was the least late.
    at_us: u64,
    is_taken: bool,
}

/// The reading by which an ID is known.
#[derive(Debug)]
struct Taken {
    by: Start,
    at_us: u64,
    /// Whether it fitted any person.
    has_shares: bool,
}

/// What areas have said of their readings of an ID.
#[derive(Debug, Default)]
struct Read {
    /// When it was read last, also without a place, µs.
    heard_us: u64,
    /// By area. Memory: one of each start of a tracker within the hour that an ID is kept.
    readings: BTreeMap<Start, Reading>,
    taken: Option<Taken>,
}

impl Read {
    /// Notes which reading is an area's last one.
    fn note(&mut self, by: &Start, own_s: f64, at_us: u64) {
        let new = || Reading { own_s, at_us, is_taken: false };
        let reading = self.readings.entry(by.clone()).or_insert_with(new);
        if own_s > reading.own_s + ANEW_S {
            *reading = new();
        } else {
            reading.at_us = reading.at_us.min(at_us);
        }
    }

    /// When it was read last at a place that is known, by any area, µs.
    fn last_us(&self) -> Option<u64> {
        self.readings.values().map(|reading| reading.at_us).max()
    }

    /// Takes an area's reading, if that is news; whether it is. The area that read it last knows best. Of two that read it at the same
    /// time, one that does not see its bearer takes nothing from the one that does.
    fn take(&mut self, by: &Start, has_shares: bool) -> bool {
        let last_us = self.last_us();
        let Some(reading) = self.readings.get_mut(by) else { return false };
        let is_last = last_us.is_none_or(|last_us| reading.at_us + AFTER_US >= last_us);
        let is_after = self.taken.as_ref().is_none_or(|taken| {
            let is_more = has_shares && !taken.has_shares;
            taken.by == *by || is_more || reading.at_us > taken.at_us + AFTER_US
        });
        let is_news = is_last && is_after && !reading.is_taken;
        if is_news {
            reading.is_taken = true;
            self.taken = Some(Taken { by: by.clone(), at_us: reading.at_us, has_shares });
        }
        is_news
    }
}

/// The names of all areas.
#[derive(Debug, Default)]
pub(super) struct Named {
    read: BTreeMap<String, Read>,
    names: Carried<String>,
}

impl Named {
    /// Time passes, so much of it, s.
    pub(super) fn follow(&mut self, persons: &Persons, elapsed_s: f64) {
        if !self.read.is_empty() {
            self.names.follow(&persons.all(), elapsed_s);
        }
    }

    /// Takes the last frame of an area, which came at `heard_us`.
    pub(super) fn hear(&mut self, area: &AreaName, said: &AreaFrame, heard_us: u64, persons: &Persons) {
        let by: Start = (area.clone(), said.epoch);
        let before = |since_s: f64| heard_us.saturating_sub((since_s.max(0.0) * 1e6) as u64);
        let person = |likely: &Likelihood| {
            let key = Key { area: area.clone(), epoch: said.epoch, track: likely.track };
            Some((persons.of(&key)?, likely.probability))
        };
        for line in &said.frame.names {
            let read = self.read.entry(line.label.clone()).or_default();
            read.heard_us = read.heard_us.max(before(line.heard_s));
            // One that was never read at a place is known of no track.
            let Some(read_s) = line.read_s else { continue };
            read.note(&by, said.frame.line.t - read_s, before(read_s));
            // While the likeliest track is no person yet, what is left is not known to be the name's.
            if line.tracks.first().is_some_and(|likely| person(likely).is_none()) {
                continue;
            }
            let shares: Vec<(u64, f64)> = line.tracks.iter().filter_map(person).collect();
            // Without shares, too: the reading fits nobody, and takes the name off the person who had it.
            if read.take(&by, !shares.is_empty()) {
                self.names.read(line.label.clone(), shares);
            }
        }
    }

    /// What is known of each ID that areas tell, at `now_us`: which of these tracks it is, and in which zones of `site` that is.
    pub(super) fn lines<'a>(
        &mut self,
        told: impl Iterator<Item = &'a NameLine>,
        tracks: &[TrackLine],
        site: &Site,
        now_us: u64,
    ) -> Vec<NameLine> {
        let labels: BTreeSet<&str> = told.map(|line| line.label.as_str()).collect();
        self.read.retain(|label, read| {
            labels.contains(label.as_str()) || now_us.saturating_sub(read.heard_us) <= NAMED_US
        });
        self.names.retain(|label| self.read.contains_key(label));
        labels.into_iter().filter_map(|label| self.line(label, tracks, site, now_us)).collect()
    }

    fn line(&self, label: &str, tracks: &[TrackLine], site: &Site, now_us: u64) -> Option<NameLine> {
        let read = self.read.get(label)?;
        let since_s = |at_us: u64| rounded(now_us.saturating_sub(at_us) as f64 * 1e-6, 10.0);
        let track = |likely: &Likelihood| tracks.iter().find(|track| track.id == likely.track);
        let mut persons = self.names.told(label);
        persons.retain(|likely| track(likely).is_some());
        let likeliest = persons.first().and_then(track);
        let zones = likeliest.map(|track| zones_at(site, Point::new(track.x, track.y))).unwrap_or_default();
        Some(NameLine {
            card: None,
            label: label.to_owned(),
            heard_s: since_s(read.heard_us),
            read_s: read.last_us().map(since_s),
            tracks: persons,
            zones,
        })
    }
}
