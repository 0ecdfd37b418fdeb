//! A module, a host that asks it, and others that forge: a row of bytes decides what happens. Whatever they say, what is
//! not seen is not known, and a module that has run undisturbed for ten seconds is heard.
//!
//! ```text
//!   byte 0–8    a tenth of a second: requests, true answers, a true report
//!   9 │ 10      a forged report of the believed start, far ahead │ of any start
//!   11 │ 12     a forged exchange │ cookie and info
//!   13 │ 14 │ 15   the module's clock jumps │ it starts anew, or from 0 │ both are silent for up to 5 s
//! ```

use std::sync::Arc;

use kehai::wire::{Cookie, Incoming, Message, Refused, Request};
use kehai_tracking::follower::Follower;
use kehai_tracking::jsonl::ZoneKnown;
use kehai_tracking::session::subscription::Subscription;
use kehai_tracking::tracker::Ideas;

use super::fake::{Fake, SITE, id};

const SECOND_US: u64 = 1_000_000;

/// After so many tenths without a change of its own a module is heard, whatever others say.
const STEADY: u32 = 100;

struct Bench {
    follower: Follower,
    left: Fake,
    now_us: u64,
    used_us: Option<u64>,
    steady: u32,
}

impl Bench {
    fn hear(&mut self, bytes: &[u8]) -> bool {
        let sessions = self.follower.sessions_mut();
        let Some(datagram) = sessions.decode(bytes) else { return false };
        sessions.admit(&datagram, self.now_us) && self.follower.follow(&datagram, self.now_us).is_some()
    }

    /// Whether the report was used.
    fn tenth(&mut self) -> bool {
        self.now_us += SECOND_US / 10;
        // An answer leads to the next request: two rounds are enough for each need.
        for _ in 0..2 {
            let mut sent = Vec::new();
            let now_us = self.now_us;
            if let Some(session) = self.follower.sessions_mut().get_mut(id(1)) {
                session.poll(now_us, |bytes| sent.push(bytes.to_vec()));
            }
            for request in sent {
                for answer in self.answers(&request) {
                    self.hear(&answer);
                }
            }
        }
        let report = self.left.report(self.now_us - SECOND_US / 10);
        self.hear(&report)
    }

    fn answers(&self, request: &[u8]) -> Vec<Vec<u8>> {
        let Ok(incoming) = Incoming::open(request) else { return Vec::new() };
        let (request_id, kind) = (incoming.request_id, incoming.header.kind);
        match incoming.request(self.left.identity) {
            Err(refusal) => vec![self.left.say(&Message::Refused(Refused { request_id, kind, refusal }))],
            Ok(Request::Subscribe { t1 }) if incoming.cookie == Cookie::NONE => {
                vec![self.left.cookie(request_id, t1)]
            }
            Ok(Request::Subscribe { t1 }) => {
                vec![self.left.subscribed(request_id, u64::from_le_bytes(t1), self.now_us)]
            }
            Ok(Request::Info) => vec![self.left.info(request_id)],
            Ok(_) => self.left.profile(),
        }
    }
}

/// Lets happen what the bytes say.
///
/// # Panics
/// What must never be is.
pub fn drive(input: &[u8]) {
    let site = Arc::new(toml::from_str(SITE).unwrap());
    let follower = Follower::new(&site, Ideas::default());
    let left = Fake { offset_us: 1 << 40, ..Fake::new(1, 5, "left") };
    let mut bench = Bench { follower, left, now_us: 10 * SECOND_US, used_us: None, steady: 0 };
    bench.follower.sessions_mut().meet(id(1), &Subscription::new(true, 7), bench.now_us);
    for step in input.chunks_exact(5) {
        let value = u32::from_le_bytes([step[1], step[2], step[3], step[4]]);
        let far = bench.left.sequence.wrapping_add(1 << 16).wrapping_add(value % (u32::MAX - (1 << 17)));
        let stamp_us = bench.left.clock_us(bench.now_us).wrapping_add(u64::from(value) << (value % 24));
        let mut forged = bench.left.clone();
        let mut is_used = false;
        match step[0] % 16 {
            0..=8 => {
                is_used = bench.tenth();
                bench.steady += 1;
                assert!(is_used || bench.steady < STEADY, "muted: {:?}", bench.follower.sessions().drops());
            }
            9 => is_used = bench.hear(&forged.reported(far, stamp_us)),
            10 => {
                forged.identity.boot = value;
                is_used = bench.hear(&forged.reported(far, stamp_us));
            }
            11 => {
                bench.hear(&forged.exchanged(value, bench.now_us - 100, stamp_us, stamp_us));
            }
            12 => {
                bench.hear(&forged.cookie(value, [0; 8]));
                forged.name = "evil";
                bench.hear(&forged.info(value));
            }
            13 => (bench.left.offset_us, bench.steady) = (i64::from(value) << 12, 0),
            14 => {
                let boot = bench.left.identity.boot;
                bench.left.identity.boot = if value % 2 == 0 { boot + 1 } else { value % 4 };
                (bench.left.sequence, bench.steady) = (0, 0);
            }
            _ => (bench.now_us, bench.steady) = (bench.now_us + u64::from(value) % (5 * SECOND_US), 0),
        }
        if is_used {
            bench.used_us = Some(bench.now_us);
        }
        let zone = bench.follower.line(bench.now_us as f64 * 1e-6).zones["area"].clone();
        let is_seen = bench.used_us.is_some_and(|used_us| bench.now_us - used_us <= 2 * SECOND_US);
        assert!(is_seen || zone.state != ZoneKnown::Known, "known, and not seen for two seconds");
        assert!(bench.follower.sessions().iter().count() <= 66, "more sessions than there may be");
    }
}
