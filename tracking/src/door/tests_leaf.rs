//! What a door does by its leaf: one of which nothing is known, one that is held open, one whose contact is wrong.

use super::*;

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
fn a_leaf_that_a_person_who_leaves_keeps_open_behind_a_group_is_not_held_open() {
    let mut stage = Stage::closing(1);
    stage.wait(3.0);
    stage.tell(Event::Exit);
    stage.wait(10.8);
    assert_eq!(stage.door.phase(), Phase::Closing, "5 s to leave, and the time to shut after them");
    stage.wait(0.4);
    assert_eq!(stage.door.line().alarm, Some(Alarm::HeldOpen));
}
