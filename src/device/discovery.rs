//! Discovery: hosts find the module without knowing its address, by DNS-SD over multicast DNS.
//!
//! ```text
//!   _kehai._udp.local                 PTR  kehai-123401._kehai._udp.local
//!   kehai-123401._kehai._udp.local    SRV  kehai-123401.local, port 4040
//!                                     TXT  protocol=1 firmware=0.1.0 id=525400123401
//!                                          model=URG-04LX serial=H0508486
//!   kehai-123401.local                A    10.1.2.77
//! ```
//!
//! This module decides what is announced and when; a board's image encodes and sends the packets:
//!
//! ```text
//!             address ──▶ join ──▶ announce, 1 s, announce, 2 s, announce
//!                          ▲              │ asked, or the sensor has changed: announce
//!                          │              ▼
//!     leave ◀── address lost or another, link lost
//! ```
//!
//! An announcement holds all records, so it is also the answer to every question. It goes to the multicast
//! group, at most once a second. The group is left and joined anew after every loss of the link: a switch
//! behind it may have forgotten the membership, and a stack that never left would not report it again.
//!
//! Names are not defended: the instance name ends in three bytes of the hardware address.
//!
//! Sources: RFC 6762 (multicast DNS) parts 5.1, 6, 6.7 and 8.3; RFC 6763 (DNS-SD) part 6.

use heapless::String;

use super::status::Status;
use super::text;
use crate::address::{HOST_NAME_LEN, Mac};
use crate::scip::Text;
use crate::wire::{ModuleId, VERSION};

/// The service, and the protocol below it.
pub const SERVICE: [&str; 2] = ["_kehai", "_udp"];

/// Multicast group of mDNS.
pub const GROUP: [u8; 4] = [224, 0, 0, 251];

/// The port of the group. A host that asks from another port wants a unicast answer.
pub const MDNS_PORT: u16 = 5353;

/// How long an announcement is good for, s: the time RFC 6762 part 10 gives names of hosts.
pub const LIFETIME_S: u32 = 120;

/// Version of the wire format, as text.
const PROTOCOL: &str = "1";
const _: () = assert!(matches!(PROTOCOL.as_bytes(), [digit] if *digit == b'0' + VERSION));

/// Unsolicited announcements of a new address: the first may be lost.
const UNASKED: u8 = 3;
/// Unsolicited announcements of changed records.
const UNASKED_CHANGED: u8 = 2;
/// Least time between two announcements, µs (RFC 6762 part 6).
const SPACING_US: u64 = 1_000_000;
/// Between leaving and joining, µs: the stack leaves only at its next poll, and joining before that sends
/// no report.
const SETTLE_US: u64 = 200_000;
/// Least and most time between a question and the answer, µs: modules answer the same question, one after
/// the other (RFC 6762 part 6).
const DELAY_US: (u64, u64) = (20_000, 120_000);
/// Time between two checks of the address, µs.
const LOOK_US: u64 = 500_000;
/// Time budget that a received datagram costs, µs: fifty datagrams a second.
const COST_US: u64 = 20_000;
/// Largest time budget, µs: fifty datagrams at once.
const SAVED_US: u64 = 1_000_000;

/// Contents of an announcement.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Service {
    instance: String<HOST_NAME_LEN>,
    id: String<12>,
    firmware: &'static str,
    model: Text<16>,
    serial: Text<16>,
}

impl Service {
    /// The service of a module that is as `status` says.
    #[must_use]
    pub fn new(module: ModuleId, firmware: &'static str, status: &Status) -> Self {
        let mut id = String::new();
        text::push_hex(&mut id, &module.0);
        Self { instance: text::host_name(module), id, firmware, model: status.model, serial: status.serial }
    }

    /// Instance name, and name of the host: `kehai-123401`.
    #[must_use]
    pub fn instance(&self) -> &str {
        &self.instance
    }

    /// Keys and values of the TXT record. Model and serial number are empty until a sensor is found.
    #[must_use]
    pub fn txt(&self) -> [(&str, &str); 5] {
        [
            ("protocol", PROTOCOL),
            ("firmware", self.firmware),
            ("id", &self.id),
            ("model", self.model.as_str()),
            ("serial", self.serial.as_str()),
        ]
    }
}

/// The next action.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Action {
    /// Join [`GROUP`].
    Join,
    /// Leave [`GROUP`].
    Leave,
    /// Send the announcement to the group.
    Announce,
    /// Wait until this time, µs, or until a datagram comes.
    Wait(u64),
}

/// When the module joins, announces and answers.
#[derive(Clone, Debug)]
pub struct Discovery {
    delay_us: u64,
    /// The address with which the group was joined.
    joined: Option<[u8; 4]>,
    /// Earliest time of the next join, µs.
    settled_us: u64,
    /// Unsolicited announcements still to be sent.
    unasked: u8,
    /// When the next one is due.
    due_us: Option<u64>,
    /// When the last one was made.
    last_us: Option<u64>,
    /// Time up to which received datagrams have used the budget, µs.
    used_us: u64,
}

impl Discovery {
    /// Of a module that has no address yet.
    #[must_use]
    pub const fn new(mac: Mac) -> Self {
        let [.., last] = mac;
        let (least_us, most_us) = DELAY_US;
        Self {
            // Neighbours have numbers in a row: as far apart as 256 of them can be.
            delay_us: least_us + (most_us - least_us) * last.reverse_bits() as u64 / 256,
            joined: None,
            settled_us: 0,
            unasked: 0,
            due_us: None,
            last_us: None,
            used_us: 0,
        }
    }

    /// The next action with this `address`, which is none without a link.
    pub fn poll(&mut self, now_us: u64, address: Option<[u8; 4]>) -> Action {
        if self.joined.is_some() && self.joined != address {
            self.joined = None;
            self.due_us = None;
            self.settled_us = now_us.saturating_add(SETTLE_US);
            return Action::Leave;
        }
        let look_us = now_us.saturating_add(LOOK_US);
        if address.is_none() {
            return Action::Wait(look_us);
        }
        if self.joined.is_none() {
            if now_us < self.settled_us {
                return Action::Wait(self.settled_us);
            }
            self.joined = address;
            self.last_us = None;
            self.unasked = UNASKED;
            self.due_us = Some(now_us.saturating_add(self.delay_us));
            return Action::Join;
        }
        match self.due_us {
            Some(due_us) if now_us >= due_us => {
                self.announced(now_us);
                Action::Announce
            }
            due_us => Action::Wait(due_us.unwrap_or(look_us).min(look_us)),
        }
    }

    fn announced(&mut self, now_us: u64) {
        self.last_us = Some(now_us);
        self.unasked = self.unasked.saturating_sub(1);
        let pause_us = match self.unasked {
            0 => None,
            1 => Some(2 * SPACING_US),
            _ => Some(SPACING_US),
        };
        self.due_us = pause_us.map(|pause_us| now_us.saturating_add(pause_us));
    }

    /// A host asks for records of the announcement.
    pub fn asked(&mut self, now_us: u64) {
        let free_us = self.last_us.map_or(0, |last_us| last_us.saturating_add(SPACING_US));
        let answer_us = now_us.saturating_add(self.delay_us).max(free_us);
        if self.joined.is_some() {
            self.due_us = Some(self.due_us.map_or(answer_us, |due_us| due_us.min(answer_us)));
        }
    }

    /// Notes that the announcement has changed.
    pub fn changed(&mut self, now_us: u64) {
        self.unasked = self.unasked.max(UNASKED_CHANGED);
        self.asked(now_us);
    }

    /// Whether the budget allows one more datagram; if not, it must be dropped and counted.
    #[must_use]
    pub fn admits(&mut self, now_us: u64) -> bool {
        if self.used_us > now_us.saturating_add(SAVED_US - COST_US) {
            return false;
        }
        self.used_us = self.used_us.max(now_us).saturating_add(COST_US);
        true
    }
}

/// Whether `from` is in the network of `address`: no other host gets a unicast answer, or a forged sender
/// address could direct answers at any host.
#[must_use]
pub const fn is_near(from: [u8; 4], address: [u8; 4], prefix: u8) -> bool {
    let differs = u32::from_be_bytes(from) ^ u32::from_be_bytes(address);
    match differs.checked_shr(32u32.saturating_sub(prefix as u32)) {
        Some(network) => network == 0,
        None => true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;
    use std::vec::Vec;

    const MAC: Mac = [0x52, 0x54, 0x00, 0x12, 0x34, 0x01];
    const HERE: Option<[u8; 4]> = Some([10, 1, 2, 77]);
    const ELSEWHERE: Option<[u8; 4]> = Some([169, 254, 3, 4]);

    /// Everything but waiting that happens until `until_us`, and when.
    fn happens(
        discovery: &mut Discovery,
        now_us: &mut u64,
        until_us: u64,
        address: Option<[u8; 4]>,
    ) -> Vec<(u64, Action)> {
        let mut actions = Vec::new();
        for _ in 0..1000 {
            match discovery.poll(*now_us, address) {
                Action::Wait(next_us) => {
                    assert!(next_us > *now_us, "it would turn in circles");
                    if next_us >= until_us {
                        *now_us = until_us;
                        return actions;
                    }
                    *now_us = next_us;
                }
                action => actions.push((*now_us, action)),
            }
        }
        panic!("too much happens: {actions:?}");
    }

    fn kinds(actions: &[(u64, Action)]) -> Vec<Action> {
        actions.iter().map(|(_, action)| *action).collect()
    }

    /// A module that has been there for a while.
    fn settled(now_us: &mut u64) -> Discovery {
        let mut discovery = Discovery::new(MAC);
        happens(&mut discovery, now_us, 20_000_000, HERE);
        discovery
    }

    #[test]
    fn nothing_is_joined_or_said_without_an_address() {
        let mut discovery = Discovery::new(MAC);
        discovery.asked(0);
        discovery.changed(0);
        assert_eq!(happens(&mut discovery, &mut 0, 60_000_000, None), []);
    }

    #[test]
    fn with_an_address_it_joins_first_and_then_announces_three_times() {
        let mut discovery = Discovery::new(MAC);
        let mut now_us = 5_000_000;
        let actions = happens(&mut discovery, &mut now_us, 60_000_000, HERE);
        assert_eq!(kinds(&actions), [Action::Join, Action::Announce, Action::Announce, Action::Announce]);
        let times: Vec<u64> = actions.iter().map(|(at_us, _)| at_us - 5_000_000).collect();
        assert!(times[1] <= DELAY_US.1, "{times:?}");
        assert_eq!([times[2] - times[1], times[3] - times[2]], [SPACING_US, 2 * SPACING_US]);
    }

    #[test]
    fn after_a_link_loss_it_leaves_and_joins_anew_when_the_stack_has_come_round() {
        let mut now_us = 0;
        let mut discovery = settled(&mut now_us);
        let lost = happens(&mut discovery, &mut now_us, 20_050_000, None);
        assert_eq!(lost, [(20_000_000, Action::Leave)]);
        let back = happens(&mut discovery, &mut now_us, 40_000_000, HERE);
        assert_eq!(back[0], (20_000_000 + SETTLE_US, Action::Join));
        assert_eq!(kinds(&back)[1..], [Action::Announce; 3]);
    }

    #[test]
    fn another_address_is_announced_under_a_new_membership() {
        let mut now_us = 0;
        let mut discovery = settled(&mut now_us);
        let moved = happens(&mut discovery, &mut now_us, 40_000_000, ELSEWHERE);
        let expected = vec![Action::Leave, Action::Join];
        assert_eq!(kinds(&moved), [expected, vec![Action::Announce; 3]].concat());
    }

    #[test]
    fn an_address_lost_before_the_announcement_is_never_announced() {
        let mut discovery = Discovery::new(MAC);
        assert_eq!(discovery.poll(0, HERE), Action::Join);
        assert_eq!(discovery.poll(1, None), Action::Leave);
        assert_eq!(happens(&mut discovery, &mut 2, 60_000_000, None), []);
    }

    #[test]
    fn a_question_is_answered_soon_but_not_at_once() {
        let mut now_us = 0;
        let mut discovery = settled(&mut now_us);
        discovery.asked(now_us);
        let answers = happens(&mut discovery, &mut now_us, 30_000_000, HERE);
        assert_eq!(kinds(&answers), [Action::Announce]);
        assert!((20_020_000..=20_120_000).contains(&answers[0].0), "{answers:?}");
    }

    #[test]
    fn however_often_it_is_asked_it_answers_once_a_second() {
        let mut now_us = 0;
        let mut discovery = settled(&mut now_us);
        let mut answers = Vec::new();
        for ms in 1..=10_000 {
            discovery.asked(now_us);
            answers.extend(happens(&mut discovery, &mut now_us, 20_000_000 + ms * 1000, HERE));
        }
        assert_eq!(answers.len(), 10, "{answers:?}");
        assert!(answers.windows(2).all(|pair| pair[1].0 - pair[0].0 >= SPACING_US), "{answers:?}");
    }

    #[test]
    fn a_new_sensor_is_announced_twice() {
        let mut now_us = 0;
        let mut discovery = settled(&mut now_us);
        discovery.changed(now_us);
        let told = happens(&mut discovery, &mut now_us, 60_000_000, HERE);
        assert_eq!(kinds(&told), [Action::Announce; 2]);
    }

    #[test]
    fn neighbours_do_not_answer_at_the_same_time() {
        let delays: Vec<u64> = (1..=4).map(|last| Discovery::new([2, 0, 0, 0, 0, last]).delay_us).collect();
        for (at, &delay_us) in delays.iter().enumerate() {
            assert!((DELAY_US.0..=DELAY_US.1).contains(&delay_us));
            assert!(delays[..at].iter().all(|other| other.abs_diff(delay_us) > 10_000), "{delays:?}");
        }
    }

    #[test]
    fn of_a_flood_fifty_a_second_are_looked_at() {
        let mut discovery = Discovery::new(MAC);
        let admitted = (0..10_000u64).filter(|ms| discovery.admits(5_000_000 + ms * 1000)).count();
        assert!((500..=550).contains(&admitted), "{admitted}");
        assert!(discovery.admits(20_000_000), "and then it looks again");
    }

    #[test]
    fn only_the_own_network_is_near() {
        assert!(is_near([10, 1, 2, 3], [10, 1, 2, 77], 24));
        assert!(!is_near([10, 1, 3, 3], [10, 1, 2, 77], 24));
        assert!(is_near([169, 254, 200, 1], [169, 254, 3, 4], 16));
        assert!(is_near([1, 2, 3, 4], [9, 9, 9, 9], 0));
        assert!(is_near([9, 9, 9, 9], [9, 9, 9, 9], 32) && !is_near([9, 9, 9, 8], [9, 9, 9, 9], 32));
        assert!(!is_near([9, 9, 9, 8], [9, 9, 9, 9], 255));
    }

    #[test]
    fn the_service_says_who_the_module_is_and_what_it_speaks() {
        let status = Status { model: Text::new(b"URG-04LX"), serial: Text::new(b"H0508486"), ..Status::NEW };
        let service = Service::new(ModuleId(MAC), "0.1.0", &status);
        assert_eq!(service.instance(), "kehai-123401");
        assert_eq!(service.instance(), crate::address::host_name(MAC));
        let expected = [
            ("protocol", "1"),
            ("firmware", "0.1.0"),
            ("id", "525400123401"),
            ("model", "URG-04LX"),
            ("serial", "H0508486"),
        ];
        assert_eq!(service.txt(), expected);
        assert_ne!(service, Service::new(ModuleId(MAC), "0.1.0", &Status::NEW));
    }
}
