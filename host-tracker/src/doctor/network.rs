//! From facts about the network to findings: the tracker that runs, datagrams, modules, the broker.

use kehai_tracking::alarm::Severity;
use kehai_tracking::snapshot::{DeviceState, ModuleLine};

use super::facts::{BrokerFact, Devices, Health, MapFact, SearchFact, SiteFact, SiteState, UdpFact};
use super::finding::{About, Finding};

/// What the kernel counts of its buffer for a datagram, bytes (`net::receiver`).
const DATAGRAM_BYTES: u64 = 1300;

/// Reports a second of a module, and for how long they may wait until they are too late to be used, ms (`net::receiver`).
const REPORTS_HZ: u64 = 10;
const USEFUL_MS: u64 = 800;

/// What was known longer ago is not how modules are now. A tracker that runs writes it every second.
const STALE_S: f64 = 60.0;

/// What is done about a tracker that does not run or does not go on: as systemd's service, and as a program started by hand.
struct Remedy {
    start: &'static str,
    restart: &'static str,
}

const REMEDY_OF_SERVICE: Remedy = Remedy {
    start: "sudo systemctl start kehai-tracker; if it ends again: sudo journalctl -u kehai-tracker -n 50",
    restart: "sudo systemctl restart kehai-tracker; what it said before: sudo journalctl -u kehai-tracker -n 50",
};

const REMEDY_BY_HAND: Remedy = Remedy {
    start: "start it: kehai-tracker run --site FILE --http; what it says last is why it ends. Where it has other options, name them: kehai-tracker doctor FILE -- OPTIONS",
    restart: "end it and start it again; what it has said last is why",
};

/// Whether the tracker answers, and is of this version.
pub(super) fn map(fact: Option<&MapFact>, is_service: bool) -> Vec<Finding> {
    let about = About::Tracker;
    let remedy = if is_service { &REMEDY_OF_SERVICE } else { &REMEDY_BY_HAND };
    let Some(map) = fact else {
        return vec![Finding::unknown(
            about,
            "without --http nothing tells whether the tracker runs",
            "look for its process: pgrep -a kehai-tracker; or add --http to its options",
        )];
    };
    let address = map.address;
    let answer = match &map.health {
        Health::Goes => Finding::ok(about, format!("a tracker goes on at {address}")),
        Health::Stands => {
            Finding::wrong(about, format!("the tracker at {address} makes no frames"), remedy.restart)
        }
        Health::Other(status) => Finding::wrong(
            about,
            format!("what answers at {address} is no tracker (HTTP {status})"),
            format!(
                "end the program that has this port (sudo ss -ltnp 'sport = :{}' names it), or choose another with --http",
                address.port()
            ),
        ),
        Health::NoAnswer(why) => {
            Finding::wrong(about, format!("no tracker answers at {address} ({why})"), remedy.start)
        }
    };
    if map.health != Health::Goes {
        return vec![answer];
    }
    let version = match &map.version {
        Ok(version) if version == map.own_version => {
            Finding::ok(About::Version, format!("{version}, as this program"))
        }
        Ok(version) => Finding::warning(
            About::Version,
            format!("the tracker that runs is {version}, this program {}", map.own_version),
            remedy.restart,
        ),
        Err(why) => Finding::unknown(
            About::Version,
            format!("which version runs is not known ({why})"),
            "add --token, made by kehai-tracker token add doctor --role view",
        ),
    };
    vec![answer, version]
}

/// Whether the kernel keeps as many datagrams as modules send while they are of use.
pub(super) fn buffer(fact: &UdpFact, modules: Option<usize>) -> Finding {
    let about = About::Buffer;
    if let Some(trouble) = &fact.trouble {
        return Finding::wrong(
            about,
            format!("no UDP socket is to be had ({trouble})"),
            "the tracker hears no module without one. sudo ss -uanp lists those in use, ulimit -n says how many files a program may have open",
        );
    }
    let Some(most_bytes) = fact.most_bytes else {
        return Finding::unknown(
            about,
            "how much the kernel keeps for a socket it does not say",
            "on the host: sysctl net.core.rmem_max",
        );
    };
    // socket(7): what is given is doubled.
    let holds = most_bytes.min(fact.asked_bytes) * 2 / DATAGRAM_BYTES;
    let Some(modules) = modules else {
        return Finding::unknown(
            about,
            format!("the kernel keeps {holds} datagrams; how many modules send them is not known"),
            "mend the site's file, or let this user read it",
        );
    };
    let needed = u64::try_from(modules).unwrap_or(u64::MAX).saturating_mul(REPORTS_HZ * USEFUL_MS) / 1000;
    let send = if modules == 1 { "1 module sends".to_owned() } else { format!("{modules} modules send") };
    let text = format!("the kernel keeps {holds} datagrams; {send} {needed} while they are of use");
    if holds >= needed {
        return Finding::ok(about, text);
    }
    let asked = fact.asked_bytes;
    let advice = format!(
        "echo net.core.rmem_max={asked} | sudo tee /etc/sysctl.d/60-kehai.conf && sudo sysctl --system, then start the tracker again"
    );
    Finding::warning(about, text, advice)
}

/// Whether modules can be found.
pub(super) fn search(fact: Option<&SearchFact>, modules: Option<usize>) -> Finding {
    let about = About::Discovery;
    match fact {
        None => Finding::ok(about, "modules are not looked for (--no-mdns)"),
        Some(SearchFact { found: Err(why), .. }) => Finding::wrong(
            about,
            why.clone(),
            "end the program that has port 5353 for itself (sudo ss -ulnp 'sport = :5353' names it), or name each module's address with --module",
        ),
        Some(SearchFact { networks: Some(0), .. }) => Finding::wrong(
            about,
            "this machine is in no IPv4 network: no module can be found",
            "plug in its network cable; ip -4 address must list an address. In a container: the host's own network (--network host)",
        ),
        Some(SearchFact { found: Ok(0), .. }) if modules != Some(0) => Finding::warning(
            about,
            "no module announces itself",
            "see that modules have power and are in this network, and that switches and Wi-Fi pass multicast; or name each module's address with --module",
        ),
        Some(SearchFact { found: Ok(found), networks }) => {
            let networks = match *networks {
                None => String::new(),
                Some(1) => ", in one network".to_owned(),
                Some(networks) => format!(", in {networks} networks"),
            };
            let found = match *found {
                1 => "one module announces itself".to_owned(),
                found => format!("{found} modules announce themselves"),
            };
            Finding::ok(about, format!("{found}{networks}"))
        }
    }
}

/// How the modules of the site are, each with a line of its own.
pub(super) fn modules(site: &SiteFact, devices: &Result<Devices, String>) -> Vec<Finding> {
    let about = About::Module;
    let SiteState::Read(site) = &site.state else { return Vec::new() };
    let unknown = |why: &str| {
        let names: Vec<&str> = site.modules.iter().map(|module| module.name.as_str()).collect();
        let text = format!("how {} are is not known ({why})", names.join(", "));
        let advice = "start the tracker; where users log in, add --token, made by kehai-tracker token add doctor --role view";
        if names.is_empty() { Vec::new() } else { vec![Finding::unknown(about, text, advice)] }
    };
    match devices {
        Err(why) => unknown(why),
        Ok(devices) if devices.age_s > STALE_S => {
            unknown(&format!("the tracker wrote that {:.0} minutes ago", devices.age_s / 60.0))
        }
        Ok(devices) => {
            let seen = |name: &str| devices.modules.iter().find(|line| line.name == name);
            site.modules.iter().map(|module| one(&module.name, seen(&module.name))).collect()
        }
    }
}

fn one(name: &str, line: Option<&ModuleLine>) -> Finding {
    let about = About::Module;
    let power =
        "see that it has power and is in this network; kehai-tracker module list shows which modules answer";
    let Some(line) = line else {
        return Finding::unknown(about, format!("the tracker says nothing of {name}"), power);
    };
    match line.state {
        DeviceState::Missing => Finding::wrong(about, format!("{name} does not answer"), power),
        DeviceState::Searching => Finding::wrong(
            about,
            format!("{name} at {} looks for its sensor", line.address),
            "see that the sensor has power and is plugged in: docs/wiring.md",
        ),
        DeviceState::Found | DeviceState::Learning | DeviceState::Watching | DeviceState::Storing => {
            let text = format!("{name} at {}: {}", line.address, line.state);
            match line.alarms.first() {
                None => Finding::ok(about, text),
                Some(alarm) if alarm.severity == Severity::Failed => {
                    Finding::wrong(about, text, alarm.text.clone())
                }
                Some(alarm) => Finding::warning(about, text, alarm.text.clone()),
            }
        }
    }
}

/// Whether the broker lets the tracker in.
pub(super) fn broker(fact: &BrokerFact) -> Finding {
    let (about, broker) = (About::Broker, &fact.broker);
    match &fact.log_in {
        Ok(()) => Finding::ok(about, format!("{broker} lets in")),
        Err(why) => Finding::wrong(
            about,
            format!("{broker} lets no client in ({why})"),
            "see that the broker runs at this address, and that its name and password in --mqtt, and --mqtt-ca, are right",
        ),
    }
}
