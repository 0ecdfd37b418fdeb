//! The sensor as the rest of the module sees it.

pub mod clock;
mod envelope;
