//! A frame in Prometheus' text format, for whoever serves it.
//!
//! ```text
//!   kehai_zone_people{zone="hall"} 2              absent while the zone is unknown: unknown is never empty
//!   kehai_zone_seen_ratio{zone="hall"} 0.93
//!   kehai_module_scans_hertz{module="left"} 9.9
//!   kehai_module_alarm{module="left",alarm="dirty"} 1
//!   kehai_datagrams_dropped_total{cause="late"} 17
//! ```
//!
//! Source: Prometheus, *exposition formats*, text format 0.0.4; names as OpenMetrics wants them.

use std::fmt::Write as _;

use crate::frame::{Frame, ModuleLine};
use crate::jsonl::ZoneKnown;
use crate::trackers::LifeCycle;

/// The `Content-Type` of the text.
pub const CONTENT_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// What is known, as text.
#[must_use]
pub fn text(frame: &Frame) -> String {
    let mut text = Text::default();
    zones(frame, &mut text);
    people(frame, &mut text);
    modules(frame, &mut text);
    drops(frame, &mut text);
    text.0
}

#[derive(Default)]
struct Text(String);

impl Text {
    /// What a metric is; nothing if it has no samples.
    fn metric<'a>(
        &mut self,
        name: &str,
        kind: &str,
        help: &str,
        samples: impl IntoIterator<Item = (Vec<(&'a str, &'a str)>, f64)>,
    ) {
        let mut samples = samples.into_iter().peekable();
        if samples.peek().is_none() {
            return;
        }
        // Writing to a String cannot fail.
        let _ = writeln!(self.0, "# HELP {name} {help}\n# TYPE {name} {kind}");
        for (labels, value) in samples {
            let labels: Vec<String> =
                labels.into_iter().map(|(key, value)| format!("{key}=\"{}\"", escaped(value))).collect();
            let labels = if labels.is_empty() { String::new() } else { format!("{{{}}}", labels.join(",")) };
            let _ = writeln!(self.0, "{name}{labels} {value}");
        }
    }
}

/// As a label's value is written.
fn escaped(value: &str) -> String {
    value.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}

fn zones(frame: &Frame, text: &mut Text) {
    let zones = &frame.line.zones;
    text.metric(
        "kehai_zone_people",
        "gauge",
        "People in the zone; absent while nothing is known of it",
        zones
            .iter()
            .filter(|(_, zone)| zone.state != ZoneKnown::Unknown)
            .map(|(name, zone)| (vec![("zone", name.as_str())], f64::from(zone.count))),
    );
    text.metric(
        "kehai_zone_known",
        "gauge",
        "1: all of the zone is known, 0.5: a part of it, 0: nothing",
        zones.iter().map(|(name, zone)| {
            let known = match zone.state {
                ZoneKnown::Known => 1.0,
                ZoneKnown::Partly => 0.5,
                ZoneKnown::Unknown => 0.0,
            };
            (vec![("zone", name.as_str())], known)
        }),
    );
    text.metric(
        "kehai_zone_seen_ratio",
        "gauge",
        "Share of the zone that some module sees",
        zones.iter().map(|(name, zone)| (vec![("zone", name.as_str())], zone.seen_share)),
    );
}

fn people(frame: &Frame, text: &mut Text) {
    let states = [
        (LifeCycle::Tentative, "tentative"),
        (LifeCycle::Confirmed, "confirmed"),
        (LifeCycle::Occluded, "occluded"),
    ];
    text.metric(
        "kehai_tracks",
        "gauge",
        "People that are followed, by state",
        states.map(|(state, name)| {
            let count = frame.line.tracks.iter().filter(|track| track.state == state).count();
            (vec![("state", name)], count as f64)
        }),
    );
}

/// A figure of a module.
type Figure = (&'static str, &'static str, &'static str, fn(&ModuleLine) -> Option<f64>);

/// Of those that are there.
const FIGURES: [Figure; 8] = [
    ("kehai_module_scans_hertz", "gauge", "Scans a second, over ten seconds", |line| Some(line.scans_hz)),
    ("kehai_module_lost_ratio", "gauge", "Share of the scans that were lost, over a minute", |line| {
        Some(line.lost_share)
    }),
    (
        "kehai_module_checksum_errors_total",
        "counter",
        "Damaged answers of the sensor since the module's start",
        |line| Some(line.checksum_errors as f64),
    ),
    ("kehai_module_unknown_ratio", "gauge", "Share of the beams that could not be judged", |line| {
        Some(line.unknown_share)
    }),
    ("kehai_module_clock_offset_seconds", "gauge", "The module's clock less the tracker's", |line| {
        line.clock_offset_ms.map(|offset_ms| offset_ms * 1e-3)
    }),
    ("kehai_module_clock_jitter_seconds", "gauge", "Spread of the clock's measurements", |line| {
        Some(line.clock_jitter_ms * 1e-3)
    }),
    ("kehai_module_background_age_seconds", "gauge", "Age of the background", |line| line.background_age_s),
    ("kehai_module_silent_seconds", "gauge", "Since the last datagram", |line| line.silent_s),
];

fn modules(frame: &Frame, text: &mut Text) {
    let modules = || frame.modules.iter().filter(|line| line.state != "found");
    text.metric(
        "kehai_module_up",
        "gauge",
        "1 if the module is heard of",
        modules()
            .map(|line| (vec![("module", line.name.as_str())], f64::from(u8::from(line.state != "missing")))),
    );
    for (name, kind, help, figure) in FIGURES {
        // A module that is missing has no figures but how long it has been.
        let there = |line: &&ModuleLine| line.state != "missing" || name == "kehai_module_silent_seconds";
        let samples = modules()
            .filter(there)
            .filter_map(|line| Some((vec![("module", line.name.as_str())], figure(line)?)));
        text.metric(name, kind, help, samples);
    }
    let alarms = modules().flat_map(|line| {
        line.alarms
            .iter()
            .map(|alarm| (vec![("module", line.name.as_str()), ("alarm", alarm.name.as_str())], 1.0))
    });
    text.metric("kehai_module_alarm", "gauge", "An alarm that is on", alarms);
}

fn drops(frame: &Frame, text: &mut Text) {
    let dropped = &frame.dropped;
    let causes = [
        ("unreadable", dropped.unreadable),
        ("repeated", dropped.repeated),
        ("late", dropped.late),
        ("early", dropped.early),
        ("stale_boot", dropped.stale_boot),
        ("unplaced", dropped.unplaced),
        ("stranger", frame.strangers),
    ];
    text.metric(
        "kehai_datagrams_dropped_total",
        "counter",
        "Datagrams that were not used, by cause",
        causes.map(|(cause, count)| (vec![("cause", cause)], count as f64)),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::AlarmLine;
    use crate::jsonl::ZoneLine;

    fn frame() -> Frame {
        let mut frame = Frame { strangers: 3, ..Frame::default() };
        let zone = |count, state| ZoneLine { count, p: vec![1.0], seen_share: 0.5, state };
        frame.line.zones.insert("hall".into(), zone(2, ZoneKnown::Partly));
        frame.line.zones.insert("a \"b\"\\\n".into(), zone(1, ZoneKnown::Unknown));
        let alarm = AlarmLine { name: "silent".into(), text: "…".into() };
        let line = |name: &str, state: &str| ModuleLine {
            name: name.into(),
            state: state.into(),
            scans_hz: 9.8,
            silent_s: Some(4.0),
            ..ModuleLine::default()
        };
        let missing = ModuleLine { alarms: vec![alarm], ..line("right", "missing") };
        frame.modules = vec![line("left", "watching"), missing, line("stranger", "found")];
        frame
    }

    #[test]
    fn an_unknown_zone_has_no_people_rather_than_none() {
        let text = text(&frame());
        assert!(text.contains("kehai_zone_people{zone=\"hall\"} 2\n"), "{text}");
        assert!(!text.contains("kehai_zone_people{zone=\"a"), "{text}");
        assert!(text.contains("kehai_zone_known{zone=\"a \\\"b\\\"\\\\\\n\"} 0\n"), "{text}");
    }

    #[test]
    fn a_missing_module_has_no_figures_but_is_told_to_be_missing() {
        let text = text(&frame());
        for line in [
            "kehai_module_up{module=\"left\"} 1",
            "kehai_module_up{module=\"right\"} 0",
            "kehai_module_scans_hertz{module=\"left\"} 9.8",
            "kehai_module_silent_seconds{module=\"right\"} 4",
            "kehai_module_alarm{module=\"right\",alarm=\"silent\"} 1",
            "kehai_datagrams_dropped_total{cause=\"stranger\"} 3",
        ] {
            assert!(text.lines().any(|known| known == line), "{line} in\n{text}");
        }
        assert!(!text.contains("kehai_module_scans_hertz{module=\"right\"}"), "{text}");
        assert!(!text.contains("module=\"stranger\""), "{text}");
    }

    #[test]
    fn every_line_is_a_comment_or_a_sample_of_the_metric_above() {
        let text = text(&frame());
        let mut metric = "";
        for line in text.lines() {
            if let Some(rest) = line.strip_prefix("# TYPE ") {
                let kind = rest.split(' ').nth(1).unwrap();
                assert!(["gauge", "counter"].contains(&kind), "{line}");
                continue;
            }
            if let Some(rest) = line.strip_prefix("# HELP ") {
                metric = rest.split(' ').next().unwrap();
                continue;
            }
            let (name, value) = line.rsplit_once(' ').unwrap();
            assert_eq!(name.split('{').next(), Some(metric), "{line}");
            assert!(value.parse::<f64>().is_ok(), "{line}");
        }
    }
}
