//! A door with its devices, transports, clocks and lock: never unlocked without a count, never shut against a request to
//! leave. The fuzz target `door` drives the same world. `KEHAI_SEQUENCES=1000000` drives so many; else there are 400.
#![allow(missing_docs, reason = "a test program")]

#[path = "door/driver.rs"]
mod driver;
#[path = "door/lock.rs"]
mod lock;

use proptest::prelude::*;

/// Of a passage: a card, the number, time, and what else comes.
fn step() -> impl Strategy<Value = Vec<u8>> {
    prop_oneof![
        3 => proptest::collection::vec(any::<u8>(), 2),
        // One person stands in the zone, and asks to go in, in time.
        2 => any::<u8>().prop_map(|more| vec![5, 0, 10, 1, 0, 0, 2, 0, more, 8]),
        // And goes in.
        1 => Just(vec![4, 0, 10, 3, 10, 4, 10, 5, 5, 10]),
        // All is well again.
        1 => Just(vec![20, 2, 16, 1, 17, 1, 22, 15, 7, 15, 22, 15]),
    ]
}

/// Sequences that are driven.
fn sequences() -> u32 {
    std::env::var("KEHAI_SEQUENCES").map_or(400, |text| text.parse().expect("KEHAI_SEQUENCES: a number"))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(sequences()) })]

    #[test]
    fn f8_f9_f10_never_unlocked_without_a_count_never_shut_against_a_request_to_leave(
        steps in proptest::collection::vec(step(), 0..40)
    ) {
        driver::drive(&steps.concat());
    }
}

#[test]
fn a_passage_happens_in_the_driven_world() {
    // Else nothing above says anything.
    let happened = driver::drive(&[5, 0, 10, 1, 0, 0, 2, 0, 23, 8, 4, 0, 10, 3, 10, 4, 10, 5, 5, 10, 6, 1]);
    assert_eq!(happened, driver::Happened { unlocked: true, left: true, restored: false });
}

#[test]
fn an_alarm_of_the_driven_world_outlives_the_trackers_death() {
    // The leaf opens, one goes in whom nobody let in; the tracker dies, starts, and dies again before it is well.
    let alarm = [4, 0, 10, 1, 10, 3, 10, 4, 10, 5];
    let dies_twice = [19, 4, 19, 3, 19, 0, 19, 7];
    let happened = driver::drive(&[alarm.as_slice(), &dies_twice].concat());
    assert_eq!(happened, driver::Happened { unlocked: false, left: false, restored: true });
}
