//! Who has logged in: sessions, in memory alone, so that a restart ends them all.
//!
//! ```text
//!   log-in ─▶ begin ─▶ 12 h ─▶ over          also: log-out, a 17th of the same user, another password, the user's removal
//! ```
//!
//! Kept is a fingerprint of what the browser shows, never that itself.

use std::collections::BTreeMap;

/// How long a session lasts, s: a working day, and its overtime.
pub const LASTS_S: u32 = 12 * 3600;

/// The same in µs.
pub const LASTS_US: u64 = LASTS_S as u64 * 1_000_000;

/// Most sessions of one user: browsers of one person.
const OF_USER: usize = 16;

/// Most sessions: four of each of 64 people.
const ALL: usize = 256;

/// A session.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Session {
    /// Whose.
    pub user: String,
    /// What was kept of the password by which it began: another one ends it.
    pub password: String,
    begun_us: u64,
}

/// All sessions, by their fingerprints.
#[derive(Debug, Default)]
pub struct Sessions(BTreeMap<String, Session>);

impl Sessions {
    /// Begins one. The oldest gives way to it, of the same user first.
    pub fn begin(&mut self, fingerprint: String, user: &str, password: &str, now_us: u64) {
        self.0.retain(|_, session| session.lasts(now_us));
        if self.0.values().filter(|session| session.user == user).count() >= OF_USER {
            self.end_oldest(|session| session.user == user);
        }
        if self.0.len() >= ALL {
            self.end_oldest(|_| true);
        }
        let session = Session { user: user.to_owned(), password: password.to_owned(), begun_us: now_us };
        self.0.insert(fingerprint, session);
    }

    /// The session of this fingerprint, if it is not over.
    #[must_use]
    pub fn get(&self, fingerprint: &str, now_us: u64) -> Option<&Session> {
        self.0.get(fingerprint).filter(|session| session.lasts(now_us))
    }

    /// Ends one.
    pub fn end(&mut self, fingerprint: &str) {
        self.0.remove(fingerprint);
    }

    fn end_oldest(&mut self, of: impl Fn(&Session) -> bool) {
        let candidates = self.0.iter().filter(|(_, session)| of(session));
        let oldest = candidates.min_by_key(|(_, session)| session.begun_us).map(|(key, _)| key.clone());
        oldest.map(|key| self.0.remove(&key));
    }
}

impl Session {
    const fn lasts(&self, now_us: u64) -> bool {
        now_us.saturating_sub(self.begun_us) < LASTS_US
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_lasts_until_its_end_or_log_out() {
        let mut sessions = Sessions::default();
        sessions.begin("a".into(), "anna", "hash", 5);
        assert_eq!(sessions.get("a", LASTS_US + 4).unwrap().user, "anna");
        assert_eq!(sessions.get("a", LASTS_US + 5), None);
        assert_eq!(sessions.get("b", 6), None);
        sessions.end("a");
        assert_eq!(sessions.get("a", 6), None);
    }

    #[test]
    fn they_are_bounded_and_only_the_bound_ends_those_of_other_users() {
        let mut sessions = Sessions::default();
        sessions.begin("first".into(), "bert", "hash", 0);
        for number in 1..=1000 {
            sessions.begin(format!("{number}"), "anna", "hash", number);
        }
        assert_eq!(sessions.0.len(), OF_USER + 1);
        assert!(sessions.get("985", 1001).is_some() && sessions.get("984", 1001).is_none());
        assert!(sessions.get("first", 1001).is_some());
        for number in 2000..3000 {
            sessions.begin(format!("{number}"), &format!("user {number}"), "hash", number);
            assert!(sessions.0.len() <= ALL);
        }
        assert!(sessions.get("first", 3000).is_none() && sessions.get("2999", 3000).is_some());
        sessions.begin("last".into(), "carl", "hash", 3000 + LASTS_US);
        assert_eq!(sessions.0.len(), 1, "those that are over are not kept");
    }
}
