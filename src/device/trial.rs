//! New addressing is on trial until a host was answered over it.
//!
//! ```text
//!   set address=B ─▶ stored: B, trial {previous A, 0 starts} ─▶ restart
//!
//!   start over B ──┬─ a host with a cookie of this start was answered ──▶ B is kept, the trial is forgotten
//!                  ├─ 5 min without ─────────────────────────────────────▶ A is stored again, restart
//!                  └─ power cut, panic: the next start is over B, too; after three, A
//!
//!   three starts in a row that did not last ──▶ this start is over DHCP, whatever is stored
//! ```
//!
//! A cookie is given to an address and fits one start only: the host that sends it back was reached over the
//! addressing in use.

use heapless::Vec;

use super::settings::{ADDRESSING_MAX, Addressing};
use super::starts::ShortStarts;
use crate::wire::EventKind;

/// New addressing is given up if no host was answered over it for so long, µs. An installer has to move cable and
/// laptop to the new network in that time.
pub const TRIAL_US: u64 = 300_000_000;

/// Starts over new addressing before it is given up: switching a switch off and on costs one or two.
pub const TRIAL_STARTS: u8 = 3;

/// Most bytes of a stored [`Trial`].
pub const TRIAL_BYTES: usize = 1 + ADDRESSING_MAX;

/// A trial as it is stored.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Trial {
    /// The addressing to return to unless a host is answered.
    pub previous: Addressing,
    /// Starts over the new one.
    pub starts: u8,
}

impl Trial {
    /// For the store: the starts, then the addressing as in the settings.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8, TRIAL_BYTES> {
        let mut bytes = Vec::new();
        for byte in core::iter::once(self.starts).chain(self.previous.text().bytes()) {
            // As long as the longest text; `collect` would panic for all the compiler knows.
            let _ = bytes.push(byte);
        }
        bytes
    }

    /// From the store; none if the bytes are no trial. An unusable addressing becomes the default.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (&starts, previous) = bytes.split_first()?;
        Some(Self { previous: Addressing::from_text(previous).unwrap_or_default(), starts })
    }
}

/// Stored addressing, and the number of short starts before this one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct StoredAddressing {
    /// Of the settings.
    pub addressing: Addressing,
    /// The stored addressing was unusable, and the default replaces it.
    pub unusable: bool,
    /// The trial of it.
    pub trial: Option<Trial>,
    /// Starts in a row that did not last.
    pub short_starts: ShortStarts,
}

/// The addressing of this start, and its trial.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AddressingInUse {
    addressing: Addressing,
    /// The addressing to return to unless a host is answered.
    previous: Option<Addressing>,
    /// Stored addressing that this start leaves alone, and its trial.
    spared: Option<(Addressing, Option<Trial>)>,
}

/// Addressing of a start, and what follows from it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Beginning {
    /// The addressing.
    pub in_use: AddressingInUse,
    /// Event to report about it.
    pub event: Option<EventKind>,
    /// The trial to store before anything is sent; none for no change.
    pub trial_to_store: Option<Trial>,
    /// Whether settings must be stored with the addressing in use.
    pub settings_to_store: bool,
}

impl AddressingInUse {
    /// Over DHCP and kept.
    pub const DEFAULT: Self = Self { addressing: Addressing::Dhcp, previous: None, spared: None };

    /// Chooses the addressing of this start.
    #[must_use]
    pub fn begin(stored: StoredAddressing) -> Beginning {
        let StoredAddressing { addressing, unusable, trial, short_starts } = stored;
        let trial = trial.filter(|trial| trial.previous != addressing);
        let kept = |addressing| Self { addressing, ..Self::DEFAULT };
        let nothing_to_do = Beginning {
            in_use: kept(addressing),
            event: None,
            trial_to_store: None,
            settings_to_store: false,
        };
        if unusable {
            return Beginning { event: Some(EventKind::AddressUnusable), ..nothing_to_do };
        }
        if short_starts.are_too_many() && addressing != Addressing::Dhcp {
            let in_use = Self { spared: Some((addressing, trial)), ..Self::DEFAULT };
            return Beginning { in_use, event: Some(EventKind::AddressDefault), ..nothing_to_do };
        }
        match trial {
            None => nothing_to_do,
            Some(Trial { previous, starts: TRIAL_STARTS.. }) => Beginning {
                in_use: kept(previous),
                event: Some(EventKind::AddressReturned),
                trial_to_store: None,
                settings_to_store: true,
            },
            Some(Trial { previous, starts }) => Beginning {
                in_use: Self { previous: Some(previous), ..kept(addressing) },
                trial_to_store: Some(Trial { previous, starts: starts.saturating_add(1) }),
                ..nothing_to_do
            },
        }
    }

    /// The addressing.
    #[must_use]
    pub const fn addressing(&self) -> Addressing {
        self.addressing
    }

    /// Notes that a host which sent back a cookie of this start is answered. True if that ends a trial: the end must
    /// then be stored.
    pub fn host_answered(&mut self) -> bool {
        self.previous.take().is_some()
    }

    /// Time at which a trial ends unless a host is answered, µs since the start.
    #[must_use]
    pub fn ends_us(&self) -> Option<u64> {
        self.previous.map(|_| TRIAL_US)
    }

    /// Checks the trial at `now_us`. True if it has failed: the previous addressing is then in use and must be stored,
    /// and the module must start anew.
    pub fn poll(&mut self, now_us: u64) -> bool {
        let failed = self.previous.filter(|_| now_us >= TRIAL_US);
        if let Some(previous) = failed {
            *self = Self { addressing: previous, ..Self::DEFAULT };
        }
        failed.is_some()
    }

    /// The trial to store with settings of this addressing.
    #[must_use]
    pub fn trial_of(&self, addressing: Addressing) -> Option<Trial> {
        match self.spared {
            Some((spared, trial)) if spared == addressing => trial,
            _ => (addressing != self.addressing).then_some(Trial { previous: self.addressing, starts: 0 }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn fixed(text: &str) -> Addressing {
        Addressing::from_text(text.as_bytes()).unwrap()
    }

    fn on_trial(starts: u8) -> StoredAddressing {
        let trial = Some(Trial { previous: fixed("10.0.0.7/24"), starts });
        StoredAddressing { addressing: fixed("10.0.1.7/24"), trial, ..StoredAddressing::default() }
    }

    #[test]
    fn a_host_that_is_answered_keeps_the_new_addressing() {
        let mut in_use = AddressingInUse::begin(on_trial(0)).in_use;
        assert_eq!((in_use.addressing(), in_use.ends_us()), (fixed("10.0.1.7/24"), Some(TRIAL_US)));
        assert!(!in_use.poll(TRIAL_US - 1));
        assert!(in_use.host_answered());
        assert!(!in_use.host_answered(), "once is enough");
        assert!(!in_use.poll(u64::MAX));
        assert_eq!((in_use.addressing(), in_use.ends_us()), (fixed("10.0.1.7/24"), None));
    }

    #[test]
    fn without_one_the_old_addressing_comes_back_after_five_minutes() {
        let mut in_use = AddressingInUse::begin(on_trial(2)).in_use;
        assert!(in_use.poll(TRIAL_US));
        assert_eq!(in_use.addressing(), fixed("10.0.0.7/24"));
        assert_eq!(in_use.trial_of(fixed("10.0.0.7/24")), None);
        assert!(!in_use.poll(TRIAL_US));
    }

    #[test]
    fn each_start_of_a_trial_is_counted_and_the_fourth_is_over_the_old_addressing() {
        for starts in 0..TRIAL_STARTS {
            let beginning = AddressingInUse::begin(on_trial(starts));
            assert_eq!(beginning.trial_to_store.map(|trial| trial.starts), Some(starts + 1));
            assert_eq!(beginning.event, None);
        }
        let beginning = AddressingInUse::begin(on_trial(TRIAL_STARTS));
        assert_eq!(beginning.in_use.addressing(), fixed("10.0.0.7/24"));
        assert_eq!(beginning.event, Some(EventKind::AddressReturned));
        assert!(beginning.settings_to_store);
    }

    #[test]
    fn f2_three_short_starts_lead_to_dhcp_whatever_is_stored() {
        let short_starts = ShortStarts::new(3);
        let beginning = AddressingInUse::begin(StoredAddressing { short_starts, ..on_trial(TRIAL_STARTS) });
        assert_eq!(beginning.in_use.addressing(), Addressing::Dhcp);
        assert_eq!(beginning.event, Some(EventKind::AddressDefault));
        let dhcp = AddressingInUse::begin(StoredAddressing { short_starts, ..StoredAddressing::default() });
        assert_eq!((dhcp.in_use, dhcp.event), (AddressingInUse::DEFAULT, None));
    }

    #[test]
    fn such_a_start_leaves_the_stored_address_and_its_trial_as_they_are() {
        let stored = StoredAddressing { short_starts: ShortStarts::new(3), ..on_trial(2) };
        let in_use = AddressingInUse::begin(stored).in_use;
        assert_eq!(in_use.trial_of(stored.addressing), stored.trial);
        let in_use = AddressingInUse::begin(StoredAddressing { trial: None, ..stored }).in_use;
        assert_eq!((in_use.trial_of(stored.addressing), in_use.trial_of(Addressing::Dhcp)), (None, None));
        let trial = Trial { previous: Addressing::Dhcp, starts: 0 };
        assert_eq!(in_use.trial_of(fixed("10.0.2.7/24")), Some(trial));
    }

    proptest! {
        #[test]
        fn a_trial_reads_as_it_was_written(starts: u8, own: u32, bits in 1..=30u8, way: Option<u32>) {
            let address = crate::address::InterfaceAddress::new(own.into(), bits, way.map(Into::into));
            let previous = address.map_or(Addressing::Dhcp, Addressing::Static);
            let trial = Trial { previous, starts };
            prop_assert_eq!(Trial::from_bytes(&trial.bytes()), Some(trial));
        }

        /// Whatever was stored and however starts end: within four starts of any length the module is over
        /// addressing that a host was answered over, or over DHCP.
        #[test]
        fn no_addressing_stays_that_no_host_was_answered_over(
            bytes in prop::collection::vec(any::<u8>(), 0..40),
            lengths in prop::collection::vec(0..2 * TRIAL_US, 4),
        ) {
            let new = fixed("10.0.1.7/24");
            let stored = Trial::from_bytes(&bytes).unwrap_or(Trial { previous: fixed("10.0.0.7/24"), starts: 0 });
            prop_assume!(stored.previous != new);
            let (mut addressing, mut trial) = (new, Some(stored));
            let mut over: Vec<Addressing> = Vec::new();
            for length_us in lengths {
                let beginning = AddressingInUse::begin(StoredAddressing { addressing, trial, ..StoredAddressing::default() });
                trial = beginning.trial_to_store.or(trial);
                let mut in_use = beginning.in_use;
                over.push(in_use.addressing());
                if in_use.poll(length_us) || beginning.settings_to_store {
                    addressing = in_use.addressing();
                    trial = in_use.trial_of(addressing);
                }
            }
            prop_assert_eq!(over[3], stored.previous, "{:?}", over);
        }
    }
}
