//! What a door does when its site is changed.

use super::*;

#[test]
fn f8_a_changed_site_forgets_no_alarm_opens_no_lock_and_ends_a_passage() {
    let site = Site::parse("test", &SITE.replace("\"secure\"", "\"safe\"")).unwrap();
    let change = |stage: &mut Stage| {
        let mut actions = Vec::new();
        assert!(stage.door.change_site(&site.doors[0], &site, &mut actions));
        stage.actions = actions;
    };
    let mut stage = alarmed();
    change(&mut stage);
    assert_eq!((stage.door.phase(), stage.door.line().alarm), (Phase::Alarmed, Some(Alarm::PassedBack)));
    for mut stage in
        [Stage::idle(), Stage::asked(1), Stage::unlocked(1), Stage::closing(1), Stage::held_open()]
    {
        let (was, was_id) = (stage.door.phase(), stage.door.line().lock_id);
        assert_eq!(stage.door.may_change(), was == Phase::Idle, "{was}");
        change(&mut stage);
        assert_eq!(stage.door.lock(), Lock::Locked, "{was}");
        assert!(stage.door.line().lock_id >= was_id, "{was}: ids go on");
        for _ in 0..30 {
            stage.wait(0.1);
            assert_eq!(stage.door.lock(), Lock::Locked, "{was}");
        }
        // The leaf is open as before.
        let then = match was {
            Phase::HeldOpen => (Phase::HeldOpen, Some(Alarm::HeldOpen)),
            _ => (Phase::Idle, None),
        };
        assert_eq!((stage.door.phase(), stage.door.line().alarm), then, "{was}");
    }
}

#[test]
fn a_door_in_trouble_does_what_the_changed_site_says_and_no_change_unlocks_it_at_once() {
    let [secure, safe] = ["secure", "safe"].map(|fail| SITE.replace("\"secure\"", &format!("{fail:?}")));
    let change = |stage: &mut Stage, text: &str| {
        let site = Site::parse("test", text).unwrap();
        assert!(stage.door.change_site(&site.doors[0], &site, &mut Vec::new()));
    };
    let lost = |stage: &mut Stage, seconds| {
        stage.trouble = Some(Trouble::ModuleLost);
        stage.wait(seconds);
        assert_eq!(stage.door.phase(), Phase::Failed);
        stage.door.lock()
    };
    let mut stage = Stage::with(&safe);
    stage.wait(SETTLED_S + 0.2);
    assert_eq!(lost(&mut stage, 0.2), Lock::Unlocked);
    change(&mut stage, &safe);
    assert_eq!(stage.door.lock(), Lock::Unlocked, "as before");
    change(&mut stage, &secure);
    assert_eq!(stage.door.lock(), Lock::Locked, "at once");
    assert_eq!(lost(&mut stage, SETTLED_S + 1.0), Lock::Locked);
    change(&mut stage, &safe);
    assert_eq!(lost(&mut stage, SETTLED_S - 0.2), Lock::Locked, "the change alone opens nothing");
    assert_eq!(lost(&mut stage, 0.4), Lock::Unlocked);
    // A passage is ended by a change that brings trouble, or after which nothing is seen.
    for is_seen in [true, false] {
        let mut stage = Stage::unlocked(1);
        change(&mut stage, &safe);
        assert_eq!(stage.door.line().trouble, Some(Trouble::SiteChanged));
        if is_seen {
            assert_eq!(lost(&mut stage, SETTLED_S - 0.2), Lock::Locked);
            assert_eq!(lost(&mut stage, 0.4), Lock::Unlocked);
        } else {
            silence(&mut stage);
            assert_eq!(stage.door.lock(), Lock::Locked);
            silence(&mut stage);
            assert_eq!(stage.door.lock(), Lock::Unlocked);
        }
    }
}

#[test]
fn f8_no_match_counts_before_the_tracks_of_a_changed_site_are_there() {
    let mut stage = Stage::idle();
    stage.put(1, 0.0, 0.0);
    stage.wait(1.0);
    let site = Site::parse("test", SITE).unwrap();
    assert!(stage.door.change_site(&site.doors[0], &site, &mut Vec::new()));
    stage.tell(Event::Card(ALICE));
    stage.tell(Event::Number(1));
    stage.wait(SETTLED_S);
    assert_eq!((stage.door.phase(), stage.door.lock()), (Phase::Checking, Lock::Locked));
    stage.wait(0.8);
    assert_eq!(stage.door.lock(), Lock::Unlocked);
}

#[test]
fn a_changed_site_counts_no_time_in_which_lines_are_missing() {
    let site = Site::parse("test", SITE).unwrap();
    let mut stage = Stage::idle();
    stage.put(1, 0.0, 0.0);
    assert!(stage.door.change_site(&site.doors[0], &site, &mut Vec::new()));
    for _ in 0..2 {
        stage.now_s += 0.9;
        let seen = stage.seen();
        stage.tell(Event::Seen(seen));
    }
    stage.tell(Event::Card(ALICE));
    stage.tell(Event::Number(1));
    stage.wait(1.5);
    assert_eq!(stage.door.phase(), Phase::Checking, "2 s from the last gap on");
    stage.wait(1.2);
    assert_eq!(stage.door.phase(), Phase::Unlocked);
}

#[test]
fn the_site_is_not_changed_while_a_person_has_the_time_to_leave() {
    let mut stage = Stage::idle();
    stage.tell(Event::Exit);
    stage.wait(4.8);
    assert_eq!((stage.door.lock(), stage.door.may_change()), (Lock::Exit, false));
    stage.wait(0.4);
    assert_eq!((stage.door.lock(), stage.door.may_change()), (Lock::Locked, true));
}
