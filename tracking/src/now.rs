//! The time, on the clock that measures and on the one that is shown.
//!
//! ```text
//!   steady_s  ─────────────────────▶       how long something lasts
//!   unix_ms   ───────╮   ╭─────────▶       what people read; a Pi without a battery for its clock is set by hours
//!                    ╰───╯ set back
//! ```

/// The same moment on two clocks.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Now {
    /// s on a clock that never goes back.
    pub steady_s: f64,
    /// ms since 1970.
    pub unix_ms: u64,
}
