//! The broker, and how it is reached.
//!
//! ```text
//!   mqtts://USER:PASSWORD@HOST:PORT    encrypted, 8883 if no port is said
//!   mqtt://HOST                        in clear, 1883
//! ```

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use rustls::ClientConfig;

use super::Topics;

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

/// The broker to which everything is published, and how.
#[derive(Debug)]
pub struct BrokerLink {
    /// The broker.
    pub broker: Broker,
    /// Which certificates an encrypted connection to it trusts, if it is one.
    pub trust: Option<Arc<ClientConfig>>,
    /// Where everything goes there.
    pub topics: Topics,
    /// Whether clients that may publish there may press buttons of modules.
    pub commands: bool,
}

impl fmt::Debug for Broker {
    /// Without the password.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "Broker({self})")
    }
}

impl fmt::Display for Broker {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
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
