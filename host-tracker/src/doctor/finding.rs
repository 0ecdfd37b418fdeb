//! What follows from the facts about one part of an installation.

use std::borrow::Cow;
use std::fmt;

use serde::Serialize;

use crate::named::named;

named! {
    /// How it is.
    #[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
    #[serde(rename_all = "lowercase")]
    pub enum Verdict {
        /// As it should be.
        Ok = "ok",
        /// It could not be found out.
        Unknown = "unknown",
        /// It works, but the installer should look at it.
        Warning = "warning",
        /// It does not work, or is not safe.
        Wrong = "wrong",
    }
}

named! {
    /// What was looked at.
    #[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
    #[serde(rename_all = "lowercase")]
    pub enum About {
        /// The options with which the tracker is started.
        Options = "options",
        /// systemd's service.
        Service = "service",
        /// The site's file.
        Site = "site",
        /// The keys of its modules.
        Keys = "keys",
        /// Who may log in.
        Users = "users",
        /// The key by which cards are hashed.
        Cards = "cards",
        /// The key of the tracker's own certificate.
        Certificate = "certificate",
        /// What is kept.
        Database = "database",
        /// The disk under it.
        Disk = "disk",
        /// The tracker that runs, by its live map.
        Tracker = "tracker",
        /// Its version.
        Version = "version",
        /// What the kernel keeps of datagrams.
        Buffer = "buffer",
        /// How modules are found.
        Discovery = "discovery",
        /// A module.
        Module = "module",
        /// The MQTT broker.
        Broker = "broker",
        /// The machine's clock.
        Clock = "clock",
    }
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
