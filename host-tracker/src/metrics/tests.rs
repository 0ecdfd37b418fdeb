//! The text of a scrape, and what comes with the project that asks for it.

use super::*;
use kehai_tracking::alarm::{AlarmKind, AlarmLine};
use kehai_tracking::lines::CrossedLine;
use kehai_tracking::occupancy::{Found, Total, ZoneLine};

const LOSSES: Losses = Losses {
    database: Some(Dropped { messages: 6, rows: 4 }),
    mqtt: Some(7),
    areas: Some([("not_understood", 1), ("no_room", 2), ("late", 3), ("crowded", 4)]),
    reports: 8,
    scans: 9,
    is_together: false,
};

fn frame() -> Arc<Snapshot> {
    let total = Total { count: Some(0), state: ZoneKnown::Known };
    let mut frame = Snapshot { strangers: 3, missed: 5, total, ..Snapshot::default() };
    let zone = |count, state| ZoneLine::new(Found::inside(count, vec![1.0]), 0.5, state);
    frame.line.zones.insert("hall".into(), zone(2, ZoneKnown::Partly));
    frame.line.zones.insert("a \"b\"\\\n".into(), zone(1, ZoneKnown::Unknown));
    let alarm = AlarmLine::new(AlarmKind::Silent, "…");
    let line = |name: &str, state| ModuleLine {
        name: name.into(),
        state,
        scans_hz: 9.8,
        lost_share: Some(0.01),
        clock_jitter_ms: Some(0.2),
        silent_s: Some(4.0),
        ..ModuleLine::default()
    };
    let missing = ModuleLine { alarms: vec![alarm], ..line("right", DeviceState::Missing) };
    let strangers = [line("stranger", DeviceState::Found), line("stranger-off", DeviceState::Missing)];
    frame.modules = [line("left", DeviceState::Watching), missing].into_iter().chain(strangers).collect();
    Arc::new(frame)
}

/// The metrics of a frame of a site with two modules.
fn text(frame: &Arc<Snapshot>, losses: Losses) -> String {
    let site = "[[module]]\nname = \"left\"\nx = 0\ny = 0\n[[module]]\nname = \"right\"\nx = 1\ny = 0\n";
    super::text(frame, &Arc::new(Site::parse("site", site).unwrap()), losses)
}

#[test]
fn an_unknown_zone_has_no_people_rather_than_none() {
    let text = text(&frame(), LOSSES);
    assert!(text.contains("kehai_zone_people{zone=\"hall\"} 2\n"), "{text}");
    assert!(!text.contains("kehai_zone_people{zone=\"a"), "{text}");
    assert!(text.contains("kehai_zone_known{zone=\"a \\\"b\\\"\\\\\\n\"} 0.0\n"), "{text}");
}

#[test]
fn that_nobody_is_followed_is_said_where_nobody_is_known_to_be() {
    let mut frame = (*frame()).clone();
    assert!(
        text(&Arc::new(frame.clone()), Losses::default()).contains("kehai_tracks{state=\"confirmed\"} 0\n")
    );
    frame.total = Total::default();
    let text = text(&Arc::new(frame), Losses::default());
    assert!(!text.contains("kehai_tracks{"), "{text}");
}

#[test]
fn a_line_that_was_never_seen_has_no_crossings() {
    let line = |name: &str, counted: Option<u64>, state| CrossedLine {
        name: name.into(),
        inward: counted,
        outward: counted,
        state,
        unknown_s: 2.5,
        unfollowed: 7,
    };
    let lines = vec![line("front", Some(12), ZoneKnown::Partly), line("back", None, ZoneKnown::Unknown)];
    let text = text(&Arc::new(Snapshot { lines, ..Snapshot::default() }), Losses::default());
    for line in [
        "kehai_line_crossings_total{line=\"front\",direction=\"in\"} 12",
        "kehai_line_crossings_total{line=\"front\",direction=\"out\"} 12",
        "kehai_line_known{line=\"front\"} 0.5",
        "kehai_line_unknown_seconds_total{line=\"back\"} 2.5",
        "kehai_line_unfollowed_tracks_total{line=\"back\"} 7",
    ] {
        assert!(text.lines().any(|known| known == line), "{line} in\n{text}");
    }
    assert!(!text.contains("kehai_line_crossings_total{line=\"back\""), "{text}");
}

#[test]
fn stays_are_a_histogram_of_each_zone() {
    let line = DwellLine { zone: "hall".into(), stays: 4, sum_s: 40_123.0, parts: [1, 2, 0, 0, 0, 0, 0, 0] };
    let text = text(&Arc::new(Snapshot { dwell: vec![line], ..Snapshot::default() }), Losses::default());
    for line in [
        "# TYPE kehai_zone_dwell_seconds histogram",
        "kehai_zone_dwell_seconds_sum{zone=\"hall\"} 40123.0",
        "kehai_zone_dwell_seconds_count{zone=\"hall\"} 4",
        "kehai_zone_dwell_seconds_bucket{le=\"5.0\",zone=\"hall\"} 1",
        "kehai_zone_dwell_seconds_bucket{le=\"15.0\",zone=\"hall\"} 3",
        "kehai_zone_dwell_seconds_bucket{le=\"+Inf\",zone=\"hall\"} 4",
    ] {
        assert!(text.lines().any(|known| known == line), "{line} in\n{text}");
    }
}

#[test]
fn a_missing_module_has_no_figures_but_is_told_to_be_missing() {
    let text = text(&frame(), LOSSES);
    for line in [
        "kehai_module_up{module=\"left\"} 1",
        "kehai_module_up{module=\"right\"} 0",
        "kehai_module_scans_hertz{module=\"left\"} 9.8",
        "kehai_module_silent_seconds{module=\"right\"} 4.0",
        "kehai_module_alarm{module=\"right\",alarm=\"silent\"} 1",
        "kehai_datagrams_dropped_total{cause=\"stranger\"} 3",
        "kehai_snapshots_missed_total 5",
        "kehai_database_dropped_total{cause=\"full\"} 6",
        "kehai_database_dropped_total{cause=\"unwritten\"} 4",
        "kehai_mqtt_dropped_total 7",
        "kehai_area_messages_dropped_total{cause=\"late\"} 3",
        "kehai_reports_missed_total 8",
        "kehai_scans_missed_total 9",
    ] {
        assert!(text.lines().any(|known| known == line), "{line} in\n{text}");
    }
    assert!(!text.contains("kehai_module_scans_hertz{module=\"right\"}"), "{text}");
    assert!(!text.contains("module=\"stranger"), "{text}");
}

#[test]
fn what_the_trackers_of_areas_count_is_absent_and_not_0() {
    let text = text(&frame(), Losses { is_together: true, ..LOSSES });
    for name in ["kehai_datagrams_dropped", "kehai_devices_refused", "kehai_signs"] {
        assert!(!text.contains(name), "{name} in\n{text}");
    }
    for line in ["kehai_snapshots_missed_total 5", "kehai_http_refused_total{cause=\"full\"} 0"] {
        assert!(text.lines().any(|known| known == line), "{line} in\n{text}");
    }
}

#[test]
fn what_was_never_measured_is_absent_and_not_0() {
    let mut frame = (*frame()).clone();
    for module in &mut frame.modules {
        (module.lost_share, module.clock_jitter_ms) = (None, None);
    }
    let text = text(&Arc::new(frame), LOSSES);
    for name in ["kehai_module_lost_ratio{", "kehai_module_clock_jitter_seconds{"] {
        assert!(!text.contains(name), "{text}");
    }
}

#[test]
fn what_is_not_there_has_dropped_nothing_rather_than_0() {
    let text = text(&frame(), Losses::default());
    assert!(!text.contains("kehai_area_messages_dropped"), "{text}");
    assert!(!text.contains("kehai_mqtt_dropped") && !text.contains("kehai_database_dropped"), "{text}");
    assert!(text.contains("kehai_reports_missed_total 0\n"), "{text}");
}

#[test]
fn every_line_is_a_comment_or_a_sample_of_the_metric_above() {
    let text = text(&frame(), LOSSES);
    let lines: Vec<&str> = text.lines().collect();
    let (mut metric, mut samples) = (String::new(), 0);
    assert_eq!(lines.last(), Some(&"# EOF"));
    for line in lines.iter().filter(|line| **line != "# EOF") {
        if let Some(rest) = line.strip_prefix("# TYPE ") {
            let (name, kind) = rest.split_once(' ').unwrap();
            // A counter's samples have a name of their own.
            metric = match kind {
                "gauge" => name.to_owned(),
                "counter" => format!("{name}_total"),
                _ => panic!("{line}"),
            };
            continue;
        }
        if line.starts_with("# HELP ") {
            continue;
        }
        let (name, value) = line.rsplit_once(' ').unwrap();
        assert_eq!(name.split('{').next(), Some(metric.as_str()), "{line}");
        assert!(value.parse::<f64>().is_ok(), "{line}");
        samples += 1;
    }
    assert!(samples > 20, "{text}");
}

#[test]
fn what_comes_with_the_project_asks_for_metrics_that_there_are() {
    let text = text(&frame(), LOSSES);
    let known: Vec<&str> = text.lines().filter_map(|line| line.split(['{', ' ']).next()).collect();
    let asked = [
        include_str!("../../../packaging/monitoring/alerts.yml"),
        include_str!("../../../packaging/monitoring/grafana.json"),
    ]
    .map(|text| {
        text.match_indices("kehai_").map(|(at, _)| {
            let name = &text[at..];
            &name[..name.find(|c: char| c != '_' && !c.is_ascii_lowercase()).unwrap_or(name.len())]
        })
    });
    let mut count = 0;
    for name in asked.into_iter().flatten() {
        assert!(known.contains(&name), "{name} in\n{text}");
        count += 1;
    }
    assert!(count > 10);
}

#[test]
fn the_alert_of_forged_datagrams_knows_every_cause_of_theirs() {
    let rules = include_str!("../../../packaging/monitoring/alerts.yml");
    let (_, rest) = rules.split_once("kehai_datagrams_dropped_total{cause=~\"").unwrap();
    let causes: Vec<&str> = rest.split_once('"').unwrap().0.split('|').collect();
    assert_eq!(causes, ["unasked", "foreign", "same_name", "jump", "clear", "forged", "replayed"]);
    let text = text(&frame(), Losses::default());
    for cause in causes {
        let sample = format!("kehai_datagrams_dropped_total{{cause=\"{cause}\"}}");
        assert!(text.contains(&sample), "{sample} in\n{text}");
    }
}

#[test]
fn the_names_that_dashboards_ask_for_stay() {
    let text = text(&frame(), LOSSES);
    let known: Vec<&str> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .filter_map(|line| line.split(['{', ' ']).next())
        .collect();
    for name in [
        "kehai_zone_people",
        "kehai_zone_known",
        "kehai_zone_seen_ratio",
        "kehai_tracks",
        "kehai_module_up",
        "kehai_module_scans_hertz",
        "kehai_module_lost_ratio",
        "kehai_module_checksum_errors_total",
        "kehai_module_unknown_ratio",
        "kehai_module_clock_jitter_seconds",
        "kehai_module_silent_seconds",
        "kehai_module_alarm",
        "kehai_datagrams_dropped_total",
        "kehai_http_refused_total",
        "kehai_snapshots_missed_total",
        "kehai_database_dropped_total",
        "kehai_mqtt_dropped_total",
        "kehai_reports_missed_total",
        "kehai_scans_missed_total",
    ] {
        assert!(known.contains(&name), "{name} in\n{text}");
    }
}
