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
        2 => any::<u8>().prop_map(|more| vec![10, 1, 0, 0, 2, 0, more, 8]),
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
    let happened = driver::drive(&[10, 1, 0, 0, 2, 0, 23, 8, 4, 0, 10, 3, 10, 4, 10, 5, 5, 10, 6, 1]);
    assert_eq!(happened, driver::Happened { unlocked: true, left: true });
}
