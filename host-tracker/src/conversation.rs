//! The host's side of the conversation with one module, as a tracker has it.
//!
//! ```text
//!   subscribe ─▶ cookie ─▶ subscribe, T1, every second ─▶ subscribed: T1, T2, T3
//!       a new place, start or setup ─▶ info?      another background version ─▶ profile?
//!       parts that do not come within a second ─▶ asked for again
//! ```
//!
//! It does no I/O: what comes in and the time go in, datagrams to send come out.

use kehai::wire::{Cookie, DATAGRAM_MAX, Identity, Message, ModuleId, Refusal, Request};

/// Between two renewals, and before anything is asked for again.
const AGAIN_US: u64 = 1_000_000;

/// The host's side of the conversation with one module.
#[derive(Debug)]
pub struct Conversation {
    module: ModuleId,
    boot: u32,
    cookie: Cookie,
    next_id: u32,
    /// Whether it wants reports, or just to know who is there.
    subscribes: bool,
    renew_us: u64,
    /// Of the last info, and of the newest report.
    told_setup: Option<u16>,
    setup: Option<u16>,
    sequence: Option<u32>,
    /// Version and parts that are there, bit i for part i, and how many there are.
    profile: (u16, u32, u8),
    version: u16,
    ask_us: u64,
}

impl Conversation {
    /// One that knows nothing but whom to ask; [`ModuleId::ANY`]: whoever answers at the address.
    #[must_use]
    pub fn new(module: ModuleId) -> Self {
        Self {
            module,
            boot: 0,
            cookie: Cookie::NONE,
            next_id: 1,
            subscribes: true,
            renew_us: 0,
            told_setup: None,
            setup: None,
            sequence: None,
            profile: (0, 0, 0),
            version: 0,
            ask_us: 0,
        }
    }

    /// Whom it talks to; [`ModuleId::ANY`] until the first answer.
    #[must_use]
    pub const fn module(&self) -> ModuleId {
        self.module
    }

    /// Whether it wants reports, and so a place among the subscribers, or just to know who is there. The former, unless
    /// told.
    pub fn subscribes(&mut self, wants: bool) {
        self.subscribes = wants;
    }

    /// Whether it wants reports.
    #[must_use]
    pub const fn is_subscribing(&self) -> bool {
        self.subscribes
    }

    /// A datagram that has arrived; `send` takes the answers to it.
    pub fn receive(&mut self, now_us: u64, datagram: &[u8], mut send: impl FnMut(&[u8])) {
        let Ok((header, message)) = Message::decode(datagram) else { return };
        let Identity { module, boot } = header.identity;
        if self.module == ModuleId::ANY {
            self.module = module;
        }
        // A late datagram of an earlier start says nothing any more.
        if module != self.module || boot < self.boot {
            return;
        }
        if boot > self.boot {
            let (next_id, subscribes) = (self.next_id, self.subscribes);
            *self = Self { boot, next_id, subscribes, ..Self::new(self.module) };
        }
        match message {
            Message::Cookie { cookie, .. } if cookie != self.cookie => {
                self.cookie = cookie;
                self.renew(now_us, &mut send);
            }
            Message::Refused(refused) if refused.refusal == Refusal::BadCookie => self.cookie = Cookie::NONE,
            Message::Info(info) => {
                self.told_setup = Some(info.setup);
                // Now the profile. But an info that is late, or early, is asked for again in its time only: as
                // fast as answers come would be without end.
                if self.knows_setup() {
                    self.ask_us = now_us;
                }
            }
            Message::Report(report) if self.sequence.is_none_or(|last| report.head.sequence > last) => {
                self.sequence = Some(report.head.sequence);
                self.setup = Some(report.head.setup);
                self.version = report.head.background_version;
            }
            Message::ProfilePart(part) => {
                let version = part.head.object as u16;
                if self.profile.0 != version {
                    self.profile = (version, 0, part.head.parts);
                }
                self.profile.1 |= 1u32.checked_shl(part.head.part.into()).unwrap_or(0);
            }
            _ => {}
        }
        self.poll(now_us, send);
    }

    /// Does what is due.
    pub fn poll(&mut self, now_us: u64, mut send: impl FnMut(&[u8])) {
        if now_us >= self.renew_us {
            self.renew(now_us, &mut send);
        }
        if self.cookie == Cookie::NONE || now_us < self.ask_us || !self.subscribes {
            return;
        }
        // A background means nothing to somebody who does not know where the beams point.
        if !self.knows_setup() {
            self.ask_us = now_us + AGAIN_US;
            return self.ask(Request::Info, &mut send);
        }
        let missing = self.missing();
        if self.version != 0 && missing != Some(0) {
            self.ask_us = now_us + AGAIN_US;
            self.ask(Request::Profile { version: self.version, parts: missing.unwrap_or(0) }, &mut send);
        }
    }

    /// When [`poll`](Self::poll) has something to do next.
    #[must_use]
    pub fn next_us(&self) -> u64 {
        let waits =
            self.subscribes && (!self.knows_setup() || (self.version != 0 && self.missing() != Some(0)));
        if self.cookie != Cookie::NONE && waits { self.renew_us.min(self.ask_us) } else { self.renew_us }
    }

    /// Whether the last info describes what the newest report was measured with; before any report, whether
    /// there was an info at all.
    fn knows_setup(&self) -> bool {
        self.told_setup.is_some() && (self.setup.is_none() || self.setup == self.told_setup)
    }

    /// The parts of the profile in use that are missing; None: all.
    fn missing(&self) -> Option<u32> {
        let (version, there, parts) = self.profile;
        let all = 1u32.checked_shl(parts.into()).unwrap_or(0).wrapping_sub(1);
        (version == self.version).then_some(all & !there)
    }

    fn renew(&mut self, now_us: u64, send: &mut impl FnMut(&[u8])) {
        self.renew_us = now_us + AGAIN_US;
        if self.cookie != Cookie::NONE && !self.subscribes {
            return self.ask(Request::Info, send);
        }
        self.ask(Request::Subscribe { t1: now_us.to_le_bytes() }, send);
    }

    fn ask(&mut self, request: Request<'_>, send: &mut impl FnMut(&[u8])) {
        let mut datagram = [0; DATAGRAM_MAX];
        let to = Identity { module: self.module, boot: self.boot };
        let length = request.encode(to, self.next_id, self.cookie, &mut datagram).unwrap_or(0);
        self.next_id += 1;
        send(datagram.get(..length).unwrap_or(&[]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai::wire::Info;

    const MODULE: ModuleId = ModuleId([2, 0, 0, 0, 0, 1]);

    fn datagram(message: &Message<'_>) -> Vec<u8> {
        let mut bytes = [0; DATAGRAM_MAX];
        let length = message.encode(Identity { module: MODULE, boot: 1 }, &mut bytes).unwrap();
        bytes[..length].to_vec()
    }

    fn info(setup: u16) -> Vec<u8> {
        datagram(&Message::Info(Info {
            request_id: 1,
            version_min: 1,
            version_max: 1,
            firmware: "",
            build: "",
            board: "",
            name: "",
            uptime_us: 0,
            setup,
            background_version: 0,
            sensor: None,
        }))
    }

    /// What is sent when each of `datagrams` comes at once.
    fn sent(conversation: &mut Conversation, now_us: u64, datagrams: &[Vec<u8>]) -> usize {
        let mut sent = 0;
        for datagram in datagrams {
            conversation.receive(now_us, datagram, |_| sent += 1);
        }
        sent
    }

    #[test]
    fn an_info_before_the_first_report_is_enough_and_asked_for_no_more() {
        let mut conversation = Conversation::new(MODULE);
        let cookie = datagram(&Message::Cookie { request_id: 1, t1: [0; 8], cookie: Cookie([7; 8]) });
        assert_eq!(sent(&mut conversation, 1000, &[cookie]), 2, "subscribe with the cookie, info");
        assert_eq!(sent(&mut conversation, 1000, &[info(1), info(1), info(1)]), 0);
        assert!(conversation.next_us() > 1000);
    }
}
