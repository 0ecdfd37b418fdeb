//! kehai-sim.
mod cli;
fn main() {}
