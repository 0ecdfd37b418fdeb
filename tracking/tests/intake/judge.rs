//! What must hold, whatever is forged.
//!
//! ```text
//!   always         known only what a used report covered within 2 s      a used report is true, or looks true in all
//!                  a true one has its own time
//!   8 s after the last disturbance, no forged report used      known ─▶ no person missed
//!   FADED after both                                           known ─▶ counted right
//!   RECOVERED after the last of all                            both modules heard, known, no person missed
//! ```

use kehai::wire::Identity;
use kehai_tracking::jsonl::{ZoneKnown, ZoneLine};
use kehai_tracking::observation::AHEAD_S;

use super::times::SECOND_US;

/// People who have been in the room for so long are counted: while one module is not used, the walking one is hidden behind the
/// standing one for up to 2 s of each 6 s, and begins anew after it; a birth takes 1.5 s.
pub const SETTLED_US: u64 = 8 * SECOND_US;

/// A module is believed again, and its times are known: 3 s of silence and two answers for a start that went back, two
/// exchanges for its times, a second each.
const STEADY_US: u64 = 6 * SECOND_US;

/// Everything has healed, the longest way one after the other: 3 s until an address is given up, 3 s more at another
/// and 5 s until the next announcement (the world's own); 5 s for a start that went back (3 s of silence, two answers); 3 s for times;
/// 2 s for info and background; 3 s for a row of reports that ends; 1 s for a person's birth.
pub const RECOVERED_US: u64 = 25 * SECOND_US;

/// No track is left of what no module has seen for so long: three half-lives of an occluded one's existence.
pub const FADED_US: u64 = 45 * SECOND_US;

/// A report that was used.
pub struct Used {
    /// Number of the module in the site, whose place it was given.
    pub place: usize,
    pub is_from_its_address: bool,
    pub identity: Identity,
    /// Of the module whose place it is.
    pub true_identity: Identity,
    /// Its time on the host's clock.
    pub start_s: f64,
    /// The host's time of its stamp by the module's true clock.
    pub stamp_host_us: i128,
}

/// What is known of it.
pub enum Report {
    /// A module's own, of a scan that began then.
    True {
        scan_us: u64,
    },
    Forged,
}

/// What has happened so far.
#[derive(Debug)]
pub struct Judge {
    /// When a datagram was forged last.
    pub forged_us: u64,
    /// When a forged report was used last.
    pub fooled_us: Option<u64>,
    /// When something last happened to a module, the host or the network.
    pub disturbed_us: u64,
    /// When a report was used last, and one of each module.
    used_us: Option<u64>,
    true_us: [u64; 2],
}

impl Judge {
    pub const fn new(now_us: u64) -> Self {
        Self { forged_us: 0, fooled_us: None, disturbed_us: now_us, used_us: None, true_us: [0; 2] }
    }

    fn is_steady(&self, now_us: u64) -> bool {
        now_us.saturating_sub(self.disturbed_us) > STEADY_US
    }

    /// A forged answer in the name of a module was admitted, or a datagram of another start: that can be only while the
    /// module itself is silent.
    pub fn believed_falsely(&mut self, now_us: u64) {
        assert!(!self.is_steady(now_us), "a forged answer, or another start, was admitted");
        self.disturbed_us = self.disturbed_us.max(now_us);
    }

    pub fn used(&mut self, used: &Used, report: Report, now_us: u64) {
        self.used_us = Some(now_us);
        let is_steady = self.is_steady(now_us);
        match report {
            Report::True { scan_us } => {
                self.true_us[used.place] = now_us;
                // A report that began later than this after it arrived is not used: a module's time is as good.
                let error_s = used.start_s - scan_us as f64 * 1e-6;
                assert!(!is_steady || error_s.abs() <= AHEAD_S, "a true report is {error_s} s off");
            }
            Report::Forged => {
                self.fooled_us = Some(now_us);
                let age_us = i128::from(now_us) - used.stamp_host_us;
                let looks_true = used.is_from_its_address
                    && used.identity == used.true_identity
                    && (-60_000..=410_000).contains(&age_us);
                assert!(!is_steady || looks_true, "used, forged: {:?}, {age_us} µs old", used.identity);
            }
        }
    }

    pub fn look(&self, zone: &ZoneLine, people: u32, now_us: u64) {
        let is_known = zone.state() == ZoneKnown::Known;
        let counted = zone.count().unwrap_or(0);
        let is_seen = self.used_us.is_some_and(|used_us| now_us - used_us <= 2 * SECOND_US);
        assert!(is_seen || !is_known, "known, and not seen for two seconds");
        let is_settled = now_us.saturating_sub(self.disturbed_us) > SETTLED_US
            && self.fooled_us.is_none_or(|fooled_us| now_us - fooled_us > RECOVERED_US);
        assert!(!(is_known && is_settled) || counted >= people, "{counted} counted of {people}");
        let has_faded = now_us.saturating_sub(self.disturbed_us.max(self.fooled_us.unwrap_or(0))) > FADED_US;
        assert!(!(is_known && has_faded) || counted == people, "{counted} counted of {people}");
        if now_us.saturating_sub(self.disturbed_us.max(self.forged_us)) > RECOVERED_US {
            let silent_us = self.true_us.map(|true_us| now_us - true_us);
            assert!(silent_us.iter().all(|silent_us| *silent_us < SECOND_US / 2), "muted: {silent_us:?} µs");
            assert!(is_known && counted >= people, "{people} people, and {zone:?}");
        }
    }
}
