//! From a datagram of a floor to a reading, or to the count of what was dropped and why.
//!
//! ```text
//!   pressed ─▶ sequence: far, repeated ─▶ clock, info: early ─▶ place: none, or of another size ─▶ time: late, ahead
//!          ─▶ Reading
//! ```

use kehai::floor::Bits;
use kehai::wire::{FaultyPanel, Pressed};

use super::Session;
use super::health::Panels;
use super::observe::is_timely;
use super::sequence::Arrival;
use crate::floor::{Plan, Reading};
use crate::snapshot::Drops;

impl Session {
    /// What a reading says that arrived at `now_us` on the host's clock; none if it is not to be used, which is counted.
    pub(super) fn read(&mut self, pressed: &Pressed<'_>, now_us: u64, drops: &mut Drops) -> Option<Reading> {
        let head = &pressed.head;
        let (arrival, sequences) = self.order(head, now_us, drops)?;
        if let Some(monitor) = &mut self.monitor {
            let panels = Panels {
                size: (pressed.columns, pressed.rows),
                wanted: self.floor.map(|(_, plan)| (plan.columns, plan.rows)),
                faulty: pressed.faulty.iter().collect(),
            };
            monitor.reading(head, panels, arrival, now_us);
        }
        if arrival == Arrival::Repeated {
            drops.repeated += 1;
            return None;
        }
        self.last_report_us = now_us;
        let Some(at_s) = self.clock.host_s(head.stamp_us).filter(|_| self.described == Some(head.setup))
        else {
            drops.early += 1;
            return None;
        };
        let fits = |plan: &Plan| (plan.columns, plan.rows) == (pressed.columns, pressed.rows);
        let Some((floor, plan)) = self.floor.filter(|(_, plan)| fits(plan)) else {
            drops.unplaced += 1;
            return None;
        };
        let now_s = now_us as f64 * 1e-6;
        if !is_timely(at_s, 0.0, now_s, drops) {
            return None;
        }
        self.sequences = sequences;
        let bytes: Vec<u8> = pressed.down.iter().collect();
        let faulty: Vec<FaultyPanel> = pressed.faulty.iter().collect();
        let mut down = Bits::of(&bytes);
        // Nothing is known of a panel that does not work, whatever its bit says.
        faulty.iter().for_each(|faulty| down.set(faulty.panel.into(), false));
        // Nothing but arrivals moves the clock of what follows.
        Some(Reading { floor, plan, at_s: at_s.min(now_s), down, faulty })
    }
}
