//! Whose datagram is believed: the device's that answers at the address, whatever others say in its name.

#[path = "../../tests/intake/fake.rs"]
mod fake;

use super::*;
use crate::alarm::AlarmKind;
use crate::jsonl::ZoneKnown;
use crate::site_tracker::SiteTracker;
use crate::snapshot::ModuleLine;
use crate::tracker::Selected;
use fake::{Fake, SITE, id};

const SECOND_US: u64 = 1_000_000;

fn at(host: u8) -> SocketAddr {
    SocketAddr::from(([192, 168, 7, host], 4040))
}

/// A network of fake modules in a simulated time.
struct Network {
    registry: Registry,
    site_tracker: SiteTracker,
    /// Follows what a recording holds.
    again: SiteTracker,
    modules: Vec<(SocketAddr, Fake)>,
    now_us: u64,
}

impl Network {
    fn new(given: &[SocketAddr], modules: Vec<(SocketAddr, Fake)>) -> Self {
        let site: Arc<Site> = Arc::new(toml::from_str(SITE).unwrap());
        let registry = Registry::new(Arc::clone(&site), given);
        let site_tracker = SiteTracker::new(&site, Selected::default());
        let again = SiteTracker::new(&site, Selected::default());
        Self { registry, site_tracker, again, modules, now_us: 10 * SECOND_US }
    }

    /// One datagram from an address; whether it was admitted.
    fn hear(&mut self, from: SocketAddr, bytes: &[u8]) -> bool {
        if !self.registry.knows(from) {
            return false;
        }
        let sessions = self.site_tracker.sessions_mut();
        let datagram = sessions.decode(bytes).unwrap();
        let admission = self.registry.admit(from, &datagram, sessions, self.now_us);
        if admission.is_elsewhere {
            self.again.sessions_mut().note_new_address(datagram.device(), self.now_us);
        }
        if !admission.is_used {
            return false;
        }
        let observation = self.site_tracker.follow(&datagram, self.now_us);
        let again = self.again.follow(&datagram, self.now_us);
        let start_s = |observation: &Observation| observation.start_s;
        let (live_s, again_s) = (observation.as_ref().map(start_s), again.as_ref().map(start_s));
        assert_eq!(live_s, again_s, "who follows the recording uses it otherwise");
        let sessions = self.site_tracker.sessions_mut();
        let mut sent = Vec::new();
        self.registry.heard(from, &datagram, observation, sessions, self.now_us, |bytes, to| {
            sent.push((bytes.to_vec(), to));
        });
        self.deliver(sent);
        true
    }

    fn deliver(&mut self, sent: Vec<(Vec<u8>, SocketAddr)>) {
        for (request, to) in sent {
            let Some((_, module)) = self.modules.iter().find(|(address, _)| *address == to) else { continue };
            for answer in module.answers(&request, module.clock_us(self.now_us)) {
                self.hear(to, &answer);
            }
        }
    }

    /// A tenth of a second: requests, their answers, a report from each module.
    fn tenth(&mut self) {
        self.now_us += SECOND_US / 10;
        let mut sent = Vec::new();
        let sessions = self.site_tracker.sessions_mut();
        self.registry.poll(sessions, self.now_us, |bytes, to| sent.push((bytes.to_vec(), to)));
        self.deliver(sent);
        for index in 0..self.modules.len() {
            let (from, module) = &mut self.modules[index];
            let (from, report) = (*from, module.report(self.now_us - SECOND_US / 10));
            self.hear(from, &report);
        }
    }

    fn seconds(&mut self, seconds: u32) {
        (0..seconds * 10).for_each(|_| self.tenth());
    }

    fn zone(&mut self) -> ZoneKnown {
        let at_s = self.now_us as f64 * 1e-6;
        let line = self.site_tracker.line(at_s);
        assert_eq!(self.again.line(at_s), line);
        line.zones["area"].state()
    }

    fn lines(&mut self) -> Vec<ModuleLine> {
        self.registry.update_lines(self.site_tracker.sessions_mut(), self.now_us)
    }

    fn announces(&mut self, instance: &str, device: ModuleId, host: u8) {
        let found =
            Found { instance: instance.into(), id: device, addresses: vec![at(host)], ..Found::default() };
        self.finds(Finding::Found(found));
    }

    fn finds(&mut self, finding: Finding) {
        let own = Networks::of([([192, 168, 7, 9].into(), [255, 255, 255, 0].into())]);
        self.registry.find(finding, &own, self.now_us);
    }
}

#[test]
fn f4_no_peer_speaks_for_another_module() {
    let (left, other) = (Fake::new(1, 5, "left"), Fake::new(2, 1, "other"));
    let mut network = Network::new(&[at(1), at(2)], vec![(at(1), left), (at(2), other)]);
    network.seconds(3);
    assert_eq!(network.zone(), ZoneKnown::Known);
    let forged = network.modules[0].1.reported(u32::MAX / 2, 0);
    assert!(!network.hear(at(2), &forged));
    assert_eq!(network.site_tracker.sessions().drops().foreign, 1);
    network.seconds(3);
    assert_eq!(network.zone(), ZoneKnown::Known);
}

#[test]
fn f4_an_announcement_moves_no_module_that_is_heard_and_back_it_comes() {
    let left = Fake::new(1, 5, "left");
    // It has all that the true one has, and a higher start.
    let evil = Fake::new(1, 6, "left");
    let mut network = Network::new(&[], vec![(at(1), left), (at(66), evil)]);
    network.announces("kehai-left", id(1), 1);
    network.seconds(3);
    network.announces("kehai-evil", id(1), 66);
    network.seconds(5);
    assert_eq!(network.lines()[0].address, at(1).to_string());
    assert_eq!(network.zone(), ZoneKnown::Known);
    // Without a name that says whose it is, it is another way to the same device: that is heard elsewhere.
    network.announces("kehai-worse", ModuleId::ANY, 66);
    network.seconds(5);
    assert_eq!(network.lines()[0].address, at(1).to_string());
    // The true one is switched off: now nothing tells them apart. Once the fake is gone, it is found again.
    let left = network.modules.remove(0);
    network.seconds(8);
    assert_eq!(network.lines()[0].address, at(66).to_string());
    network.modules[0] = left;
    network.finds(Finding::Lost("kehai-worse".into()));
    network.seconds(20);
    assert_eq!(network.lines()[0].address, at(1).to_string());
    assert_eq!(network.zone(), ZoneKnown::Known);
}

#[test]
fn f4_a_module_that_was_silent_is_back_at_once_however_many_addresses_were_announced() {
    let mut network = Network::new(&[], vec![(at(1), Fake::new(1, 5, "left"))]);
    network.announces("kehai-left", id(1), 1);
    network.seconds(3);
    assert_eq!(network.zone(), ZoneKnown::Known);
    let addresses = (100..120).map(at).collect();
    let found = Found { instance: "kehai-evil".into(), id: id(1), addresses, ..Found::default() };
    network.finds(Finding::Found(found));
    let silent = std::mem::take(&mut network.modules);
    network.seconds(5);
    assert_eq!(network.zone(), ZoneKnown::Unknown);
    network.modules = silent;
    network.seconds(4);
    assert_eq!(network.zone(), ZoneKnown::Known, "asked at its own address, too");
}

#[test]
fn f4_a_fake_that_does_not_answer_gets_no_module() {
    let mut network = Network::new(&[at(1)], Vec::new());
    let mut left = Fake::new(1, 5, "left");
    network.tenth();
    for _ in 0..20 {
        let report = left.report(network.now_us);
        assert!(!network.hear(at(1), &report));
        network.tenth();
    }
    assert_eq!(network.site_tracker.sessions().iter().count(), 0);
    assert!(network.site_tracker.sessions().drops().unasked > 0);
}

#[test]
fn f4_a_false_announcement_before_the_first_answer_takes_no_address_away() {
    let left = Fake::new(1, 1, "left");
    let mut network = Network::new(&[], vec![(at(1), left.clone())]);
    network.announces("kehai-left", left.identity.module, 1);
    // Nothing answers there.
    network.announces("kehai-left", left.identity.module, 66);
    network.seconds(5);
    assert_eq!(network.zone(), ZoneKnown::Known);
    // The same the other way round: the true address is tried once the false one was silent for three seconds.
    let mut network = Network::new(&[], vec![(at(1), left.clone())]);
    for host in [66, 1, 67, 68] {
        network.announces("kehai-left", left.identity.module, host);
    }
    network.seconds(40);
    assert_eq!(network.zone(), ZoneKnown::Known);
}

#[test]
fn f3_a_module_whose_flash_was_erased_is_heard_again_and_a_forged_start_silences_none() {
    let mut network = Network::new(&[at(1)], vec![(at(1), Fake::new(1, 57, "left"))]);
    network.seconds(3);
    let forged = Fake::new(1, u32::MAX, "left").report(network.now_us);
    assert!(!network.hear(at(1), &forged));
    network.seconds(3);
    assert_eq!(network.zone(), ZoneKnown::Known);
    // Its flash is erased: it counts its starts from 1.
    network.modules[0].1 = Fake::new(1, 1, "left");
    let mut known = Vec::new();
    for _ in 0..8 {
        network.seconds(1);
        known.push(network.zone());
    }
    assert_eq!(known[1], ZoneKnown::Unknown, "while it is not clear which is true");
    assert_eq!(known[7], ZoneKnown::Known);
}

#[test]
fn f4_two_modules_of_one_name_are_an_alarm_and_neither_is_used() {
    let (left, second) = (Fake::new(2, 5, "left"), Fake::new(1, 5, "left"));
    let mut network = Network::new(&[at(1), at(2)], vec![(at(1), left)]);
    network.seconds(3);
    assert_eq!(network.zone(), ZoneKnown::Known);
    network.modules.push((at(2), second));
    network.seconds(4);
    assert_eq!(network.zone(), ZoneKnown::Unknown);
    assert!(network.site_tracker.sessions().drops().same_name > 0);
    let lines = network.lines();
    assert!(lines[1].unused_s.is_some_and(|unused_s| unused_s > 3.0), "as long as there are two: {lines:?}");
    assert_eq!(lines[0].unused_s, None, "none of its reports was ever used");
    assert_eq!(lines.iter().filter(|line| line.name == "left").count(), 1);
    let alarms = lines.iter().flat_map(|line| &line.alarms);
    assert_eq!(alarms.filter(|alarm| alarm.kind == AlarmKind::SameName).count(), 2);
    // The first one is broken, and the second is there in its place.
    network.modules.remove(0);
    network.seconds(6);
    assert_eq!(network.zone(), ZoneKnown::Known);
    let lines = network.lines();
    assert_eq!((lines[0].name.as_str(), lines[0].id.as_str()), ("left", id(1).to_string().as_str()));
}

#[test]
fn f4_a_device_without_a_key_takes_no_place_from_one_that_has_a_key_and_is_no_rival_of_it() {
    let sealed = Fake { key: 3, ..Fake::new(2, 5, "left") };
    // It has the lower identity, answers first, and says the same name.
    let evil = Fake::new(1, 5, "left");
    let mut network = Network::new(&[at(1), at(2)], vec![(at(2), evil)]);
    network.seconds(3);
    network.modules.push((at(1), sealed));
    network.seconds(4);
    assert_eq!(network.zone(), ZoneKnown::Known);
    let lines = network.lines();
    assert_eq!((lines[0].name.as_str(), lines[0].id.as_str()), ("left", id(2).to_string().as_str()));
    assert!(
        lines[0].unused_s.is_some_and(|unused_s| unused_s < 0.5) && lines[0].alarms.is_empty(),
        "{lines:?}"
    );
    assert!(lines[1].unused_s.is_some_and(|unused_s| unused_s > 3.0), "{lines:?}");
    assert!(lines[1].alarms.iter().any(|alarm| alarm.text.contains("has no key")), "{lines:?}");
    // Nor is the other used in its place while it is silent.
    network.modules.pop();
    network.seconds(6);
    assert_eq!(network.zone(), ZoneKnown::Unknown);
    assert_eq!(network.lines()[0].id, id(2).to_string());
}

#[test]
fn f4_a_module_that_is_swapped_for_another_at_its_address_is_found() {
    let mut network = Network::new(&[at(1)], vec![(at(1), Fake::new(1, 57, "left"))]);
    network.seconds(3);
    network.modules[0].1 = Fake::new(9, 3, "left");
    network.seconds(2);
    assert_eq!(network.zone(), ZoneKnown::Unknown);
    network.seconds(6);
    assert_eq!(network.zone(), ZoneKnown::Known);
}

#[test]
fn f4_a_given_peer_that_says_it_is_an_announced_module_gets_nothing_while_that_answers() {
    let (left, peer) = (Fake::new(1, 5, "left"), Fake::new(2, 1, "other"));
    let mut network = Network::new(&[at(2)], vec![(at(1), left), (at(2), peer)]);
    network.announces("kehai-left", id(1), 1);
    network.seconds(3);
    network.modules[1].1 = Fake::new(1, 6, "left");
    network.seconds(10);
    assert_eq!(network.lines()[0].address, at(1).to_string());
    assert_eq!(network.zone(), ZoneKnown::Known);
}

#[test]
fn f4_a_module_is_found_again_after_a_peer_has_answered_as_it() {
    for given in [true, false] {
        let (left, peer) = (Fake::new(1, 5, "left"), Fake::new(2, 1, "other"));
        let addresses = [at(2), at(1)];
        let addresses = if given { &addresses[..] } else { &addresses[..1] };
        let mut network = Network::new(addresses, vec![(at(1), left), (at(2), peer)]);
        network.announces("kehai-left", id(1), 1);
        network.seconds(3);
        // The module is away, and the peer is it, under another name.
        let left = network.modules.remove(0);
        network.modules[0].1 = Fake::new(1, 5, "fake");
        network.seconds(3);
        network.announces("kehai-left", id(1), 1);
        network.seconds(10);
        // All is as it was before; the module says that it is there, as every module does.
        network.modules[0].1 = Fake::new(2, 1, "other");
        network.modules.push(left);
        network.seconds(5);
        network.announces("kehai-left", id(1), 1);
        network.seconds(10);
        assert_eq!(network.lines()[0].address, at(1).to_string(), "given: {given}");
        assert_eq!(network.zone(), ZoneKnown::Known, "given: {given}");
    }
}

#[test]
fn f4_a_given_module_is_found_at_its_address_again_after_a_given_peer_has_answered_as_it() {
    let (left, peer) = (Fake::new(1, 5, "left"), Fake::new(2, 1, "other"));
    let mut network = Network::new(&[at(2), at(1)], vec![(at(1), left), (at(2), peer)]);
    network.seconds(3);
    network.modules[1].1 = Fake::new(1, 5, "left");
    network.seconds(10);
    // The host sleeps, and then the peer is itself again.
    network.modules[1].1 = Fake::new(2, 1, "other");
    network.now_us += 600 * SECOND_US;
    network.seconds(15);
    assert_eq!(network.lines()[0].address, at(1).to_string());
    assert_eq!(network.zone(), ZoneKnown::Known);
}

#[test]
fn f4_a_module_swapped_for_another_is_found_while_a_peer_answers_as_the_first_one() {
    let (left, peer) = (Fake::new(1, 5, "left"), Fake::new(2, 1, "other"));
    let mut network = Network::new(&[at(1), at(2)], vec![(at(1), left), (at(2), peer)]);
    network.seconds(3);
    network.modules[1].1 = Fake::new(1, 5, "left");
    // Just before the peer is believed, so that the first one's address is left for the peer's at once.
    (0..13).for_each(|_| network.tenth());
    network.modules[0].1 = Fake::new(4, 89, "left");
    network.seconds(25);
    let alarms = network.lines().into_iter().flat_map(|line| line.alarms);
    assert_eq!(alarms.filter(|alarm| alarm.kind == AlarmKind::SameName).count(), 2);
    assert_eq!(network.zone(), ZoneKnown::Unknown);
    network.modules[1].1 = Fake::new(2, 1, "other");
    network.seconds(10);
    assert_eq!(network.zone(), ZoneKnown::Known);
    assert_eq!(network.lines()[0].address, at(1).to_string());
}

#[test]
fn f4_what_another_said_of_a_module_is_asked_for_again_at_its_address() {
    let mut network = Network::new(&[at(2), at(1)], vec![(at(2), Fake::new(1, 5, "fake"))]);
    network.seconds(3);
    network.modules[0].1 = Fake::new(2, 1, "other");
    network.modules.push((at(1), Fake::new(1, 5, "left")));
    network.seconds(15);
    assert_eq!(network.lines()[0].address, at(1).to_string());
    assert_eq!(network.zone(), ZoneKnown::Known);
}

#[test]
fn f4_the_clock_of_another_that_answered_as_it_is_not_the_modules() {
    let fake = Fake { offset_us: 120_000, ..Fake::new(1, 5, "fake") };
    let mut network = Network::new(&[at(2), at(1)], vec![(at(2), fake)]);
    network.seconds(3);
    network.modules[0].1 = Fake::new(2, 1, "other");
    network.modules.push((at(1), Fake::new(1, 5, "left")));
    let mut is_found = false;
    for _ in 0..150 {
        network.tenth();
        let line = network.lines().swap_remove(0);
        if line.address == at(1).to_string() {
            is_found |= line.clock_offset_ms.is_some();
            assert!(line.clock_offset_ms.is_none_or(|offset_ms| offset_ms.abs() < 10.0), "{line:?}");
        }
    }
    assert!(is_found);
}

#[test]
fn a_module_that_starts_anew_each_second_and_a_half_is_followed_each_time() {
    let mut network = Network::new(&[at(1)], vec![(at(1), Fake::new(1, 1, "left"))]);
    network.seconds(3);
    for boot in 2..29 {
        network.modules[0].1 = Fake::new(1, boot, "left");
        let before = network.site_tracker.sessions().get(id(1)).unwrap().reports();
        (0..15).for_each(|_| network.tenth());
        let session = network.site_tracker.sessions().get(id(1)).unwrap();
        assert!(before > 0 && session.reports() > 0, "start {boot}");
    }
    assert_eq!(network.site_tracker.sessions().iter().count(), 1);
    network.seconds(3);
    assert_eq!(network.zone(), ZoneKnown::Known);
}

#[test]
fn f4_a_sequence_from_far_ahead_mutes_nothing() {
    let mut network = Network::new(&[at(1)], vec![(at(1), Fake::new(1, 5, "left"))]);
    network.seconds(3);
    let forged = {
        let module = &network.modules[0].1;
        module.reported(module.sequence + (1 << 30), module.clock_us(network.now_us))
    };
    network.hear(at(1), &forged);
    assert_eq!(network.site_tracker.sessions().drops().jump, 1);
    network.seconds(3);
    assert_eq!(network.zone(), ZoneKnown::Known);
    // A row that ended, as after a network that was away for long, is followed by another.
    network.now_us += 300 * SECOND_US;
    network.modules[0].1.sequence += 3000;
    network.seconds(3);
    assert_eq!(network.zone(), ZoneKnown::Known);
}

#[test]
fn f6_an_answer_that_was_not_asked_for_moves_no_clock() {
    let mut network = Network::new(&[at(1)], vec![(at(1), Fake::new(1, 5, "left"))]);
    network.seconds(3);
    let before_ms = network.lines()[0].clock_offset_ms;
    let now_us = network.now_us;
    for request_id in 0..100 {
        let forged =
            network.modules[0].1.exchanged(request_id, now_us - 100, now_us + 900_000, now_us + 900_000);
        assert!(!network.hear(at(1), &forged));
    }
    assert_eq!(network.lines()[0].clock_offset_ms, before_ms);
    assert_eq!(network.site_tracker.sessions().drops().unasked, 100);
}

#[test]
fn f7_nothing_is_sent_to_an_address_outside_the_own_networks() {
    let mut network = Network::new(&[], Vec::new());
    let addresses =
        ["203.0.113.7:53", "127.0.0.1:4040", "192.168.7.255:4040"].map(|text| text.parse().unwrap());
    let found = Found { instance: "kehai-evil".into(), addresses: addresses.to_vec(), ..Found::default() };
    network.finds(Finding::Found(found));
    let mut sent = 0;
    network.registry.poll(network.site_tracker.sessions_mut(), network.now_us, |_, _| sent += 1);
    assert_eq!((sent, network.registry.refused().outside), (0, 3));
}

#[test]
fn f7_a_flood_of_announcements_is_bounded_and_displaces_no_module() {
    let mut network = Network::new(&[], vec![(at(1), Fake::new(1, 5, "left"))]);
    network.announces("kehai-left", id(1), 1);
    network.seconds(2);
    for number in 0..5000_u16 {
        let port = 1000 + number;
        let addresses = vec![SocketAddr::from(([192, 168, 7, 66], port))];
        let found = Found { instance: format!("kehai-{number}"), addresses, ..Found::default() };
        network.finds(Finding::Found(found));
    }
    assert_eq!(network.registry.routes.len(), PEERS);
    let mut sent = 0;
    for second in 0..60 {
        let now_us = network.now_us + second * SECOND_US;
        let to_evil = |_: &[u8], to: SocketAddr| sent += usize::from(to != at(1));
        network.registry.poll(network.site_tracker.sessions_mut(), now_us, to_evil);
    }
    assert!(sent <= 6 * PEERS, "{sent} in a minute");
    network.seconds(2);
    assert_eq!(network.zone(), ZoneKnown::Known);
}

#[test]
fn a_site_of_500_devices_is_found_whole() {
    let mut network = Network::new(&[], Vec::new());
    for number in 0..500_u16 {
        let addresses = vec![SocketAddr::from(([192, 168, 7, 1], 1000 + number))];
        let found = Found { instance: format!("kehai-{number}"), addresses, ..Found::default() };
        network.finds(Finding::Found(found));
    }
    assert_eq!((network.registry.routes.len(), network.registry.refused().crowded), (500, 0));
}

#[test]
fn f5_no_more_sessions_are_kept_than_a_network_may_have() {
    let mut network = Network::new(&[at(1)], vec![(at(1), Fake::new(1, 5, "left"))]);
    network.seconds(2);
    for number in 0..10_000_u32 {
        let [_, _, a, b] = number.to_be_bytes();
        let identity = Identity { module: ModuleId([2, 0, 0, 1, a, b]), boot: 1 };
        let stranger = Fake { identity, ..Fake::new(1, 1, "") };
        let report = stranger.reported(1, 0);
        network.site_tracker.receive(&report, network.now_us);
    }
    let sessions = network.site_tracker.sessions();
    assert_eq!((sessions.iter().count(), sessions.forgotten()), (66, 10_001 - 66));
    assert!(sessions.get(id(1)).is_some(), "what has a place stays");
}
