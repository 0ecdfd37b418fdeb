//! kehai-sim.
fn main() {}
