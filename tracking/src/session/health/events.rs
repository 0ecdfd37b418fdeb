//! What a module did with its background and its settings: reported in each health, published for a minute.
//!
//! ```text
//!   health, once a second ─▶ its newest eight events, each with a number ─▶ those that are new ─▶ frames, for a minute ─▶ database
//! ```
//!
//! What happened before the tracker watched is not published: a restarted tracker would record it twice.

use std::collections::VecDeque;
use std::net::Ipv4Addr;

use kehai::wire::{Event, Health};

use crate::figures::{rounded, seconds};
use crate::snapshot::EventLine;

/// How long an event stays in snapshots, µs: a sink that misses some snapshots does not miss it.
const SHOWN_US: u64 = 60_000_000;

/// Events shown at once.
const SHOWN: usize = 16;

/// The newest events of one module.
#[derive(Clone, Debug, Default)]
pub struct Events {
    /// Number of its newest event, and in which of its lives.
    newest: (u32, u32),
    shown: VecDeque<(u64, EventLine)>,
}

impl Events {
    /// Records the events in its health of start `boot`, which came at `now_us`; `since_us` is when the watch began.
    pub fn record(&mut self, boot: u32, health: &Health<'_>, since_us: u64, now_us: u64) {
        // Each start counts its events from 1, and after a reset to factory settings starts count from 1, too.
        let (of, newest) = self.newest;
        let before = if of == boot { newest } else { 0 };
        for event in health.events.iter().filter(|event| event.number > before) {
            self.newest = (boot, event.number);
            let ago_us = health.head.uptime_us.saturating_sub(event.at_us);
            if let Some(at_us) = now_us.checked_sub(ago_us).filter(|&at_us| at_us >= since_us) {
                self.shown.push_back((at_us, line(boot, &event)));
            }
        }
        let over = self.shown.len().saturating_sub(SHOWN);
        self.shown.drain(..over);
    }

    /// Those of the last minute, oldest first.
    pub fn lines(&mut self, now_us: u64) -> Vec<EventLine> {
        self.shown.retain(|(at_us, _)| now_us.saturating_sub(*at_us) < SHOWN_US);
        let line = |(at_us, line): &(u64, EventLine)| {
            let ago_s = rounded(seconds(*at_us, now_us), 10.0);
            EventLine { ago_s, ..line.clone() }
        };
        self.shown.iter().map(line).collect()
    }
}

fn line(boot: u32, event: &Event) -> EventLine {
    let by = Ipv4Addr::from(event.by);
    let text =
        if by.is_unspecified() { event.kind.to_string() } else { format!("{}, as {by} asked", event.kind) };
    EventLine { boot, number: event.number, kind: event.kind.into(), text, ago_s: 0.0 }
}
