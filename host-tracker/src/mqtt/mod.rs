//! What is known, published to a broker, with discovery for Home Assistant.
//!
//! ```text
//!   frames ─▶ messages     frame → topics and payloads, pure; which topics: `topics`
//!             └▶ outbox    what has changed, what is new to this broker, what is stale, pure
//!                └▶ publisher ─▶ broker        a thread; a new connection begins with everything
//!
//!   kehai/SITE/status                      online │ offline (also the last will)
//!   kehai/SITE/tracker                     {"alarm":null,"alarms":[],"version":"…"}
//!   kehai/SITE/total                       {"state":"known","occupied":true,"count":5}
//!   kehai/SITE/total/availability
//!   kehai/SITE/zone/ZONE                   {"alarms":[],"state":"known","occupied":true,"count":2}
//!   kehai/SITE/zone/ZONE/availability      online │ offline: nothing is known of it
//!   kehai/SITE/module/MODULE               {"state":"watching","alarm":null,"alarms":[],"scans_hz":10.0,…}
//!   kehai/SITE/module/MODULE/availability
//!   kehai/SITE/door/DOOR                   {"phase":"unlocked","lock":"unlocked","alarm":null,…}
//!   kehai/SITE/alarms, kehai/SITE/alarm/…   as `alarms` says
//!   kehai/SITE/name/LABEL                  {"track":4,"probability":0.93,"x":1.2,…}     LABEL: four digits of an ID's hash
//!   homeassistant/device/kehai_SITE…/config
//!
//!   kehai/SITE/door/DOOR/lock              {"id":8,"at_ms":…,"lock":"unlocked","for_ms":1500}    a lease, renewed
//!                                          {"id":9,"at_ms":…,"lock":"locked"}      again every second until it is taken
//!   kehai/SITE/door/DOOR/alarm             {"id":3,"at_ms":…,"alarm":"followed"}   or null: over
//!   kehai/SITE/door/DOOR/refused           {"at_ms":…,"why":"repeated: …"}         what came in changed nothing
//!   kehai/SITE/door/DOOR/card │ number │ contact │ exit │ reset │ lock/ready │ lock/taken │ alarm/taken     ◀─ as `door::inbox` says
//!   kehai/SITE/module/MODULE/learn │ restart │ identify     PRESS                     ◀─ with --mqtt-commands, as `presses` says
//!   kehai/SITE/module/MODULE/refused       {"at_ms":…,"why":"…"}             a press that did nothing
//!   kehai/SITE/sign                        {"id":"04A22B…","reader":"hall"}        ◀─ as `names::message` says
//!   kehai/SITE/sign/refused                {"at_ms":…,"why":"late: …"}             what came in changed nothing
//! ```
//!
//! Everything but a door's orders, inputs and signs is retained: an old "unlocked" must never reach a lock that comes back.
//! A retained input is not taken. *Unknown* is never *empty*: a zone that no module sees has neither count nor
//! occupancy, and is not available.
//!
//! Sources: MQTT 3.1.1; Home Assistant's MQTT discovery, *device discovery payload*.

mod alarms;
pub(crate) mod channels;
mod entities;
mod holds;
mod home_assistant;
mod messages;
mod outage;
mod outbox;
pub(crate) mod payloads;
pub mod presses;
mod publisher;
mod topics;
pub mod trust;

use std::str::FromStr;

pub use home_assistant::{About, discovery};
pub use messages::{door_input, states};
pub use outbox::{Outbox, Publication};
pub use publisher::{Buttons, Publisher, Settings, warn_or};
pub use topics::Topics;

/// How the address of a broker begins, in clear and encrypted, and its port if none is said.
const SCHEMES: [(&str, bool, u16); 2] = [("mqtt://", false, 1883), ("mqtts://", true, 8883)];

/// A broker, and the login there.
#[derive(Clone, PartialEq, Eq)]
pub struct Broker {
    /// Name or address.
    pub host: String,
    /// Port.
    pub port: u16,
    /// Whether the connection is encrypted.
    pub encrypted: bool,
    /// User and password.
    pub login: Option<(String, String)>,
}

impl std::fmt::Debug for Broker {
    /// Without the password.
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Broker({self})")
    }
}

impl std::fmt::Display for Broker {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}:{}", self.host, self.port)
    }
}

/// That is no broker.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum BrokerError {
    /// Not of the form.
    #[error("a broker is mqtt://[USER:PASSWORD@]HOST[:PORT], or mqtts://… for an encrypted connection")]
    Form,
}

/// Not rumqttc's own reading of a URL: it demands a `client_id` in it, and hands on an IPv6 address with its
/// brackets and a password with its percent signs.
impl FromStr for Broker {
    type Err = BrokerError;

    fn from_str(text: &str) -> Result<Self, BrokerError> {
        let scheme = SCHEMES.iter().find_map(|(scheme, encrypted, port)| {
            text.strip_prefix(scheme).map(|rest| (rest.trim_end_matches('/'), *encrypted, *port))
        });
        let (rest, encrypted, usual) = scheme.ok_or(BrokerError::Form)?;
        let (login, place) = match rest.rsplit_once('@') {
            None => (None, rest),
            Some((login, place)) => (Some(login.split_once(':').ok_or(BrokerError::Form)?), place),
        };
        let (host, port) = match place.rsplit_once(':') {
            Some((host, port)) if !place.ends_with(']') => {
                (host, port.parse().map_err(|_| BrokerError::Form)?)
            }
            _ => (place, usual),
        };
        let host = host.trim_start_matches('[').trim_end_matches(']');
        if host.is_empty() || host.contains(['/', '@', ' ']) {
            return Err(BrokerError::Form);
        }
        let login = login.map(|(user, password)| (user.to_owned(), password.to_owned()));
        Ok(Self { host: host.to_owned(), port, encrypted, login })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broker_is_read_in_all_its_forms() {
        let read = |text: &str| text.parse::<Broker>().map(|broker| (broker.host, broker.port, broker.login));
        assert_eq!(read("mqtt://here"), Ok(("here".into(), 1883, None)));
        assert_eq!(read("mqtt://here:99/"), Ok(("here".into(), 99, None)));
        assert_eq!(read("mqtt://[::1]:99"), Ok(("::1".into(), 99, None)));
        assert_eq!(read("mqtt://[::1]"), Ok(("::1".into(), 1883, None)));
        let login = Some(("me".into(), "p@ss:word".into()));
        assert_eq!(read("mqtt://me:p@ss:word@here"), Ok(("here".into(), 1883, login)));
        for wrong in
            ["", "here:1883", "http://here", "mqtt://", "mqtt://here:port", "mqtt://me@here", "mqtt://a/b"]
        {
            assert_eq!(read(wrong), Err(BrokerError::Form), "{wrong}");
        }
        assert_eq!(read("mqtts://here"), Ok(("here".into(), 8883, None)));
        let encrypted = |text: &str| text.parse::<Broker>().unwrap().encrypted;
        assert!(encrypted("mqtts://here") && !encrypted("mqtt://here"));
        assert_eq!(read("wss://here"), Err(BrokerError::Form));
    }

    #[test]
    fn a_password_is_not_shown() {
        let broker: Broker = "mqtt://me:secret@here".parse().unwrap();
        assert!(!format!("{broker} {broker:?}").contains("secret"));
    }
}
