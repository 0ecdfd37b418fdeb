//! For how long rows are kept.

/// For how long things are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Keep {
    /// Days for everything but cards and raw scans.
    pub days: u32,
    /// Days for what is kept of cards.
    pub card_days: u32,
}

impl Default for Keep {
    /// A year, and of cards a month.
    fn default() -> Self {
        Self { days: 365, card_days: 30 }
    }
}
