//! What a door knows after the tracker has started anew.

use super::*;

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
fn a_door_does_not_know_whom_it_had_let_in_before_a_restart_until_its_leaf_was_shut() {
    let reason = |mut stage: Stage| {
        for y in [0.9, 1.2] {
            stage.put(9, 0.0, y);
            stage.wait(0.1);
        }
        assert_eq!(stage.door.line().alarm, Some(Alarm::WentIn), "it does not know, and locks");
        stage.passage().reason.clone()
    };
    for contact in [None, Some(Contact::Open)] {
        let mut stage = Stage::after_restart(&[]);
        contact.into_iter().for_each(|contact| stage.tell(Event::Contact(contact)));
        stage.wait(SETTLED_S + 0.2);
        let reason = reason(stage);
        assert!(reason.ends_with("is not known"), "{reason}");
    }
    // With a leaf that was shut what was under way before is over.
    let mut stage = Stage::idle();
    stage.wait(0.2);
    stage.tell(Event::Contact(Contact::Open));
    assert_eq!(reason(stage), Alarm::WentIn.words());
}
