//! Requests: the permissions of hosts, and the actions of the module.
//!
//! ```text
//!   datagram ─▶ guard ─▶ readable? ─▶ for this module, this start? ─▶ subscribe ──▶ cookie │ place │ Full
//!     └─────────┴ counted, dropped       └ refused by name           all others ─▶ cookie fits?
//!                                                               came before? ─▶ the stored answer
//!                                                               may control? ─▶ done │ refused
//! ```

use core::net::SocketAddrV4;

use super::answers::{Answer, RequestKey};
use super::guard::Admitted;
use super::subscribers::LEASE_US;
use super::{Change, ImageWork, Module, Pending, text};
use crate::background::{Absorb, LearnRequest, Learning};
use crate::link::Outbox;
use crate::seal::handshake::OPEN;
use crate::seal::keyring::BadKeys;
use crate::seal::{Holder, Role};
use crate::wire::{
    Counter, EventKind, IDENTIFY_MAX_S, Incoming, Info, Message, Refusal, Request, Subscribed, VERSION,
    VERSION_MIN,
};

impl<const BEAMS: usize> Module<BEAMS> {
    /// Handles a datagram that came from `from` at `now_us`, and answers it.
    ///
    /// A sealed datagram is opened in its place. What an image's piece asks of flash is returned, to be done with this
    /// datagram and reported by [`image_done`](Self::image_done); dropped, its host is never answered and asks again.
    pub fn receive(
        &mut self,
        from: SocketAddrV4,
        datagram: &mut [u8],
        now_us: u64,
        out: &mut impl Outbox,
    ) -> Option<ImageWork> {
        let mut work = None;
        self.subscribers.expire(now_us, &mut self.counters);
        self.lanes.choose(*from.ip(), now_us, &mut self.counters, out);
        match self.guard.admit(datagram, (from, &self.cookies), self.identity, now_us) {
            Admitted::Request(by) => match Incoming::open(datagram) {
                Ok(incoming) => {
                    let begin = datagram.as_ptr().addr();
                    let key = RequestKey::of(from, by, &incoming);
                    work = self.answer(key, (&incoming, begin), now_us, out);
                }
                Err(unreadable) => self.counters.count(unreadable.counter()),
            },
            Admitted::Opened(answer) => {
                self.counters.count(Counter::SessionsOpened);
                self.lanes.send(from, &answer, &mut self.counters, out);
            }
            Admitted::Refused(open, refusal) => {
                let key = RequestKey { from, kind: OPEN, request_id: open.request_id, by: Holder::Nothing };
                self.refuse(key, refusal, out);
            }
            Admitted::Dropped(counter) => self.counters.count(counter),
        }
        self.publish_health(now_us, out);
        work
    }

    /// Answers a request in a datagram that begins at this address.
    fn answer(
        &mut self,
        key: RequestKey,
        (incoming, begin): (&Incoming<'_>, usize),
        now_us: u64,
        out: &mut impl Outbox,
    ) -> Option<ImageWork> {
        let place = |bytes: &[u8]| {
            let from = bytes.as_ptr().addr().wrapping_sub(begin);
            from..from.saturating_add(bytes.len())
        };
        let from = key.from;
        let request = match incoming.request(self.identity) {
            Ok(request) => request,
            Err(refusal) => {
                self.refuse(key, refusal, out);
                return None;
            }
        };
        let has_cookie = self.cookies.fits(incoming.cookie, from);
        let is_heard = self.is_heard(key.by);
        if has_cookie && is_heard && self.addressing.host_answered() {
            self.addressing_to_store = true;
        }
        match request {
            Request::Subscribe { t1 } if !has_cookie => {
                self.counters.count(Counter::CookiesGiven);
                let cookie = self.cookies.cookie(from);
                self.send_answer(key, &Message::Cookie { request_id: key.request_id, t1, cookie }, out);
            }
            _ if !has_cookie => self.refuse(key, Refusal::BadCookie, out),
            Request::Info => self.send_info(key, now_us, out),
            _ if !is_heard => self.refuse(key, Refusal::NeedsKey, out),
            _ if !self.may(key, &request) => self.refuse(key, Refusal::NotAllowed, out),
            Request::Subscribe { .. } if !incoming.speaks_our_version() => {
                self.refuse(key, Refusal::VERSION, out);
            }
            Request::Subscribe { t1 } => self.subscribe(key, t1, now_us, out),
            Request::GetSettings => {
                let text = self.settings.text();
                let message = Message::Settings { request_id: key.request_id, text: &text };
                self.send_answer(key, &message, out);
            }
            Request::Profile { version, parts } => {
                if let Err(refusal) = self.want_profile(from, version, parts) {
                    self.refuse(key, refusal, out);
                }
            }
            Request::RawAgain { object, parts } => {
                if let Err(refusal) = self.raw_again(from, (object, parts), now_us, out) {
                    self.refuse(key, refusal, out);
                }
            }
            Request::Update { manifest } => {
                let wish = self.update(manifest, place(manifest));
                return self.image_wish(key, wish, out);
            }
            Request::UpdateChunk { offset, bytes } => {
                let wish = self.update_chunk(offset, place(bytes));
                return self.image_wish(key, wish, out);
            }
            Request::UpdateInstall => {
                let wish = self.update_install();
                return self.image_wish(key, wish, out);
            }
            _ => self.once(key, request, now_us, out),
        }
        None
    }

    /// Carries out a request that changes something, unless it has been.
    fn once(&mut self, key: RequestKey, request: Request<'_>, now_us: u64, out: &mut impl Outbox) {
        if let Some(answer) = self.answers.of(key) {
            self.counters.count(Counter::RequestsRepeated);
            if let Some(message) = answer.message(key) {
                self.send_answer(key, &message, out);
            }
            return;
        }
        match self.carry_out(key, request, now_us) {
            // The answer is not kept, so that the host can ask again.
            Err(Refusal::Busy) => self.refuse(key, Refusal::Busy, out),
            Err(refusal) => {
                self.answers.keep(key, Answer::Refused(refusal));
                self.refuse(key, refusal, out);
            }
            Ok(answer) => {
                self.answers.keep(key, answer);
                if let Some(message) = answer.message(key) {
                    self.send_answer(key, &message, out);
                }
            }
        }
    }

    fn carry_out(&mut self, key: RequestKey, request: Request<'_>, now_us: u64) -> Result<Answer, Refusal> {
        match request {
            Request::SetSettings { text } => self.set(key, text),
            Request::SetKeys { keys } => self.set_keys(key, keys),
            Request::Learn { scans } => self.learn(key, scans, now_us),
            Request::Absorb(wish) => self.absorb(key, wish, now_us),
            Request::Raw { seconds } => {
                let subscriber = self.subscribers.of(key.from).ok_or(Refusal::BadCookie)?;
                subscriber.raw_until_us = now_us.saturating_add(u64::from(seconds) * 1_000_000);
                Ok(Answer::Done)
            }
            Request::Identify { seconds } => {
                let us = u64::from(seconds.min(IDENTIFY_MAX_S)) * 1_000_000;
                self.identify_until_us = now_us.saturating_add(us);
                Ok(Answer::Done)
            }
            Request::Restart => {
                self.restarting = true;
                self.event(EventKind::Restarting, key, now_us);
                Ok(Answer::Done)
            }
            _ => Err(Refusal::Unsupported),
        }
    }

    /// Settings are answered once they are stored.
    fn set(&mut self, key: RequestKey, text: &str) -> Result<Answer, Refusal> {
        if self.pending.is_some() || self.storing {
            return Err(Refusal::Busy);
        }
        let settings = self
            .settings
            .changed_by(text)
            .map_err(|bad| Refusal::Setting { line: bad.line, fault: bad.fault })?;
        if settings == self.settings {
            return Ok(Answer::Done);
        }
        self.pending = Some(Pending { change: Change::Settings(settings), key });
        Ok(Answer::Pending)
    }

    /// Keys are answered once they are stored.
    fn set_keys(&mut self, key: RequestKey, keys: &[u8]) -> Result<Answer, Refusal> {
        if self.pending.is_some() || self.storing {
            return Err(Refusal::Busy);
        }
        let keyring = self.guard.keyring().with(keys).map_err(|BadKeys| Refusal::BadKeys)?;
        self.pending = Some(Pending { change: Change::Keys(keyring), key });
        Ok(Answer::Pending)
    }

    fn learn(&mut self, key: RequestKey, scans: u16, now_us: u64) -> Result<Answer, Refusal> {
        if self.storing {
            return Err(Refusal::Busy);
        }
        let scans = if scans == 0 { self.settings.learn_scans } else { scans };
        self.pipeline.learn(LearnRequest { scans, even_if_moving: false })?;
        self.observed.learning = Learning::Running { scans: 0, of: scans, restarts: 0, moved: None };
        self.event(EventKind::LearnStarted, key, now_us);
        Ok(Answer::Done)
    }

    fn absorb(&mut self, key: RequestKey, wish: Absorb, now_us: u64) -> Result<Answer, Refusal> {
        if self.storing {
            return Err(Refusal::Busy);
        }
        let beams = self.pipeline.absorb(wish)?;
        self.background_to_store = true;
        self.event(EventKind::Absorbed, key, now_us);
        Ok(Answer::Absorbed { beams, background_version: self.pipeline.background().version() })
    }

    pub(super) fn event(&mut self, kind: EventKind, by: RequestKey, now_us: u64) {
        self.events.add(now_us, kind, self.pipeline.background().version(), by.from.ip().octets());
    }

    /// Whether a host that asks by this right is listened to at all: once there are keys, only by one of them.
    fn is_heard(&self, by: Holder) -> bool {
        by != Holder::Nothing || !self.guard.keyring().is_claimed()
    }

    /// Whether a host that is heard may ask this. Without keys its address decides: any host may control, until some are
    /// listed. Keys are never set in clear, and images never taken.
    fn may(&self, key: RequestKey, request: &Request<'_>) -> bool {
        let sets_keys = matches!(request, Request::SetKeys { .. });
        let is_image =
            matches!(request, Request::Update { .. } | Request::UpdateChunk { .. } | Request::UpdateInstall);
        match key.by {
            Holder::Key(Role::Label) => sets_keys,
            Holder::Key(role) => role >= request.needs(),
            Holder::Nothing => {
                !sets_keys && !is_image && (request.needs() <= Role::Read || self.may_control(key.from))
            }
        }
    }

    fn may_control(&self, from: SocketAddrV4) -> bool {
        self.settings.hosts.is_empty() || self.settings.hosts.contains(from.ip())
    }

    /// Ends the raw scans of hosts that may not have them any more.
    pub(super) fn withdraw_raw(&mut self) {
        let hosts = &self.settings.hosts;
        if hosts.is_empty() || self.guard.keyring().is_claimed() {
            return;
        }
        for subscriber in self.subscribers.iter_mut().filter(|subscriber| !hosts.contains(subscriber.at.ip()))
        {
            subscriber.raw_until_us = 0;
        }
    }

    fn subscribe(&mut self, key: RequestKey, t1: [u8; 8], now_us: u64, out: &mut impl Outbox) {
        if self.subscribers.renew(key.from, now_us, out).is_err() {
            return self.refuse(key, Refusal::Full, out);
        }
        let subscribed = Subscribed {
            request_id: key.request_id,
            t1,
            t2_us: now_us,
            t3_us: now_us,
            lease_ms: (LEASE_US / 1000) as u16,
            may_control: self.may(key, &Request::Restart),
            subscribers: self.subscribers.len(),
        };
        self.send_answer(key, &Message::Subscribed(subscribed), out);
    }

    /// To a host that is not heard it says who it is, and no more.
    fn send_info(&mut self, key: RequestKey, now_us: u64, out: &mut impl Outbox) {
        let host_name = text::host_name(self.identity.module);
        let name: &str = if self.settings.name.is_empty() { &host_name } else { &self.settings.name };
        let stranger = Info {
            request_id: key.request_id,
            version_min: VERSION_MIN,
            version_max: VERSION,
            firmware: "",
            build: "",
            board: "",
            name,
            uptime_us: 0,
            setup: 0,
            background_version: 0,
            sensor: None,
        };
        let about = self.about;
        let info = if self.is_heard(key.by) {
            Info {
                firmware: about.firmware,
                build: about.build,
                board: about.board,
                uptime_us: now_us,
                setup: self.setup.number(),
                background_version: self.pipeline.background().version(),
                sensor: self.setup.info(self.pipeline.settings().open_range_mm),
                ..stranger
            }
        } else {
            stranger
        };
        let length = Message::Info(info).encode(self.identity, &mut self.datagram).unwrap_or(0);
        self.send_encoded(key, length, out);
    }

    pub(super) fn refuse(&mut self, key: RequestKey, refusal: Refusal, out: &mut impl Outbox) {
        self.counters.count(refusal.counter());
        if let Some(message) = Answer::Refused(refusal).message(key) {
            self.send_answer(key, &message, out);
        }
    }

    /// Sends an answer as its request came: sealed, or in clear.
    pub(super) fn send_answer(&mut self, to: RequestKey, message: &Message<'_>, out: &mut impl Outbox) {
        let length = message.encode(self.identity, &mut self.datagram).unwrap_or(0);
        self.send_encoded(to, length, out);
    }

    fn send_encoded(&mut self, to: RequestKey, length: usize, out: &mut impl Outbox) {
        let datagram = self.datagram.get(..length).unwrap_or(&[]);
        match to.by {
            Holder::Nothing => self.lanes.send(to.from, datagram, &mut self.counters, out),
            Holder::Key(_) => {
                self.lanes.send(to.from, datagram, &mut self.counters, &mut self.guard.over(out));
            }
        }
    }
}
