//! What modules, and others in their names, send to the tracker: see `tracking/tests/intake/driver.rs`.
#![no_main]

#[path = "../../tracking/tests/intake/driver.rs"]
mod driver;
#[path = "../../tracking/tests/intake/fake.rs"]
mod fake;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| driver::drive(input));
