//! Many copies of a recorded site, side by side: a building of equal rooms, to measure the cost of a tracker.
//!
//! ```text
//!   ┌─────┐        ┌─────┬─────┬─────┐
//!   │ 1 2 │  ─▶    │ 1 2 │ 3 4 │ 5 6 │      same walls, people and scans; modules of their own, and reports
//!   └─────┘        └─────┴─────┴─────┘      that come evenly spread over a scan's time
//! ```

use kehai::wire::{Message, ModuleId};
use kehai_tracking::site::{Entry, Exclude, Module, Mover, Site, Wall, Zone};

use super::unit::module_id;
use super::{Arrival, ModuleName, Moment, Record};

/// Bytes of a datagram that hold the device's identity.
const IDENTITY: std::ops::Range<usize> = 8..14;

/// Copies come one after another within this time, µs: a scan of a URG-04LX.
const SPREAD_US: u64 = 100_000;

impl Record {
    /// The same site `count` times, in a square with `apart_m` between neighbours. The positions of
    /// people are left out: only the times of the truth are kept.
    #[must_use]
    pub fn copies(&self, count: usize, apart_m: f64) -> Self {
        let columns = (count as f64).sqrt().ceil() as usize;
        let place = |copy: usize| [(copy % columns) as f64 * apart_m, (copy / columns) as f64 * apart_m];
        let mut copies = Self {
            site: Site::default(),
            modules: Vec::new(),
            arrivals: Vec::new(),
            events: None,
            truth: self.truth.iter().map(|moment| Moment { t: moment.t, people: Vec::new() }).collect(),
            ..self.clone()
        };
        for copy in 0..count {
            let first = copies.modules.len();
            let late_us = SPREAD_US * copy as u64 / count as u64;
            let id = |module: usize| module_id(first + module);
            add(&mut copies.site, &self.site, place(copy), copy, id);
            copies.modules.extend(
                (0..self.modules.len()).map(|own| ModuleName { name: id(own).to_string(), id: id(own).0 }),
            );
            copies.arrivals.extend(self.arrivals.iter().map(|arrival| {
                let own = usize::from(arrival.module);
                Arrival {
                    at_us: arrival.at_us + late_us,
                    module: u16::try_from(first + own).unwrap_or(u16::MAX),
                    bytes: as_from(&arrival.bytes, id(own), late_us),
                }
            }));
        }
        copies.arrivals.sort_by_key(|arrival| arrival.at_us);
        copies
    }
}

/// The datagram as another device would have sent it, in a session that is later by `late_us`.
fn as_from(datagram: &[u8], id: ModuleId, late_us: u64) -> Vec<u8> {
    let mut bytes = datagram.to_vec();
    if let Some(place) = bytes.get_mut(IDENTITY) {
        place.copy_from_slice(&id.0);
    }
    if let Ok((_, Message::Subscribed(told))) = Message::decode(datagram) {
        let later = (u64::from_le_bytes(told.t1) + late_us).to_le_bytes();
        let at = datagram.windows(later.len()).position(|window| window == told.t1);
        if let Some(place) = at.and_then(|at| bytes.get_mut(at..at + later.len())) {
            place.copy_from_slice(&later);
        }
    }
    bytes
}

/// Adds `from`, moved, to a site; its modules are called by their identity.
fn add(to: &mut Site, from: &Site, [x_m, y_m]: [f64; 2], copy: usize, id: impl Fn(usize) -> ModuleId) {
    let moved = |place: &[f64; 2]| [place[0] + x_m, place[1] + y_m];
    let all = |places: &[[f64; 2]]| places.iter().map(moved).collect::<Vec<_>>();
    let named = |name: &str| format!("{name} {}", copy + 1);
    to.modules.extend(from.modules.iter().enumerate().map(|(own, module)| Module {
        name: id(own).to_string(),
        x: module.x + x_m,
        y: module.y + y_m,
        ..module.clone()
    }));
    to.walls.extend(from.walls.iter().map(|wall| Wall { points: all(&wall.points), ..wall.clone() }));
    to.zones.extend(from.zones.iter().map(|zone| Zone {
        name: named(&zone.name),
        polygon: all(&zone.polygon),
        ..zone.clone()
    }));
    to.entries.extend(from.entries.iter().map(|entry| Entry {
        name: named(&entry.name),
        line: entry.line.map(|end| moved(&end)),
        zone: entry.zone.as_deref().map(named),
    }));
    to.movers.extend(
        from.movers.iter().map(|mover| Mover { name: named(&mover.name), polygon: all(&mover.polygon) }),
    );
    to.excludes.extend(
        from.excludes.iter().map(|area| Exclude { name: named(&area.name), polygon: all(&area.polygon) }),
    );
}
