//! The module's LED: one light that shows its state to an installer.
//!
//! ```text
//!              0 s                 1 s                 2 s
//!   starting   ████████████████████████████████████████    steady
//!   no network ██  ██                                       two flashes
//!   no sensor  ██  ██  ██                                   three flashes
//!   learning   ████████████████████                         half on, half off
//!   working    ██                                           one flash
//!   storing    ██████████████████████████████████  ████    on, with a gap
//!   fault      ██  ██  ██  ██  ██  ██  ██  ██  ██  ██      flicker
//!   identify   ██  ██  ██  ██  ██  ████████████████████    flicker, then on
//! ```
//!
//! The picture repeats every two seconds. `docs/hardware.md` explains it to an installer.

use super::status::Status;
use crate::wire::{Alarms, SensorCode};

/// One slot of a pattern, µs: the shortest flash that is easy to see.
pub const SLOT_US: u64 = 100_000;

/// Slots of a pattern.
const SLOTS: u32 = 20;

/// Time in which sensor and address may still be missing, µs: a sensor at an unknown speed is found in 4 s, and a
/// network without DHCP has an address after 4 s; a rangefinder boots in a few seconds itself.
pub const STARTING_US: u64 = 10_000_000;

/// States that the LED shows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum LedState {
    /// Switched on a moment ago; sensor or address are still to come.
    Starting,
    /// No link, or no address.
    NoNetwork,
    /// No scans come.
    NoSensor,
    /// The room is being learned.
    Learning,
    /// Every scan is judged and reported.
    Working,
    /// Settings or background are being stored: the power is to stay on.
    Storing,
    /// The sensor cannot be used, or nothing can be stored: health has the cause.
    Fault,
    /// A host has asked which box it is: for a person who looks for it.
    Identify,
}

impl LedState {
    /// What to show: which box it is while that is asked, then a fault, then what an installer has to see to first.
    #[must_use]
    pub const fn of(status: &Status, has_network: bool, uptime_us: u64) -> Self {
        let faulty = match status.sensor {
            SensorCode::Abnormal | SensorCode::TooLarge | SensorCode::Unusable | SensorCode::Refused => true,
            _ => status.alarms.has(Alarms::STORE_FAILED),
        };
        let has_scans = !status.alarms.has(Alarms::NO_SCANS);
        if status.identifying {
            Self::Identify
        } else if faulty {
            Self::Fault
        } else if status.storing {
            Self::Storing
        } else if uptime_us < STARTING_US && !(has_network && has_scans) {
            Self::Starting
        } else if !has_network {
            Self::NoNetwork
        } else if !has_scans {
            Self::NoSensor
        } else if status.learning {
            Self::Learning
        } else {
            Self::Working
        }
    }

    /// A bit for each [`SLOT_US`], the first one lowest.
    const fn pattern(self) -> u32 {
        match self {
            Self::Starting => 0b1111_1111_1111_1111_1111,
            Self::NoNetwork => 0b0000_0000_0000_0000_0101,
            Self::NoSensor => 0b0000_0000_0000_0001_0101,
            Self::Learning => 0b0000_0000_0011_1111_1111,
            Self::Working => 0b0000_0000_0000_0000_0001,
            Self::Storing => 0b1101_1111_1111_1111_1111,
            Self::Fault => 0b0101_0101_0101_0101_0101,
            Self::Identify => 0b1111_1111_1101_0101_0101,
        }
    }

    /// Whether the LED is lit at this moment.
    #[must_use]
    pub const fn is_lit(self, uptime_us: u64) -> bool {
        let slot = (uptime_us / SLOT_US) % SLOTS as u64;
        (self.pattern() >> slot) & 1 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;
    use std::string::String;
    use std::vec::Vec;

    const ALL: [LedState; 8] = [
        LedState::Starting,
        LedState::NoNetwork,
        LedState::NoSensor,
        LedState::Learning,
        LedState::Working,
        LedState::Storing,
        LedState::Fault,
        LedState::Identify,
    ];
    const LATER_US: u64 = STARTING_US;

    fn working() -> Status {
        Status { sensor: SensorCode::Streaming, alarms: Alarms::default(), ..Status::NEW }
    }

    /// What an eye sees in `count` periods from `from_us` on.
    fn seen(state: LedState, from_us: u64, count: u64) -> String {
        (0..count * u64::from(SLOTS))
            .map(|slot| if state.is_lit(from_us + slot * SLOT_US) { '#' } else { '.' })
            .collect()
    }

    #[test]
    fn every_state_looks_different_from_wherever_one_begins_to_watch() {
        let mut pictures = HashSet::new();
        for state in ALL {
            let turns: HashSet<String> =
                (0..u64::from(SLOTS)).map(|slot| seen(state, slot * SLOT_US, 1)).collect();
            assert!(turns.is_disjoint(&pictures), "{state:?} looks like another one");
            pictures.extend(turns);
        }
    }

    #[test]
    fn the_flashes_can_be_counted() {
        let flashes = |state| {
            let picture = seen(state, 0, 1);
            picture.split('.').filter(|flash| !flash.is_empty()).map(str::len).collect::<Vec<_>>()
        };
        assert_eq!(flashes(LedState::Working), [1]);
        assert_eq!(flashes(LedState::NoNetwork), [1, 1]);
        assert_eq!(flashes(LedState::NoSensor), [1, 1, 1]);
        assert_eq!(flashes(LedState::Fault), [1; 10]);
        assert_eq!(flashes(LedState::Identify), [1, 1, 1, 1, 1, 10]);
        assert_eq!(flashes(LedState::Learning), [10]);
        assert_eq!(flashes(LedState::Starting), [20]);
        assert_eq!(seen(LedState::Storing, 0, 1).matches('.').count(), 1);
    }

    #[test]
    fn a_pattern_repeats_for_ever() {
        for state in ALL {
            assert_eq!(seen(state, 0, 2), seen(state, 0, 1).repeat(2));
            assert_eq!(seen(state, u64::MAX / 2_000_000 * 2_000_000 - 2_000_000, 1), seen(state, 0, 1));
        }
    }

    #[test]
    fn a_module_with_everything_it_needs_works_from_the_first_moment() {
        assert_eq!(LedState::of(&working(), true, 0), LedState::Working);
    }

    #[test]
    fn what_is_missing_is_starting_at_first_and_named_after_ten_seconds() {
        for (status, has_network) in [(Status::NEW, true), (working(), false), (Status::NEW, false)] {
            assert_eq!(LedState::of(&status, has_network, LATER_US - 1), LedState::Starting);
        }
        assert_eq!(LedState::of(&Status::NEW, true, LATER_US), LedState::NoSensor);
        assert_eq!(LedState::of(&working(), false, LATER_US), LedState::NoNetwork);
        assert_eq!(LedState::of(&Status::NEW, false, LATER_US), LedState::NoNetwork);
    }

    #[test]
    fn learning_and_storing_are_shown() {
        let learning = Status { learning: true, ..working() };
        assert_eq!(LedState::of(&learning, true, LATER_US), LedState::Learning);
        let storing = Status { storing: true, ..working() };
        assert_eq!(LedState::of(&storing, false, 0), LedState::Storing);
    }

    #[test]
    fn a_module_that_is_looked_for_shows_that_and_then_its_state_again() {
        let states = [
            (working(), LedState::Working),
            (Status { storing: true, ..working() }, LedState::Storing),
            (Status { sensor: SensorCode::Abnormal, ..working() }, LedState::Fault),
        ];
        for (status, state) in states {
            let looked_for = Status { identifying: true, ..status };
            for uptime_us in [0, LATER_US] {
                assert_eq!(LedState::of(&looked_for, true, uptime_us), LedState::Identify);
                assert_eq!(LedState::of(&looked_for, false, uptime_us), LedState::Identify);
            }
            assert_eq!(LedState::of(&status, true, LATER_US), state);
        }
    }

    #[test]
    fn a_fault_comes_before_every_other_state() {
        let codes = [SensorCode::Abnormal, SensorCode::TooLarge, SensorCode::Unusable, SensorCode::Refused];
        for sensor in codes {
            let status = Status { sensor, storing: true, ..Status::NEW };
            assert_eq!(LedState::of(&status, false, 0), LedState::Fault, "{sensor:?}");
        }
        let status = Status { alarms: Alarms::STORE_FAILED, ..working() };
        assert_eq!(LedState::of(&status, true, LATER_US), LedState::Fault);
        for sensor in [SensorCode::Stalled, SensorCode::Booting, SensorCode::Paused] {
            assert_ne!(LedState::of(&Status { sensor, ..working() }, true, LATER_US), LedState::Fault);
        }
    }
}
