//! A door with its devices, transports, clocks and lock, as the property test `door` of kehai-tracking drives it: never
//! unlocked without a count, never shut against a request to leave.
#![no_main]

#[path = "../../tracking/tests/door/driver.rs"]
mod driver;
#[path = "../../tracking/tests/door/lock.rs"]
mod lock;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    driver::drive(input);
});
