//! The log-in with any texts and times: no panic, no more tries than are allowed, no session that is over, and no user
//! who was not let in.
//!
//! ```text
//!   input:  step │ step │ …                   a step is a byte, and what it needs
//!   step:   a header │ a file of users │ a try of an address │ a right one │ a session shown │ time goes on
//! ```
//!
//! The daemon's own files, without the daemon: it would take minutes to build.
#![no_main]

use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use access::attempts::Attempts;
use access::credential::Credential;
use access::directory::Directory;
use access::secret::fingerprint;
use access::sessions::{LASTS_US, Sessions};
use libfuzzer_sys::fuzz_target;

#[path = "../../host-tracker/src/named.rs"]
mod named;
#[path = "../../host-tracker/src/access"]
#[allow(dead_code, reason = "the daemon uses the rest")]
mod access {
    pub mod attempts;
    pub mod credential;
    pub mod directory;
    pub mod password;
    pub mod roles;
    pub mod secret;
    pub mod sessions;
}

/// Tries of one address at once, and what it gets back after: docs/security.md.
const BURST: u64 = 10;
const EVERY_US: u64 = 30_000_000;

fn address(byte: u8) -> IpAddr {
    match byte % 8 {
        // Two of one /64.
        0 => Ipv6Addr::new(0xfd00, 0, 0, 1, 0, 0, 0, 1).into(),
        1 => Ipv6Addr::new(0xfd00, 0, 0, 1, 9, 9, 9, 9).into(),
        other => Ipv4Addr::new(10, 0, 0, other).into(),
    }
}

/// Whose tries are counted together.
fn whose(byte: u8) -> u8 {
    if byte % 8 == 1 { 0 } else { byte % 8 }
}

fn text<'a>(rest: &mut &'a [u8]) -> &'a str {
    let length = rest.first().map_or(0, |length| usize::from(*length));
    let (taken, left) = rest.split_at((1 + length).min(rest.len()));
    *rest = left;
    let taken = taken.get(1..).unwrap_or(&[]);
    std::str::from_utf8(taken).unwrap_or("")
}

fuzz_target!(|input: &[u8]| {
    let (mut attempts, mut sessions, mut now_us) = (Attempts::default(), Sessions::default(), 0_u64);
    // When each address's tries were compared, and when each session began.
    let (mut compared, mut begun) = (BTreeMap::<u8, Vec<u64>>::new(), BTreeMap::<String, u64>::new());
    let mut rest = input;
    while let Some((step, left)) = rest.split_first() {
        rest = left;
        match step % 6 {
            0 => {
                let (authorization, cookie) = (text(&mut rest), text(&mut rest));
                let shown = (!authorization.is_empty()).then_some(authorization);
                match Credential::of(shown, [cookie], "__Host-kehai-session") {
                    Credential::None => {}
                    Credential::Token(token) => assert!(shown.is_some_and(|shown| shown.contains(&token))),
                    Credential::Session(session) => assert!(shown.is_none() && cookie.contains(&session)),
                }
            }
            1 => {
                if let Ok(directory) = toml::from_str::<Directory>(text(&mut rest)) {
                    let _ = directory.check();
                    assert!(directory.user("no such user").is_none());
                }
            }
            2 | 3 => {
                let byte = rest.first().copied().unwrap_or(0);
                rest = rest.get(1..).unwrap_or(&[]);
                if attempts.begin(address(byte), now_us).is_ok() {
                    let is_right = step % 6 == 3;
                    let tries = compared.entry(whose(byte)).or_default();
                    if is_right {
                        attempts.was_right(address(byte));
                        let session = format!("{now_us}-{byte}");
                        sessions.begin(fingerprint(&session), &format!("user {}", byte % 3), "", now_us);
                        begun.insert(session, now_us);
                    } else {
                        tries.push(now_us);
                        // In no span of time more than the burst and what has come back meanwhile.
                        for (number, first_us) in tries.iter().enumerate() {
                            let span_us = now_us - first_us;
                            let count = (tries.len() - number) as u64;
                            assert!(count <= BURST + span_us / EVERY_US + 1, "{count} within {span_us} us");
                        }
                    }
                }
            }
            4 => {
                let number = rest.first().map_or(0, |byte| usize::from(*byte));
                rest = rest.get(1..).unwrap_or(&[]);
                if let Some((session, from_us)) = begun.iter().nth(number) {
                    let lasts = sessions.get(&fingerprint(session), now_us).is_some();
                    assert!(!lasts || now_us - from_us < LASTS_US, "it is over");
                }
                assert!(sessions.get(&fingerprint(text(&mut rest)), now_us).is_none_or(|_| !begun.is_empty()));
            }
            _ => {
                let (head, left) = rest.split_at(rest.len().min(3));
                rest = left;
                let units = head.iter().fold(0_u64, |sum, byte| sum << 8 | u64::from(*byte));
                now_us = now_us.saturating_add(units * 10_000);
            }
        }
    }
});
