//! Numbers as SQLite has them.

/// As SQLite has them: signed. No time or number of ours is that large.
pub(super) fn integer(value: u64) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}
