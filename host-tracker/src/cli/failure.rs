//! What ends a command early.

/// What can go wrong in a command: one line.
pub(super) type Failure = Box<dyn std::error::Error>;
