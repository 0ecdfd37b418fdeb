//! The tracking loop: what the devices send, in the order of its arrival, and a snapshot every 0.1 s.
//!
//! ```text
//!   DNS-SD ─▶ registry ─▶ subscribe, info, profile ─▶ socket
//!   receiver ─▶ decode, once ─▶ admitted? ─▶ session ─▶ observation ─▶ tracker ─▶ tracks, zones ─▶ doors ─▶ Snapshot every 0.1 s
//!                                            └─▶ how each device is ────────────────────────────────────────┘
//! ```

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::Duration;

use crate::alarm_handle::AlarmHandle;
use crate::calibration::Calibration;
use crate::clock::HostClock;
use crate::connections::Connections;
use crate::doors::DoorHandle;
use crate::key_file::Watched;
use crate::module_id;
use crate::net::discovery::Search;
use crate::net::networks;
use crate::net::poses::Poses;
use crate::net::receiver::{self, Arrival, Receiver};
use crate::record::Recorder;
use crate::reports::{ReportLine, Reports};
use crate::scans::{Scan, Scans};
use crate::signs::SignHandle;
use crate::tracker_alarms::TrackerAlarms;
use kehai::wire::Message;
use kehai_tracking::alarm::{AlarmKind, AlarmLine};
use kehai_tracking::capacity::Capacity;
use kehai_tracking::explain::{Facts, FactsOf, Question};
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::keys::{Arrived, Links, Standing};
use kehai_tracking::now::Now;
use kehai_tracking::registry::{Networks, Registry};
use kehai_tracking::session::Input;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::snapshot::{ModuleLine, Refused, Snapshot, active_alarms, unix_ms};

/// Between two snapshots, µs.
pub const LINE_US: u64 = 100_000;

/// The host's interfaces are asked for again after so long, µs: one may come up, or get an address.
const NETWORKS_US: u64 = 1_000_000;

/// Longest wait for a datagram: a tenth of that.
const WAIT: Duration = Duration::from_millis(10);

/// Between two looks at the file of keys, µs.
const KEYS_US: u64 = 1_000_000;

/// Devices are asked what is due so often at most, µs: hundreds are looked through each time.
const POLL_US: u64 = 1000;

/// Everything that takes part in the loop beside the tracker; what is left out does nothing.
#[derive(Debug, Default)]
pub struct Parts {
    /// Records everything that comes in; the recording begins before the first snapshot.
    pub recorder: Option<Recorder>,
    /// The tracker's own alarms.
    pub alarms: TrackerAlarms,
    /// The list of all alarms.
    pub listed: AlarmHandle,
    /// HTTP connections that were refused.
    pub connections: Connections,
    /// The doors of the site.
    pub doors: Option<DoorHandle>,
    /// The calibration under way.
    pub calibration: Calibration,
    /// Listeners for every single report.
    pub reports: Reports,
    /// Listeners for what each scan saw empty.
    pub scans: Scans,
    /// Who is where.
    pub signs: Option<SignHandle>,
    /// The file of the devices' keys.
    pub keys: Option<Watched>,
}

/// Follows live devices.
pub struct TrackingLoop {
    socket: UdpSocket,
    search: Option<Search>,
    registry: Registry,
    links: Links,
    site_tracker: SiteTracker,
    poses: Poses,
    clock: HostClock,
    receiver: Receiver,
    /// Arrived after the snapshot that is due.
    pending: Option<Arrival>,
    /// Time of what was used last, µs: none is used as if it had come before a snapshot that was made without it.
    used_us: u64,
    polled_us: u64,
    /// When the file of keys is looked at next, µs.
    keys_us: u64,
    next_line_us: u64,
    /// The host's networks, and until when they are taken as they were, µs.
    networks: Networks,
    networks_until_us: u64,
    /// Datagrams from addresses that are no device of ours.
    strangers: u64,
    capacity: Capacity,
    parts: Parts,
}

/// Says whether a device speaks sealed, and raises the alarm if it is not believed.
fn stand(module: &mut ModuleLine, links: &Links) {
    let Some(device) = module_id::read(&module.id) else { return };
    match links.standing(device) {
        Standing::Sealed => module.is_sealed = true,
        Standing::InClear => {}
        Standing::NotBelieved => {
            let text = "it has no key, in a site whose modules have keys, and is not believed: kehai-tracker module claim";
            module.alarms.insert(0, AlarmLine::new(AlarmKind::NoKey, text));
        }
    }
}

impl TrackingLoop {
    /// A socket for [`new`](Self::new).
    ///
    /// # Errors
    /// None can be had.
    pub fn bind() -> io::Result<UdpSocket> {
        let socket = UdpSocket::bind("0.0.0.0:0")?;
        receiver::enlarge(&socket);
        Ok(socket)
    }

    /// Listens over a socket of [`bind`](Self::bind) to the devices of the registry, and to those that are found.
    ///
    /// # Errors
    /// There is no thread that receives.
    pub fn new(
        socket: UdpSocket,
        (registry, links): (Registry, Links),
        search: Option<Search>,
        site_tracker: SiteTracker,
        parts: Parts,
    ) -> io::Result<Self> {
        let clock = HostClock::start();
        Ok(Self {
            receiver: Receiver::start(&socket, clock)?,
            pending: None,
            used_us: 0,
            polled_us: 0,
            keys_us: 0,
            socket,
            search,
            poses: Poses::resume(registry.site(), &parts.listed.resumed()),
            registry,
            links,
            site_tracker,
            clock,
            next_line_us: LINE_US,
            networks: Networks::default(),
            networks_until_us: 0,
            strangers: 0,
            capacity: Capacity::default(),
            parts,
        })
    }

    /// Goes on with another site.
    pub fn change_site(&mut self, site: &Arc<Site>) {
        self.parts.calibration.set_site(site);
        if let Some(recorder) = &self.parts.recorder {
            recorder.told(self.now_us(), site);
        }
        if let Some(doors) = &self.parts.doors {
            doors.change_site(site);
        }
        if let Some(signs) = &self.parts.signs {
            signs.change_site(site);
        }
        self.poses = Poses::new(site);
        self.site_tracker.change_site(site);
        self.registry.change_site(site, self.site_tracker.sessions_mut());
    }

    /// µs since it began: the clock of all that follows.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        self.clock.now_us()
    }

    /// Sends what is due and uses what arrives, until the next snapshot is.
    ///
    /// # Errors
    /// The socket fails for good.
    pub fn snapshot(&mut self) -> io::Result<Snapshot> {
        loop {
            let now_us = self.now_us();
            self.ask(now_us);
            // A snapshot is due when all that arrived before it has been used.
            let arrival = match self.pending.take() {
                Some(arrival) => Some(arrival),
                None => self.receiver.next(Duration::ZERO)?,
            };
            let reached_us = arrival.as_ref().map_or(now_us, |arrival| arrival.at_us).max(self.used_us);
            if reached_us >= self.next_line_us {
                self.pending = arrival;
                let at_us = line_us(reached_us);
                self.next_line_us = at_us + LINE_US;
                self.used_us = at_us;
                return Ok(self.snapshot_at(at_us));
            }
            match arrival {
                Some(mut arrival) => self.receive(&mut arrival),
                None => self.pending = self.receiver.next(WAIT)?,
            }
        }
    }

    /// Sends what is due, and takes in what was found.
    fn ask(&mut self, now_us: u64) {
        for finding in self.search.iter_mut().flat_map(Search::findings) {
            if now_us >= self.networks_until_us {
                self.networks = networks::of_host();
                self.networks_until_us = now_us + NETWORKS_US;
            }
            self.registry.find(finding, &self.networks, now_us);
        }
        if now_us >= self.keys_us {
            self.keys_us = now_us + KEYS_US;
            self.look_at_keys();
        }
        if now_us >= self.polled_us + POLL_US {
            self.polled_us = now_us;
            let socket = &self.socket;
            let sessions = self.site_tracker.sessions_mut();
            let links = &mut self.links;
            self.registry.poll(sessions, now_us, |datagram, to| {
                links.send(datagram, to, now_us, |sealed| send(socket, sealed, to));
            });
        }
    }

    /// Takes the keys that are in their file by now.
    fn look_at_keys(&mut self) {
        let trouble = match self.parts.keys.as_mut().and_then(Watched::changed) {
            None => return,
            Some(Ok(keys)) => {
                self.links.change(Arc::new(keys));
                None
            }
            Some(Err(error)) => Some(error.to_string()),
        };
        self.parts.alarms.set(AlarmKind::Keys, trouble.as_deref());
    }

    fn receive(&mut self, arrival: &mut Arrival) {
        let (bytes, from) = (&mut *arrival.bytes, arrival.from);
        self.used_us = self.used_us.max(arrival.at_us);
        let now_us = self.used_us;
        if !self.registry.knows(from) {
            self.strangers += 1;
            return;
        }
        let (socket, sessions) = (&self.socket, self.site_tracker.sessions_mut());
        let answer = |datagram: &[u8]| send(socket, datagram, from);
        let arrived = self.links.take(bytes, from, now_us, sessions.drops_mut(), answer);
        if matches!(arrived, Arrived::Full | Arrived::Dropped) {
            return;
        }
        let Some(datagram) = sessions.decode(bytes) else { return };
        if arrived == Arrived::Clear && !self.links.believe(&datagram, sessions.drops_mut()) {
            return;
        }
        let admission = self.registry.admit(from, &datagram, sessions, now_us);
        if let Some(recorder) = self.parts.recorder.as_ref().filter(|_| admission.is_elsewhere) {
            recorder.elsewhere(now_us, datagram.device());
        }
        if !admission.is_used {
            return;
        }
        // Only what is used: who follows the recording again has not sent the requests, and cannot tell.
        if let Some(recorder) = &self.parts.recorder {
            recorder.datagram(now_us, bytes);
        }
        let input = self.site_tracker.take(&datagram, now_us);
        if let Some(Input::Floor(reading)) = &input {
            self.parts.calibration.read(reading);
        }
        let observation = input.and_then(Input::scan);
        if let Some(observation) = &observation {
            // One that is not placed is nowhere that could be wrong.
            if self.registry.site().is_placed(observation.view.module) {
                self.poses.observe(observation);
                if let Some(module) = self.registry.site().modules.get(observation.view.module) {
                    if let Some(recorder) = &mut self.parts.recorder {
                        recorder.scan(now_us, &module.name, observation);
                    }
                    if self.parts.scans.are_wanted() {
                        self.parts.scans.publish(Scan::of(&module.name, observation));
                    }
                }
            }
            self.parts.calibration.observe(observation);
            if let Message::Report(report) = &datagram.message
                && self.parts.reports.are_wanted()
            {
                let t = now_us as f64 * 1e-6;
                let module = self.registry.site().modules.get(observation.view.module);
                self.parts.reports.publish(ReportLine {
                    t,
                    module: module.map_or_else(String::new, |module| module.name.clone()),
                    sequence: report.head.sequence,
                    tracks: self.site_tracker.peek(t),
                });
            }
        }
        let socket = &self.socket;
        let sessions = self.site_tracker.sessions_mut();
        let links = &mut self.links;
        let answer = |datagram: &[u8], to| {
            links.send(datagram, to, now_us, |sealed| send(socket, sealed, to));
        };
        self.registry.heard(from, &datagram, observation, sessions, now_us, answer);
    }

    fn snapshot_at(&mut self, at_us: u64) -> Snapshot {
        let now_us = self.now_us();
        let estimate = self.site_tracker.estimate(at_us as f64 * 1e-6);
        let line = TracksLine::from(&estimate);
        let Self { registry, links, site_tracker, poses, capacity, parts, .. } = self;
        parts.calibration.tick(site_tracker.sessions(), at_us as f64 * 1e-6);
        if let Some(recorder) = &parts.recorder {
            recorder.line(at_us, &line);
            parts.alarms.set(AlarmKind::Recording, recorder.trouble().as_deref());
        }
        let mut modules = registry.update_lines(site_tracker.sessions_mut(), now_us);
        modules.iter_mut().for_each(|module| stand(module, links));
        poses.raise(site_tracker.sessions(), &mut modules, now_us);
        let doors = parts.doors.as_ref().map(|doors| doors.observe(&estimate, &modules));
        let doors = doors.unwrap_or_default();
        let (unix_ms, own) = (unix_ms(), parts.alarms.lines());
        let crowded = capacity.observe(registry.site(), &line.zones, line.t);
        let active = active_alarms(&own, &modules, &doors).chain(crowded);
        let alarms = parts.listed.observe(Now { steady_s: now_us as f64 * 1e-6, unix_ms }, active);
        if let Some(recorder) = &parts.recorder {
            recorder.alarms(at_us);
        }
        let total = site_tracker.total(&line, &modules);
        let (names, signs) = parts.signs.as_ref().map(|signs| signs.observe(&estimate)).unwrap_or_default();
        Snapshot {
            unix_ms,
            line,
            tracks: estimate.tracks,
            total,
            alarms,
            lines: site_tracker.lines(),
            dwell: site_tracker.dwell(),
            doors,
            names,
            signs,
            floors: site_tracker.floors(),
            modules,
            dropped: *site_tracker.sessions().drops(),
            strangers: self.strangers,
            overrun: self.receiver.overrun(),
            refused: Refused { forgotten: site_tracker.sessions().forgotten(), ..registry.refused() },
            http: parts.connections.refused(),
            // Counted by the thread that hands snapshots out.
            missed: 0,
        }
    }

    /// What is known at `at_s`, the time of the newest snapshot, to be explained.
    #[must_use]
    pub fn facts(&self, question: &Question, at_s: f64) -> Facts {
        let mut facts = self.site_tracker.facts(question, at_s);
        if let Question::Alarm(kind) = question {
            let conditions = self.registry.conditions(*kind, self.site_tracker.sessions(), self.now_us());
            facts.of = Some(FactsOf::Alarm(conditions));
        }
        facts
    }

    /// Where devices send to.
    ///
    /// # Errors
    /// The socket does not know.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// The sessions with all devices.
    #[must_use]
    pub const fn sessions(&self) -> &kehai_tracking::session::Sessions {
        self.site_tracker.sessions()
    }
}

/// The time of the snapshot that is due at `now_us`: after a stall, or the machine's sleep, the newest. Those missed are
/// left out: what was seen before is not what is known now.
const fn line_us(now_us: u64) -> u64 {
    now_us / LINE_US * LINE_US
}

/// What cannot be sent now is due again in a second.
fn send(socket: &UdpSocket, datagram: &[u8], to: SocketAddr) {
    let _ = socket.send_to(datagram, to);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f1_the_snapshot_after_a_sleep_is_of_now() {
        assert_eq!([line_us(100_000), line_us(199_999)], [100_000, 100_000]);
        assert_eq!(line_us(700_012_345), 700_000_000, "not of the time at which it was due");
    }
}
