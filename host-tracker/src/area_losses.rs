//! Messages of areas that were not used, by cause: counted where all areas are put together, for the log and the metrics.

use crate::shared_count::SharedCount;

/// So many of each cause, by its name.
pub type AreaLossCounts = [(&'static str, u64); 4];

/// The counts. Clones are the same ones.
#[derive(Clone, Debug, Default)]
pub struct AreaLosses {
    /// Too long, or no message of ours.
    pub not_understood: SharedCount,
    /// Came while too many waited.
    pub no_room: SharedCount,
    /// Older than one of the same start that was heard before.
    pub late: SharedCount,
    /// Of an area for which there is no room.
    pub crowded: SharedCount,
}

impl AreaLosses {
    /// How many so far, by cause.
    #[must_use]
    pub fn counts(&self) -> AreaLossCounts {
        let Self { not_understood, no_room, late, crowded } = self;
        let all =
            [("not_understood", not_understood), ("no_room", no_room), ("late", late), ("crowded", crowded)];
        all.map(|(cause, count)| (cause, count.get()))
    }
}
