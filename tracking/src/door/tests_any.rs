//! What holds whatever happens: never unlocked without a matching count, never locked against an exit.

use proptest::prelude::*;

use super::*;

/// Any event, and its delay after the one before.
fn anything() -> impl Strategy<Value = (u8, u32, f64)> {
    (0_u8..14, 0_u32..5, prop_oneof![4 => 0.02_f64..0.3, 1 => 0.3_f64..12.0])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Never unlocked without a matching count, never locked against an exit, only the transitions of the list.
    #[test]
    fn whatever_happens(steps in proptest::collection::vec(anything(), 1..250), safe in any::<bool>()) {
        let mut stage = Stage::with(&SITE.replace("\"secure\"", if safe { "\"safe\"" } else { "\"secure\"" }));
        let mut exit_s = f64::NEG_INFINITY;
        for (kind, number, after_s) in steps {
            stage.now_s += after_s;
            let event = match kind {
                0 => Event::Card([ALICE, BOB][number as usize % 2]),
                1 | 2 => Event::Number(number),
                3 => Event::Contact(if number % 2 == 0 { Contact::Shut } else { Contact::Open }),
                4 if number == 0 => Event::Exit,
                5 => Event::LockTaken(u64::from(number)),
                6 if number == 0 => Event::Reset,
                7 if number == 0 => Event::Time,
                8 => {
                    let y = [0.5, 0.95, 1.2, -0.5, -1.4][number as usize % 5];
                    stage.put(u64::from(number) % 2 + 1, 0.0, y);
                    Event::Seen(stage.seen())
                }
                9 if number == 0 => {
                    stage.bodies.pop();
                    Event::Seen(stage.seen())
                }
                10 if number == 0 => Event::Seen(Seen { trouble: Some(Trouble::ModuleLost), ..stage.seen() }),
                11 => Event::Seen(Seen { seen_share: 0.9, ..stage.seen() }),
                _ => Event::Seen(stage.seen()),
            };
            // Mostly the tracker is well and says what it sees, ten times.
            let times = if kind > 11 { 10 } else { 1 };
            for _ in 0..times {
                stage.now_s += if times > 1 { 0.1 } else { 0.0 };
                let entered = stage.door.line().entered as usize;
                let matches = matches!(&event, Event::Seen(seen)
                    if seen.count_p.get(entered).is_some_and(|p| *p >= SURE) && seen.seen_share >= SEEN);
                if event == Event::Exit {
                    exit_s = stage.now_s;
                }
                stage.tell(event.clone());
                for taken in stage.transitions.drain(..) {
                    prop_assert!(TRANSITIONS.contains(&taken), "{}", name(taken));
                    if taken.2 == Phase::Unlocked {
                        prop_assert!(matches && taken.0 == Phase::Checking, "unlocked without a match");
                        prop_assert!(stage.door.line().contact.is_some(), "unlocked, and the leaf is not known");
                    }
                }
                let may_enter = stage.door.phase() == Phase::Unlocked || (safe && stage.door.phase() == Phase::Failed);
                prop_assert_eq!(stage.door.lock() == Lock::Unlocked, may_enter);
                if stage.now_s - exit_s < 5.0 {
                    prop_assert!(stage.door.lock() != Lock::Locked, "locked against an exit");
                }
            }
        }
    }
}
