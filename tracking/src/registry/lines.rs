//! How every device is: a line of the snapshot for each that is in the site or has been found.
//!
//! ```text
//!   site      left ────▶ the device that answers as "left" ─▶ line      none has: missing, since when
//!             right
//!   found     of no place in the site ─▶ line, after those of the site
//!   given     an address where nothing has answered ─▶ line
//! ```

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::iter;
use std::sync::Arc;

use kehai::wire::ModuleId;

use super::Registry;
use crate::alarm::AlarmKind;
use crate::explain::alarm::DeviceCondition;
use crate::observation::Observation;
use crate::session::health::Monitor;
use crate::session::{Session, Sessions};
use crate::site::Place;
use crate::snapshot::{DeviceState, ModuleLine};

/// An observation older than this no longer shows what the device sees, s.
const OLD_S: f64 = 1.0;

/// Most corners of what a device sees, the device's own place left out: one for each 2° of a whole turn.
const CORNERS: usize = 180;

/// Which of two devices stands for a place: before all the one that has a key, then the one that is there.
type Rank = (bool, bool);

impl Registry {
    /// Judges how every device is at `now_us`: those of the site in its order, then the others. One that is neither in the site nor
    /// there any more is forgotten; since when one is missing, and how long an alarm's cause has lasted, is counted by these calls.
    pub fn update_lines(&mut self, sessions: &mut Sessions, now_us: u64) -> Vec<ModuleLine> {
        self.forget_departed(sessions);
        let Self { site, routes, answered, missing, .. } = self;
        let mut placed: BTreeMap<Place, (Rank, ModuleLine)> = BTreeMap::new();
        let mut others = Vec::new();
        for (&device, answered) in answered {
            let alarm = sessions.alarm(device, now_us);
            let Some(session) = sessions.get_mut(device) else { continue };
            let place = site.place_of_device(session.name(), device);
            let known = site.places().find(|(known, _)| Some(*known) == place);
            let name = known.map(|(_, name)| name.to_owned());
            let name = name.unwrap_or_else(|| session.name().to_owned());
            let (subscribed, is_sealed) = (session.wants_reports(), session.is_sealed());
            let furniture = match place {
                Some(Place::Module(module)) => {
                    site.modules.get(module).map_or(&[][..], |module| &module.furniture)
                }
                _ => &[],
            };
            let Some(mut line) = session.line(&name, furniture, now_us) else { continue };
            line.address = answered.address.to_string();
            show_view(&mut line, answered.newest.as_ref(), now_us);
            if !matches!(place, Some(Place::Module(module)) if !site.is_placed(module)) {
                line.sees.clear();
            }
            if line.state != DeviceState::Missing && !subscribed {
                line.state = DeviceState::Found;
            }
            if let Some(alarm) = alarm {
                line.alarms.insert(0, alarm);
            }
            let Some(place) = place else {
                others.push(line);
                continue;
            };
            // Of two with one place the one of the higher rank stands for it; the other goes by its identity.
            let rank = (is_sealed, line.state != DeviceState::Missing);
            let second = match placed.entry(place) {
                Entry::Vacant(vacant) => {
                    vacant.insert((rank, line));
                    continue;
                }
                Entry::Occupied(mut first) if rank > first.get().0 => first.insert((rank, line)).1,
                Entry::Occupied(_) => line,
            };
            others.push(ModuleLine { name: second.id.clone(), ..second });
        }
        missing.retain(|name, _| site.places().any(|(_, known)| known == name));
        for (place, name) in site.places() {
            if placed.contains_key(&place) {
                missing.remove(name);
                continue;
            }
            let since_us = *missing.entry(name.to_owned()).or_insert(now_us);
            placed.insert(place, ((false, false), silent(name, since_us, now_us)));
        }
        for route in routes.iter().filter(|route| route.given && route.device().is_none()) {
            let Some(address) = route.address() else { continue };
            let name = address.to_string();
            let line = silent(&name, 0, now_us);
            others.push(ModuleLine { address: name, ..line });
        }
        placed.into_values().map(|(_, line)| line).chain(others).collect()
    }

    /// Forgets devices that are neither in the site nor there any more.
    fn forget_departed(&mut self, sessions: &mut Sessions) {
        let Self { site, routes, answered, .. } = self;
        answered.retain(|&device, _| {
            let Some(session) = sessions.get(device) else { return false };
            let is_there = routes.iter().any(|route| route.leads_to(device));
            let stays = is_there || site.place_of_device(session.name(), device).is_some();
            if !stays {
                sessions.part(device);
            }
            stays
        });
    }

    /// What an alarm is decided on at each device of the site, at the time of the last [`update_lines`](Self::update_lines).
    #[must_use]
    pub fn conditions(&self, kind: AlarmKind, sessions: &Sessions, now_us: u64) -> Vec<DeviceCondition> {
        let session = |place: Place| {
            let devices = self.answered.keys().filter_map(|device| Some((*device, sessions.get(*device)?)));
            let placed = devices.filter(|(device, session)| {
                self.site.place_of_device(session.name(), *device) == Some(place)
            });
            // Of two with one place the one that stands for it in the lines.
            let rank = |session: &&Session| -> Rank { (session.is_sealed(), session.is_heard(now_us)) };
            placed.map(|(_, session)| session).max_by_key(rank)
        };
        let condition = |(place, name): (Place, &str)| DeviceCondition {
            device: name.to_owned(),
            condition: match session(place) {
                Some(session) => session.condition(kind, now_us),
                None => {
                    let since_us = self.missing.get(name).copied().unwrap_or(now_us);
                    Monitor::new(since_us).condition(kind, None, now_us)
                }
            },
        };
        self.site.places().map(condition).collect()
    }
}

/// How a device is that has never answered since `since_us`.
fn silent(name: &str, since_us: u64, now_us: u64) -> ModuleLine {
    Monitor::new(since_us).line(name, ModuleId::ANY, None, now_us)
}

/// What a device sees and what it cannot judge, from its newest observation.
fn show_view(line: &mut ModuleLine, newest: Option<&Observation>, now_us: u64) {
    let Some(observation) = newest.filter(|newest| now_us as f64 * 1e-6 - newest.start_s < OLD_S) else {
        return;
    };
    let beams = observation.background_mm.len().max(1);
    let unlearned = observation.background_mm.iter().filter(|range_mm| **range_mm == 0).count();
    line.unknown_share = (line.unknown_share + unlearned as f64 / beams as f64).min(1.0);
    let view = &observation.view;
    let each = observation.empty_mm.len().div_ceil(CORNERS).max(1);
    let corner = |(index, ranges_mm): (usize, &[u16])| {
        let beam = u16::try_from(index * each + ranges_mm.len() / 2).unwrap_or(u16::MAX);
        let range_m = f64::from(ranges_mm.iter().copied().min().unwrap_or(0)) * 1e-3;
        let at = view.place(f64::from(view.geometry.bearing_rad(beam)), range_m);
        [cm(at.x), cm(at.y)]
    };
    let from = [cm(view.pose.at.x), cm(view.pose.at.y)];
    let corners = observation.empty_mm.chunks(each).enumerate().map(corner);
    line.free = Arc::new(iter::once(from).chain(corners).collect());
    let seen = observation.detections.iter().filter(|seen| !seen.candidate.narrow);
    line.sees = seen.map(|seen| [cm(seen.centre.x), cm(seen.centre.y)]).collect();
}

fn cm(value_m: f64) -> f64 {
    (value_m * 100.0).round() / 100.0
}
