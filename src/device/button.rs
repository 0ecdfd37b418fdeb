//! The board's button: held for ten seconds from power-up, it resets the module to its delivered state.
//!
//! ```text
//!   power-up ─┬─ not pressed ──────────────────▶ start
//!             └─ pressed ─┬─ let go before 10 s ─▶ start
//!                         └─ held for 10 s ──────▶ settings and background are erased, start
//! ```

/// Time to hold the button, µs: longer than an accidental press while cables are plugged in.
const HELD_US: u64 = 10_000_000;

/// State of the button at power-up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Button {
    /// The button is held, for less than the full time.
    Held,
    /// The module starts as it is.
    LetGo,
    /// Settings and background must be erased.
    FactoryReset,
}

impl Button {
    /// After it was pressed without a break for `now_us` since power-up, or was not.
    #[must_use]
    pub const fn at(now_us: u64, pressed: bool) -> Self {
        match pressed {
            false => Self::LetGo,
            true if now_us >= HELD_US => Self::FactoryReset,
            true => Self::Held,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_seconds_erase_and_less_does_not() {
        assert_eq!(Button::at(0, false), Button::LetGo);
        assert_eq!(Button::at(0, true), Button::Held);
        assert_eq!(Button::at(9_999_999, true), Button::Held);
        assert_eq!(Button::at(9_999_999, false), Button::LetGo);
        assert_eq!(Button::at(10_000_000, true), Button::FactoryReset);
    }
}
