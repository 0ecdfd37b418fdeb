//! What follows from which facts. Each finding is made by facts that differ in one thing from a sound installation's.

use std::net::SocketAddr;

use kehai_tracking::alarm::{AlarmKind, AlarmLine};
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{DeviceState, ModuleLine};

use super::examine;
use super::facts::*;
use super::finding::{About, Finding, Verdict};

const SITE: &str = "[[module]]\nname = \"left\"\nx = 0\ny = 0\n[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";

fn site(text: &str) -> SiteState {
    SiteState::Read(Box::new(Site::parse("home.toml", text).unwrap()))
}

fn secret(secret: Secret) -> SecretFile {
    let state = SecretState::There { mode: Some(0o100_600), owned: Some(true), content: Some(Ok(1)) };
    SecretFile { secret, file: "/etc/kehai/site.keys".into(), state }
}

fn module(state: DeviceState) -> ModuleLine {
    ModuleLine { name: "left".into(), address: "10.0.0.7:4040".into(), state, ..ModuleLine::default() }
}

/// An installation with which nothing is wrong.
fn sound() -> Facts {
    let service = Service::Installed { activity: Activity::Active, enabled: Some(true), restarts: Some(0) };
    let read = DatabaseState::Read { layout: 6, newest: 6, written: Some(true) };
    Facts {
        options: OptionsState::Usable,
        is_service: true,
        service: Some(service),
        site: SiteFact { file: "/etc/kehai/site.toml".into(), owned: Some(true), state: site(SITE) },
        secrets: [Secret::Keys, Secret::Users, Secret::Cards, Secret::Certificate].map(secret).into(),
        database: Some(DatabaseFact {
            file: "/var/lib/kehai/site.db".into(),
            state: read,
            free_bytes: Some(9_000_000_000),
        }),
        map: Some(MapFact {
            address: SocketAddr::from(([127, 0, 0, 1], 8420)),
            is_reached: false,
            insecure: false,
            first_admin: false,
            health: Health::Goes,
            version: Ok("0.1.0".into()),
            own_version: "0.1.0",
        }),
        udp: UdpFact { most_bytes: Some(212_992), asked_bytes: 4 << 20, trouble: None },
        search: Some(SearchFact { networks: Some(1), found: Ok(1) }),
        devices: Ok(Devices { age_s: 0.1, modules: vec![module(DeviceState::Watching)] }),
        broker: Some(BrokerFact { broker: "here:1883".into(), log_in: Ok(()) }),
        clock: Clock::Synchronised,
    }
}

/// What is not fine with a sound installation that was changed so.
fn after(change: impl FnOnce(&mut Facts)) -> Vec<Finding> {
    let mut facts = sound();
    change(&mut facts);
    let mut findings = examine(&facts);
    findings.retain(|finding| finding.verdict != Verdict::Ok);
    findings
}

/// How, and what about, if that is one thing; with something to do.
fn one(change: impl FnOnce(&mut Facts)) -> (Verdict, About) {
    let findings = after(change);
    let [finding] = &findings[..] else { panic!("{findings:?}") };
    assert!(finding.advice.as_ref().is_some_and(|advice| !advice.is_empty()), "{finding}");
    assert_eq!(finding.to_string().lines().count(), 1, "{finding}");
    (finding.verdict, finding.about)
}

use Verdict::{Unknown, Warning, Wrong};

#[test]
fn of_a_sound_installation_every_part_is_ok() {
    let findings = examine(&sound());
    assert!(findings.iter().all(|finding| finding.verdict == Verdict::Ok), "{findings:?}");
    assert_eq!(findings.len(), 15, "{findings:?}");
}

#[test]
fn a_site_that_cannot_be_used_is_wrong_and_one_in_which_something_is_to_be_done_a_warning() {
    let of = |state: SiteState| one(|facts| facts.site.state = state);
    for (state, verdict) in
        [(SiteState::Wrong("home.toml:3: wrong".into()), Wrong), (SiteState::Denied, Unknown)]
    {
        let findings = after(|facts| {
            facts.site.state = state;
            facts.search = Some(SearchFact { networks: Some(1), found: Ok(0) });
        });
        let found: Vec<_> = findings.iter().map(|finding| (finding.verdict, finding.about)).collect();
        let of_no_number = [(Unknown, About::Buffer), (Warning, About::Discovery)];
        assert_eq!(found, [[(verdict, About::Site)].as_slice(), &of_no_number].concat());
    }
    assert_eq!(of(SiteState::Missing), (Warning, About::Site), "the map makes it");
    let of_root = after(|facts| facts.site.owned = Some(false));
    assert_eq!((of_root.len(), of_root[0].verdict, of_root[0].about), (1, Warning, About::Site));
    let advice = of_root[0].advice.as_ref().unwrap();
    assert_eq!(advice, "sudo chown --reference=/etc/kehai /etc/kehai/site.toml");
    let alone = |facts: &mut Facts| (facts.map, facts.site.state) = (None, SiteState::Missing);
    assert!(after(alone).iter().any(|finding| (finding.verdict, finding.about) == (Wrong, About::Site)));
    assert_eq!(of(site(&SITE.replace("y = 0", "y = 0\nplaced = false"))), (Warning, About::Site));
    assert_eq!(of(site(&SITE[..SITE.find("[[zone]]").unwrap()])), (Warning, About::Site), "no zone");
    assert_eq!(of(site(&SITE[SITE.find("[[zone]]").unwrap()..])), (Warning, About::Site), "no module");
    let two = format!("{SITE}[[module]]\nname = \"right\"\nx = 0\ny = 0\n");
    let twice = after(|facts| facts.site.state = site(&two));
    assert!(twice[0].text.contains("modules left and right are at one place"), "{twice:?}");
}

#[test]
fn a_secret_that_others_may_read_or_that_its_owner_may_not_is_wrong() {
    let good = || SecretState::There { mode: Some(0o600), owned: Some(true), content: Some(Ok(1)) };
    let of = |state: SecretState| one(|facts| facts.secrets[0].state = state);
    for mode in [0o640, 0o604, 0o620, 0o777] {
        let open = SecretState::There { mode: Some(mode), owned: Some(true), content: Some(Ok(1)) };
        assert_eq!(of(open), (Wrong, About::Keys), "{mode:o}");
    }
    let foreign = SecretState::There { mode: Some(0o600), owned: Some(false), content: Some(Ok(1)) };
    assert_eq!(of(foreign), (Wrong, About::Keys));
    let damaged = SecretState::There { mode: Some(0o600), owned: Some(true), content: Some(Err("x".into())) };
    assert_eq!(of(damaged), (Wrong, About::Keys));
    let closed = SecretState::There { mode: Some(0o600), owned: Some(true), content: None };
    assert_eq!(of(closed), (Unknown, About::Keys));
    let unsaid = SecretState::There { mode: None, owned: None, content: Some(Ok(1)) };
    assert_eq!(of(unsaid), (Unknown, About::Keys));
    assert_eq!(of(SecretState::Denied), (Unknown, About::Keys));
    assert_eq!(of(SecretState::Missing { needed: true }), (Wrong, About::Keys));
    assert_eq!(of(SecretState::Missing { needed: false }), (Warning, About::Keys));
    assert_eq!(after(|facts| facts.secrets[0].state = good()), []);
}

#[test]
fn a_map_for_the_network_without_anybody_who_may_log_in_is_wrong() {
    let of = |change: fn(&mut MapFact)| {
        one(|facts| {
            facts.secrets[1].state = SecretState::Missing { needed: false };
            change(facts.map.as_mut().unwrap());
        })
    };
    assert_eq!(of(|_| ()), (Warning, About::Users));
    assert_eq!(of(|map| map.is_reached = true), (Wrong, About::Users));
    assert_eq!(of(|map| (map.is_reached, map.insecure) = (true, true)), (Wrong, About::Users));
    assert_eq!(of(|map| (map.is_reached, map.first_admin) = (true, true)), (Warning, About::Users));
}

#[test]
fn a_database_is_wrong_if_it_cannot_be_used_or_its_disk_is_full() {
    let of = |state: DatabaseState| one(|facts| facts.database.as_mut().unwrap().state = state);
    assert_eq!(of(DatabaseState::Wrong("x".into())), (Wrong, About::Database));
    assert_eq!(of(DatabaseState::Missing { folder: false }), (Wrong, About::Database));
    assert_eq!(of(DatabaseState::Denied), (Unknown, About::Database));
    let read = |layout, written| DatabaseState::Read { layout, newest: 6, written };
    assert_eq!(of(read(7, Some(true))), (Wrong, About::Database));
    assert_eq!(of(read(6, None)), (Unknown, About::Database));
    for fine in [read(6, Some(false)), read(5, Some(false)), DatabaseState::Missing { folder: true }] {
        assert_eq!(after(|facts| facts.database.as_mut().unwrap().state = fine), []);
    }
    let disk = |free_bytes| one(|facts| facts.database.as_mut().unwrap().free_bytes = free_bytes);
    assert_eq!(disk(Some(0)), (Wrong, About::Disk));
    assert_eq!(disk(Some(20_000_000)), (Warning, About::Disk));
    assert_eq!(disk(None), (Unknown, About::Disk));
    assert_eq!(after(|facts| facts.database.as_mut().unwrap().free_bytes = Some(500_000_000)), []);
    assert_eq!(after(|facts| facts.database = None), []);
}

#[test]
fn a_tracker_that_does_not_answer_or_is_another_version_is_told() {
    let health = |health: Health| one(|facts| facts.map.as_mut().unwrap().health = health);
    for wrong in [Health::Stands, Health::Other(404), Health::NoAnswer("refused".into())] {
        assert_eq!(health(wrong), (Wrong, About::Tracker));
    }
    let version = |version| one(|facts| facts.map.as_mut().unwrap().version = version);
    assert_eq!(version(Ok("0.0.9".into())), (Warning, About::Version));
    assert_eq!(version(Err("log in".into())), (Unknown, About::Version));
    assert_eq!(one(|facts| facts.map = None), (Unknown, About::Tracker));
    let options = |state| one(|facts| facts.options = state);
    assert_eq!(options(OptionsState::Wrong("default: unknown option".into())), (Wrong, About::Options));
    let default = "/etc/default/kehai-tracker".into();
    assert_eq!(options(OptionsState::Denied(default)), (Unknown, About::Options), "root alone may read it");
    assert_eq!(one(|facts| facts.service = Some(Service::NotInstalled)), (Wrong, About::Service));
}

#[test]
fn what_to_do_about_a_tracker_that_does_not_go_on_is_a_command_for_the_way_in_which_it_was_started() {
    let advice = |is_service, health: &Health| {
        let findings = after(|facts| {
            facts.is_service = is_service;
            facts.map.as_mut().unwrap().health = health.clone();
        });
        findings[0].advice.clone().unwrap()
    };
    for health in [Health::Stands, Health::NoAnswer("refused".into())] {
        assert!(advice(true, &health).contains("sudo systemctl "), "{health:?}");
        assert!(!advice(false, &health).contains("systemctl"), "{health:?}");
    }
    assert!(advice(false, &Health::NoAnswer("refused".into())).contains("kehai-tracker run --site"));
    assert!(advice(true, &Health::Other(404)).contains("sport = :8420"));
}

#[test]
fn datagrams_of_forty_modules_fit_into_a_usual_buffer_and_of_forty_one_not() {
    let modules = |count: u32| {
        let module = |number| format!("[[module]]\nname = \"m{number}\"\nx = {number}\ny = 0\n");
        let text: String = (0..count).map(module).collect();
        move |facts: &mut Facts| {
            facts.site.state = site(&format!("{text}{}", &SITE[SITE.find("[[zone]]").unwrap()..]));
            let line = |number| ModuleLine { name: format!("m{number}"), ..module_line() };
            facts.devices = Ok(Devices { age_s: 0.0, modules: (0..count).map(line).collect() });
        }
    };
    assert_eq!(after(modules(40)), []);
    assert_eq!(one(modules(41)), (Warning, About::Buffer));
    assert_eq!(
        after(|facts| {
            modules(41)(facts);
            facts.udp.most_bytes = Some(4 << 20);
        }),
        []
    );
    assert_eq!(one(|facts| facts.udp.most_bytes = None), (Unknown, About::Buffer));
    assert_eq!(one(|facts| facts.udp.trouble = Some("no more files".into())), (Wrong, About::Buffer));
}

fn module_line() -> ModuleLine {
    module(DeviceState::Watching)
}

#[test]
fn a_module_is_fine_only_if_the_tracker_says_so_and_has_just_said_it() {
    let of = |line: ModuleLine| one(|facts| facts.devices = Ok(Devices { age_s: 0.1, modules: vec![line] }));
    assert_eq!(of(module(DeviceState::Missing)), (Wrong, About::Module));
    assert_eq!(of(module(DeviceState::Searching)), (Wrong, About::Module));
    let alarm = |kind| ModuleLine { alarms: vec![AlarmLine::new(kind, "wipe it")], ..module_line() };
    assert_eq!(of(alarm(AlarmKind::Dirty)), (Warning, About::Module));
    assert_eq!(of(alarm(AlarmKind::Silent)), (Wrong, About::Module));
    assert_eq!(of(ModuleLine { name: "other".into(), ..module_line() }), (Unknown, About::Module));
    let stale = |facts: &mut Facts| facts.devices.as_mut().unwrap().age_s = 61.0;
    assert_eq!(one(stale), (Unknown, About::Module));
    assert_eq!(one(|facts| facts.devices = Err("log in".into())), (Unknown, About::Module));
}

#[test]
fn modules_that_cannot_be_found_and_a_broker_that_lets_no_client_in_are_wrong() {
    let search = |networks, found| one(|facts| facts.search = Some(SearchFact { networks, found }));
    assert_eq!(search(Some(1), Err("no socket".into())), (Wrong, About::Discovery));
    assert_eq!(search(Some(0), Ok(0)), (Wrong, About::Discovery));
    for networks in [Some(1), None] {
        assert_eq!(search(networks, Ok(0)), (Warning, About::Discovery));
    }
    assert_eq!(after(|facts| facts.search = None), []);
    let found = |networks, found| {
        let fact = SearchFact { networks: Some(networks), found: Ok(found) };
        super::network::search(Some(&fact), Some(2)).text
    };
    assert_eq!(found(1, 1), "one module announces itself, in one network");
    assert_eq!(found(2, 3), "3 modules announce themselves, in 2 networks");
    let broker = |facts: &mut Facts| facts.broker.as_mut().unwrap().log_in = Err("not authorised".into());
    assert_eq!(one(broker), (Wrong, About::Broker));
    assert_eq!(one(|facts| facts.clock = Clock::Free), (Warning, About::Clock));
}
