//! The thread that talks to the broker.
//!
//! ```text
//!   frames ─▶ outbox ─▶ client ══▶ broker
//!                ▲        │ link thread: connected, retained topics, the end
//!                └────────┘
//!   the end ─▶ everything about the connection is thrown away, a second later a new one begins with everything
//! ```
//!
//! Nothing of one connection lives on in the next: what was meant for a broker that went away is stale.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, TryRecvError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rumqttc::{Client, Connection, Event, LastWill, MqttOptions, Packet, QoS, TlsConfiguration, Transport};
use rustls::ClientConfig;
use tokio::sync::watch;
use tracing::Level;

use super::Broker;
use super::home_assistant::About;
use super::messages::{door_input, door_topics};
use super::outage::Outage;
use super::outbox::{Outbox, Publication};
use super::payloads::{DoorAlarmOrder, Lock, Refused, written};
use super::presses::{NotPressed, Presser, Target, button};
use super::topics::Topics;
use crate::doors::DoorHandle;
use crate::signs::SignHandle;
use crate::supervise::Worker;
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::door::doors::Output;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, unix_ms};

/// Between two connections.
const AGAIN: Duration = Duration::from_secs(1);

/// Wait for a frame.
const WAIT: Duration = Duration::from_millis(100);

/// A broker that is silent for half as long again is gone.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// Messages on the way to the link: everything about a thousand modules.
const ON_THE_WAY: usize = 8192;

/// Longest message that is taken, bytes: other devices' discoveries come, too.
const LONGEST: usize = 4 << 20;

/// Longest time for the last words.
const FAREWELL: Duration = Duration::from_secs(2);

/// Where to publish.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The broker.
    pub broker: Broker,
    /// Whom an encrypted connection trusts, if it is one.
    pub trust: Option<Arc<ClientConfig>>,
    /// Where everything goes there.
    pub topics: Topics,
    /// The site in use.
    pub site: watch::Receiver<Arc<Site>>,
    /// Where the live map is for others than this machine.
    pub map_url: Option<String>,
    /// The doors, if there are any: they receive the inputs for them.
    pub doors: Option<DoorHandle>,
    /// Who is where: it receives the signs.
    pub signs: Option<SignHandle>,
    /// Whether modules have buttons, which clients that may publish at the broker may press.
    pub buttons: Option<Buttons>,
    /// Told when the thread ends by itself.
    pub alarms: TrackerAlarms,
}

/// What is needed for buttons.
#[derive(Clone, Debug)]
pub struct Buttons {
    /// The file of the keys of the site's modules; it may not be there yet.
    pub keys: Option<PathBuf>,
}

/// For [`Publisher::start`]: logs what is grave, and passes on the rest.
pub fn warn_or(say: fn(&str)) -> impl Fn(Level, &str) + Send + 'static {
    move |level, text| if level == Level::WARN { tracing::warn!("{text}") } else { say(text) }
}

/// Publishes until it is dropped; then it says that nothing more will come.
#[derive(Debug)]
pub struct Publisher {
    _thread: Worker,
}

/// What the link says.
enum News {
    Connected,
    Retained(String),
    Message(String, Vec<u8>),
    Ended(String),
}

impl Publisher {
    /// Begins to publish `frames`. `say` is called when the broker comes and goes, with how grave that is.
    ///
    /// # Errors
    /// There is no thread for it.
    pub fn start(
        settings: Settings,
        frames: Receiver<Arc<Snapshot>>,
        told: Option<Receiver<Output>>,
        say: impl Fn(Level, &str) + Send + 'static,
    ) -> std::io::Result<Self> {
        let alarms = settings.alarms.clone();
        let work = move |stop: &AtomicBool| run(&settings, &frames, told.as_ref(), stop, &say);
        Ok(Self { _thread: Worker::start("mqtt", alarms, work)? })
    }
}

fn run(
    settings: &Settings,
    frames: &Receiver<Arc<Snapshot>>,
    told: Option<&Receiver<Output>>,
    stop: &AtomicBool,
    say: &impl Fn(Level, &str),
) -> Result<(), String> {
    let begun = Instant::now();
    let mut outbox = Outbox::new(settings.topics.clone());
    let start = |buttons: &Buttons| Presser::start(buttons.keys.clone());
    let presser = settings.buttons.as_ref().map(start).transpose().map_err(|error| error.to_string())?;
    let mut outage = Outage::default();
    let of_broker =
        |level: Level, text: &str| say(level, &format!("mqtt: broker {}: {text}", settings.broker));
    while !stop.load(Ordering::Relaxed) {
        let (client, connection) = Client::new(options(settings), ON_THE_WAY);
        let (tell, news) = mpsc::channel();
        let Ok(link) =
            std::thread::Builder::new().name("mqtt link".into()).spawn(move || link(connection, &tell))
        else {
            return Err("no thread is to be had for the link".to_owned());
        };
        let mut site = settings.site.clone();
        site.mark_changed();
        let mut session = Session {
            client,
            site,
            map_url: settings.map_url.as_deref(),
            outbox: &mut outbox,
            connected: false,
            newest: Arc::default(),
            door_topics: BTreeMap::new(),
            doors: settings.doors.as_ref(),
            signs: settings.signs.as_ref(),
            presser: presser.as_ref(),
            outage: &mut outage,
            say: &of_broker,
        };
        let end = session.run(frames, told, &news, stop, begun);
        drop(session);
        let Some(reason) = end else {
            await_farewell(&link);
            return Ok(());
        };
        if let Some(level) = outage.failed(Instant::now()) {
            of_broker(level, &format!("{reason}; trying again"));
        }
        if !pause(frames, stop) {
            return Ok(());
        }
    }
    Ok(())
}

/// The last words are on their way; the link ends with them.
fn await_farewell(link: &JoinHandle<()>) {
    let begun = Instant::now();
    while !link.is_finished() && begun.elapsed() < FAREWELL {
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Waits before the next connection. What happens meanwhile is old when the broker is back. False: no frame will come.
fn pause(frames: &Receiver<Arc<Snapshot>>, stop: &AtomicBool) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < AGAIN && !stop.load(Ordering::Relaxed) {
        match frames.recv_timeout(WAIT) {
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return false,
        }
    }
    true
}

fn options(settings: &Settings) -> MqttOptions {
    let Broker { host, port, login, .. } = &settings.broker;
    let id = format!("{}-{}", settings.topics.site().replace('/', "-"), std::process::id());
    let mut options = MqttOptions::new(id, host.clone(), *port);
    options.set_keep_alive(KEEP_ALIVE).set_max_packet_size(LONGEST, LONGEST);
    options.set_last_will(LastWill::new(settings.topics.status(), "offline", QoS::AtLeastOnce, true));
    if let Some((user, password)) = login {
        options.set_credentials(user, password);
    }
    if let Some(trust) = &settings.trust {
        options.set_transport(Transport::tls_with_config(TlsConfiguration::Rustls(Arc::clone(trust))));
    }
    options
}

/// Keeps the connection going until it ends, and reports its news.
fn link(mut connection: Connection, tell: &mpsc::Sender<News>) {
    for event in connection.iter() {
        let news = match event {
            Ok(Event::Incoming(Packet::ConnAck(_))) => News::Connected,
            Ok(Event::Incoming(Packet::Publish(publish)))
                if publish.retain && !publish.payload.is_empty() =>
            {
                News::Retained(publish.topic)
            }
            Ok(Event::Incoming(Packet::Publish(publish))) if !publish.retain => {
                News::Message(publish.topic, publish.payload.to_vec())
            }
            Ok(_) => continue,
            Err(error) => {
                let _ = tell.send(News::Ended(error.to_string()));
                return;
            }
        };
        if tell.send(news).is_err() {
            return;
        }
    }
}

/// One connection.
struct Session<'a> {
    client: Client,
    site: watch::Receiver<Arc<Site>>,
    map_url: Option<&'a str>,
    outbox: &'a mut Outbox,
    connected: bool,
    /// The newest frame.
    newest: Arc<Snapshot>,
    /// Where the orders of each door go, also of one that has just gone from the site.
    door_topics: BTreeMap<String, String>,
    doors: Option<&'a DoorHandle>,
    signs: Option<&'a SignHandle>,
    presser: Option<&'a Presser>,
    outage: &'a mut Outage,
    /// Says something of this broker.
    say: &'a dyn Fn(Level, &str),
}

impl Session<'_> {
    /// Publishes until the connection ends, and returns why it did; None when it was stopped.
    fn run(
        &mut self,
        frames: &Receiver<Arc<Snapshot>>,
        told: Option<&Receiver<Output>>,
        news: &Receiver<News>,
        stop: &AtomicBool,
        begun: Instant,
    ) -> Option<String> {
        loop {
            let fresh = match frames.recv_timeout(WAIT) {
                Ok(frame) => Some(frame),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => {
                    self.end();
                    return None;
                }
            };
            if stop.load(Ordering::Relaxed) {
                self.end();
                return None;
            }
            // Only the newest snapshot matters.
            let fresh = frames.try_iter().last().or(fresh);
            if let Some(frame) = &fresh {
                self.use_snapshot(frame);
            }
            if let Err(reason) = self.take_news(news) {
                return Some(reason);
            }
            if let Some(presser) = self.presser {
                presser.refusals().for_each(|(target, why)| self.refuse(&target, &why));
            }
            // What was published while no broker was connected is stale: the doors repeat what still holds.
            let orders: Vec<Output> = told.map(|told| told.try_iter().collect()).unwrap_or_default();
            if self.connected
                && let Err(reason) = self.publish_due(&orders, fresh.as_deref(), begun)
            {
                return Some(reason);
            }
        }
    }

    /// From now on this is what is known; with it the site, if that has changed.
    fn use_snapshot(&mut self, frame: &Arc<Snapshot>) {
        self.newest = Arc::clone(frame);
        if self.site.has_changed().unwrap_or(false) {
            let site = Arc::clone(&self.site.borrow_and_update());
            let map_url = self.map_url.map(str::to_owned);
            self.outbox.set_about(About { site, map_url, buttons: self.presser.is_some() });
        }
        self.door_topics.extend(door_topics(frame, self.outbox.topics()));
    }

    /// All that the link has said; an error is why the connection has ended.
    fn take_news(&mut self, news: &Receiver<News>) -> Result<(), String> {
        loop {
            match news.try_recv() {
                Ok(News::Connected) => self.begin()?,
                Ok(News::Retained(topic)) => self.outbox.retained(&topic),
                Ok(News::Message(topic, payload)) => self.receive(&topic, &payload),
                Ok(News::Ended(reason)) => return Err(reason),
                Err(TryRecvError::Empty) => return Ok(()),
                Err(TryRecvError::Disconnected) => return Err("the link has ended".to_owned()),
            }
        }
    }

    /// The broker has taken the connection.
    fn begin(&mut self) -> Result<(), String> {
        self.connected = true;
        if self.outage.end() {
            (self.say)(Level::INFO, "connected");
        }
        self.outbox.connected();
        for filter in self.outbox.topics().filters() {
            self.client.try_subscribe(filter, QoS::AtLeastOnce).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// Publishes what doors order, and what has changed.
    fn publish_due(
        &mut self,
        orders: &[Output],
        fresh: Option<&Snapshot>,
        begun: Instant,
    ) -> Result<(), String> {
        orders.iter().try_for_each(|order| self.order(order))?;
        let now_ms = u64::try_from(begun.elapsed().as_millis()).unwrap_or(u64::MAX);
        let due = self.outbox.due(fresh, now_ms);
        due.into_iter().try_for_each(|publication| self.publish(publication))
    }

    /// Presses a button of a module, if there are buttons.
    fn press(&self, target: Target, payload: &[u8]) {
        let Some(presser) = self.presser else { return };
        let judged = target.judge(payload, &self.site.borrow());
        if let Err(why) = judged.and_then(|address| presser.press(target.clone(), address)) {
            self.refuse(&target, &why);
        }
    }

    fn refuse(&self, target: &Target, why: &NotPressed) {
        tracing::warn!("module {}: {} from the MQTT broker: {why}", target.module, target.button.name());
        let refused = written(&Refused { at_ms: unix_ms(), why: why.to_string() });
        let topic = format!("{}/module/{}/refused", self.outbox.topics().site(), target.slug);
        // Without room for it the log has it.
        let _ = self.client.try_publish(topic, QoS::AtMostOnce, false, refused);
    }

    /// Passes a message to a door, which publishes what becomes of it, takes a sign, or presses a button.
    fn receive(&self, topic: &str, payload: &[u8]) {
        let sign_topic = self.outbox.topics().sign();
        if let Some(signs) = self.signs.filter(|_| topic == sign_topic) {
            if let Err(why) = signs.tell(payload) {
                let refused = written(&Refused { at_ms: unix_ms(), why: why.to_string() });
                // Without room for it the count in the metrics says so.
                let _ =
                    self.client.try_publish(format!("{sign_topic}/refused"), QoS::AtMostOnce, false, refused);
            }
            return;
        }
        if let Some(target) = button(&self.newest, self.outbox.topics(), topic) {
            self.press(target, payload);
            return;
        }
        let input = door_input(&self.newest, self.outbox.topics(), topic);
        if let Some((doors, (name, input))) = self.doors.zip(input) {
            doors.post(&name, input, payload);
        }
    }

    /// What a door orders: never retained, and kept by no broker.
    fn order(&self, order: &Output) -> Result<(), String> {
        let at_ms = unix_ms();
        let (door, kind, payload) = match order {
            Output::Lock { door, order } => (door, "lock", written(&Lock { at_ms, order: *order })),
            Output::Alarm { door, id, alarm } => {
                (door, "alarm", written(&DoorAlarmOrder { alarm: *alarm, at_ms, id: *id }))
            }
            Output::NotTaken { door, why } => {
                (door, "refused", written(&Refused { at_ms, why: why.clone() }))
            }
            Output::Passage(_) => return Ok(()),
        };
        let Some(topic) = self.door_topics.get(door) else { return Ok(()) };
        // Said again while it holds: a broker that kept it for a lock that is away would deliver an old one.
        self.client
            .try_publish(format!("{topic}/{kind}"), QoS::AtMostOnce, false, payload)
            .map_err(|error| error.to_string())
    }

    fn publish(&self, Publication { topic, payload }: Publication) -> Result<(), String> {
        self.client.try_publish(topic, QoS::AtLeastOnce, true, payload).map_err(|error| error.to_string())
    }

    fn end(&self) {
        if self.connected {
            let _ = self.publish(self.outbox.farewell());
        }
        let _ = self.client.try_disconnect();
    }
}
