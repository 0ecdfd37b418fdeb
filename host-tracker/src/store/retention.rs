//! For how long rows are kept, and whether the clock is to be trusted with deleting them.
//!
//! ```text
//!   runs   ├──┤ ├─────┤  ├───┤        now          the newest run is a rest ago: what is too old is deleted
//!   runs   ├──┤ ├─────┤  ├───┤                                          ├┤ now   10 years: nothing is
//!                            └──── longer than any rest ────────────────┘
//! ```

/// For how long things are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Keep {
    /// Days for everything but cards and raw scans.
    pub days: u32,
    /// Days for what is kept of cards.
    pub card_days: u32,
}

impl Keep {
    /// Unless the command line says otherwise: a year, and of cards a month.
    pub const USUAL: Self = Self { days: 365, card_days: 30 };
}

/// A day, ms.
pub(super) const DAY_MS: u64 = 86_400_000;

/// Longest time without a tracker that is believed however little is kept, days: a season.
const REST_DAYS: u64 = 90;

/// Before this there was no tracker, ms since 1970: the clock of such a run had not been set. 1 January 2025.
const FIRST_MS: u64 = 1_735_689_600_000;

/// Why nothing is deleted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Doubt {
    days: u64,
}

impl std::fmt::Display for Doubt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "nothing is deleted: by the clock, nothing was kept for {} days; is it right? If it is, begin a new file",
            self.days
        )
    }
}

/// Whether what is too old at `now_ms` may be deleted; `runs` are beginnings and ends, ms since 1970, by their beginnings.
///
/// A rest as long as everything is kept would delete all of it at once: either the tracker was away for so long, or the
/// clock is wrong. Deleting cannot be taken back, so that is for a person to say.
pub(super) fn may_delete(
    runs: impl Iterator<Item = (u64, u64)>,
    now_ms: u64,
    keep: Keep,
) -> Result<(), Doubt> {
    let rest_ms = u64::from(keep.days).max(REST_DAYS).saturating_mul(DAY_MS);
    let mut known_ms: Option<u64> = None;
    for (begun_ms, ended_ms) in runs.filter(|(_, ended_ms)| *ended_ms >= FIRST_MS) {
        match known_ms {
            // Runs beyond the gap were under the same wrong clock.
            Some(known_ms) if begun_ms > known_ms.saturating_add(rest_ms) => break,
            known => known_ms = known.max(Some(ended_ms)),
        }
    }
    let away_ms = known_ms.map_or(0, |known_ms| now_ms.saturating_sub(known_ms));
    if away_ms > rest_ms { Err(Doubt { days: away_ms / DAY_MS }) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f12_a_clock_far_ahead_deletes_nothing_however_often_it_is_started_with() {
        let day = |day: u64| FIRST_MS + day * DAY_MS;
        let check = |runs: &[(u64, u64)], now: u64| may_delete(runs.iter().copied(), now, Keep::USUAL);
        let before = [(day(0), day(3)), (day(4), day(300))];
        assert_eq!(check(&before, day(301)), Ok(()));
        assert_eq!(check(&before, day(300 + 365)), Ok(()), "a long rest");
        assert_eq!(check(&before, day(300 + 3650)), Err(Doubt { days: 3650 }));
        let with_now = [before[0], before[1], (day(3950), day(3950))];
        assert!(check(&with_now, day(3950)).is_err(), "its own run, and a start after it");
        assert_eq!(check(&with_now, day(302)), Ok(()), "the clock was set right");
        assert_eq!(check(&[(5, 9), (day(1), day(2))], day(3)), Ok(()), "a start before the clock was set");
        assert_eq!(check(&[], day(3)), Ok(()));
    }
}
