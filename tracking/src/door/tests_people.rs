//! What a door concludes from people who leave, turn back, part, are lost, or stand where they are not expected.

use super::*;

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

#[test]
fn the_card_of_a_person_who_was_lost_on_the_way_in_is_inside() {
    let mut stage = Stage::unlocked(1);
    stage.put(1, 0.0, 0.8);
    stage.wait(0.1);
    stage.bodies.clear();
    stage.wait(0.1);
    assert_eq!(stage.door.phase(), Phase::Closing);
    shuts(&mut stage);
    assert_eq!(stage.passage().outcome, Outcome::Complete);
    stage.tell(Event::Card(ALICE));
    assert_eq!(stage.door.line().alarm, Some(Alarm::PassedBack));
}

#[test]
fn the_card_of_a_person_who_was_lost_before_a_leaf_that_did_not_move_is_outside() {
    let mut stage = Stage::checking(1, 1);
    stage.wait(1.0);
    assert_eq!(stage.door.phase(), Phase::Unlocked);
    stage.put(1, 0.0, 0.8);
    stage.wait(0.1);
    stage.bodies.clear();
    stage.wait(0.2);
    assert_eq!(stage.passage().outcome, Outcome::Complete);
    stage.tell(Event::Card(ALICE));
    assert_eq!((stage.door.phase(), stage.door.line().alarm), (Phase::Asked, None));
}

#[test]
fn a_person_who_goes_in_while_the_door_recovers_is_in_the_records_with_what_is_known_of_them() {
    let reason = |mut stage: Stage| {
        stage.trouble = Some(Trouble::ModuleLost);
        stage.wait(0.3);
        stage.trouble = None;
        stage.put(1, 0.0, 0.9);
        stage.wait(0.2);
        stage.put(1, 0.0, 1.2);
        stage.wait(0.1);
        let passage = stage.passage();
        assert_eq!((passage.outcome, passage.alarm), (Outcome::Alarmed, Some(Alarm::WentIn)));
        passage.reason.clone()
    };
    let of_the_group = reason(Stage::unlocked(1));
    assert!(of_the_group.ends_with("is not known"), "{of_the_group}");
    let mut stage = Stage::idle();
    stage.wait(0.2);
    stage.tell(Event::Contact(Contact::Open));
    assert_eq!(reason(stage), Alarm::WentIn.words(), "none was let in");
}
