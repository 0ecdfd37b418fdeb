//! The thread that talks to the broker: one connection after the other.
//!
//! ```text
//!   frames ─▶ session ─▶ client ══▶ broker
//!                ▲          │ link thread: connected, retained topics, messages, the end
//!                └──────────┘
//!   the end ─▶ everything about the connection is thrown away, a second later a new one begins with everything
//! ```
//!
//! Nothing of one connection lives on in the next: what was meant for a broker that went away is stale.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rumqttc::{Client, LastWill, MqttOptions, QoS, TlsConfiguration, Transport};
use rustls::ClientConfig;
use tokio::sync::watch;
use tracing::Level;

use super::Broker;
use super::inputs::KeptInputs;
use super::link;
use super::outage::Outage;
use super::outbox::Outbox;
use super::presence::Presence;
use super::presses::Presser;
use super::session::{Session, WAIT};
use super::topics::Topics;
use crate::doors::DoorHandle;
use crate::log_limit::CountLog;
use crate::shared_count::SharedCount;
use crate::signs::SignHandle;
use crate::supervise::Worker;
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::door::doors::Output;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;

/// Between two connections.
const AGAIN: Duration = Duration::from_secs(1);

/// A broker that is silent for half as long again is gone.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// Longest message that is taken, bytes: other devices' discoveries come, too.
const LONGEST: usize = 4 << 20;

/// Messages on the way to the link: everything about a thousand modules.
const ON_THE_WAY: usize = 8192;

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
    /// Told when the thread ends by itself, and while another tracker publishes under the same topics.
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
    dropped: SharedCount,
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
        let (alarms, dropped) = (settings.alarms.clone(), SharedCount::default());
        let counted = dropped.clone();
        let work = move |stop: &AtomicBool| run(&settings, &frames, told.as_ref(), (stop, &counted), &say);
        Ok(Self { _thread: Worker::start("mqtt", alarms, work)?, dropped })
    }

    /// Messages of the broker that found no room, for the metrics.
    #[must_use]
    pub fn dropped(&self) -> SharedCount {
        self.dropped.clone()
    }
}

fn run(
    settings: &Settings,
    frames: &Receiver<Arc<Snapshot>>,
    told: Option<&Receiver<Output>>,
    (stop, dropped): (&AtomicBool, &SharedCount),
    say: &impl Fn(Level, &str),
) -> Result<(), String> {
    let begun = Instant::now();
    let mut outbox = Outbox::new(settings.topics.clone());
    let start = |buttons: &Buttons| Presser::start(buttons.keys.clone());
    let presser = settings.buttons.as_ref().map(start).transpose().map_err(|error| error.to_string())?;
    let mut outage = Outage::default();
    let (mut drop_log, mut kept_inputs) = (CountLog::default(), KeptInputs::default());
    let mut presence = Presence::new();
    let of_broker =
        |level: Level, text: &str| say(level, &format!("mqtt: broker {}: {text}", settings.broker));
    while !stop.load(Ordering::Relaxed) {
        let (client, connection) = Client::new(options(settings, presence.own()), ON_THE_WAY);
        let (tell, news) = link::queue(dropped);
        let Ok(thread) =
            std::thread::Builder::new().name("mqtt link".into()).spawn(move || link::run(connection, &tell))
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
            presence: &mut presence,
            alarms: &settings.alarms,
            dropped,
            drop_log: &mut drop_log,
            kept_inputs: &mut kept_inputs,
            say: &of_broker,
        };
        let end = session.run(frames, told, &news, stop, begun);
        drop(session);
        let Some(reason) = end else {
            await_farewell(&thread);
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

/// How the broker is reached, and what it says of a publisher that is gone.
fn options(settings: &Settings, instance: &str) -> MqttOptions {
    let Broker { host, port, login, .. } = &settings.broker;
    // Two clients of one identity end each other's connection: in containers all trackers are process 1.
    let id = format!("{}-{instance}", settings.topics.site().replace('/', "-"));
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
