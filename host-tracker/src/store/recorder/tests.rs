//! Which rows frames become, and that none is lost or kept twice.

use super::*;
use kehai_tracking::alarm::AlarmLine;
use kehai_tracking::jsonl::{TrackLine, TracksLine, ZoneLine};
use kehai_tracking::occupancy::Found;
use kehai_tracking::snapshot::{DeviceEvent, EventLine};

fn site() -> Site {
    toml::from_str("[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [4, 0], [4, 4], [0, 4]]").unwrap()
}

fn track(id: u64, x: f64) -> TrackLine {
    let text = format!("{{\"id\":{id},\"x\":{x},\"y\":1.0,\"state\":\"confirmed\"}}");
    serde_json::from_str(&text).unwrap()
}

fn frame(unix_ms: u64, tracks: Vec<TrackLine>) -> Snapshot {
    Snapshot::of(unix_ms, TracksLine { tracks, ..TracksLine::default() })
}

#[test]
fn a_person_who_walks_through_a_zone_enters_it_and_leaves_it() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    for tenth in 0..60 {
        recorder.record(&frame(1000 + 100 * tenth, vec![track(7, -1.0 + 0.1 * tenth as f64)]));
    }
    recorder.record(&frame(8000, vec![]));
    let (rows, paths) = recorder.rows();
    let events: Vec<&str> = rows
        .iter()
        .filter_map(|row| match row {
            Row::Event(event) if event.track == Some(7) && event.subject == "hall" => Some(event.kind.name()),
            _ => None,
        })
        .collect();
    assert_eq!(events, ["enter", "leave"]);
    let path = &paths[&(7, 0)];
    assert_eq!((path.begun_ms, path.ended_ms), (1000, 6900));
    assert_eq!(super::super::path::decode(&path.points).len(), 2);
}

#[test]
fn what_was_not_written_is_handed_out_again_and_nothing_twice() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    recorder.record(&frame(1000, vec![track(1, 1.0)]));
    let before = (recorder.rows().0.to_vec(), recorder.rows().1.clone());
    assert_eq!((recorder.rows().0.to_vec(), recorder.rows().1.clone()), before);
    recorder.written();
    assert!(recorder.rows().0.is_empty() && recorder.rows().1.is_empty());
    recorder.record(&frame(1100, vec![track(1, 1.0)]));
    assert_eq!(recorder.rows().1.len(), 1, "the open part, longer than before");
}

#[test]
fn a_long_stay_is_parts_that_meet() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    for second in 0..700 {
        recorder.record(&frame(1000 * second, vec![track(1, 1.0)]));
    }
    let spans: Vec<_> = recorder.rows().1.values().map(|row| (row.begun_ms, row.ended_ms)).collect();
    assert_eq!(spans, [(0, 300_000), (300_000, 600_000), (600_000, 699_000)]);
}

#[test]
fn a_track_that_comes_back_under_its_number_does_not_replace_what_it_walked_before() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    for (at_ms, tracks) in [(1000, vec![track(7, 1.0)]), (1100, vec![]), (1200, vec![track(7, 1.0)])] {
        recorder.record(&frame(at_ms, tracks));
    }
    let parts: Vec<_> = recorder.rows().1.iter().map(|(&part, row)| (part, row.begun_ms)).collect();
    assert_eq!(parts, [((7, 0), 1000), ((7, 1), 1200)]);
}

#[test]
fn counts_and_alarms_are_kept_when_they_change() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    for second in 0..10_u64 {
        let mut frame = frame(1000 * second, vec![]);
        let (count, state) = (u32::from(second > 4), ZoneKnown::Known);
        frame.line.zones.insert("hall".into(), ZoneLine::new(Found::inside(count, vec![]), 1.0, state));
        let alarm = AlarmLine::new(AlarmKind::Silent, "no datagram for 3 s");
        let alarms = if (3..6).contains(&second) { vec![alarm] } else { vec![] };
        frame.modules.push(ModuleLine { name: "left".into(), alarms, ..ModuleLine::default() });
        recorder.record(&frame);
    }
    let (rows, _) = recorder.rows();
    let counts = rows.iter().filter(|row| matches!(row, Row::Count { .. })).count();
    let kinds: Vec<&str> = rows
        .iter()
        .filter_map(|row| if let Row::Event(event) = row { Some(event.kind.name()) } else { None })
        .collect();
    assert_eq!((counts, kinds), (2, vec!["state", "alarm", "cleared"]));
}

#[test]
fn the_track_of_an_id_is_kept_when_it_changes_and_is_likely() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    let name = |track, probability| NameLine {
        card: Some(Card(7)),
        label: "00000000".into(),
        heard_s: 0.0,
        read_s: Some(0.0),
        tracks: vec![Likelihood { track, probability }],
        zones: Vec::new(),
    };
    for (at_ms, names) in [
        (1000, vec![name(4, 0.4)]),
        (1100, vec![name(4, 0.9)]),
        (1200, vec![name(4, 0.8)]),
        (1300, vec![name(5, 0.45)]),
        (1400, vec![name(5, 0.7)]),
        (1500, vec![]),
        (1600, vec![name(5, 0.9)]),
    ] {
        recorder.record(&Snapshot { names, ..frame(at_ms, vec![]) });
    }
    let kept = |row: &Row| match row {
        Row::Name { at_ms, track, hash, .. } => Some((*at_ms, *track, *hash)),
        _ => None,
    };
    let hash = CardHash::from(Card(7));
    let kept: Vec<_> = recorder.rows().0.iter().filter_map(kept).collect();
    let all = [(1100, 4, hash), (1300, 4, hash), (1400, 5, hash), (1500, 5, hash), (1600, 5, hash)];
    assert_eq!(kept, all);
}

/// What is kept of names: times, tracks and probabilities.
fn named(recorder: &mut ChangeRecorder) -> Vec<(u64, u64, f64)> {
    let row = |row: &Row| match row {
        Row::Name { at_ms, track, probability, .. } => Some((*at_ms, *track, *probability)),
        _ => None,
    };
    recorder.rows().0.iter().filter_map(row).collect()
}

/// A frame with one ID and the tracks that may be it.
fn with_name(unix_ms: u64, tracks: &[(u64, f64)]) -> Snapshot {
    let text = "{\"label\":\"0000\",\"heard_s\":0.0,\"tracks\":[]}";
    let mut name: NameLine = serde_json::from_str(text).unwrap();
    name.card = Some(Card(7));
    name.tracks = tracks.iter().map(|&(track, probability)| Likelihood { track, probability }).collect();
    Snapshot { names: vec![name], ..frame(unix_ms, vec![]) }
}

#[test]
fn that_an_id_has_its_track_no_more_is_kept_once_and_does_not_flap() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    recorder.record(&with_name(1000, &[(4, 0.9)]));
    // About as likely as not it stays.
    recorder.record(&with_name(1100, &[(4, 0.45)]));
    recorder.record(&with_name(1200, &[(4, 0.55)]));
    // Two who touch.
    recorder.record(&with_name(1300, &[(5, 0.45), (4, 0.375)]));
    recorder.record(&with_name(1400, &[(5, 0.45), (4, 0.375)]));
    // Another at once: its row ends the one before.
    recorder.record(&with_name(1500, &[(4, 0.75)]));
    recorder.record(&with_name(1600, &[(5, 0.75)]));
    // The track is gone; then the ID is forgotten.
    recorder.record(&with_name(1700, &[]));
    recorder.record(&frame(1800, vec![]));
    recorder.record(&with_name(1900, &[(6, 0.75)]));
    recorder.record(&frame(2000, vec![]));
    recorder.record(&frame(2100, vec![]));
    let all = [
        (1000, 4, 0.9),
        (1300, 4, 0.375),
        (1500, 4, 0.75),
        (1600, 5, 0.75),
        (1700, 5, 0.0),
        (1900, 6, 0.75),
        (2000, 6, 0.0),
    ];
    assert_eq!(named(&mut recorder), all);
}

#[test]
fn while_there_are_no_frames_no_id_has_a_track() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    recorder.record(&with_name(1000, &[(4, 0.75)]));
    recorder.record(&with_name(2000, &[(4, 0.75)]));
    recorder.record(&with_name(9000, &[(4, 0.75)]));
    assert_eq!(named(&mut recorder), [(1000, 4, 0.75), (5000, 4, 0.0), (9000, 4, 0.75)]);
}

#[test]
fn where_rows_of_names_were_dropped_their_ids_have_no_track_until_it_is_said_again() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    recorder.record(&with_name(1000, &[(4, 0.75)]));
    for number in 0..ROWS_MAX as u64 {
        recorder.happened(Event::new(number, EventKind::State, "", ""));
    }
    recorder.record(&with_name(1100, &[(4, 0.75)]));
    assert_eq!(named(&mut recorder), [(1000, 4, 0.0)]);
    recorder.written();
    recorder.record(&with_name(1200, &[(4, 0.75)]));
    assert_eq!(named(&mut recorder), [(1200, 4, 0.75)]);
}

#[test]
fn what_a_module_learned_or_absorbed_is_kept_once_and_of_each_start() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    let event = |boot, number, kind, ago_s| EventLine { boot, number, ago_s, kind, ..EventLine::default() };
    let frames = [
        (1000, vec![event(1, 1, DeviceEvent::Learned, 0.5)]),
        (1100, vec![event(1, 1, DeviceEvent::Learned, 0.6), event(1, 2, DeviceEvent::Absorbed, 0.0)]),
        (9000, vec![event(2, 1, DeviceEvent::LearnStarted, 0.0)]),
        // Reset to factory settings it counts its starts from 1.
        (
            9100,
            vec![event(2, 1, DeviceEvent::LearnStarted, 0.1), event(1, 1, DeviceEvent::FactoryReset, 0.0)],
        ),
        (9200, vec![event(1, 1, DeviceEvent::FactoryReset, 0.1)]),
    ];
    for (unix_ms, events) in frames {
        let module = ModuleLine { name: "left".into(), events, ..ModuleLine::default() };
        recorder.record(&Snapshot { modules: vec![module], ..frame(unix_ms, vec![]) });
    }
    let kept: Vec<(u64, &str, &str)> = recorder
        .rows()
        .0
        .iter()
        .filter_map(|row| if let Row::Event(event) = row { Some(event) } else { None })
        .map(|event| (event.at_ms, event.kind.name(), &*event.subject))
        .collect();
    assert_eq!(
        kept,
        [
            (1000, "state", "left"),
            (500, "learned", "left"),
            (1100, "absorbed", "left"),
            (9000, "learn-started", "left"),
            (9100, "factory-reset", "left")
        ]
    );
}

#[test]
fn a_module_s_place_is_kept_when_it_changes_and_by_whom() {
    let mut site = site();
    site.modules = vec![toml::from_str("name = \"left\"\nx = 1.0\ny = 2.0").unwrap()];
    let mut recorder = ChangeRecorder::new(&site, 1000);
    recorder.set_site(&site, 2000, Source::Map);
    site.modules[0].yaw_deg = 45.0;
    recorder.set_site(&site, 3000, Source::Map);
    let poses: Vec<(u64, f64, Source)> = recorder
        .rows()
        .0
        .iter()
        .filter_map(|row| match row {
            Row::Pose(pose) => Some((pose.at_ms, pose.yaw_deg, pose.source)),
            _ => None,
        })
        .collect();
    assert_eq!(poses, [(1000, 0.0, Source::File), (3000, 45.0, Source::Map)]);
}

#[test]
fn a_database_that_cannot_be_written_for_long_costs_rows_and_says_how_many() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    for number in 0..ROWS_MAX as u64 + 10 {
        recorder.happened(Event::new(number, EventKind::State, "", ""));
    }
    recorder.record(&frame(1, vec![]));
    // The frame brings a row more: which zones make the total.
    assert_eq!((recorder.rows().0.len(), recorder.dropped()), (ROWS_MAX, 11));
}

#[test]
fn each_crossing_is_a_row_though_frames_were_missed_and_what_was_counted_before_is_none() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    let mut see = |at_ms: u64, inward: u64, outward: u64, state: ZoneKnown| {
        let (name, unknown_s) = ("front".to_owned(), 0.0);
        let line = CrossedLine {
            name,
            inward: Some(inward),
            outward: Some(outward),
            state,
            unknown_s,
            unfollowed: 0,
        };
        recorder.record(&Snapshot { lines: vec![line], ..frame(at_ms, vec![]) });
        let row = |row: &Row| match row {
            Row::Crossing { direction, .. } => Some(direction.name().to_owned()),
            Row::Line { totals, state, .. } => {
                Some(format!("{} {} {state:?}", totals.inward, totals.outward))
            }
            _ => None,
        };
        let rows: Vec<String> = recorder.rows().0.iter().filter_map(row).collect();
        recorder.written();
        rows
    };
    assert_eq!(see(1000, 7, 3, ZoneKnown::Known), ["7 3 Known"], "counted by an earlier process");
    assert!(see(1100, 7, 3, ZoneKnown::Known).is_empty());
    assert_eq!(see(1900, 9, 4, ZoneKnown::Known), ["in", "in", "out", "9 4 Known"]);
    assert_eq!(see(3000, 9, 4, ZoneKnown::Unknown), ["9 4 Unknown"]);
    assert!(see(3100, 9, 4, ZoneKnown::Known).is_empty(), "at most once a second");
    assert_eq!(see(4100, 9, 4, ZoneKnown::Known), ["9 4 Known"]);
}

/// What is kept of the zone and the line: times and counts.
fn kept(recorder: &mut ChangeRecorder) -> Vec<(u64, Option<u32>)> {
    let row = |row: &Row| match row {
        Row::Count { at_ms, count, .. } => Some((*at_ms, *count)),
        Row::Line { at_ms, state, .. } => Some((*at_ms, (*state == ZoneKnown::Known).then_some(0))),
        _ => None,
    };
    recorder.rows().0.iter().filter_map(row).collect()
}

fn counted(unix_ms: u64, count: u32, state: ZoneKnown) -> Snapshot {
    let mut frame = frame(unix_ms, vec![]);
    frame.line.zones.insert("hall".into(), ZoneLine::new(Found::inside(count, vec![1.0]), 1.0, state));
    frame
}

#[test]
fn that_a_zone_is_empty_is_taken_back_at_once() {
    use ZoneKnown::{Known, Unknown};
    let mut recorder = ChangeRecorder::new(&site(), 0);
    for (at_ms, count, state) in [
        (1000, 0, Known),
        (1100, 0, Unknown),
        (1200, 0, Known),
        (2100, 0, Known),
        (2200, 1, Known),
        (2300, 2, Known),
        (2400, 2, Unknown),
    ] {
        recorder.record(&counted(at_ms, count, state));
    }
    let all = [(1000, Some(0)), (1100, None), (2100, Some(0)), (2200, Some(1)), (2400, None)];
    assert_eq!(kept(&mut recorder), all);
}

#[test]
fn while_there_are_no_frames_and_of_a_zone_that_is_gone_nothing_is_known() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    recorder.record(&counted(1000, 0, ZoneKnown::Known));
    recorder.record(&counted(9000, 0, ZoneKnown::Known));
    recorder.record(&frame(9100, vec![]));
    let all = [(1000, Some(0)), (4000, None), (9000, Some(0)), (9100, None)];
    assert_eq!(kept(&mut recorder), all);
}

#[test]
fn where_rows_were_dropped_nothing_is_known() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    recorder.record(&counted(1000, 0, ZoneKnown::Known));
    recorder.written();
    for number in 0..ROWS_MAX as u64 + 10 {
        recorder.record(&counted(2000 + number * 1000, (number % 2) as u32, ZoneKnown::Known));
    }
    // A row at 3000 and each second after it; the nine oldest are one now.
    let kept = kept(&mut recorder);
    assert_eq!((kept[0], kept[1].0, kept.len()), ((3000, None), 12_000, ROWS_MAX + 1));
    assert_eq!(recorder.dropped(), 8);
}

#[test]
fn that_a_part_is_no_longer_seen_is_kept_at_once() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    let mut states = Vec::new();
    for (at_ms, state) in [(1000, ZoneKnown::Known), (1100, ZoneKnown::Partly), (1200, ZoneKnown::Known)] {
        recorder.record(&counted(at_ms, 2, state));
    }
    for row in recorder.rows().0 {
        if let Row::Count { at_ms, state, .. } = row {
            states.push((*at_ms, *state));
        }
    }
    assert_eq!(states, [(1000, ZoneKnown::Known), (1100, ZoneKnown::Partly)]);
}

#[test]
fn after_the_clock_was_set_back_all_is_said_again_and_once_more_when_it_has_caught_up() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    recorder.record(&counted(9000, 0, ZoneKnown::Known));
    recorder.clock_set();
    for at_ms in [5000, 7000, 9000, 9100, 9200] {
        recorder.record(&counted(at_ms, 0, ZoneKnown::Known));
    }
    assert_eq!(kept(&mut recorder), [(9000, Some(0)), (5000, Some(0)), (9100, Some(0))]);
}

#[test]
fn health_is_kept_each_minute_also_after_the_clock_was_set_back() {
    let mut recorder = ChangeRecorder::new(&site(), 0);
    let healthy = |at_ms: u64, recorder: &mut ChangeRecorder| {
        let mut frame = frame(at_ms, vec![]);
        frame.modules.push(ModuleLine { name: "left".into(), ..ModuleLine::default() });
        recorder.record(&frame);
    };
    healthy(7_200_000, &mut recorder);
    recorder.clock_set();
    for minute in 0..3 {
        healthy(3_600_000 + minute * HEALTH_MS, &mut recorder);
    }
    let at = |row: &Row| if let Row::Health { at_ms, .. } = row { Some(*at_ms) } else { None };
    let kept: Vec<u64> = recorder.rows().0.iter().filter_map(at).collect();
    assert_eq!(kept, [7_200_000, 3_600_000, 3_660_000, 3_720_000]);
}
