//! Buttons of modules, pressed at the broker: which there are, which a site allows, and the thread that asks the modules.
//!
//! ```text
//!   kehai/SITE/module/MODULE/learn │ restart │ identify  ◀─ PRESS     only with --mqtt-commands, never retained
//!        └─▶ named, allowed, found? ─▶ queue of 16 ─▶ thread ─▶ module    each press is logged
//!                  └ no ──────────────▶ kehai/SITE/module/MODULE/refused  {"at_ms":…,"why":"…"}
//! ```
//!
//! Each client that may publish at the broker may press. What a module sees decides what a door counts: on a site with a door it
//! only blinks.
//! Source: Home Assistant's *MQTT button*.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender, SyncSender, TrySendError};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::messages::modules;
use super::topics::Topics;
use crate::key_file;
use crate::module::{self, kept::KeptClients};
use crate::named::named;
use kehai_tracking::keys::Keys;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;

/// Presses that wait for a module: each takes a second at most if the module answers.
const WAITING: usize = 16;

/// What a button says: Home Assistant's own default.
#[derive(Serialize, Deserialize, JsonSchema)]
pub enum Pressed {
    /// It was pressed.
    #[serde(rename = "PRESS")]
    Press,
}

/// The payload of it.
const PRESS: &[u8] = b"PRESS";

named! {
    /// A button of a module, by its name in topics.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub enum Button {
        /// It learns its background anew.
        Learn = "learn",
        /// It starts anew.
        Restart = "restart",
        /// It blinks for half a minute.
        Identify = "identify",
    }
}

/// Why a press does nothing.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum NotPressed {
    /// Its payload.
    #[error("a button says PRESS, and nothing else")]
    Payload,
    /// The site has a door.
    #[error(
        "what a module sees decides what a door counts: on a site with a door an admin does this on the map"
    )]
    Guarded,
    /// It has no address yet.
    #[error("the module has not been found")]
    NotFound,
    /// Others wait.
    #[error("{WAITING} presses wait already")]
    Full,
    /// The module's own words, or those of the file of keys.
    #[error("{0}")]
    Module(String),
}

impl Button {
    /// Whether a site has it.
    #[must_use]
    pub fn is_allowed(self, site: &Site) -> bool {
        match self {
            Self::Identify => true,
            Self::Learn | Self::Restart => site.doors.is_empty(),
        }
    }
}

/// The module, its word in topics, and the button that a topic is for, if it is for one.
#[must_use]
pub fn button(frame: &Snapshot, site: &Site, topics: &Topics, topic: &str) -> Option<Target> {
    let rest = topic.strip_prefix(&topics.site())?.strip_prefix("/module/")?;
    let (slug, name) = rest.split_once('/')?;
    let button = Button::named(name)?;
    let (_, line) = modules(frame, site).into_iter().find(|(known, _)| known == slug)?;
    let address = line.address.parse().ok();
    Some(Target { slug: slug.to_owned(), module: line.name.clone(), address, button })
}

/// What is pressed.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Target {
    /// The module's word in topics.
    pub slug: String,
    /// Its name.
    pub module: String,
    /// Where it answers, once it is found.
    pub address: Option<SocketAddr>,
    /// The button.
    pub button: Button,
}

impl Target {
    /// Where the module is to be asked, if the press counts.
    ///
    /// # Errors
    /// [`NotPressed`].
    pub fn judge(&self, payload: &[u8], site: &Site) -> Result<SocketAddr, NotPressed> {
        if payload != PRESS {
            return Err(NotPressed::Payload);
        }
        if !self.button.is_allowed(site) {
            return Err(NotPressed::Guarded);
        }
        self.address.ok_or(NotPressed::NotFound)
    }
}

/// The thread that asks modules. It ends when this is dropped.
#[derive(Debug)]
pub struct Presser {
    presses: SyncSender<(Target, SocketAddr)>,
    refusals: Receiver<(Target, NotPressed)>,
}

impl Presser {
    /// Starts it; `keys` is the file of the keys of the site's modules.
    ///
    /// # Errors
    /// There is no thread for it.
    pub fn start(keys: Option<PathBuf>) -> std::io::Result<Self> {
        let (presses, waiting) = mpsc::sync_channel(WAITING);
        let (tell, refusals) = mpsc::channel();
        std::thread::Builder::new()
            .name("mqtt buttons".into())
            .spawn(move || press_all(&waiting, &tell, keys.as_ref()))?;
        Ok(Self { presses, refusals })
    }

    /// Presses, without waiting for the module.
    ///
    /// # Errors
    /// [`NotPressed::Full`].
    pub fn press(&self, target: Target, address: SocketAddr) -> Result<(), NotPressed> {
        tracing::info!("module {}: {}, pressed at the MQTT broker", target.module, target.button.name());
        self.presses.try_send((target, address)).map_err(|error| match error {
            TrySendError::Full(_) => NotPressed::Full,
            TrySendError::Disconnected(_) => NotPressed::Module("the thread of buttons has ended".into()),
        })
    }

    /// What modules have refused since the last time.
    pub fn refusals(&self) -> impl Iterator<Item = (Target, NotPressed)> + '_ {
        self.refusals.try_iter()
    }
}

fn press_all(
    waiting: &Receiver<(Target, SocketAddr)>,
    tell: &Sender<(Target, NotPressed)>,
    keys: Option<&PathBuf>,
) {
    let mut clients = KeptClients::default();
    for (target, address) in waiting {
        if let Err(why) = press(&mut clients, address, target.button, keys) {
            // A publisher that has ended does not receive it.
            let _ = tell.send((target, NotPressed::Module(why)));
        }
    }
}

fn press(
    clients: &mut KeptClients,
    address: SocketAddr,
    button: Button,
    keys: Option<&PathBuf>,
) -> Result<(), String> {
    let loaded = keys.map(|file| key_file::load(file)).transpose().map_err(|error| error.to_string())?;
    let keys = Arc::new(loaded.flatten().unwrap_or_else(Keys::none));
    let asked = clients.ask(address, &keys, |client| match button {
        Button::Identify => module::identify(client, module::IDENTIFY_S),
        Button::Learn => {
            module::control(client)?;
            Ok(module::learn(client, 0)?)
        }
        Button::Restart => {
            module::control(client)?;
            Ok(module::restart(client)?)
        }
    });
    asked.map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::super::messages::tests::{frame, site, topics};
    use super::*;

    const DOOR: &str = "[[zone]]\nname = \"hall\"\nsecure = true\npolygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]\n\
        [[door]]\nname = \"front\"\nzone = \"hall\"\nline = [[-0.45, 1.0], [0.45, 1.0]]\nfail = \"secure\"\n";

    #[test]
    fn a_topic_is_a_button_of_one_module_and_no_other_is() {
        let mut frame = frame();
        frame.modules[0].address = "127.0.0.1:4040".into();
        let of = |topic: &str| button(&frame, &site(), &topics(), topic);
        for (button, name) in Button::NAMED {
            let target = of(&format!("kehai/front-door/module/left/{name}")).unwrap();
            assert_eq!((target.module.as_str(), target.button, button.name()), ("left", button, name));
            assert_eq!(target.address, Some("127.0.0.1:4040".parse().unwrap()));
        }
        for other in [
            "kehai/front-door/module/right/learn",
            "kehai/front-door/module/left/unlock",
            "kehai/front-door/module/left",
            "kehai/other/module/left/learn",
            "kehai/front-door/door/front/learn",
        ] {
            assert_eq!(of(other), None, "{other}");
        }
    }

    #[test]
    fn a_press_counts_if_it_says_so_the_module_is_found_and_no_door_depends_on_it() {
        let (open, guarded) = (Site::default(), Site::parse("site", DOOR).unwrap());
        let address = Some("127.0.0.1:4040".parse().unwrap());
        let of = |button, address| Target { slug: "left".into(), module: "left".into(), address, button };
        for (button, _) in Button::NAMED {
            assert_eq!(of(button, address).judge(b"PRESS", &open).ok(), address);
            assert_eq!(of(button, address).judge(b"press", &open), Err(NotPressed::Payload));
            assert_eq!(of(button, None).judge(b"PRESS", &open), Err(NotPressed::NotFound));
        }
        assert_eq!(of(Button::Identify, address).judge(b"PRESS", &guarded).ok(), address);
        for button in [Button::Learn, Button::Restart] {
            assert_eq!(of(button, address).judge(b"PRESS", &guarded), Err(NotPressed::Guarded));
        }
    }

    #[test]
    fn what_a_button_says_is_what_is_described() {
        assert_eq!(serde_json::to_string(&Pressed::Press).unwrap().as_bytes(), b"\"PRESS\"");
    }
}
