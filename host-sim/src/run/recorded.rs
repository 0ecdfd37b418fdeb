//! Recordings in the place of a world: what several sensors measured at one time, through modules to a host.
//!
//! ```text
//!   recording ─▶ RecordingSource ─▶ Urg ─▶ SCIP bytes ─▶ Driver ─▶ tasks::run ─▶ datagrams ─▶ Record
//!      └─ learned beforehand? ─▶ flash ────────────────────────────────┘
//!
//!   0 ── modules start ── all measure ── blank scans ── begin: first stamp of all recordings ── end
//! ```
//!
//! Stamps of all recordings are on one clock. A background learned from a whole recording is in the module's flash
//! when it starts; its sensor then returns no ranges until the recordings begin, so that the host has the
//! background by then. A module that learns by itself uses the recording's first scans.

use std::sync::Arc;

use embassy_futures::block_on;
use kehai::background::LearnRequest;
use kehai::device;
use kehai::pipeline::Settings;
use kehai::scip::Text;
use kehai::store;
use kehai::wire::{Message, NAME_MAX};
use parking_lot::Mutex;

use super::network::Conditions;
use super::unit::{Plan, Sights, Unit, empty_flash, module_id, store as store_in};
use super::{Arrival, ModuleName, Moment, Record, TICK_US};
use crate::replay::{Learn, ReplayError, sensor};
use crate::world::site::Site;
use kehai_emulator::chain::{Chain, ChainError};
use kehai_emulator::pc::flash::Flash;
use kehai_emulator::recording::{LONGEST_US, Recording, RecordingSource};
use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry, SourceScan};

/// Time by which every sensor measures, µs.
const STARTED_US: u64 = 5_000_000;

/// Blank scans before a recording with a known background, µs: a host asks for info and profile within a second,
/// and the profile comes a part a scan.
const BLANK_US: u64 = 2_500_000;

/// After the last scan, µs: its way to the host.
const END_US: u64 = 300_000;

/// The result of playing recordings.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// The datagrams that the host received, on its clock; the truth is unknown and holds only times.
    pub record: Record,
    /// The host's time less the recordings', s.
    pub zero_s: f64,
}

/// A recording that waits for the others.
struct Waiting {
    recording: RecordingSource,
    begin_us: u64,
    blank: bool,
    /// When the measurement was first asked for.
    asked_us: Arc<Mutex<Option<u64>>>,
}

impl RangeSource for Waiting {
    fn geometry(&self) -> SensorGeometry {
        self.recording.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let start_us = revolution.start_us;
        self.asked_us.lock().get_or_insert(start_us);
        let ready_us = start_us + u64::from(revolution.period_us);
        if self.blank && ready_us < self.begin_us {
            let ranges_mm = vec![0; self.geometry().steps()];
            return Some(SourceScan { start_us, ready_us, ranges_mm });
        }
        self.recording.scan(revolution)
    }

    fn latest(&mut self, revolution: Revolution) -> Option<SourceScan> {
        self.recording.latest(revolution)
    }
}

/// A module of the site and what its sensor saw.
struct Part<'a> {
    name: &'a str,
    recording: &'a Recording,
    flash: Flash,
}

impl Part<'_> {
    fn first_us(&self) -> u64 {
        self.recording.scans.first().map_or(0, |scan| scan.stamp_us)
    }

    fn last_us(&self) -> u64 {
        self.recording.scans.last().map_or(0, |scan| scan.stamp_us)
    }

    /// Its unit, and when its measurement was first asked for.
    fn unit(
        &self,
        index: usize,
        recording: RecordingSource,
        (begin_us, blank): (u64, bool),
    ) -> (Unit, Arc<Mutex<Option<u64>>>) {
        let asked_us: Arc<Mutex<Option<u64>>> = Arc::default();
        let config = sensor(recording.geometry());
        let source = Box::new(Waiting { recording, begin_us, blank, asked_us: Arc::clone(&asked_us) });
        let plan = Plan {
            index,
            name: self.name.to_owned(),
            source,
            config,
            phase_us: 0,
            sights: Sights::default(),
            flash: self.flash.clone(),
            conditions: Conditions::IDEAL,
            seed: 0,
            amend: None,
            outages_us: Vec::new(),
        };
        (Unit::new(plan), asked_us)
    }
}

impl Recorded {
    /// Plays recordings, each under the name of a module of `site`, all together. `done` is called for each device.
    ///
    /// # Errors
    /// [`ReplayError`].
    pub fn play(
        site: &Site,
        recordings: &[(String, Recording)],
        learn: Learn,
        mut done: impl FnMut(),
    ) -> Result<Self, ReplayError> {
        for (name, recording) in recordings {
            kehai::scan::Geometry::new(recording.geometry)?;
            if name.len() > NAME_MAX {
                return Err(ReplayError::LongName(name.clone()));
            }
            if !site.modules.iter().any(|module| module.name == *name) {
                let known: Vec<&str> = site.modules.iter().map(|module| module.name.as_str()).collect();
                return Err(ReplayError::NoModule { name: name.clone(), known: known.join(", ") });
            }
        }
        // All of the time between the first and the last stamp is played.
        let stamps_us =
            recordings.iter().flat_map(|(_, recording)| &recording.scans).map(|scan| scan.stamp_us);
        let ends_us = stamps_us.clone().min().zip(stamps_us.max());
        if ends_us.is_some_and(|(first_us, last_us)| last_us - first_us > LONGEST_US) {
            return Err(ReplayError::Apart);
        }
        let prepare =
            |(name, recording)| flash(recording, learn).map(|flash| Part { name, recording, flash });
        let pairs = recordings.iter().map(|(name, recording)| (name.as_str(), recording));
        let parts: Vec<Part<'_>> = pairs.map(prepare).collect::<Result<_, ReplayError>>()?;
        let first_us = parts.iter().map(Part::first_us).min().unwrap_or(0);
        let last_us = parts.iter().map(Part::last_us).max().unwrap_or(0);
        let blank = learn == Learn::All;
        let begin_us = measuring_us(&parts)? + if blank { BLANK_US } else { 0 };
        let end_us = begin_us + (last_us - first_us) + END_US;
        let mut arrivals = Vec::new();
        for (index, part) in parts.iter().enumerate() {
            let start_us = begin_us + (part.first_us() - first_us);
            let source = RecordingSource::starting_at(part.recording.clone(), start_us);
            let (mut unit, _) = part.unit(index, source, (begin_us, blank));
            let came = unit.advance(end_us).map_err(ChainError::from)?;
            let module = u16::try_from(index).unwrap_or(u16::MAX);
            arrivals.extend(came.into_iter().map(|(at_us, bytes)| Arrival { at_us, module, bytes }));
            done();
        }
        // Reports of blank scans say nothing.
        arrivals.retain(|arrival| arrival.at_us > begin_us || !is_report(&arrival.bytes));
        arrivals.sort_by_key(|arrival| arrival.at_us);
        let modules = parts.iter().enumerate();
        let modules =
            modules.map(|(index, part)| ModuleName { name: part.name.to_owned(), id: module_id(index).0 });
        let moment = |tick: u64| Moment { t: (tick * TICK_US) as f64 * 1e-6, people: Vec::new() };
        let record = Record {
            seed: 0,
            duration_s: end_us as f64 * 1e-6,
            site: site.clone(),
            modules: modules.collect(),
            events: None,
            arrivals,
            truth: (begin_us / TICK_US..=end_us / TICK_US).map(moment).collect(),
        };
        Ok(Self { record, zero_s: (begin_us as f64 - first_us as f64) * 1e-6 })
    }

    /// The recordings' time of a time of the host's, s, to the microsecond.
    #[must_use]
    pub fn recorded_s(&self, host_s: f64) -> f64 {
        ((host_s - self.zero_s) * 1e6).round() * 1e-6
    }
}

/// When all sensors measure, on a whole tick. Found by letting them begin with nothing to measure.
fn measuring_us(parts: &[Part<'_>]) -> Result<u64, ReplayError> {
    let mut latest_us = 0;
    for (index, part) in parts.iter().enumerate() {
        let nothing = Recording { scans: Vec::new(), ..part.recording.clone() };
        let fresh = Part { flash: empty_flash(), ..*part };
        let (mut unit, asked_us) = fresh.unit(index, RecordingSource::new(nothing), (0, false));
        unit.advance(STARTED_US).map_err(ChainError::from)?;
        let asked_us = *asked_us.lock();
        latest_us = latest_us.max(asked_us.unwrap_or(STARTED_US));
    }
    Ok((latest_us / TICK_US + 1) * TICK_US)
}

/// Initial content of a module's flash: learning settings, or the background learned from the whole recording.
fn flash(recording: &Recording, learn: Learn) -> Result<Flash, ReplayError> {
    let flash = empty_flash();
    let Some(mut kept) = store_in(&flash) else { return Ok(flash) };
    let stored = match learn {
        Learn::Scans(learn_scans) => {
            let settings = device::Settings { learn_scans, ..device::Settings::new() };
            block_on(store::save_settings(&mut kept, &settings))
        }
        Learn::All => {
            let scans = recording.scans.len().try_into().unwrap_or(u16::MAX);
            let learn = LearnRequest { scans, even_if_moving: true };
            let source = RecordingSource::new(recording.clone());
            let config = sensor(source.geometry());
            let serial = Text::new(config.model.serial.as_bytes());
            let mut chain = Chain::new(Box::new(source), config, Settings { learn, ..Settings::default() });
            while chain.next_scan()?.is_some() {}
            block_on(store::save_background(&mut kept, chain.pipeline().background(), serial))
        }
    };
    stored.map(|()| flash).map_err(|_| ReplayError::NotStored)
}

fn is_report(datagram: &[u8]) -> bool {
    matches!(Message::decode(datagram), Ok((_, Message::Report(_))))
}

#[cfg(test)]
mod tests {
    use kehai::scan::URG_04LX;
    use kehai_emulator::recording::RecordedScan;

    use super::*;

    #[test]
    fn recordings_of_two_clocks_are_refused_before_all_the_time_between_is_played() {
        let site: Site =
            toml::from_str("module = [{ name = 'left', x = 0, y = 0 }, { name = 'right', x = 1, y = 0 }]")
                .unwrap();
        let recorded = |name: &str, stamp_us| {
            let scans = vec![RecordedScan { stamp_us, ranges_mm: vec![3000; 682] }];
            (name.to_owned(), Recording { geometry: URG_04LX, scans })
        };
        let both = [recorded("left", 0), recorded("right", 1_700_000_000_000_000)];
        let refused = Recorded::play(&site, &both, Learn::All, || ());
        assert!(matches!(refused, Err(ReplayError::Apart)), "{:?}", refused.err());
    }
}
