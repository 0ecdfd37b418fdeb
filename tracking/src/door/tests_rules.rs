//! What a door takes, unlocks for, and says again: refusals, counts, leases.

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
