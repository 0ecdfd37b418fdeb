//! A SensFloor as a device's floor: when its line is asked, when it is read, and what its line has lost.
//!
//! ```text
//!   line ─▶ sensfloor: triangles ─▶ panels, 9 Hz ─▶ floor: debounce, faults ─▶ `pressed`
//!     ◀── request, 10 Hz            a silent line: no reading
//! ```

use super::Module;
use crate::floor::sensfloor::{FRAME_LEN, Layout, Losses, SensFloor};
use crate::floor::{Floor, next_reading_us};
use crate::link::Outbox;
use crate::wire::Counter;

/// The tiles of a floor and their panels.
#[derive(Clone, Debug)]
struct Known {
    tiles: SensFloor,
    panels: Floor,
}

/// What a line has lost.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Lost {
    losses: Losses,
    /// Whole frames of another floor.
    foreign: u32,
}

/// A SensFloor beside a device; none until its settings say which tiles it has.
#[derive(Clone, Debug, Default)]
pub struct Tiles {
    known: Option<Known>,
    reading_us: u64,
    link_failures: u32,
    /// Lost while other tiles were set, earlier.
    before: Lost,
    /// Readings until the tiles were last set.
    sequence: u32,
}

impl Tiles {
    /// A floor of which nothing is known yet.
    #[must_use]
    pub const fn new() -> Self {
        let losses = Losses { torn: 0, skipped: 0, others: 0 };
        let before = Lost { losses, foreign: 0 };
        Self { known: None, reading_us: 0, link_failures: 0, before, sequence: 0 }
    }

    /// It has these tiles from `now_us` on; what was learned stays if they are the same.
    pub fn set(&mut self, layout: Option<Layout>, now_us: u64) {
        if self.known.as_ref().map(|known| known.tiles.layout()) == layout.as_ref() {
            return;
        }
        self.before = self.lost_so_far();
        self.sequence = self.known.as_ref().map_or(self.sequence, |known| known.panels.sequence());
        self.known = layout.and_then(|layout| {
            let (columns, rows) = layout.panels();
            let panels = Floor::coarse(columns, rows)?.after(self.sequence);
            Some(Known { tiles: SensFloor::new(layout, now_us), panels })
        });
    }

    /// Bytes of its line that came at `now_us`; as long as its tiles are not known they are dropped and counted.
    pub fn receive(&mut self, bytes: &[u8], now_us: u64) {
        match &mut self.known {
            Some(known) => known.tiles.receive(bytes, now_us),
            None => {
                let skipped = &mut self.before.losses.skipped;
                *skipped = skipped.saturating_add(u32::try_from(bytes.len()).unwrap_or(u32::MAX));
            }
        }
    }

    /// Its line has lost bytes or failed.
    pub fn lost(&mut self) {
        self.link_failures = self.link_failures.saturating_add(1);
        if let Some(known) = &mut self.known {
            known.tiles.lost();
        }
    }

    /// What its line has lost since the start.
    fn lost_so_far(&self) -> Lost {
        let Some(Known { tiles, .. }) = &self.known else { return self.before };
        let (Losses { torn, skipped, others }, before) = (tiles.losses(), self.before.losses);
        let losses = Losses {
            torn: torn.saturating_add(before.torn),
            skipped: skipped.saturating_add(before.skipped),
            others: others.saturating_add(before.others),
        };
        Lost { losses, foreign: tiles.foreign().saturating_add(self.before.foreign) }
    }

    /// When it is due, µs.
    #[must_use]
    pub fn next_us(&self) -> u64 {
        let Some(Known { tiles, .. }) = &self.known else { return self.reading_us };
        tiles.ask_us().min(tiles.read_us(self.reading_us))
    }
}

impl<const BEAMS: usize> Module<BEAMS> {
    /// Reads the floor if that is due, and sends the reading. Returns the bytes to be written to the floor's line, if
    /// any are.
    pub fn tiles(
        &mut self,
        tiles: &mut Tiles,
        now_us: u64,
        out: &mut impl Outbox,
    ) -> Option<[u8; FRAME_LEN]> {
        self.begin_floor();
        tiles.set(self.settings.tiles, now_us);
        let Lost { losses: Losses { torn, skipped, others }, foreign } = tiles.lost_so_far();
        self.counters.set(Counter::ScansDamaged, torn);
        self.counters.set(Counter::SensorEcho, skipped);
        self.counters.set(Counter::SensorUnexpected, others.saturating_add(foreign));
        self.counters.set(Counter::SensorLinkFailures, tiles.link_failures);
        let due_us = tiles.reading_us;
        let is_due = now_us >= tiles.known.as_ref().map_or(due_us, |known| known.tiles.read_us(due_us));
        if is_due {
            tiles.reading_us = next_reading_us(tiles.reading_us, now_us);
        }
        let known = tiles.known.as_mut()?;
        if is_due
            && !self.storing
            && let Some(reading) = known.tiles.reading(now_us)
        {
            known.panels.cannot_read(reading.unread);
            // As many bits as the floor has panels.
            let _ = known.panels.read(reading.down.bytes(known.panels.panels()));
            self.counters.set(Counter::ScansAccepted, known.panels.sequence());
            self.panels(&known.panels, now_us, now_us, out);
        }
        known.tiles.ask(now_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::Settings;
    use crate::device::fixture::{Sent, about};
    use crate::floor::sensfloor::frame::{Frame, encode};
    use crate::wire::{Alarms, SensorCode};

    fn module(settings: &str) -> Module<1> {
        let mut module = Module::new(about());
        module.begin(1, Settings::new().changed_by(settings).unwrap());
        module
    }

    fn has(module: &Module<1>, alarm: Alarms, now_us: u64) -> bool {
        module.alarms(now_us).has(alarm)
    }

    #[test]
    fn a_line_that_is_silent_is_said_and_gives_no_reading() {
        let (mut module, mut tiles) = (module("tiles=10,1,1,1,1"), Tiles::new());
        let code = |module: &Module<1>, now_us| module.floor_health(now_us).map(|health| health.code);
        let mut asked = 0;
        let mut run =
            |module: &mut Module<1>, tiles: &mut Tiles, tenths: core::ops::Range<u64>, answers: bool| {
                for tenth in tenths {
                    let now_us = tenth * 100_000;
                    if module.tiles(tiles, now_us, &mut Sent::default()).is_some() && answers {
                        tiles.receive(&encode(&Frame { group: 10, tile: (1, 1), values: [128; 8] }), now_us);
                    }
                    asked += 1;
                }
                module.counters().get(Counter::ScansAccepted)
            };
        assert_eq!(run(&mut module, &mut tiles, 0..30, false), 0);
        assert_eq!(code(&module, 2_900_000), Some(SensorCode::Searching));
        assert!(has(&module, Alarms::NO_SCANS, 2_900_000) && !has(&module, Alarms::NO_BACKGROUND, 2_900_000));
        let readings = run(&mut module, &mut tiles, 30..60, true);
        assert!((25..=30).contains(&readings), "{readings}");
        assert_eq!(code(&module, 5_900_000), Some(SensorCode::Streaming));
        // A second later nothing that it said counts, and half a second later that is an alarm.
        let at_most = readings + 11;
        let readings = run(&mut module, &mut tiles, 60..80, false);
        assert!(readings <= at_most, "{readings} readings after its last word");
        assert_eq!(code(&module, 7_900_000), Some(SensorCode::Stalled));
        assert!(has(&module, Alarms::NO_SCANS, 7_900_000));
    }

    #[test]
    fn readings_that_were_missed_are_not_made_up_for() {
        let (mut module, mut tiles) = (module("tiles=10,1,1,1,1"), Tiles::new());
        let mut readings = |tiles: &mut Tiles, now_us| {
            module.tiles(tiles, now_us, &mut Sent::default());
            module.counters().get(Counter::ScansAccepted)
        };
        assert_eq!(readings(&mut tiles, 0), 0);
        tiles.receive(&encode(&Frame { group: 10, tile: (1, 1), values: [128; 8] }), 80_000);
        let times_us = [120_000, 600_000, 600_001, 711_110, 711_111];
        assert_eq!(times_us.map(|now_us| readings(&mut tiles, now_us)), [1, 2, 2, 2, 3]);
    }

    #[test]
    fn other_tiles_begin_anew_and_readings_and_losses_are_counted_on() {
        let (mut module, mut tiles) = (module("tiles=10,1,1,1,1"), Tiles::new());
        let speaks = |tiles: &mut Tiles, group, now_us| {
            tiles.receive(&[1, 2, 3], now_us);
            tiles.receive(&encode(&Frame { group, tile: (1, 1), values: [170; 8] }), now_us);
        };
        module.tiles(&mut tiles, 0, &mut Sent::default());
        speaks(&mut tiles, 10, 80_000);
        module.tiles(&mut tiles, 120_000, &mut Sent::default());
        module.settings = Settings::new().changed_by("tiles=11,1,1,1,1").unwrap();
        module.tiles(&mut tiles, 240_000, &mut Sent::default());
        assert_eq!(module.counters().get(Counter::ScansAccepted), 1, "nothing is known of the new ones");
        speaks(&mut tiles, 11, 300_000);
        speaks(&mut tiles, 10, 340_000);
        module.tiles(&mut tiles, 380_000, &mut Sent::default());
        module.tiles(&mut tiles, 390_000, &mut Sent::default());
        let count = |counter| module.counters().get(counter);
        assert_eq!(count(Counter::ScansAccepted), 2);
        assert_eq!((count(Counter::SensorEcho), count(Counter::SensorUnexpected)), (9, 1));
    }
}
