//! kehai-tracker.
fn main() {}
