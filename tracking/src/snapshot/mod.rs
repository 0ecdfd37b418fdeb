//! The snapshot: tracks, zones and device health at one time, for every sink that shows, stores or publishes it.
//!
//! ```text
//!   tracking loop ── every 0.1 s ──▶ Snapshot ──▶ file of lines · live map · database · MQTT · metrics
//!                                     ├ line      tracks and zones at t        (`jsonl`)
//!                                     ├ lines     how often each counting line was crossed
//!                                     ├ doors     what each door made of them
//!                                     ├ alarms    those that stand
//!                                     ├ names     which IDs they may be
//!                                     └ modules   rates, losses, clock, alarms
//! ```
//!
//! A snapshot is made once and shared. A slow sink misses snapshots and delays no other.

mod module;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::alarm::{Active, AlarmLine, Cause, Source};
use crate::alarm_list::ListedAlarm;
use crate::door::{DoorLine, Trouble};
use crate::floor::FloorLine;
use crate::jsonl::{TrackLine, TracksLine, ZoneLine};
use crate::lines::CrossedLine;
use crate::names::{NameLine, SignCounts};
use crate::occupancy::Total;
use crate::site::Site;
use crate::stays::DwellLine;
use crate::tracker::TrackState;
pub use module::{DeviceEvent, DeviceState, EventLine, ModuleLine};

/// So long after a snapshot without another nothing is known any more, ms.
pub const STALE_MS: u64 = 3000;

/// ms since 1970, by this machine's clock.
#[must_use]
pub fn unix_ms() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}

/// What is known at one time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "Flat")]
#[schemars(rename = "Frame")]
pub struct Snapshot {
    /// Milliseconds since 1970 when it was made, by this machine's clock: for people and databases, never for
    /// computing.
    pub unix_ms: u64,
    /// Tracks and zones.
    #[serde(flatten)]
    pub line: TracksLine,
    /// The tracks of that line as doors and the database take them; not written.
    #[serde(skip)]
    pub tracks: Vec<TrackState>,
    /// How many people are in the whole site.
    #[serde(default)]
    pub total: Total,
    /// Every alarm that stands, of the tracker itself, of modules and of doors, the oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub alarms: Vec<ListedAlarm>,
    /// Every counting line of the site.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lines: Vec<CrossedLine>,
    /// How long people have stayed in each zone, since the start.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dwell: Vec<DwellLine>,
    /// Every guarded door of the site.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doors: Vec<DoorLine>,
    /// Every ID that was read within the last hour, and which tracks it may be.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub names: Vec<NameLine>,
    /// Signs since the start, by what became of them.
    #[serde(default)]
    pub signs: SignCounts,
    /// Every floor of pressure panels that is read.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub floors: Vec<FloorLine>,
    /// Every module of the site, and every one that was found beside them.
    pub modules: Vec<ModuleLine>,
    /// Datagrams of modules that were not used, since the start.
    #[serde(default)]
    pub dropped: Drops,
    /// Datagrams from addresses that are no device of ours, since the start.
    #[serde(default)]
    pub strangers: u64,
    /// Datagrams that were dropped as the tracker had fallen behind, since the start.
    #[serde(default)]
    pub overrun: u64,
    /// Announced devices that were not asked, or are no longer known, since the start.
    #[serde(default)]
    pub refused: Refused,
    /// HTTP connections and requests that were refused or ended, since the start.
    #[serde(default)]
    pub http: HttpRefused,
    /// Snapshots that the database, MQTT or another sink did not get, as it had fallen behind, since the start.
    #[serde(default)]
    pub missed: u64,
}

/// HTTP connections and requests that were refused or ended, by cause.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct HttpRefused {
    /// All places for connections were taken.
    pub full: u64,
    /// An address had its share of the places.
    pub address: u64,
    /// No whole header of a request came in time; a connection that was kept open for nothing is one of these.
    pub header: u64,
    /// The body of a request did not come in time.
    pub body: u64,
    /// A client did not take what it was sent, or did not answer.
    pub unread: u64,
    /// The host or the page that asked is not allowed.
    pub foreign: u64,
    /// Who asked is not known, or the password was wrong.
    pub unknown: u64,
    /// Who asked may not do this.
    pub role: u64,
    /// Passwords were tried too often.
    pub often: u64,
    /// No TLS could be agreed, or a request came without it.
    pub tls: u64,
}

/// Announced devices that were not asked, or are no longer known, by cause.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Refused {
    /// Addresses outside the networks of this host.
    pub outside: u64,
    /// There were too many: the oldest that had never answered was given up, or the new one.
    pub crowded: u64,
    /// Devices that answered, and were given up for newer ones.
    pub forgotten: u64,
}

/// A frame as it is written, its line's parts beside its own. To be read this way, since numbers within a flattened
/// part cannot be read when some other crate has switched on `serde_json`'s `arbitrary_precision`.
#[derive(Deserialize, JsonSchema)]
struct Flat {
    unix_ms: u64,
    t: f64,
    tracks: Vec<TrackLine>,
    #[serde(default)]
    zones: BTreeMap<String, ZoneLine>,
    #[serde(default)]
    total: Total,
    #[serde(default)]
    alarms: Vec<ListedAlarm>,
    #[serde(default)]
    lines: Vec<CrossedLine>,
    #[serde(default)]
    dwell: Vec<DwellLine>,
    #[serde(default)]
    doors: Vec<DoorLine>,
    #[serde(default)]
    names: Vec<NameLine>,
    #[serde(default)]
    signs: SignCounts,
    #[serde(default)]
    floors: Vec<FloorLine>,
    modules: Vec<ModuleLine>,
    #[serde(default)]
    dropped: Drops,
    #[serde(default)]
    strangers: u64,
    #[serde(default)]
    overrun: u64,
    #[serde(default)]
    refused: Refused,
    #[serde(default)]
    http: HttpRefused,
    #[serde(default)]
    missed: u64,
}

impl From<Flat> for Snapshot {
    fn from(flat: Flat) -> Self {
        let Flat { unix_ms, t, tracks, zones, total, alarms, lines, dwell, doors, .. } = flat;
        let Flat {
            names, signs, floors, modules, dropped, strangers, overrun, refused, http, missed, ..
        } = flat;
        let written = Self::of(unix_ms, TracksLine { t, tracks, zones });
        Self {
            total,
            alarms,
            lines,
            dwell,
            doors,
            names,
            signs,
            floors,
            modules,
            dropped,
            strangers,
            overrun,
            refused,
            http,
            missed,
            ..written
        }
    }
}

impl Snapshot {
    /// A line that was written, with its tracks as the line has them.
    #[must_use]
    pub fn of(unix_ms: u64, line: TracksLine) -> Self {
        let tracks = line.tracks.iter().map(TrackState::from).collect();
        Self { unix_ms, line, tracks, ..Self::default() }
    }

    /// The modules that have a place in `site`. One that was only found beside them may be another site's, or no site's, and is that
    /// also when it is switched off and missing.
    pub fn own_modules<'a>(&'a self, site: &Site) -> impl Iterator<Item = &'a ModuleLine> {
        let known: BTreeSet<&str> = site.places().map(|(_, name)| name).collect();
        self.modules.iter().filter(move |module| known.contains(module.name.as_str()))
    }

    /// When it was made, ns since 1970.
    #[must_use]
    pub const fn stamp_ns(&self) -> u64 {
        self.unix_ms.saturating_mul(1_000_000)
    }

    /// When the tracker's clock stood at 0, ns since 1970.
    #[must_use]
    pub fn begun_ns(&self) -> u64 {
        self.stamp_ns().saturating_sub((self.line.t * 1e9) as u64)
    }

    /// The same, but for what modules see empty: most of the bytes, and slow to change.
    #[must_use]
    pub fn without_free(&self) -> Self {
        let mut without = self.clone();
        without.modules.iter_mut().for_each(|module| module.free = Arc::default());
        without
    }
}

/// Datagrams that were not used, by cause.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Drops {
    /// Not a device's datagram, or not a version understood.
    pub unreadable: u64,
    /// Came before.
    pub repeated: u64,
    /// Older than [`LATE_S`](crate::observation::LATE_S).
    pub late: u64,
    /// The device's clock, setup or geometry is not known yet.
    pub early: u64,
    /// From a start of the device that is over.
    pub stale_boot: u64,
    /// The device has no place in the site.
    pub unplaced: u64,
    /// From the future: begun later than [`AHEAD_S`](crate::observation::AHEAD_S) after it arrived.
    pub ahead: u64,
    /// An exchange of times that cannot be, or that contradicts the ones before.
    pub clock: u64,
    /// A report whose number is far from those of the row that goes on.
    pub jump: u64,
    /// An answer to nothing that was asked.
    pub unasked: u64,
    /// In the name of a device that answers at another address.
    pub foreign: u64,
    /// Of one of two devices that have the same place in the site.
    pub same_name: u64,
    /// In clear, in the name of a device that has a key.
    pub clear: u64,
    /// Sealed, but not by the holder of the key, or changed on the way, or of a session that is over.
    pub forged: u64,
    /// Sealed, and taken before.
    pub replayed: u64,
    /// A device refuses the site's key.
    pub key: u64,
}

/// Every alarm that is on: the tracker's own, those of the devices, those of the doors.
pub fn active_alarms<'a>(
    own: &'a [AlarmLine],
    modules: &'a [ModuleLine],
    doors: &'a [DoorLine],
) -> impl Iterator<Item = Active> + 'a {
    let fault = |source: Source, alarm: &AlarmLine| Active {
        source,
        cause: Cause::Fault(alarm.kind),
        text: alarm.text.clone(),
    };
    let own = own.iter().map(move |alarm| fault(Source::Tracker, alarm));
    let of_devices = modules.iter().flat_map(move |module| {
        module.alarms.iter().map(move |alarm| fault(Source::Device(module.name.clone()), alarm))
    });
    let of_doors = doors.iter().flat_map(|door| {
        // At a start nothing has been seen yet, which is no fault; an alarm that stood before the start still is one.
        let said = door.alarm.filter(|_| door.trouble != Some(Trouble::Starting));
        said.into_iter().chain(door.standing).map(|alarm| Active {
            source: Source::Door(door.name.clone()),
            cause: Cause::Door(alarm),
            text: format!("{}: {}", alarm.words(), alarm.advice()),
        })
    });
    own.chain(of_devices).chain(of_doors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::door::Alarm;
    use crate::occupancy::{Found, ZoneKnown, ZoneLine};

    #[test]
    fn the_tracker_began_as_long_before_a_snapshot_as_its_clock_says() {
        let snapshot = Snapshot::of(1_700_000_000_500, TracksLine { t: 2.25, ..TracksLine::default() });
        assert_eq!(snapshot.begun_ns(), 1_699_999_998_250_000_000);
    }

    #[test]
    fn trouble_of_a_door_hides_no_alarm_that_stands_beneath_it() {
        let site = Site::parse("site", crate::site::door::tests::DOOR).unwrap();
        let mut doors = crate::door::doors::Doors::new(&site, 1);
        doors.resume([("front", Alarm::Followed)]);
        let mut line = doors.lines().next().unwrap();
        let causes = |line: &DoorLine| {
            active_alarms(&[], &[], std::slice::from_ref(line)).map(|on| on.cause).collect::<Vec<_>>()
        };
        let (trouble, followed) = (Cause::Door(Alarm::Trouble), Cause::Door(Alarm::Followed));
        assert_eq!(causes(&line), [followed], "that it starts is no alarm");
        line.trouble = Some(Trouble::ModuleLost);
        assert_eq!(causes(&line), [trouble, followed]);
    }

    #[test]
    fn a_frame_survives_being_written_and_read() {
        let zone = ZoneLine::new(Found::inside(1, vec![0.1, 0.9]), 1.0, ZoneKnown::Known);
        let track =
            r#"{"id":7,"x":1.5,"y":-0.25,"cov":[0.01,0.0,0.01],"state":"occluded","reason":"hidden"}"#;
        let line = TracksLine {
            t: 12.3,
            tracks: vec![serde_json::from_str(track).unwrap()],
            zones: [("hall".to_owned(), zone)].into(),
        };
        let frame = Snapshot { missed: 3, ..Snapshot::of(1_700_000_000_000, line) };
        let text = serde_json::to_string(&frame).unwrap();
        assert_eq!(
            serde_json::from_str::<Snapshot>(&text).map_err(|error| format!("{error}: {text}")),
            Ok(frame)
        );
    }
}
