//! Requests: the permissions of hosts, and the actions of the module.
//!
//! ```text
//!   datagram ─▶ readable? ─▶ for this module, this start? ─▶ subscribe ──▶ cookie │ place │ Full
//!     └ counted, dropped       └ refused by name              all others ─▶ cookie fits?
//!                                                               came before? ─▶ the stored answer
//!                                                               may control? ─▶ done │ refused
//! ```

use core::net::SocketAddrV4;

use super::answers::{Answer, RequestKey};
use super::subscribers::LEASE_US;
use super::{Module, PendingSettings, text};
use crate::background::{Absorb, LearnRequest, Learning};
use crate::link::Outbox;
use crate::wire::{
    Counter, EventKind, Incoming, Info, Message, Refusal, Request, Subscribed, VERSION, VERSION_MIN,
};

impl<const BEAMS: usize> Module<BEAMS> {
    /// Handles a datagram that came from `from` at `now_us`, and answers it.
    pub fn receive(&mut self, from: SocketAddrV4, datagram: &[u8], now_us: u64, out: &mut impl Outbox) {
        self.subscribers.expire(now_us, &mut self.counters);
        self.lanes.choose(*from.ip(), now_us, &mut self.counters, out);
        match Incoming::open(datagram) {
            Ok(incoming) => self.answer(from, &incoming, now_us, out),
            Err(unreadable) => self.counters.count(unreadable.counter()),
        }
        self.publish_health(now_us, out);
    }

    fn answer(&mut self, from: SocketAddrV4, incoming: &Incoming<'_>, now_us: u64, out: &mut impl Outbox) {
        let key = RequestKey::of(from, incoming);
        let request = match incoming.request(self.identity) {
            Ok(request) => request,
            Err(refusal) => return self.refuse(key, refusal, out),
        };
        let has_cookie = self.cookies.fits(incoming.cookie, from);
        if has_cookie && self.addressing.host_answered() {
            self.addressing_to_store = true;
        }
        match request {
            Request::Subscribe { t1 } if !has_cookie => {
                self.counters.count(Counter::CookiesGiven);
                let cookie = self.cookies.cookie(from);
                self.send_answer(from, &Message::Cookie { request_id: key.request_id, t1, cookie }, out);
            }
            _ if !has_cookie => self.refuse(key, Refusal::BadCookie, out),
            Request::Subscribe { .. } if !incoming.speaks_our_version() => {
                self.refuse(key, Refusal::VERSION, out);
            }
            Request::Subscribe { t1 } => self.subscribe(key, t1, now_us, out),
            Request::Info => self.send_info(key, now_us, out),
            Request::GetSettings => {
                let text = self.settings.text();
                let message = Message::Settings { request_id: key.request_id, text: &text };
                self.send_answer(from, &message, out);
            }
            Request::Profile { version, parts } => {
                if let Err(refusal) = self.want_profile(from, version, parts) {
                    self.refuse(key, refusal, out);
                }
            }
            Request::RawAgain { .. } if !self.may_control(from) => self.refuse(key, Refusal::NotAllowed, out),
            Request::RawAgain { object, parts } => {
                if let Err(refusal) = self.raw_again(from, (object, parts), now_us, out) {
                    self.refuse(key, refusal, out);
                }
            }
            _ => self.once(key, request, now_us, out),
        }
    }

    /// Carries out a request that changes something, unless it has been.
    fn once(&mut self, key: RequestKey, request: Request<'_>, now_us: u64, out: &mut impl Outbox) {
        if let Some(answer) = self.answers.of(key) {
            self.counters.count(Counter::RequestsRepeated);
            if let Some(message) = answer.message(key) {
                self.send_answer(key.from, &message, out);
            }
            return;
        }
        let result = if request.controls() && !self.may_control(key.from) {
            Err(Refusal::NotAllowed)
        } else {
            self.carry_out(key, request, now_us)
        };
        match result {
            // The answer is not kept, so that the host can ask again.
            Err(Refusal::Busy) => self.refuse(key, Refusal::Busy, out),
            Err(refusal) => {
                self.answers.keep(key, Answer::Refused(refusal));
                self.refuse(key, refusal, out);
            }
            Ok(answer) => {
                self.answers.keep(key, answer);
                if let Some(message) = answer.message(key) {
                    self.send_answer(key.from, &message, out);
                }
            }
        }
    }

    fn carry_out(&mut self, key: RequestKey, request: Request<'_>, now_us: u64) -> Result<Answer, Refusal> {
        match request {
            Request::SetSettings { text } => self.set(key, text),
            Request::Learn { scans } => self.learn(key, scans, now_us),
            Request::Absorb(wish) => self.absorb(key, wish, now_us),
            Request::Raw { seconds } => {
                let subscriber = self.subscribers.of(key.from).ok_or(Refusal::BadCookie)?;
                subscriber.raw_until_us = now_us.saturating_add(u64::from(seconds) * 1_000_000);
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
        if self.pending_settings.is_some() || self.storing {
            return Err(Refusal::Busy);
        }
        let settings = self
            .settings
            .changed_by(text)
            .map_err(|bad| Refusal::Setting { line: bad.line, fault: bad.fault })?;
        if settings == self.settings {
            return Ok(Answer::Done);
        }
        self.pending_settings = Some(PendingSettings { settings, key });
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

    /// Whether the host at this address may set, learn, absorb, restart and get raw scans: each, until some are listed.
    fn may_control(&self, from: SocketAddrV4) -> bool {
        self.settings.hosts.is_empty() || self.settings.hosts.contains(from.ip())
    }

    /// Ends the raw scans of hosts that may not have them any more.
    pub(super) fn withdraw_raw(&mut self) {
        let hosts = &self.settings.hosts;
        if hosts.is_empty() {
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
            may_control: self.may_control(key.from),
            subscribers: self.subscribers.len(),
        };
        self.send_answer(key.from, &Message::Subscribed(subscribed), out);
    }

    fn send_info(&mut self, key: RequestKey, now_us: u64, out: &mut impl Outbox) {
        let host_name = text::host_name(self.identity.module);
        let about = self.about;
        let info = Info {
            request_id: key.request_id,
            version_min: VERSION_MIN,
            version_max: VERSION,
            firmware: about.firmware,
            build: about.build,
            board: about.board,
            name: if self.settings.name.is_empty() { &host_name } else { &self.settings.name },
            uptime_us: now_us,
            setup: self.setup.number(),
            background_version: self.pipeline.background().version(),
            sensor: self.setup.info(self.pipeline.settings().open_range_mm),
        };
        let encoded = Message::Info(info).encode(self.identity, &mut self.datagram);
        let datagram = encoded.ok().and_then(|length| self.datagram.get(..length)).unwrap_or(&[]);
        self.lanes.send(key.from, datagram, &mut self.counters, out);
    }

    pub(super) fn refuse(&mut self, key: RequestKey, refusal: Refusal, out: &mut impl Outbox) {
        self.counters.count(refusal.counter());
        if let Some(message) = Answer::Refused(refusal).message(key) {
            self.send_answer(key.from, &message, out);
        }
    }

    pub(super) fn send_answer(&mut self, to: SocketAddrV4, message: &Message<'_>, out: &mut impl Outbox) {
        let encoded = message.encode(self.identity, &mut self.datagram);
        let datagram = encoded.ok().and_then(|length| self.datagram.get(..length)).unwrap_or(&[]);
        self.lanes.send(to, datagram, &mut self.counters, out);
    }
}
