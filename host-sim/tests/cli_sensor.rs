//! `kehai-sim sensor` as people meet it: what it refuses and how, and that it leaves nothing behind.

use std::process::{Command, Output};

fn kehai_sim(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_kehai-sim")).args(arguments).output().expect("the program runs")
}

/// Exit status, and the first line on stderr.
fn refusal(arguments: &[&str]) -> (i32, String) {
    let output = kehai_sim(arguments);
    let text = String::from_utf8(output.stderr).expect("text");
    (output.status.code().unwrap_or(0), text.lines().next().unwrap_or_default().to_owned())
}

#[test]
fn wrong_arguments_are_refused_in_one_line_with_status_2() {
    let tcp = ["sensor", "--tcp", "127.0.0.1:0"];
    let with = |more: &[&'static str]| refusal(&[tcp.as_slice(), more].concat());
    assert_eq!(
        with(&["--model", "urg"]),
        (
            2,
            "error: invalid value 'urg' for '--model <MODEL>': there is no such model; known are urg-04lx, \
             urg-04lx-ug01, uhg-08lx, utm-30lx, ust-10lx"
                .to_owned()
        )
    );
    let (status, line) = with(&["--fault", "bitflip"]);
    assert_eq!(status, 2);
    assert!(line.contains("unknown fault `bitflip`; known are bit-flip,"), "{line}");
    assert_eq!(
        refusal(&["sensor", "--tcp", "nowhere"]),
        (
            2,
            "error: invalid value 'nowhere' for '--tcp <ADDR>': an address is HOST:PORT, for example \
             127.0.0.1:10940"
                .to_owned()
        )
    );
    assert_eq!(with(&["--baud", "0"]).0, 2);
    assert_eq!(with(&["--start", "asleep"]).0, 2);
    assert_eq!(with(&["--pty", "/tmp/x"]).0, 2, "one link only");
    assert_eq!(refusal(&["sensor"]).0, 2, "some link");
}

#[test]
fn missing_files_and_names_are_refused_with_status_1() {
    let with =
        |more: &[&'static str]| refusal(&[["sensor", "--tcp", "127.0.0.1:0"].as_slice(), more].concat());
    let (status, line) = with(&["--recording", "/no/such.csv"]);
    assert_eq!(status, 1);
    assert!(line.starts_with("kehai-sim: /no/such.csv: cannot be read:"), "{line}");
    let (status, line) = with(&["--scene", "/no/such.toml", "--module", "left"]);
    assert_eq!(status, 1);
    assert!(line.starts_with("kehai-sim: /no/such.toml: cannot be read"), "{line}");
    let (status, line) = with(&["--scene", "demo", "--module", "none"]);
    assert_eq!(status, 1);
    assert!(line.starts_with("kehai-sim: demo: there is no module `none`; the scene has "), "{line}");
}

#[test]
fn a_state_the_model_does_not_have_is_refused() {
    assert_eq!(
        refusal(&["sensor", "--tcp", "127.0.0.1:0", "--model", "utm-30lx", "--start", "scip11"]),
        (1, "kehai-sim: utm-30lx speaks no SCIP 1.1; urg-04lx does".to_owned())
    );
}

#[test]
fn the_help_names_every_fault() {
    let help = String::from_utf8(kehai_sim(&["sensor", "--help"]).stdout).expect("text");
    for kind in kehai_emulator::urg::faults::KINDS {
        assert!(help.contains(&format!("\n  {}", kind.name)), "{} is missing", kind.name);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn an_interrupt_ends_it_in_peace_and_removes_the_device() {
    use std::time::Duration;
    let link = std::env::temp_dir().join(format!("kehai-{}-cli", std::process::id()));
    let _ = std::fs::remove_file(&link);
    let mut child = Command::new(env!("CARGO_BIN_EXE_kehai-sim"))
        .args(["sensor", "--model", "urg-04lx", "--pty"])
        .arg(&link)
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the program runs");
    for _ in 0..400 {
        if link.exists() {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(link.exists(), "the device appears");
    let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(interrupted.expect("kill runs").success());
    let status = child.wait().expect("it ends");
    assert!(status.success(), "{status}");
    assert!(std::fs::symlink_metadata(&link).is_err(), "the device is gone");
}
