//! Which requests are allowed, and from which page: other sites' pages, open in the same browser, are refused.
//!
//! ```text
//!   browser ── Host: what was typed ──▶ an address, or a local name?      no: a public name that was made to
//!          └── Origin: the page ─────▶ the same host? (writes, sockets)      point here (DNS rebinding)
//! ```
//!
//! A program without `Origin` is no browser, and is allowed: any program that reaches the port may write. So the server
//! listens on the loopback address unless it is told otherwise.

use std::net::{IpAddr, Ipv6Addr};

/// What a request says of its origin.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asks<'a> {
    /// `Host`: the host that the browser believes it asks.
    pub host: Option<&'a str>,
    /// `Origin`: the page that asks.
    pub origin: Option<&'a str>,
    /// `Sec-Fetch-Site`: the browser's own opinion.
    pub fetch_site: Option<&'a str>,
    /// Whether it may change something.
    pub writes: bool,
    /// Whether it opens a WebSocket, which browsers do not guard.
    pub opens_socket: bool,
}

/// Why a request is refused.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Refusal {
    /// No `Host`.
    #[error("the request does not say which host it is for")]
    NoHost,
    /// A public name.
    #[error(
        "\"{0}\" is not this machine's address or local name: open the map by its address, or allow the name \
         with --http-name {0}"
    )]
    ForeignName(String),
    /// Another page's script.
    #[error("refused: the page {origin} may not do this at {host}; only the map's own page may")]
    ForeignPage {
        /// The page that asked.
        origin: String,
        /// The host that it asked.
        host: String,
    },
}

/// Ends of names that no public server can have.
const LOCAL_ENDS: [&str; 5] = [".local", ".localhost", ".lan", ".internal", ".home.arpa"];

/// Whether a request may pass; `names` are allowed beside addresses and local names.
///
/// # Errors
/// Why it may not.
pub fn check(asks: &Asks<'_>, names: &[String]) -> Result<(), Refusal> {
    let host = asks.host.ok_or(Refusal::NoHost)?;
    let name = without_port(host);
    if !is_local(name) && !names.iter().any(|allowed| allowed.eq_ignore_ascii_case(name)) {
        return Err(Refusal::ForeignName(name.to_owned()));
    }
    if !(asks.writes || asks.opens_socket) {
        return Ok(());
    }
    let foreign = |origin: &str| Refusal::ForeignPage { origin: origin.to_owned(), host: host.to_owned() };
    if let Some(origin) = asks.origin {
        let asked = origin.strip_prefix("http://").or_else(|| origin.strip_prefix("https://"));
        if !asked.is_some_and(|from| from.eq_ignore_ascii_case(host)) {
            return Err(foreign(origin));
        }
    }
    match asks.fetch_site {
        None | Some("same-origin" | "none") => Ok(()),
        Some(_) => Err(foreign(asks.origin.unwrap_or("of another site"))),
    }
}

fn without_port(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if !port.is_empty() && port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    }
}

/// An address, a name without dots, or one that no public server can have.
fn is_local(name: &str) -> bool {
    let is_v6 = name
        .strip_prefix('[')
        .and_then(|name| name.strip_suffix(']'))
        .is_some_and(|inner| inner.parse::<Ipv6Addr>().is_ok());
    let lower = name.to_ascii_lowercase();
    let plain = !lower.is_empty()
        && lower.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'.');
    is_v6
        || name.parse::<IpAddr>().is_ok()
        || plain && (!lower.contains('.') || LOCAL_ENDS.iter().any(|end| lower.ends_with(end)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(host: &str) -> Result<(), Refusal> {
        check(&Asks { host: Some(host), ..Asks::default() }, &["map.example.org".to_owned()])
    }

    fn write(host: &str, origin: &str) -> Result<(), Refusal> {
        let asks = Asks { host: Some(host), origin: Some(origin), writes: true, ..Asks::default() };
        check(&asks, &[])
    }

    #[test]
    fn only_addresses_and_local_names_are_asked_for() {
        for host in [
            "127.0.0.1:8080",
            "localhost:8080",
            "[::1]:8080",
            "192.168.1.4",
            "hall",
            "hall.local",
            "map.example.org",
        ] {
            assert_eq!(read(host), Ok(()), "{host}");
        }
        for host in ["evil.example:8080", "127.0.0.1.evil.example", "", ":80", "[::1].evil.example", "a/b"] {
            assert!(read(host).is_err(), "{host}");
        }
        assert_eq!(check(&Asks::default(), &[]), Err(Refusal::NoHost));
    }

    #[test]
    fn another_page_may_neither_write_nor_open_a_socket() {
        assert_eq!(write("127.0.0.1:8080", "http://127.0.0.1:8080"), Ok(()));
        for origin in
            ["http://evil.example", "http://127.0.0.1:81", "null", "http://127.0.0.1:8080.evil.example"]
        {
            let why = write("127.0.0.1:8080", origin).unwrap_err().to_string();
            assert!(why.contains(origin), "{why}");
        }
        let socket = Asks {
            host: Some("localhost"),
            origin: Some("http://evil.example"),
            opens_socket: true,
            ..Asks::default()
        };
        assert!(check(&socket, &[]).is_err());
        let fetch =
            Asks { host: Some("localhost"), fetch_site: Some("cross-site"), writes: true, ..Asks::default() };
        assert!(check(&fetch, &[]).is_err());
    }

    #[test]
    fn a_program_is_no_browser() {
        let asks = Asks { host: Some("localhost:1"), writes: true, ..Asks::default() };
        assert_eq!(check(&asks, &[]), Ok(()));
    }
}
