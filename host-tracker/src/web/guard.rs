//! Which requests are allowed, and from which page: other sites' pages, open in the same browser, are refused.
//!
//! ```text
//!   browser ── Host: what was typed ──▶ this machine's own name or address?   no: a name that was made to
//!          └── Origin: the page ─────▶ the same host? (writes, sockets)          point here (DNS rebinding)
//! ```
//!
//! A page of `evil.lan` is as foreign as one of `evil.example`: the DNS server of this network can make either
//! point here. So only what names this very machine passes:
//!
//! | `Host` | |
//! |---|---|
//! | the address that the connection reached, or any of loopback | an address cannot be made to point elsewhere |
//! | `localhost` | browsers ask no server for it |
//! | the host's own name, alone, whole, and with `.local`, `.lan`, `.home.arpa` | what routers and mDNS make of it |
//! | names of `--http-name` | others that its owner gave it |
//!
//! A request with two `Host` is refused as malformed (RFC 9112, 3.2): one of them may be what passes, the other what was asked.
//!
//! A program without `Origin` is no browser, and passes: who it is, and what it may, is asked after that (`access`).

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

/// The host that the browser believes it asks: `Host`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Host<'a> {
    /// It is not said.
    None,
    /// This one.
    One(&'a str),
    /// Several: which of them a proxy on the way, or the browser, has meant cannot be known.
    Several,
}

/// What a request says of its origin.
#[derive(Clone, Copy, Debug)]
pub struct Asks<'a> {
    /// The address that its connection reached.
    pub own: IpAddr,
    /// The host that it is for.
    pub host: Host<'a>,
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
    /// More than one `Host`.
    #[error("the request says more than once which host it is for")]
    SeveralHosts,
    /// Another machine's name, or an address that is not here.
    #[error(
        "\"{0}\" is no name of this machine: open the map at {1}, or start the tracker with --http-name {0}"
    )]
    ForeignName(String, IpAddr),
    /// Another page's script.
    #[error("refused: the page {origin} may not do this at {host}; only the map's own page may")]
    ForeignPage {
        /// The page that asked.
        origin: String,
        /// The host that it asked.
        host: String,
    },
}

/// Ends that routers and mDNS put behind the name of a machine.
const ENDS: [&str; 3] = [".local", ".lan", ".home.arpa"];

/// The names of this machine.
#[derive(Clone, Debug, Default)]
pub struct Names(Vec<String>);

impl Names {
    /// As the system calls it, and these.
    #[must_use]
    pub fn of_this_machine(others: &[String]) -> Self {
        let system = rustix::system::uname();
        Self::new(system.nodename().to_str().unwrap_or_default(), others)
    }

    /// Of a machine that the system calls this.
    fn new(own: &str, others: &[String]) -> Self {
        let mut names = vec!["localhost".to_owned()];
        let short = own.split('.').next().unwrap_or(own);
        if !short.is_empty() {
            names.extend([own.to_owned(), short.to_owned()]);
            names.extend(ENDS.map(|end| format!("{short}{end}")));
        }
        names.extend_from_slice(others);
        Self(names)
    }

    /// All of them.
    pub fn all(&self) -> &[String] {
        &self.0
    }

    fn has(&self, name: &str) -> bool {
        // DNS knows a name by a dot behind it, too.
        let name = name.strip_suffix('.').unwrap_or(name);
        self.0.iter().any(|known| known.eq_ignore_ascii_case(name))
    }
}

/// Whether a request may pass.
///
/// # Errors
/// Why it may not.
pub fn check(asks: &Asks<'_>, names: &Names) -> Result<(), Refusal> {
    let host = match asks.host {
        Host::One(host) => host,
        Host::None => return Err(Refusal::NoHost),
        Host::Several => return Err(Refusal::SeveralHosts),
    };
    let name = without_port(host);
    let is_here = |address: IpAddr| address == asks.own || address.is_loopback();
    if !address(name).is_some_and(is_here) && !names.has(name) {
        return Err(Refusal::ForeignName(name.to_owned(), asks.own));
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

/// The address that is written as a host, IPv6 between brackets.
fn address(name: &str) -> Option<IpAddr> {
    match name.strip_prefix('[').and_then(|name| name.strip_suffix(']')) {
        Some(inner) => inner.parse::<Ipv6Addr>().ok().map(|address| IpAddr::from(address).to_canonical()),
        None => name.parse::<Ipv4Addr>().ok().map(IpAddr::from),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOCAL: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

    fn asks(host: Option<&str>) -> Asks<'_> {
        let host = host.map_or(Host::None, Host::One);
        Asks { own: LOCAL, host, origin: None, fetch_site: None, writes: false, opens_socket: false }
    }

    fn names() -> Names {
        Names::new("hall.example.net", &["map.example.org".to_owned(), "192.168.1.9".to_owned()])
    }

    fn write(host: &str, origin: &str) -> Result<(), Refusal> {
        check(&Asks { origin: Some(origin), writes: true, ..asks(Some(host)) }, &names())
    }

    #[test]
    fn f11_only_this_machine_is_asked_for() {
        let own = IpAddr::from([192, 168, 1, 4]);
        for host in [
            "127.0.0.1:8080",
            "localhost:8080",
            "LOCALHOST.",
            "[::1]:8080",
            "[::ffff:192.168.1.4]",
            "192.168.1.4",
            "hall",
            "Hall.local:80",
            "hall.lan",
            "hall.home.arpa",
            "hall.example.net",
            "map.example.org",
            "192.168.1.9",
        ] {
            assert_eq!(check(&Asks { own, ..asks(Some(host)) }, &names()), Ok(()), "{host}");
        }
        for host in [
            "evil.local",
            "evil.lan",
            "evil",
            "evil.localhost",
            "hall.evil.lan",
            "evil.example:8080",
            "127.0.0.1.evil.example",
            "192.168.1.5",
            "[fe80::1]",
            "",
            ".",
            ":80",
            "[::1].evil.example",
            "a/b",
        ] {
            for writes in [false, true] {
                let refused = check(&Asks { own, writes, ..asks(Some(host)) }, &names());
                let text = refused.unwrap_err().to_string();
                assert!(text.contains("--http-name") && text.contains("192.168.1.4"), "{host}: {text}");
            }
        }
        assert_eq!(check(&asks(None), &names()), Err(Refusal::NoHost));
        let several = Asks { host: Host::Several, ..asks(None) };
        assert_eq!(check(&several, &names()), Err(Refusal::SeveralHosts));
        assert!(check(&asks(Some("")), &Names::new("", &[])).is_err(), "a machine without a name");
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
        let local = asks(Some("localhost"));
        let socket = Asks { origin: Some("http://evil.example"), opens_socket: true, ..local };
        assert!(check(&socket, &names()).is_err());
        let fetch = Asks { fetch_site: Some("cross-site"), writes: true, ..local };
        assert!(check(&fetch, &names()).is_err());
    }

    #[test]
    fn a_program_is_no_browser() {
        assert_eq!(check(&Asks { writes: true, ..asks(Some("localhost:1")) }, &names()), Ok(()));
    }
}
