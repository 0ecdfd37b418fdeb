//! `kehai-sim module` is found by DNS-SD, and forgotten when it ends.

#[path = "support/program.rs"]
mod program;

use std::collections::BTreeMap;
use std::process::Command;
use std::time::{Duration, Instant};

use kehai_emulator::pc::discovery::{multicast_passes, service_type};
use mdns_sd::{Receiver, ServiceDaemon, ServiceEvent};
use program::{Program, word};

const PATIENCE: Duration = Duration::from_secs(60);

/// `02:aa:bb:cc:dd:ee` is announced as `kehai-ccddee`.
fn full_name(module: &str) -> String {
    let digits: String = module.split(':').collect();
    format!("kehai-{}.{}", &digits[6..], service_type())
}

/// The next event that `found` likes; everything before it is noted in `seen`.
fn look<T>(events: &Receiver<ServiceEvent>, found: impl Fn(&ServiceEvent) -> Option<T>) -> T {
    let (begin, mut seen) = (Instant::now(), Vec::new());
    while let Ok(event) = events.recv_timeout(PATIENCE.saturating_sub(begin.elapsed())) {
        if let Some(found) = found(&event) {
            return found;
        }
        seen.push(format!("{event:?}"));
    }
    panic!("nothing of the kind; but {seen:#?}");
}

#[test]
fn a_module_is_found_with_what_its_sensor_says_of_itself_unless_it_is_told_to_be_silent() {
    if !multicast_passes() {
        return test_support::fail_in_ci_else_skip("no multicast between programs of this machine");
    }
    let (_sensor, line) =
        Program::start(&["sensor", "--model", "urg-04lx", "--tcp", "127.0.0.1:0"], "listening on");
    let place = format!("tcp://{}", word(&line, "listening on "));
    let daemon = ServiceDaemon::new().expect("sockets");
    let events = daemon.browse(&service_type()).expect("browsing");

    let module = |place: &str, more: &[&str]| {
        let arguments = ["module", "--sensor", place, "--listen", "127.0.0.1:0"];
        let (program, line) = Program::start(&[&arguments[..], more].concat(), " at ");
        let port: u16 = word(&line, " at 127.0.0.1:").parse().expect("a port");
        (program, full_name(word(&line, "module ")), port)
    };
    let (_silent, silent_name, _) = module("tcp://127.0.0.1:1", &["--no-mdns"]);
    let (heard, heard_name, port) = module(&place, &[]);

    let (found_port, addresses, txt) = look(&events, |event| match event {
        ServiceEvent::ServiceResolved(service) if service.fullname == heard_name => {
            let txt: BTreeMap<String, String> = service
                .txt_properties
                .iter()
                .map(|pair| (pair.key().to_owned(), pair.val_str().to_owned()))
                .collect();
            let addresses: Vec<String> = service.get_addresses_v4().iter().map(ToString::to_string).collect();
            // It says more once the sensor is found.
            (!txt["model"].is_empty()).then_some((service.port, addresses, txt))
        }
        ServiceEvent::ServiceFound(_, name) if *name == silent_name => panic!("it is not silent"),
        _ => None,
    });
    assert_eq!((found_port, addresses), (port, vec!["127.0.0.1".to_owned()]));
    assert_eq!(txt["protocol"], "1");
    assert_eq!(txt["firmware"], env!("CARGO_PKG_VERSION"));
    assert!(txt["model"].starts_with("URG-04LX"), "{txt:?}");
    assert!(!txt["serial"].is_empty(), "{txt:?}");
    assert!(txt["id"].ends_with(&heard_name["kehai-".len()..][..6]), "{txt:?}");

    heard.interrupt();
    look(&events, |event| match event {
        ServiceEvent::ServiceRemoved(_, name) if *name == heard_name => Some(()),
        ServiceEvent::ServiceFound(_, name) if *name == silent_name => panic!("it is not silent"),
        _ => None,
    });
    let _ = daemon.shutdown();
}

#[test]
fn f12_modules_of_a_demo_keep_their_names_and_do_not_take_one_after_the_other() {
    if !multicast_passes() {
        return test_support::fail_in_ci_else_skip("no multicast between programs of this machine");
    }
    let daemon = ServiceDaemon::new().expect("sockets");
    let events = daemon.browse(&service_type()).expect("browsing");
    let demo = Command::new(env!("CARGO_BIN_EXE_kehai-sim"))
        .args(["demo", "--headless", "--seconds", "8"])
        .output()
        .unwrap();
    assert!(demo.status.success());
    // Another demo on this machine may cost a name a number; a name that fights itself gets eight a second.
    let names: Vec<String> = events
        .try_iter()
        .filter_map(|event| if let ServiceEvent::ServiceFound(_, name) = event { Some(name) } else { None })
        .collect();
    assert!(!names.is_empty() && names.iter().all(|name| !name.contains("(10)")), "{names:?}");
    let _ = daemon.shutdown();
}

#[test]
fn the_help_says_how_to_switch_the_announcement_off() {
    let output = Command::new(env!("CARGO_BIN_EXE_kehai-sim")).args(["module", "--help"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("--no-mdns") && text.contains("_kehai._udp"), "{text}");
}
