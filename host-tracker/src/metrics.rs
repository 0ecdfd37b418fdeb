//! A frame in the text format of OpenMetrics, which Prometheus scrapes.
//!
//! ```text
//!   kehai_zone_people{zone="hall"} 2              absent while the zone is unknown: unknown is never empty
//!   kehai_zone_seen_ratio{zone="hall"} 0.93
//!   kehai_line_crossings_total{line="front",direction="in"} 12
//!   kehai_module_scans_hertz{module="left"} 9.9
//!   kehai_module_alarm{module="left",alarm="dirty"} 1
//!   kehai_datagrams_dropped_total{cause="late"} 17
//! ```
//!
//! Each scrape writes the newest frame, and what was counted beside it; nothing is counted here. Source: *OpenMetrics* 1.0, text format.

use std::fmt;
use std::sync::Arc;

use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, EncodeMetric, MetricEncoder, NoLabelSet, text::encode};
use prometheus_client::metrics::MetricType;
use prometheus_client::metrics::counter::ConstCounter;
use prometheus_client::metrics::gauge::ConstGauge;
use prometheus_client::registry::Registry;

use crate::area_losses::AreaLossCounts;
use crate::store::Dropped;
use kehai_tracking::jsonl::ZoneKnown;
use kehai_tracking::lines::Direction;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{DeviceState, ModuleLine, Snapshot};
use kehai_tracking::stays::{BOUNDS_S, DwellLine};
use kehai_tracking::tracker::LifeCycle;

/// The `Content-Type` of the text.
pub const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// What was lost on the way to those who are told, as they count it, and which counts there are; no frame says so.
#[derive(Clone, Copy, Debug, Default)]
pub struct Losses {
    /// What the database has dropped, if there is one.
    pub database: Option<Dropped>,
    /// Messages of the MQTT broker that found no room, if there is one.
    pub mqtt: Option<u64>,
    /// Messages of areas that were not used, where several trackers are one site.
    pub areas: Option<AreaLossCounts>,
    /// Reports for which clients were too slow.
    pub reports: u64,
    /// Scans for which viewers or ROS 2 were too slow.
    pub scans: u64,
    /// Several trackers are one site: what comes in is counted by each of them, and here not at all.
    pub is_together: bool,
}

/// The metrics of a frame of this site, and of what was lost, as text.
#[must_use]
pub fn text(frame: &Arc<Snapshot>, site: &Arc<Site>, losses: Losses) -> String {
    let mut registry = Registry::default();
    let scrape = Scrape { frame: Arc::clone(frame), site: Arc::clone(site), losses };
    registry.register_collector(Box::new(scrape));
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = encode(&mut text, &registry);
    text
}

#[derive(Debug)]
struct Scrape {
    frame: Arc<Snapshot>,
    site: Arc<Site>,
    losses: Losses,
}

impl Collector for Scrape {
    fn encode(&self, mut encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let Self { frame, site, losses } = self;
        zones(frame, &mut encoder)?;
        lines(frame, &mut encoder)?;
        dwell(frame, &mut encoder)?;
        tracks(frame, &mut encoder)?;
        modules(frame, site, &mut encoder)?;
        if !losses.is_together {
            inputs(frame, &mut encoder)?;
        }
        refusals(frame, &mut encoder)?;
        lost(*losses, &mut encoder)
    }
}

/// Writes one metric with its samples; nothing if it has none. A counter's name gets `_total` behind it.
fn family<'a, const LABELS: usize, M: EncodeMetric>(
    encoder: &mut DescriptorEncoder<'_>,
    name: &str,
    help: &str,
    samples: impl IntoIterator<Item = ([(&'a str, &'a str); LABELS], M)>,
) -> fmt::Result {
    let mut samples = samples.into_iter().peekable();
    let Some((_, first)) = samples.peek() else { return Ok(()) };
    let mut family = encoder.encode_descriptor(name, help, None, first.metric_type())?;
    samples.try_for_each(|(labels, metric)| metric.encode(family.encode_family(&labels)?))
}

fn zones(frame: &Snapshot, encoder: &mut DescriptorEncoder<'_>) -> fmt::Result {
    let zones = &frame.line.zones;
    let known = zones.iter().filter_map(|(name, zone)| Some((name, zone.count()?)));
    family(
        encoder,
        "kehai_zone_people",
        "People in the zone; absent while that is not known",
        known.map(|(name, count)| ([("zone", name.as_str())], ConstGauge::new(count))),
    )?;
    family(
        encoder,
        "kehai_zone_known",
        "1: all of the zone is known, 0.5: a part of it, 0: nothing",
        zones
            .iter()
            .map(|(name, zone)| ([("zone", name.as_str())], ConstGauge::new(known_part(zone.state())))),
    )?;
    family(
        encoder,
        "kehai_zone_seen_ratio",
        "Share of the zone that some module sees",
        zones.iter().map(|(name, zone)| ([("zone", name.as_str())], ConstGauge::new(zone.seen_share()))),
    )
}

fn lines(frame: &Snapshot, encoder: &mut DescriptorEncoder<'_>) -> fmt::Result {
    let counted = frame.lines.iter().filter_map(|line| Some((line.name.as_str(), line.totals()?)));
    family(
        encoder,
        "kehai_line_crossings",
        "People who crossed the line; absent while it was never seen",
        counted.flat_map(|(line, totals)| {
            let ways = [(Direction::In, totals.inward), (Direction::Out, totals.outward)];
            ways.map(|(direction, count)| {
                ([("line", line), ("direction", direction.name())], ConstCounter::new(count))
            })
        }),
    )?;
    family(
        encoder,
        "kehai_line_known",
        "1: all of the line is seen, 0.5: a part of it, 0: nothing",
        frame
            .lines
            .iter()
            .map(|line| ([("line", line.name.as_str())], ConstGauge::new(known_part(line.state)))),
    )?;
    family(
        encoder,
        "kehai_line_unknown_seconds",
        "For how long people may have crossed the line unseen, since the start",
        frame.lines.iter().map(|line| ([("line", line.name.as_str())], ConstCounter::new(line.unknown_s))),
    )?;
    family(
        encoder,
        "kehai_line_unfollowed_tracks",
        "Tracks that were not followed at the line, as there were too many, since the start",
        frame.lines.iter().map(|line| ([("line", line.name.as_str())], ConstCounter::new(line.unfollowed))),
    )
}

/// A histogram that was counted elsewhere.
#[derive(Debug)]
struct Dwell<'a>(&'a DwellLine);

impl EncodeMetric for Dwell<'_> {
    fn encode(&self, mut encoder: MetricEncoder<'_>) -> fmt::Result {
        let DwellLine { stays, sum_s, parts, .. } = self.0;
        let longer = stays.saturating_sub(parts.iter().sum());
        let buckets: Vec<(f64, u64)> =
            BOUNDS_S.into_iter().zip(*parts).chain([(f64::INFINITY, longer)]).collect();
        encoder.encode_histogram::<NoLabelSet>(*sum_s, *stays, &buckets, None)
    }

    fn metric_type(&self) -> MetricType {
        MetricType::Histogram
    }
}

fn dwell(frame: &Snapshot, encoder: &mut DescriptorEncoder<'_>) -> fmt::Result {
    let samples = frame.dwell.iter().map(|line| ([("zone", line.zone.as_str())], Dwell(line)));
    family(encoder, "kehai_zone_dwell_seconds", "Stays of people in the zone that have ended", samples)
}

const fn known_part(state: ZoneKnown) -> f64 {
    match state {
        ZoneKnown::Known => 1.0,
        ZoneKnown::Partly => 0.5,
        ZoneKnown::Unknown => 0.0,
    }
}

fn tracks(frame: &Snapshot, encoder: &mut DescriptorEncoder<'_>) -> fmt::Result {
    let states = [
        (LifeCycle::Tentative, "tentative"),
        (LifeCycle::Confirmed, "confirmed"),
        (LifeCycle::Occluded, "occluded"),
    ];
    // 0 followed tracks are said only where it is known that the site is empty.
    let is_said = |count: usize| count > 0 || frame.total.count.is_some();
    let samples = states.map(|(state, name)| {
        let count = frame.line.tracks.iter().filter(|track| track.state == state).count();
        is_said(count).then(|| ([("state", name)], ConstGauge::new(count)))
    });
    let help = "Tracks, by state; absent while there is none and it is not known that the site is empty";
    family(encoder, "kehai_tracks", help, samples.into_iter().flatten())
}

/// A gauge of a module.
struct Figure {
    name: &'static str,
    help: &'static str,
    /// A missing module has no other figures.
    while_missing: bool,
    value: fn(&ModuleLine) -> Option<f64>,
}

impl Figure {
    const fn new(name: &'static str, help: &'static str, value: fn(&ModuleLine) -> Option<f64>) -> Self {
        Self { name, help, while_missing: false, value }
    }
}

const FIGURES: [Figure; 7] = [
    Figure::new("kehai_module_scans_hertz", "Scans a second, over ten seconds", |line| Some(line.scans_hz)),
    Figure::new("kehai_module_lost_ratio", "Share of the scans that were lost, over a minute", |line| {
        line.lost_share
    }),
    Figure::new("kehai_module_unknown_ratio", "Share of the beams that could not be judged", |line| {
        Some(line.unknown_share)
    }),
    Figure::new("kehai_module_clock_offset_seconds", "The module's clock less the tracker's", |line| {
        line.clock_offset_ms.map(|offset_ms| offset_ms * 1e-3)
    }),
    Figure::new("kehai_module_clock_jitter_seconds", "Spread of the clock's measurements", |line| {
        line.clock_jitter_ms.map(|jitter_ms| jitter_ms * 1e-3)
    }),
    Figure::new("kehai_module_background_age_seconds", "Age of the background", |line| line.background_age_s),
    Figure {
        while_missing: true,
        ..Figure::new("kehai_module_silent_seconds", "Since the last datagram", |line| line.silent_s)
    },
];

fn modules(frame: &Snapshot, site: &Site, encoder: &mut DescriptorEncoder<'_>) -> fmt::Result {
    let present = || frame.own_modules(site).filter(|line| line.state != DeviceState::Missing);
    family(
        encoder,
        "kehai_module_up",
        "1 if the module is heard of",
        frame.own_modules(site).map(|line| {
            let up = u64::from(line.state != DeviceState::Missing);
            ([("module", line.name.as_str())], ConstGauge::new(up))
        }),
    )?;
    family(
        encoder,
        "kehai_module_checksum_errors",
        "Damaged answers of the sensor since the module's start",
        present().map(|line| ([("module", line.name.as_str())], ConstCounter::new(line.checksum_errors))),
    )?;
    for figure in FIGURES {
        let there = |line: &&ModuleLine| figure.while_missing || line.state != DeviceState::Missing;
        let samples = frame.own_modules(site).filter(there).filter_map(|line| {
            let value = (figure.value)(line)?;
            Some(([("module", line.name.as_str())], ConstGauge::new(value)))
        });
        family(encoder, figure.name, figure.help, samples)?;
    }
    let alarms = frame.own_modules(site).flat_map(|line| {
        line.alarms.iter().map(|alarm| {
            let labels = [("module", line.name.as_str()), ("alarm", alarm.kind.name())];
            (labels, ConstGauge::new(1_u64))
        })
    });
    family(encoder, "kehai_module_alarm", "An alarm that is on", alarms)
}

/// What the tracker did not use of what came in, and what became of signs.
fn inputs(frame: &Snapshot, encoder: &mut DescriptorEncoder<'_>) -> fmt::Result {
    let dropped = &frame.dropped;
    let causes = [
        ("unreadable", dropped.unreadable),
        ("repeated", dropped.repeated),
        ("late", dropped.late),
        ("early", dropped.early),
        ("stale_boot", dropped.stale_boot),
        ("unplaced", dropped.unplaced),
        ("ahead", dropped.ahead),
        ("clock", dropped.clock),
        ("jump", dropped.jump),
        ("unasked", dropped.unasked),
        ("foreign", dropped.foreign),
        ("same_name", dropped.same_name),
        ("clear", dropped.clear),
        ("forged", dropped.forged),
        ("replayed", dropped.replayed),
        ("key", dropped.key),
        ("stranger", frame.strangers),
        ("overrun", frame.overrun),
    ];
    let samples = causes.map(|(cause, count)| ([("cause", cause)], ConstCounter::new(count)));
    family(encoder, "kehai_datagrams_dropped", "Datagrams that were not used, by cause", samples)?;
    let refused = &frame.refused;
    let causes =
        [("outside", refused.outside), ("crowded", refused.crowded), ("forgotten", refused.forgotten)];
    let samples = causes.map(|(cause, count)| ([("cause", cause)], ConstCounter::new(count)));
    let help = "Announced devices that were not asked, or are no longer known, by cause";
    family(encoder, "kehai_devices_refused", help, samples)?;
    let signs = &frame.signs;
    let outcomes = [
        ("taken", signs.taken),
        ("malformed", signs.malformed),
        ("no_reader", signs.no_reader),
        ("no_place", signs.no_place),
        ("late", signs.late),
        ("untracked", signs.untracked),
        ("full", signs.full),
    ];
    let samples = outcomes.map(|(outcome, count)| ([("outcome", outcome)], ConstCounter::new(count)));
    family(encoder, "kehai_signs", "Cards and tags that were read, by what became of them", samples)
}

/// What this program refused itself, or could not hand on.
fn refusals(frame: &Snapshot, encoder: &mut DescriptorEncoder<'_>) -> fmt::Result {
    let http = &frame.http;
    let causes = [
        ("full", http.full),
        ("address", http.address),
        ("header", http.header),
        ("body", http.body),
        ("unread", http.unread),
        ("foreign", http.foreign),
        ("unknown", http.unknown),
        ("role", http.role),
        ("often", http.often),
        ("tls", http.tls),
    ];
    let samples = causes.map(|(cause, count)| ([("cause", cause)], ConstCounter::new(count)));
    let help = "HTTP connections and requests that were refused or ended, by cause";
    family(encoder, "kehai_http_refused", help, samples)?;
    let help = "Snapshots that the database, MQTT or another sink did not get, as it had fallen behind";
    plain(encoder, "kehai_snapshots_missed", help, frame.missed)
}

/// A counter without labels.
fn plain(encoder: &mut DescriptorEncoder<'_>, name: &str, help: &str, count: u64) -> fmt::Result {
    let count = ConstCounter::new(count);
    let kind = count.metric_type();
    count.encode(encoder.encode_descriptor(name, help, None, kind)?)
}

fn lost(losses: Losses, encoder: &mut DescriptorEncoder<'_>) -> fmt::Result {
    let Losses { database, mqtt, areas, reports, scans, .. } = losses;
    if let Some(mqtt) = mqtt {
        let help = "Messages of the MQTT broker that came too fast and were dropped; absent without a broker";
        plain(encoder, "kehai_mqtt_dropped", help, mqtt)?;
    }
    let causes = areas.into_iter().flatten();
    let samples = causes.map(|(cause, count)| ([("cause", cause)], ConstCounter::new(count)));
    let help = "Messages of areas that were not used, by cause; absent where one tracker is the site";
    family(encoder, "kehai_area_messages_dropped", help, samples)?;
    let help = "Reports that a client did not get, as it had fallen behind";
    plain(encoder, "kehai_reports_missed", help, reports)?;
    let help = "Scans that viewers or ROS 2 did not get, as they had fallen behind";
    plain(encoder, "kehai_scans_missed", help, scans)?;
    let causes = database.map(|Dropped { messages, rows }| [("full", messages), ("unwritten", rows)]);
    let samples =
        causes.into_iter().flatten().map(|(cause, count)| ([("cause", cause)], ConstCounter::new(count)));
    let help = "What the database was to keep and does not, by cause; absent without a database";
    family(encoder, "kehai_database_dropped", help, samples)
}

#[cfg(test)]
mod tests;
