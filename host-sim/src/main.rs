//! `kehai-sim`: emulated range finders, recordings and simulated worlds on a PC.
#![forbid(unsafe_code)]

mod cli;

use std::alloc::System;
use std::process::ExitCode;

use cap::Cap;

/// Counts the bytes in use, which [`cli`]'s soak watches; no limit is set.
#[global_allocator]
static HEAP: Cap<System> = Cap::new(System, usize::MAX);

fn main() -> ExitCode {
    cli::run()
}
