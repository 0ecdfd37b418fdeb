//! What has no room, and what is said of it.

use std::sync::mpsc::Receiver;

use kehai_tracking::alarm::Cause;
use kehai_tracking::alarm_list::About;
use kehai_tracking::door;
use kehai_tracking::jsonl::TracksLine;

use super::retention::DAY_MS;
use super::*;

/// A store of one place, of which nothing is taken while its messages are kept.
fn full() -> (Store, Receiver<Message>) {
    let (queue, messages) = sync_channel(1);
    let store = Store { queue: Some(queue), state: Arc::default(), thread: None };
    store.record(Arc::default());
    (store, messages)
}

fn work(file: &Path, store: &Store) -> Work {
    Work {
        file: file.to_path_buf(),
        keep: Keep::USUAL,
        writer: Some(Writer::open(file, 1, None).unwrap()),
        lock: None,
        damage: None,
        recorder: ChangeRecorder::default(),
        newest: None,
        newest_s: 0.0,
        run: None,
        failed: None,
        dropped: Dropped::default(),
        state: Arc::clone(&store.state),
    }
}

#[test]
fn a_site_for_which_there_is_no_room_is_not_taken_and_not_lost() {
    let (store, messages) = full();
    assert!(!store.set_site(&Arc::default(), Source::Map));
    assert!(messages.try_recv().is_ok());
    assert!(store.set_site(&Arc::default(), Source::Map));
    assert_eq!(store.state().dropped, Dropped::default());
}

#[test]
fn messages_and_rows_that_are_dropped_are_counted_each_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let (mut store, messages) = full();
    let mut work = work(&folder.path().join("kehai.db"), &store);
    (0..3).for_each(|_| store.record(Arc::default()));
    assert_eq!(store.watch().dropped(), Dropped { messages: 3, rows: 0 });
    for number in 0..50_001 {
        work.recorder.happened(Event::new(number, EventKind::Raw, "", ""));
    }
    store.queue = None;
    work.run(&messages);
    let state = store.state();
    assert_eq!((state.dropped, state.written), (Dropped { messages: 3, rows: 2 }, 1));
    let trouble = state.trouble.unwrap();
    assert!(trouble.contains("kehai.db") && trouble.contains("3 messages and 2 rows are lost"), "{trouble}");
}

#[test]
fn what_came_last_is_written_when_it_is_closed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("kehai.db");
    let store = Store::open(&file, &Arc::default(), Keep::USUAL).unwrap();
    store.record(Arc::new(Snapshot { unix_ms: 5, ..Snapshot::default() }));
    let state = store.close();
    assert_eq!((state.written, state.dropped, state.trouble), (1, Dropped::default(), None));
    assert_eq!(Reader::open(&file).unwrap().snapshot().unwrap().unwrap().unix_ms, 5);
}

#[test]
fn what_cannot_be_written_at_the_end_is_counted_as_lost() {
    let store = Store::open(Path::new("/proc/kehai/kehai.db"), &Arc::default(), Keep::USUAL).unwrap();
    store.happened(Event::new(5, EventKind::Raw, "hall", "…"));
    let state = store.close();
    assert_eq!(state.dropped, Dropped { messages: 0, rows: 1 });
    assert!(state.trouble.is_some_and(|trouble| trouble.contains("kehai.db")));
}

#[test]
fn f12_a_clock_that_jumps_ahead_while_the_tracker_runs_deletes_nothing_and_blanks_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("kehai.db");
    let store = Store::open(&file, &Arc::default(), Keep::USUAL).unwrap();
    let now_ms = unix_ms();
    let ahead_ms = now_ms + 3650 * DAY_MS;
    // Ten years ahead for a tenth of a second, and right again.
    for (unix_ms, t) in [
        (now_ms, 1.0),
        (now_ms + 100, 1.1),
        (ahead_ms + 200, 1.2),
        (ahead_ms + 300, 1.3),
        (now_ms + 400, 1.4),
        (now_ms + 500, 1.5),
        // Snapshots that were lost: both clocks say so.
        (now_ms + 60_000, 61.0),
    ] {
        let line = TracksLine { t, ..TracksLine::default() };
        store.see_waiting(Arc::new(Snapshot::of(unix_ms, line)));
    }
    drop(store);
    let reader = Reader::open(&file).unwrap();
    let mut ends: Vec<u64> = reader.runs().unwrap().into_iter().map(|(_, ended_ms)| ended_ms).collect();
    ends.sort_unstable();
    assert_eq!(ends, [now_ms + 100, now_ms + 60_000, ahead_ms + 300]);
    let lives = reader.lives(now_ms + 400, now_ms + 60_000).unwrap();
    assert_eq!(lives, [(now_ms + 399, now_ms + 60_000)], "what came once the clock was right is told");
    let writer = Writer::open(&file, ahead_ms + 400, None).unwrap();
    assert!(writer.doubt(ahead_ms + 400, Keep::USUAL).unwrap().is_some(), "nothing is deleted by that clock");
    assert!(writer.doubt(now_ms + 60_000, Keep::USUAL).unwrap().is_none());
}

#[test]
fn a_file_that_is_begun_anew_has_the_alarms_that_stand() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("kehai.db");
    let (mut store, messages) = full();
    messages.try_recv().unwrap();
    // One that has ended long ago is deleted.
    let ended_ms = unix_ms();
    let cause = Cause::Door(door::Alarm::Followed);
    let alarm = |id: u64, until_ms: Option<u64>| ListedAlarm {
        id,
        about: About::Door,
        of: "front".to_owned(),
        cause,
        severity: cause.severity(),
        text: String::new(),
        since_ms: 5,
        until_ms,
        acknowledged: None,
    };
    let alarms = vec![alarm(1, None), alarm(2, None)];
    let mut work = work(&file, &store);
    (work.writer, work.damage) = (None, Some("torn".to_owned()));
    work.newest = Some(Arc::new(Snapshot { unix_ms: 6, alarms, ..Snapshot::default() }));
    work.recorder.alarm(alarm(2, Some(ended_ms)));
    store.queue = None;
    work.run(&messages);
    let mut known = Reader::open(&file).unwrap().alarms(0).unwrap();
    known.sort_by_key(|alarm| alarm.id);
    assert_eq!(known, [alarm(1, None), alarm(2, Some(ended_ms))]);
}
