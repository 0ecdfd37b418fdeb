//! Asks the tracker that runs, as any client does; or reads what it wrote last.

use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::path::Path;
use std::time::Duration;

use kehai_tracking::snapshot::{Snapshot, unix_ms};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use ureq::Agent;

use super::MapPlace;
use crate::doctor::facts::{Devices, Health, MapFact};
use crate::http_agent::{LONGEST, agent};
use crate::map::is_reached;
use crate::store::reader::Reader;

/// A tracker answers within a second, also if it stands still.
const PATIENCE: Duration = Duration::from_secs(4);

/// The part of `/api/session` that is of interest.
#[derive(Deserialize)]
struct Session {
    #[serde(default)]
    version: Option<String>,
}

/// How the tracker is, and how its modules are.
pub(super) fn ask(map: &MapPlace, token: Option<&str>) -> (MapFact, Result<Devices, String>) {
    let address = reached_from_here(map.listen);
    let fact = |health, version| MapFact {
        address,
        is_reached: is_reached(&map.listen),
        insecure: map.insecure,
        first_admin: map.first_admin,
        health,
        version,
        own_version: env!("CARGO_PKG_VERSION"),
    };
    // Asked in clear: a certificate that cannot be read here says nothing of the tracker.
    let health = match agent(PATIENCE, None) {
        Ok(agent) => health(&agent, address),
        Err(error) => Health::NoAnswer(error.to_string()),
    };
    if health != Health::Goes {
        let why = "no tracker answers".to_owned();
        return (fact(health, Err(why.clone())), Err(why));
    }
    let certificate = map.certificate.as_deref().filter(|file| file.exists());
    let agent = match agent(PATIENCE, certificate) {
        Ok(agent) => agent,
        Err(error) => {
            let file = certificate.unwrap_or(Path::new("its certificate")).display();
            let why =
                format!("{file}: {error}: see that this user may read it, and that it is a certificate");
            return (fact(health, Err(why.clone())), Err(why));
        }
    };
    let scheme = if map.certificate.is_some() { "https" } else { "http" };
    let base = format!("{scheme}://{address}");
    let version = get::<Session>(&agent, &format!("{base}/api/session"), token)
        .and_then(|session| session.version.ok_or_else(|| "it tells only clients that may look".to_owned()));
    let devices = get::<Snapshot>(&agent, &format!("{base}/api/state"), token).map(devices);
    (fact(health, version), devices)
}

/// What a tracker has written last; none if nothing is to be read.
pub(super) fn last_known(database: &Path) -> Option<Devices> {
    let reader = Reader::look(database).ok()?;
    reader.snapshot().ok()?.map(devices)
}

fn devices(frame: Snapshot) -> Devices {
    let age_ms = unix_ms().saturating_sub(frame.unix_ms);
    Devices { age_s: age_ms as f64 / 1000.0, modules: frame.modules }
}

/// `/healthz` is answered in clear, also where TLS is spoken.
fn health(agent: &Agent, address: SocketAddr) -> Health {
    match agent.get(format!("http://{address}/healthz")).call() {
        Err(error) => Health::NoAnswer(error.to_string()),
        Ok(mut answer) => {
            let text = answer.body_mut().with_config().limit(LONGEST).read_to_string().unwrap_or_default();
            match (answer.status().as_u16(), text.as_str()) {
                (200, "ok\n") => Health::Goes,
                (503, _) => Health::Stands,
                (status, _) => Health::Other(status),
            }
        }
    }
}

fn get<T: DeserializeOwned>(agent: &Agent, url: &str, token: Option<&str>) -> Result<T, String> {
    let request = agent.get(url);
    let request = match token {
        Some(token) => request.header("Authorization", format!("Bearer {token}")),
        None => request,
    };
    let mut answer = request.call().map_err(|error| error.to_string())?;
    match answer.status().as_u16() {
        200 => {
            let text = answer.body_mut().with_config().limit(LONGEST).read_to_string();
            let text = text.map_err(|error| error.to_string())?;
            serde_json::from_str(&text).map_err(|error| error.to_string())
        }
        // What is asked in clear of a tracker over TLS.
        307 => Err("it is served over TLS: name its options, as kehai-tracker doctor SITE.toml -- --http=0.0.0.0:8420".to_owned()),
        401 | 403 => Err("one has to log in".to_owned()),
        status => Err(format!("HTTP {status}")),
    }
}

/// Where this machine reaches what listens there.
fn reached_from_here(listen: SocketAddr) -> SocketAddr {
    match listen {
        SocketAddr::V4(v4) if v4.ip().is_unspecified() => (Ipv4Addr::LOCALHOST, v4.port()).into(),
        SocketAddr::V6(v6) if v6.ip().is_unspecified() => (Ipv6Addr::LOCALHOST, v6.port()).into(),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::TcpListener;

    use super::*;

    #[test]
    fn a_tracker_whose_certificate_cannot_be_read_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let certificate = folder.path().join("home.cert.pem");
        std::fs::write(&certificate, "-----BEGIN CERTIFICATE-----\nMIIB\n").unwrap();
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let listen = listener.local_addr().unwrap();
        let answers = std::thread::spawn(move || {
            let (mut client, _) = listener.accept().unwrap();
            let mut asked = [0; 1024];
            let length = client.read(&mut asked).unwrap();
            client
                .write_all(b"HTTP/1.1 200 OK\r\nContent-Length: 3\r\nConnection: close\r\n\r\nok\n")
                .unwrap();
            asked[..length].starts_with(b"GET /healthz ")
        });
        let map = MapPlace { listen, certificate: Some(certificate), insecure: false, first_admin: false };
        let (fact, devices) = ask(&map, None);
        assert!(answers.join().unwrap());
        assert_eq!(fact.health, Health::Goes);
        for why in [fact.version.unwrap_err(), devices.unwrap_err()] {
            assert!(why.contains("home.cert.pem: "), "{why}");
        }
    }
}
