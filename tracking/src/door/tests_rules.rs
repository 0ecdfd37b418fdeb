//! What a door does beside its transitions: refusals, leases, changed sites, people who turn back.

use super::*;

#[test]
fn what_comes_at_the_wrong_time_changes_nothing_and_says_why() {
    let mut stage = Stage::idle();
    stage.tell(Event::Number(1));
    assert_eq!(stage.refusals(), [Refusal::NoCard]);
    stage.tell(Event::Reset);
    assert_eq!(stage.refusals(), [Refusal::NoAlarm]);
    stage.tell(Event::LockTaken(99));
    assert_eq!(stage.refusals(), [Refusal::OldAcknowledgement]);
    let mut stage = Stage::asked(1);
    stage.tell(Event::Card(ALICE));
    assert_eq!(stage.refusals(), [Refusal::SameCard]);
    stage.tell(Event::Card(BOB));
    assert_eq!(stage.refusals(), [Refusal::Busy]);
    for number in [0, 8, u32::MAX] {
        stage.tell(Event::Number(number));
        assert_eq!(stage.refusals(), [Refusal::Number]);
    }
    assert_eq!(stage.door.phase(), Phase::Asked);
    let mut stage = alarmed();
    stage.tell(Event::Card(BOB));
    assert_eq!((stage.refusals(), stage.door.phase()), (vec![Refusal::NotNow], Phase::Alarmed));
}

#[test]
fn a_door_that_fails_safe_unlocks_and_one_that_fails_secure_does_not_and_both_say_so() {
    for (fail, lock) in [("secure", Lock::Locked), ("safe", Lock::Unlocked)] {
        let mut stage = Stage::with(&SITE.replace("\"secure\"", &format!("{fail:?}")));
        stage.tell(Event::Time);
        assert_eq!(stage.door.lock(), lock, "nothing is known at the start");
        assert!(
            stage
                .actions
                .iter()
                .any(|action| matches!(action, Action::Alarm { alarm: Some(Alarm::Trouble), .. }))
        );
        stage.wait(SETTLED_S + 0.2);
        assert_eq!((stage.door.phase(), stage.door.lock()), (Phase::Idle, Lock::Locked));
        silence(&mut stage);
        assert_eq!((stage.door.phase(), stage.door.lock()), (Phase::Failed, lock));
    }
}

#[test]
fn locked_is_said_again_until_it_is_taken() {
    let mut stage = Stage::closing(1);
    stage.wait(4.0);
    let three = stage.lock_orders();
    assert!(three.len() >= 3 && three.iter().all(|same| *same == three[0]), "{three:?}");
    assert_eq!((three[0].lock, three[0].for_ms), (Lock::Locked, None));
    stage.tell(Event::LockTaken(three[0].id));
    stage.wait(2.0);
    assert_eq!(stage.lock_orders(), []);
}

#[test]
fn f9_unlocked_is_a_lease_that_is_renewed_each_half_second_taken_or_not() {
    let mut stage = Stage::unlocked(1);
    stage.wait(2.0);
    let orders = stage.lock_orders();
    let wanted = LockOrder { id: orders[0].id, lock: Lock::Unlocked, for_ms: Some(1500), nonce: None };
    assert!(orders.len() >= 3 && orders.iter().all(|order| *order == wanted), "{orders:?}");
    stage.tell(Event::LockTaken(wanted.id));
    stage.wait(2.0);
    assert!(stage.lock_orders().len() >= 3, "{:?}", stage.lock_orders());
    stage.tell(Event::LockReady(Nonce(41)));
    assert_eq!(stage.lock_orders(), [LockOrder { nonce: Some(Nonce(41)), ..wanted }], "at once");
    stage.tell(Event::Card(ALICE));
    assert_eq!((stage.door.phase(), stage.lock_orders()[0].lock), (Phase::Alarmed, Lock::Locked));
}

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
fn f8_an_alarm_of_before_a_restart_stands_until_its_own_end() {
    for alarm in [Alarm::Followed, Alarm::RanIn, Alarm::TurnedBack, Alarm::PassedBack, Alarm::WentIn] {
        let mut stage = Stage::after_restart(&[Alarm::HeldOpen, alarm, Alarm::Trouble, Alarm::HeldOpen]);
        let line = stage.door.line();
        assert_eq!(
            (line.phase, line.alarm, line.standing),
            (Phase::Failed, Some(Alarm::Trouble), Some(alarm))
        );
        stage.tell(Event::Contact(Contact::Shut));
        stage.wait(SETTLED_S + 0.2);
        let line = stage.door.line();
        assert_eq!((line.phase, line.alarm, line.standing), (Phase::Alarmed, Some(alarm), None));
        stage.tell(Event::Card(ALICE));
        assert_eq!((stage.refusals(), stage.door.lock()), (vec![Refusal::NotNow], Lock::Locked));
        stage.tell(Event::Reset);
        assert_eq!((stage.door.phase(), stage.door.line().alarm), (Phase::Idle, None));
    }
    // Reset before the tracker is well: it is over.
    let mut stage = Stage::after_restart(&[Alarm::Followed]);
    stage.tell(Event::Contact(Contact::Shut));
    stage.tell(Event::Reset);
    assert_eq!((stage.refusals(), stage.door.line().standing), (vec![], None));
    stage.wait(SETTLED_S + 0.2);
    assert_eq!((stage.door.phase(), stage.door.line().alarm), (Phase::Idle, None));
    let mut stage = Stage::after_restart(&[Alarm::Trouble]);
    stage.wait(SETTLED_S + 0.2);
    assert_eq!((stage.door.phase(), stage.door.line().alarm), (Phase::Idle, None), "all is well");
}

#[test]
fn f8_a_leaf_that_was_held_open_before_a_restart_is_until_it_is_shut() {
    let held_open = |stage: &Stage| {
        let line = stage.door.line();
        assert_eq!((line.phase, line.alarm), (Phase::HeldOpen, Some(Alarm::HeldOpen)));
    };
    for contact in [None, Some(Contact::Open)] {
        let mut stage = Stage::after_restart(&[Alarm::HeldOpen]);
        contact.into_iter().for_each(|contact| stage.tell(Event::Contact(contact)));
        stage.wait(SETTLED_S + 0.2);
        held_open(&stage);
        stage.tell(Event::Reset);
        assert_eq!(stage.refusals(), [Refusal::NoAlarm], "shut it");
        silence(&mut stage);
        assert_eq!(stage.door.line().standing, Some(Alarm::HeldOpen), "whatever trouble comes");
        stage.wait(SETTLED_S + 0.2);
        held_open(&stage);
        shuts(&mut stage);
        assert_eq!((stage.door.phase(), stage.door.line().alarm), (Phase::Idle, None));
    }
    let mut stage = Stage::after_restart(&[Alarm::HeldOpen]);
    shuts(&mut stage);
    assert_eq!(stage.door.line().standing, None, "shut while the tracker was not well yet");
    stage.wait(SETTLED_S);
    assert_eq!(stage.door.phase(), Phase::Idle);
}

#[test]
fn f8_a_leaf_of_which_nothing_is_known_may_be_open() {
    let start = || {
        let mut stage = Stage::with(SITE);
        stage.wait(SETTLED_S + 0.2);
        assert_eq!((stage.door.phase(), stage.door.line().contact), (Phase::Idle, None));
        stage
    };
    let mut stage = start();
    stage.put(1, 0.0, 0.0);
    stage.wait(0.3);
    stage.tell(Event::Card(ALICE));
    assert_eq!((stage.refusals(), stage.door.phase()), (vec![Refusal::NoContact], Phase::Idle));
    stage.tell(Event::Contact(Contact::Shut));
    stage.tell(Event::Card(ALICE));
    assert_eq!(stage.door.phase(), Phase::Asked);
    let mut stage = start();
    stage.walk_in(9);
    assert_eq!(stage.door.line().alarm, Some(Alarm::WentIn), "by a leaf that nobody has said is shut");
    let mut stage = start();
    stage.wait(6.0);
    assert_eq!(stage.door.line().alarm, Some(Alarm::HeldOpen));
    assert!(stage.door.may_change(), "its contact may be wired after it was drawn");
    stage.tell(Event::Contact(Contact::Open));
    assert!(!stage.door.may_change());
    shuts(&mut stage);
    assert_eq!((stage.door.phase(), stage.door.line().alarm), (Phase::Idle, None));
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
fn a_count_that_is_not_sure_or_a_zone_that_is_not_seen_unlocks_nothing() {
    for (p, seen_share) in [(SURE - 0.01, 1.0), (1.0, SEEN - 0.01)] {
        let mut stage = Stage::checking(1, 1);
        for _ in 0..30 {
            stage.now_s += 0.1;
            let seen = Seen { count_p: vec![1.0 - p, p], seen_share, ..stage.seen() };
            stage.tell(Event::Seen(seen));
            assert_eq!(stage.door.lock(), Lock::Locked);
        }
    }
}

#[test]
fn a_card_was_shown_by_one_of_the_people_before_the_line_and_by_none_inside() {
    let mut stage = Stage::idle();
    stage.put(1, 0.0, 0.7);
    stage.put(2, 0.0, -0.8);
    stage.put(3, 0.0, 1.2);
    stage.wait(0.2);
    stage.tell(Event::Card(ALICE));
    let named = stage.actions.iter().find_map(|action| match action {
        Action::Named { card, reader, by } => Some((*card, *reader, by.clone())),
        _ => None,
    });
    let (card, reader, by) = named.unwrap();
    assert_eq!((card, by), (ALICE, vec![1, 2]));
    assert_eq!(reader, Point::new(0.0, 1.0), "the middle of the line, as the site says nothing else");
}

#[test]
fn a_person_who_leaves_meanwhile_is_no_alarm() {
    let mut stage = Stage::unlocked(1);
    stage.put(7, 0.0, 1.6);
    stage.wait(0.2);
    for y in [1.3, 1.05, 0.8, 0.2, -0.5, -1.3] {
        stage.put(7, 0.2, y);
        stage.wait(0.3);
        assert_eq!(stage.door.phase(), Phase::Unlocked, "at {y}");
    }
}

#[test]
fn two_tracks_that_change_places_in_the_doorway_are_no_alarm() {
    let mut stage = Stage::unlocked(2);
    stage.walk_in(1);
    // The second is behind the first, and the tracks change places: the first jumps back by 0.3 s of outward motion.
    for (first, second) in [(1.2, 0.8), (0.95, 1.0), (0.85, 1.25), (0.8, 1.5)] {
        stage.put(1, 0.0, first);
        stage
            .bodies
            .iter_mut()
            .filter(|body| body.id == 1)
            .for_each(|body| body.velocity = Point::new(0.0, -0.8));
        stage.put(2, 0.0, second);
        stage.wait(0.1);
        assert_eq!(stage.door.phase(), Phase::Unlocked, "at {first}");
    }
    assert_eq!(stage.door.line().through, 1, "one person is in, no matter which");
    stage.walk_in(1);
    assert_eq!((stage.door.phase(), stage.door.line().through), (Phase::Closing, 2));
    // A person who goes all the way back has turned back.
    let mut stage = Stage::unlocked(2);
    stage.walk_in(1);
    stage.walk_back(1);
    assert_eq!(stage.passage().alarm, Some(Alarm::TurnedBack));
}

#[test]
fn a_match_is_not_steady_while_lines_are_missing() {
    let mut stage = Stage::checking(1, 1);
    for _ in 0..3 {
        stage.now_s += 0.9;
        let seen = stage.seen();
        stage.tell(Event::Seen(seen));
        assert_eq!(stage.door.phase(), Phase::Checking, "two lines 0.9 s apart are no half second on end");
    }
    stage.wait(0.4);
    assert_eq!(stage.door.phase(), Phase::Checking);
    stage.wait(0.2);
    assert_eq!(stage.door.phase(), Phase::Unlocked);
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
fn a_person_who_goes_in_says_that_the_leaf_is_open_if_its_contact_does_not() {
    // The report that it opened is lost: the contact says "shut" since long ago.
    let shut = |stage: Stage| {
        assert_eq!(stage.door.line().contact, Some(Contact::Shut));
        stage
    };
    let mut stage = shut(then(Stage::checking(1, 1), |stage| stage.wait(1.0)));
    stage.walk_in(1);
    assert_eq!((stage.door.phase(), stage.door.line().contact), (Phase::Closing, Some(Contact::Open)));
    stage.put(2, 0.0, 0.5);
    stage.wait(0.3);
    stage.walk_in(2);
    assert_eq!(stage.door.line().alarm, Some(Alarm::Followed));
    // And it shuts with the next report, as any.
    let mut stage = shut(then(Stage::checking(1, 1), |stage| stage.wait(1.0)));
    stage.walk_in(1);
    shuts(&mut stage);
    assert_eq!((stage.door.phase(), stage.passage().outcome), (Phase::Idle, Outcome::Complete));
    // Open for a person who leaves.
    let mut stage = shut(Stage::idle());
    stage.tell(Event::Exit);
    stage.walk_in(9);
    assert_eq!(stage.door.line().alarm, Some(Alarm::WentIn));
    // No order has opened it: a track that changes sides is the tracker's mistake.
    let mut stage = shut(Stage::idle());
    stage.walk_in(9);
    assert_eq!((stage.door.phase(), stage.door.line().contact), (Phase::Idle, Some(Contact::Shut)));
    // The leaf falls shut behind the last one, and its report is there before the track has crossed.
    let mut stage = Stage::unlocked(1);
    stage.put(1, 0.0, 1.05);
    stage.wait(0.1);
    stage.tell(Event::Contact(Contact::Shut));
    stage.wait(0.2);
    stage.put(1, 0.0, 1.5);
    stage.wait(1.0);
    assert_eq!((stage.door.phase(), stage.door.line().contact), (Phase::Idle, Some(Contact::Shut)));
}

#[test]
fn between_the_zone_and_a_line_off_it_people_are_on_their_way_and_count() {
    let off = SITE.replace("1.0], [0.45, 1.0]", "1.6], [0.45, 1.6]");
    let unlocked = || {
        let mut stage = Stage::with(&off);
        stage.tell(Event::Contact(Contact::Shut));
        stage.put(1, 0.0, 0.7);
        stage.wait(SETTLED_S + 0.2);
        stage.tell(Event::Card(ALICE));
        stage.tell(Event::Number(1));
        stage.wait(1.0);
        assert_eq!(stage.door.phase(), Phase::Unlocked);
        stage.tell(Event::Contact(Contact::Open));
        stage
    };
    let mut stage = unlocked();
    for tenth in 7..=18 {
        stage.put(1, 0.0, 0.1 * f64::from(tenth));
        stage.wait(0.1);
    }
    assert_eq!((stage.door.phase(), stage.door.line().through), (Phase::Closing, 1));
    let mut stage = unlocked();
    stage.put(2, 0.0, 1.4);
    stage.wait(0.4);
    assert_eq!(stage.door.line().alarm, Some(Alarm::RanIn), "another stands there");
}

#[test]
fn a_person_who_goes_in_while_the_door_recovers_is_an_alarm() {
    let blinks = |mut stage: Stage| {
        stage.trouble = Some(Trouble::ModuleLost);
        stage.wait(0.3);
        stage.trouble = None;
        stage.wait(0.3);
        stage
    };
    let mut stage = blinks(Stage::unlocked(1));
    stage.walk_in(1);
    stage.walk_in(2);
    let line = stage.door.line();
    assert_eq!((line.phase, line.standing, line.lock), (Phase::Failed, Some(Alarm::WentIn), Lock::Locked));
    stage.wait(SETTLED_S);
    assert_eq!((stage.door.phase(), stage.door.line().alarm), (Phase::Alarmed, Some(Alarm::WentIn)));
    // No change of the site ends it, as one that gives the door another name would: it is reset first.
    silence(&mut stage);
    assert_eq!((stage.door.phase(), stage.door.may_change()), (Phase::Failed, false));
    stage.tell(Event::Reset);
    assert!(stage.door.may_change());
    // The alarm of before stands; so does none where the leaf is shut, or the lock is open.
    let mut stage = blinks(alarmed());
    stage.walk_in(2);
    assert_eq!(stage.door.line().standing, Some(Alarm::PassedBack));
    let mut stage = blinks(Stage::idle());
    stage.walk_in(2);
    assert_eq!(stage.door.line().standing, None);
    let mut stage = Stage::with(&SITE.replace("\"secure\"", "\"safe\""));
    stage.wait(0.2);
    stage.walk_in(2);
    assert_eq!((stage.door.line().standing, stage.door.lock()), (None, Lock::Unlocked));
}

#[test]
fn what_parts_from_a_person_inside_has_not_gone_in_and_what_parts_from_one_of_the_group_has() {
    let part_of = |stage: &mut Stage, owner: u64| {
        stage.bodies.iter_mut().filter(|body| body.id == 9).for_each(|body| {
            (body.presence, body.is_seen) = (Presence::PartOf(owner), false);
        });
        stage.wait(0.1);
    };
    // A suitcase that is put down deep inside.
    let mut stage = Stage::unlocked(1);
    stage.put(8, 6.0, 3.0);
    stage.put(9, 6.2, 3.0);
    part_of(&mut stage, 8);
    stage.put(9, 6.2, 3.0);
    stage.wait(0.1);
    assert_eq!((stage.door.phase(), stage.door.line().through), (Phase::Unlocked, 0));
    // One who came in as a part of the person before, and parts a metre behind the door.
    stage.put(9, 0.0, 0.5);
    part_of(&mut stage, 1);
    stage.walk_in(1);
    stage.put(1, 0.0, 2.4);
    stage.put(9, 0.0, 2.0);
    part_of(&mut stage, 1);
    assert_eq!(stage.door.line().through, 1);
    stage.put(9, 0.0, 2.0);
    stage.wait(0.1);
    assert_eq!(stage.door.line().alarm, Some(Alarm::Followed));
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

#[test]
fn a_leaf_that_a_person_who_leaves_keeps_open_behind_a_group_is_not_held_open() {
    let mut stage = Stage::closing(1);
    stage.wait(3.0);
    stage.tell(Event::Exit);
    stage.wait(10.8);
    assert_eq!(stage.door.phase(), Phase::Closing, "5 s to leave, and the time to shut after them");
    stage.wait(0.4);
    assert_eq!(stage.door.line().alarm, Some(Alarm::HeldOpen));
}

#[test]
fn a_person_inside_is_not_one_of_the_number_where_the_zone_reaches_beyond_the_line() {
    let mut stage = Stage::with(&SITE.replace("1.0], [0.45, 1.0]", "0.5], [0.45, 0.5]"));
    stage.tell(Event::Contact(Contact::Shut));
    stage.put(1, 0.0, 0.0);
    stage.put(2, 0.0, 0.8);
    stage.wait(SETTLED_S + 0.2);
    stage.tell(Event::Card(ALICE));
    stage.tell(Event::Number(2));
    stage.wait(2.0);
    assert_eq!(stage.door.phase(), Phase::Checking, "two are counted, and one of them is inside");
    stage.put(2, 0.0, 1.5);
    stage.wait(2.2);
    stage.tell(Event::Number(1));
    stage.wait(1.0);
    assert_eq!(stage.door.phase(), Phase::Unlocked);
}

#[test]
fn a_track_that_is_lost_before_an_open_door_and_found_beyond_it_has_gone_in() {
    let found = |is_lost: bool, after_s: f64| {
        let mut stage = Stage::idle();
        stage.tell(Event::Contact(Contact::Open));
        if is_lost {
            stage.put(8, 0.0, 0.8);
            stage.wait(0.2);
            stage.bodies.clear();
        }
        stage.wait(after_s);
        stage.put(9, 0.0, 1.3);
        stage.bodies.iter_mut().for_each(|body| body.velocity = Point::new(0.0, 0.8));
        stage.wait(0.1);
        stage.door.line().alarm
    };
    assert_eq!(found(true, 1.0), Some(Alarm::WentIn));
    assert_eq!(found(true, 2.5), None, "too late for the same person");
    assert_eq!(found(false, 1.0), None, "a person inside turns round");
}
