//! What was heard of each area, and the picture of all of them at one time.
//!
//! ```text
//!   frame      ─▶ ╭────────╮            heard within 2 s   its zones and people
//!   site       ─▶ │ Campus │ ─▶ picture   not             its zones unknown, its modules missing, an alarm
//!   token gone ─▶ ╰────────╯              token gone       the same, at once
//! ```

use std::collections::BTreeMap;

use super::alarms::Alarms;
use super::area::Area;
use super::grounds::Grounds;
use super::named::Named;
use super::persons::Persons;
use super::tracks::{Heard, Key};
use super::{AreaFrame, AreaName, SILENT_US, Taken, prefix};
use crate::jsonl::TrackLine;
use crate::occupancy::{Total, ZoneKnown};
use crate::site::Site;
use crate::snapshot::Snapshot;
use crate::total::{is_person, total};

/// The areas of a site. Memory: a frame and a site of each area that was ever heard, at most as many as [`Campus::new`] allows.
#[derive(Debug)]
pub struct Campus {
    areas: BTreeMap<AreaName, Area>,
    areas_max: usize,
    /// Areas that there was no room for, and when they were heard last, µs.
    refused: BTreeMap<AreaName, u64>,
    /// Since when there are such, ms since 1970.
    refused_since_ms: Option<u64>,
    persons: Persons,
    named: Named,
    followed_us: u64,
    alarms: Alarms,
    begun_us: Option<u64>,
}

impl Campus {
    /// Without any area yet; `expected` are missed from the start, and at most `areas_max` are listened to.
    #[must_use]
    pub fn new(expected: &[AreaName], areas_max: usize) -> Self {
        Self {
            areas: expected.iter().map(|area| (area.clone(), Area::default())).collect(),
            areas_max: areas_max.max(expected.len()),
            refused: BTreeMap::new(),
            refused_since_ms: None,
            persons: Persons::default(),
            named: Named::default(),
            followed_us: 0,
            alarms: Alarms::default(),
            begun_us: None,
        }
    }

    fn area(&mut self, name: &AreaName) -> Option<&mut Area> {
        let has_room = self.areas.contains_key(name) || self.areas.len() < self.areas_max;
        has_room.then(|| self.areas.entry(name.clone()).or_default())
    }

    /// Notes an area that there is no room for: what cannot be kept is at least said, of so many as there is room for.
    fn refuse(&mut self, name: &AreaName, now_us: u64) {
        if self.refused.len() < self.areas_max || self.refused.contains_key(name) {
            self.refused.insert(name.clone(), now_us);
        }
    }

    /// Takes what an area says; a frame that is older than the last one of the same start is left out, and of an area
    /// too many nothing is kept.
    pub fn hear(&mut self, name: &AreaName, frame: AreaFrame, now_us: u64) -> Taken {
        let Some(area) = self.area(name) else {
            self.refuse(name, now_us);
            return Taken::Crowded;
        };
        area.hear(frame, now_us)
    }

    /// Takes the site of an area; whether it is another one than before.
    pub fn set_site(&mut self, name: &AreaName, site: Site) -> bool {
        let Some(area) = self.area(name) else { return false };
        let has_changed = area.site.as_ref() != Some(&site);
        (area.site, area.is_site_old) = (Some(site), false);
        has_changed
    }

    /// Notes whether the tracker of an area uses another site than the one of [`Campus::set_site`]: until it has said that, the total
    /// is known in part at most.
    pub fn note_site(&mut self, name: &AreaName, is_old: bool) {
        if let Some(area) = self.areas.get_mut(name) {
            area.is_site_old = is_old;
        }
    }

    /// Whether there is an area, and each one is heard and has said the site that it uses.
    #[must_use]
    pub fn is_known(&self, now_us: u64) -> bool {
        !self.areas.is_empty() && self.areas.values().all(|area| area.is_known(now_us))
    }

    /// The tracker of an area is gone, as its token says. What is heard of it later brings it back.
    pub fn leave(&mut self, name: &AreaName) {
        self.refused.remove(name);
        if let Some(area) = self.areas.get_mut(name) {
            area.is_gone = true;
        }
    }

    /// The areas that were ever heard, or are expected.
    pub fn names(&self) -> impl Iterator<Item = &AreaName> {
        self.areas.keys()
    }

    /// The site of all areas, under the names that their parts have in the picture.
    #[must_use]
    pub fn site(&self) -> Site {
        let mut all = Site::default();
        for (name, area) in &self.areas {
            let Some(site) = &area.site else { continue };
            let site = prefix::site(name, site.clone());
            all.modules.extend(site.modules);
            all.walls.extend(site.walls);
            all.zones.extend(site.zones);
            all.entries.extend(site.entries);
            all.lines.extend(site.lines);
            all.movers.extend(site.movers);
            all.excludes.extend(site.excludes);
            all.doors.extend(site.doors);
            all.readers.extend(site.readers);
            all.floors.extend(site.floors);
        }
        all
    }

    /// The picture at `now_us`; `site` is that of [`Campus::site`].
    pub fn picture(&mut self, site: &Site, now_us: u64, unix_ms: u64) -> Snapshot {
        let begun_us = *self.begun_us.get_or_insert(now_us);
        let mut picture = Snapshot { unix_ms, ..Snapshot::default() };
        picture.line.t = now_us.saturating_sub(begun_us) as f64 * 1e-6;
        self.refused.retain(|_, heard_us| now_us.saturating_sub(*heard_us) <= SILENT_US);
        let since_ms = self.refused_since_ms.unwrap_or(unix_ms);
        self.refused_since_ms = (!self.refused.is_empty()).then_some(since_ms);
        self.areas.values_mut().for_each(|area| area.note_time(now_us, unix_ms));
        let grounds = Grounds::of(
            self.areas
                .iter()
                .filter_map(|(name, area)| Some((name, area.site.as_ref()?, &area.said(now_us)?.frame))),
        );
        let (mut heard, not_known) = (Vec::new(), Site::default());
        for (name, area) in &self.areas {
            let Some(last) = area.said(now_us) else {
                let last = area.last.as_ref().map(|last| &last.frame);
                prefix::add_unheard(name, area.site.as_ref(), last, &mut picture);
                continue;
            };
            prefix::add(name, area.site.as_ref(), &last.frame, &mut picture);
            let is_person = |track: &&TrackLine| is_person(area.site.as_ref().unwrap_or(&not_known), track);
            heard.extend(last.frame.line.tracks.iter().filter(is_person).map(|line| Heard {
                key: Key { area: name.clone(), epoch: last.epoch, track: line.id },
                line: line.clone(),
                age_s: now_us.saturating_sub(area.heard_us) as f64 * 1e-6,
                is_abroad: grounds.is_abroad(name, line),
            }));
        }
        let elapsed_s = now_us.saturating_sub(self.followed_us) as f64 * 1e-6;
        self.followed_us = now_us;
        picture.line.tracks = self.persons.follow(heard, elapsed_s);
        picture.tracks = picture.line.tracks.iter().map(Into::into).collect();
        self.named.follow(&self.persons, elapsed_s);
        let said =
            || self.areas.iter().filter_map(|(name, area)| Some((name, area.said(now_us)?, area.heard_us)));
        for (name, last, heard_us) in said() {
            self.named.hear(name, last, heard_us, &self.persons);
        }
        let told = said().flat_map(|(_, last, _)| &last.frame.names);
        picture.names = self.named.lines(told, &picture.line.tracks, site, now_us);
        picture.alarms = self.alarms.list(&self.areas, (&self.refused, since_ms), now_us);
        picture.total = total(site, &picture.line, &picture.modules);
        // Of an area without zones nobody is counted where others have some.
        let is_uncounted = |area: &Area| {
            !site.zones.is_empty() && area.site.as_ref().is_none_or(|site| site.zones.is_empty())
        };
        let is_missed = |area: &Area| !area.is_known(now_us) || is_uncounted(area);
        if !self.refused.is_empty() || self.areas.values().any(is_missed) {
            // Who is in an area is not known: it is left out, is not heard, or has not said the site that it uses.
            let Total { count, state } = picture.total;
            let state = if state == ZoneKnown::Known { ZoneKnown::Partly } else { state };
            // Without any site all people are in it, also those before its doors.
            let has_site = self.areas.values().any(|area| area.site.is_some());
            picture.total = Total { count: count.filter(|count| has_site && *count > 0), state };
        }
        picture
    }
}
