//! A recorded exchange for authors of other implementations, and the one in Python that opens it.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use kehai::seal::Key;
use kehai::wire::{DATAGRAM_MAX, Identity, Request};

use super::{ID, Program, Role, Sent, claimed, key};

pub fn project() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn file() -> PathBuf {
    project().join("tests/data/seal/exchange.txt")
}

/// The exchange, as its file has it: the same bytes each time.
fn exchange() -> String {
    let mut module = claimed();
    let mut own = Program::of(5000, Role::Control);
    let (id, Key(role_key)) = key(Role::Control);
    let mut rows = vec![("role_key", role_key.to_vec()), ("key_id", vec![id])];
    for _ in 0..4 {
        let request = own.sealed(Request::GetSettings);
        let mut sent = Sent::default();
        module.receive(own.at, &mut request.clone(), own.now_us, &mut sent);
        let answers: Vec<Vec<u8>> = sent.0.into_iter().map(|(_, bytes)| bytes).collect();
        let opened: Vec<_> = answers.iter().filter_map(|bytes| own.opened(bytes)).collect();
        match (request[14], request[15]) {
            (0x0b, _) => rows.extend([("open", request), ("opened", answers[0].clone())]),
            (_, 0) => {}
            _ => {
                let mut clear = [0; DATAGRAM_MAX];
                let to = Identity { module: ID, boot: 3 };
                let length = Request::GetSettings.encode(to, own.requests, own.cookie, &mut clear).unwrap();
                rows.extend([("request_sealed", request), ("request", clear[..length].to_vec())]);
                rows.extend([("message_sealed", answers[0].clone()), ("message", opened[0].clone())]);
                break;
            }
        }
        answers.iter().for_each(|bytes| own.take(bytes));
    }
    let mut text = String::from("# A session of module 02:00:00:00:00:01, start 3: docs/wire.md, Keys.\n");
    for (name, bytes) in rows {
        let digits: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        writeln!(text, "{name} {digits}").unwrap();
    }
    text
}

#[test]
fn the_recorded_exchange_has_its_bytes() {
    let text = exchange();
    if !file().exists() && std::env::var_os("KEHAI_WRITE_GOLDEN").is_some() {
        std::fs::create_dir_all(file().parent().unwrap()).unwrap();
        std::fs::write(file(), &text).unwrap();
    }
    assert_eq!(std::fs::read_to_string(file()).unwrap(), text, "the sealed wire has changed");
    for name in ["open", "opened", "request_sealed", "request", "message_sealed", "message"] {
        assert!(text.contains(&format!("\n{name} ")), "{name}");
    }
}

/// Python with `cryptography`: `./ci.sh test` installs it.
pub fn python() -> Option<Command> {
    let name = std::env::var("KEHAI_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let has_it = Command::new(&name).args(["-c", "import cryptography"]).output();
    if !has_it.is_ok_and(|output| output.status.success()) {
        test_support::fail_in_ci_else_skip("no python3 with the package cryptography");
        return None;
    }
    Some(Command::new(name))
}

#[test]
fn python_opens_the_recorded_exchange_and_nothing_else() {
    let (Some(mut right), Some(mut wrong)) = (python(), python()) else { return };
    let script = project().join("examples/python/kehai_seal.py");
    let output = right.arg(&script).arg("--check").arg(file()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let other = std::env::temp_dir().join(format!("kehai-exchange-{}.txt", std::process::id()));
    let text = std::fs::read_to_string(file()).unwrap();
    std::fs::write(&other, text.replace("role_key 0d", "role_key 0e")).unwrap();
    let output = wrong.arg(&script).arg("--check").arg(&other).output().unwrap();
    std::fs::remove_file(&other).unwrap();
    assert!(!output.status.success());
    let line = String::from_utf8(output.stderr).unwrap();
    assert!(line.contains("does not open: open, opened, request, message"), "{line}");
}
