//! The add-on for Home Assistant, held against what its supervisor demands, and its start script with a supervisor that is played.
//!
//! ```text
//!   config.yaml, build.yaml, translations/, repository.yaml ─▶ tests/data/home-assistant-addon.json: our words for the rules
//!   run.sh, with curl, setpriv and kehai-tracker played by scripts ─▶ the arguments and the broker that the tracker gets
//! ```
#![cfg(unix)]

use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

const RULES: &str = include_str!("data/home-assistant-addon.json");

/// The tracker's package, as it lies beside the Dockerfile.
const PACKAGE: &str = "kehai-tracker.deb";

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../packaging/home-assistant")
}

fn read(file: &str) -> String {
    let path = folder().join(file);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn yaml(text: &str) -> Value {
    serde_saphyr::from_str(text).unwrap()
}

/// What is wrong with a document, by the rules of its kind.
fn wrong(kind: &str, document: &Value) -> Vec<String> {
    let mut rules: Value = serde_json::from_str(RULES).unwrap();
    rules["$ref"] = json!(format!("#/$defs/{kind}"));
    let rules = jsonschema::validator_for(&rules).unwrap();
    rules.iter_errors(document).map(|error| format!("{}: {error}", error.instance_path())).collect()
}

fn configuration() -> Value {
    yaml(&read("kehai/config.yaml"))
}

fn keys(object: &Value) -> BTreeSet<String> {
    object.as_object().unwrap().keys().cloned().collect()
}

#[test]
fn it_is_as_the_supervisor_demands() {
    assert_eq!(wrong("configuration", &configuration()), [] as [&str; 0]);
    assert_eq!(wrong("build", &yaml(&read("kehai/build.yaml"))), [] as [&str; 0]);
    assert_eq!(wrong("repository", &yaml(&read("repository.yaml"))), [] as [&str; 0]);
    // The rules refuse, too.
    for (key, value) in [
        ("arch", json!(["i386"])),
        ("slug", json!("a b")),
        ("webui", json!("http://[HOST]:8420")),
        ("services", json!(["mqtt:wants"])),
        ("schema", json!({ "site": "string" })),
        ("schema", json!({ "http_names": ["string"] })),
        ("timeout", json!(5)),
        ("host_networks", json!(true)),
    ] {
        let mut changed = configuration();
        changed[key] = value;
        assert!(!wrong("configuration", &changed).is_empty(), "{key}");
    }
}

#[test]
fn its_version_is_the_trackers_and_every_file_is_there() {
    let configuration = configuration();
    assert_eq!(configuration["version"], env!("CARGO_PKG_VERSION"));
    let version = format!("## {}\n", env!("CARGO_PKG_VERSION"));
    assert!(read("kehai/CHANGELOG.md").contains(&version));
    for file in ["DOCS.md", "Dockerfile", "run.sh"] {
        assert!(!read(&format!("kehai/{file}")).is_empty());
    }
    let copied = read("kehai/Dockerfile");
    for line in copied.lines().filter_map(|line| line.strip_prefix("COPY ")) {
        let file = line.split_whitespace().next().unwrap();
        // The package is put there by addon.sh.
        assert!(file == PACKAGE || folder().join("kehai").join(file).exists(), "{file}");
    }
    // One name for all versions and processors: a package of before is replaced, and never another beside it.
    assert!(copied.contains(&format!("COPY {PACKAGE} /tmp/")), "{copied}");
    assert!(read("addon.sh").contains(&format!("$out/kehai/{PACKAGE}\n")));
    for (picture, width, height) in [("icon.png", 128, 128), ("logo.png", 290, 100)] {
        let bytes = fs::read(folder().join("kehai").join(picture)).unwrap();
        let number = |at: usize| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap());
        assert_eq!((&bytes[1..4], number(16), number(20)), (&b"PNG"[..], width, height), "{picture}");
    }
}

#[test]
fn every_option_has_a_default_a_rule_and_words_in_every_language() {
    let configuration = configuration();
    let options = keys(&configuration["options"]);
    assert_eq!(keys(&configuration["schema"]), options);
    let (documents, script) = (read("kehai/DOCS.md"), read("kehai/run.sh"));
    for option in &options {
        assert!(documents.contains(&format!("| `{option}` |")), "{option}: no word in DOCS.md");
        assert!(script.contains(&format!("option {option})")), "{option}: not read by run.sh");
    }
    let mut languages = BTreeSet::new();
    for entry in fs::read_dir(folder().join("kehai/translations")).unwrap() {
        let path = entry.unwrap().path();
        let document = yaml(&fs::read_to_string(&path).unwrap());
        assert_eq!(wrong("translation", &document), [] as [&str; 0], "{}", path.display());
        assert_eq!(keys(&document["configuration"]), options, "{}", path.display());
        languages.insert(path.file_stem().unwrap().to_string_lossy().into_owned());
    }
    assert_eq!(languages, ["de", "en", "ja"].map(str::to_owned).into());
}

/// What the start script starts: the arguments, a line each, and the broker behind `KEHAI_MQTT=`; and what it says.
fn started(options: &Value, service: Option<&Value>) -> (Vec<String>, String) {
    let folder_of_test = tempfile::tempdir().unwrap();
    let data = folder_of_test.path();
    fs::write(data.join("options.json"), options.to_string()).unwrap();
    if let Some(service) = service {
        fs::write(data.join("service.json"), service.to_string()).unwrap();
    }
    let play = |program: &str, script: &str| {
        let file = data.join(program);
        fs::write(&file, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o755)).unwrap();
    };
    play("curl", "[ -e \"$KEHAI_DATA/service.json\" ] || exit 22\ncat \"$KEHAI_DATA/service.json\"");
    play("install", "while [ $# -gt 1 ]; do shift; done; mkdir -p \"$1\"");
    play("setpriv", "while [ \"$1\" != kehai-tracker ]; do shift; done; exec \"$@\"");
    play("kehai-tracker", "for one in \"$@\"; do echo \"$one\"; done; echo \"KEHAI_MQTT=${KEHAI_MQTT-}\"");
    let path = format!("{}:{}", data.display(), std::env::var("PATH").unwrap());
    let output = Command::new("sh")
        .arg(folder().join("kehai/run.sh"))
        .env("PATH", path)
        .env("KEHAI_DATA", data)
        .env_remove("KEHAI_MQTT")
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    let text = String::from_utf8(output.stdout).unwrap().replace(&data.display().to_string(), "/data");
    (text.lines().map(str::to_owned).collect(), said)
}

/// Whether there is what the script needs; without, it is left out with a message.
fn jq() -> bool {
    let found = Command::new("jq").arg("--version").output().is_ok();
    if !found {
        test_support::fail_in_ci_else_skip("no jq (Debian: apt-get install jq)");
    }
    found
}

#[test]
fn options_become_arguments_and_the_supervisors_broker_that_of_the_tracker() {
    if !jq() {
        return;
    }
    let service = |ssl: bool, username: &str| {
        let data = json!({ "host": "core-mosquitto", "port": 1883, "ssl": ssl, "username": username, "password": "a@b c", "protocol": "3.1.1" });
        json!({ "result": "ok", "data": data })
    };
    let usual = configuration()["options"].clone();
    let (said, silent) = started(&usual, Some(&service(false, "addons")));
    let expected = "run --site /data/kehai/site.toml --db /data/kehai/site.db --first-admin --http 0.0.0.0:8420 \
        --http-name homeassistant.local --http-name homeassistant --keep-days 7 --log info";
    let broker = |broker: &str| format!("KEHAI_MQTT={broker}");
    assert_eq!(said[..said.len() - 1].join(" "), expected);
    assert_eq!(said.last(), Some(&broker("mqtt://addons:a@b c@core-mosquitto:1883")));
    assert_eq!(silent, "");
    let of = |service: Option<&Value>, options: &Value| started(options, service).0.last().cloned();
    assert_eq!(of(Some(&service(true, "")), &usual), Some(broker("mqtts://core-mosquitto:1883")));
    let mut without = usual.clone();
    without["mqtt"] = json!(false);
    assert_eq!(of(Some(&service(false, "addons")), &without), Some(broker("")));
    let mut commands = usual.clone();
    commands["mqtt_commands"] = json!(true);
    let said = started(&commands, Some(&service(false, "addons"))).0;
    assert_eq!(said[said.len() - 2], "--mqtt-commands");
    let mut unnamed = usual.clone();
    unnamed["http_names"] = json!([]);
    let said = started(&unnamed, None).0;
    assert!(!said.iter().any(|word| word == "--http-name"), "{said:?}");
    // Without a broker the tracker counts all the same, and the log says why Home Assistant hears nothing.
    let (said, words) = started(&usual, None);
    assert_eq!(said.last(), Some(&broker("")));
    assert!(words.contains("no MQTT broker"), "{words}");
    // Each option is one of the program's.
    let help = Command::new(env!("CARGO_BIN_EXE_kehai-tracker")).args(["run", "--help"]).output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    for option in said.iter().filter(|word| word.starts_with("--")) {
        assert!(help.contains(&format!("{option} ")) || help.contains(&format!("{option}\n")), "{option}");
    }
}
