//! A tracker that watches a room with people through two modules, while datagrams are forged and clocks, modules and the
//! network go wrong: see `tracking/tests/intake/driver.rs`.
#![no_main]

#[path = "../../tracking/tests/intake/attack.rs"]
mod attack;
#[path = "../../tracking/tests/intake/driver.rs"]
mod driver;
#[path = "../../tracking/tests/intake/fake.rs"]
mod fake;
#[path = "../../tracking/tests/intake/judge.rs"]
mod judge;
#[path = "../../tracking/tests/intake/scene.rs"]
mod scene;
#[path = "../../tracking/tests/intake/times.rs"]
mod times;
#[path = "../../tracking/tests/intake/tracker.rs"]
mod tracker;
#[path = "../../tracking/tests/intake/world.rs"]
mod world;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| driver::drive(input));
