//! Asks the network: a socket, modules that announce themselves, the broker.

use std::fs;
use std::sync::Arc;
use std::time::{Duration, Instant};

use if_addrs::get_if_addrs;
use rumqttc::{Client, Event, MqttOptions, Packet, TlsConfiguration, Transport};

use crate::doctor::facts::{BrokerFact, SearchFact, UdpFact};
use crate::mqtt::BrokerLink;
use crate::net::discovery::Search;
use crate::net::receiver::KERNEL_BUFFER;
use crate::net::tracking::TrackingLoop;

/// What the kernel gives a socket at most (socket(7)).
const MOST: &str = "/proc/sys/net/core/rmem_max";

/// Modules answer a search within a second, and a second search after that finds who was busy.
const LISTENS: Duration = Duration::from_secs(3);

/// A broker that does not answer within this time is none.
const PATIENCE: Duration = Duration::from_secs(5);

/// The broker takes a connection for gone after half as long again.
const KEEP_ALIVE: Duration = Duration::from_secs(10);

/// What the kernel keeps of datagrams.
pub(super) fn udp() -> UdpFact {
    UdpFact {
        most_bytes: fs::read_to_string(MOST).ok().and_then(|text| text.trim().parse().ok()),
        asked_bytes: KERNEL_BUFFER.into(),
        trouble: TrackingLoop::bind().err().map(|error| error.to_string()),
    }
}

/// Listens for modules.
pub(super) fn search() -> SearchFact {
    let networks = get_if_addrs()
        .ok()
        .map(|interfaces| interfaces.iter().filter(|one| one.ip().is_ipv4() && !one.is_loopback()).count());
    let found = Search::start().map(|search| search.all_within(LISTENS).len());
    SearchFact { networks, found: found.map_err(|error| error.to_string()) }
}

/// Logs in at the broker, and leaves.
pub(super) fn broker(mqtt: Result<BrokerLink, String>) -> BrokerFact {
    match mqtt {
        Ok(mqtt) => BrokerFact { log_in: log_in(&mqtt), broker: mqtt.broker.to_string() },
        Err(why) => BrokerFact { broker: "the broker".to_owned(), log_in: Err(why) },
    }
}

fn log_in(mqtt: &BrokerLink) -> Result<(), String> {
    let id = format!("kehai-doctor-{}", std::process::id());
    let mut options = MqttOptions::new(id, mqtt.broker.host.clone(), mqtt.broker.port);
    options.set_keep_alive(KEEP_ALIVE);
    if let Some((user, password)) = &mqtt.broker.login {
        options.set_credentials(user, password);
    }
    if let Some(trust) = &mqtt.trust {
        options.set_transport(Transport::tls_with_config(TlsConfiguration::Rustls(Arc::clone(trust))));
    }
    let (client, mut connection) = Client::new(options, 4);
    let end = Instant::now() + PATIENCE;
    loop {
        let left = end.saturating_duration_since(Instant::now());
        match connection.recv_timeout(left) {
            Ok(Ok(Event::Incoming(Packet::ConnAck(_)))) => {
                // It leaves with its word; without, the broker notices by itself.
                let _ = client.disconnect();
                let _ = connection.recv_timeout(left);
                return Ok(());
            }
            Ok(Ok(_)) => {}
            Ok(Err(error)) => return Err(error.to_string()),
            Err(_) => return Err(format!("no answer within {} s", PATIENCE.as_secs())),
        }
    }
}
