//! What follows from the facts about one part of an installation.

use std::borrow::Cow;
use std::fmt;

use serde::Serialize;

/// How it is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// As it should be.
    Ok,
    /// It could not be found out.
    Unknown,
    /// It works, but the installer should look at it.
    Warning,
    /// It does not work, or is not safe.
    Wrong,
}

/// What was looked at.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum About {
    /// The options with which the tracker is started.
    Options,
    /// systemd's service.
    Service,
    /// The site's file.
    Site,
    /// The keys of its modules.
    Keys,
    /// Who may log in.
    Users,
    /// The key by which cards are hashed.
    Cards,
    /// The key of the tracker's own certificate.
    Certificate,
    /// What is kept.
    Database,
    /// The disk under it.
    Disk,
    /// The tracker that runs, by its live map.
    Tracker,
    /// Its version.
    Version,
    /// What the kernel keeps of datagrams.
    Buffer,
    /// How modules are found.
    Discovery,
    /// A module.
    Module,
    /// The MQTT broker.
    Broker,
    /// The machine's clock.
    Clock,
}

/// A line of what was found.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct Finding {
    /// How it is.
    pub verdict: Verdict,
    /// What was looked at.
    pub about: About,
    /// What is so, in words.
    pub text: String,
    /// What to do, in words; absent where nothing is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub advice: Option<Cow<'static, str>>,
}

impl Verdict {
    /// Its name, as in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Unknown => "unknown",
            Self::Warning => "warning",
            Self::Wrong => "wrong",
        }
    }
}

impl About {
    /// Its name, as in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Options => "options",
            Self::Service => "service",
            Self::Site => "site",
            Self::Keys => "keys",
            Self::Users => "users",
            Self::Cards => "cards",
            Self::Certificate => "certificate",
            Self::Database => "database",
            Self::Disk => "disk",
            Self::Tracker => "tracker",
            Self::Version => "version",
            Self::Buffer => "buffer",
            Self::Discovery => "discovery",
            Self::Module => "module",
            Self::Broker => "broker",
            Self::Clock => "clock",
        }
    }
}

impl Finding {
    pub(super) fn ok(about: About, text: impl Into<String>) -> Self {
        Self { verdict: Verdict::Ok, about, text: text.into(), advice: None }
    }

    pub(super) fn unknown(
        about: About,
        text: impl Into<String>,
        advice: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self { verdict: Verdict::Unknown, about, text: text.into(), advice: Some(advice.into()) }
    }

    pub(super) fn warning(
        about: About,
        text: impl Into<String>,
        advice: impl Into<Cow<'static, str>>,
    ) -> Self {
        Self { verdict: Verdict::Warning, about, text: text.into(), advice: Some(advice.into()) }
    }

    pub(super) fn wrong(about: About, text: impl Into<String>, advice: impl Into<Cow<'static, str>>) -> Self {
        Self { verdict: Verdict::Wrong, about, text: text.into(), advice: Some(advice.into()) }
    }
}

impl fmt::Display for Finding {
    /// `wrong    keys         /etc/kehai/site.keys can be read by others: chmod 600 …`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<8} {:<12} {}", self.verdict.name(), self.about.name(), self.text)?;
        self.advice.as_ref().map_or(Ok(()), |advice| write!(f, ": {advice}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_how_it_is_what_is_so_and_what_to_do() {
        let wrong = Finding::wrong(About::Keys, "a.keys can be read by others", "chmod 600 a.keys");
        assert_eq!(wrong.to_string(), "wrong    keys         a.keys can be read by others: chmod 600 a.keys");
        let fine = Finding::ok(About::Certificate, "a.key.pem");
        assert_eq!(fine.to_string(), "ok       certificate  a.key.pem");
        let json = serde_json::to_string(&fine).unwrap();
        assert_eq!(json, r#"{"verdict":"ok","about":"certificate","text":"a.key.pem"}"#);
        for (name, shown) in [
            (Verdict::Warning.name(), serde_json::to_value(Verdict::Warning)),
            (About::Discovery.name(), serde_json::to_value(About::Discovery)),
        ] {
            assert_eq!(shown.unwrap(), name);
        }
    }
}
