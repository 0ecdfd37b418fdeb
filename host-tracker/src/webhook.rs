//! Tells another program by HTTP what becomes of alarms.
//!
//! ```text
//!   alarm list ─▶ (queue) ─▶ POST URL  {"event": "raised" │ "acknowledged" │ "ended", "site": "home", "alarm": {…}}
//!                               └ no answer of 2xx within 5 s: again after 1 s and 5 s, then given up, and counted
//! ```
//!
//! A thread of its own: tracking never waits for it. A URL may hold a secret; no more than its host is ever said.

use std::fmt;
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use ureq::Agent;
use ureq::http::Uri;

use crate::alarm_handle::{AlarmChange, AlarmHandle};
use crate::http_agent::agent;
use crate::supervise::Worker;
use crate::tracker_alarms::TrackerAlarms;
use crate::web::bodies::AlarmTold;

/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// Waits before the same is told again.
const AGAIN: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(5)];

/// Between two looks at whether it is to end.
const LOOK: Duration = Duration::from_millis(100);

/// Where alarms are told.
#[derive(Clone, PartialEq, Eq)]
pub struct Target(Uri);

/// That is no such place.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a webhook is http://HOST[:PORT]/… or https://…")]
pub struct NoTarget;

impl FromStr for Target {
    type Err = NoTarget;

    fn from_str(text: &str) -> Result<Self, NoTarget> {
        let uri: Uri = text.parse().map_err(|_| NoTarget)?;
        let is_http = matches!(uri.scheme_str(), Some("http" | "https"));
        if is_http && uri.host().is_some_and(|host| !host.is_empty()) { Ok(Self(uri)) } else { Err(NoTarget) }
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.host().unwrap_or_default())
    }
}

impl fmt::Debug for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Target({self})")
    }
}

/// Tells until it is dropped.
#[derive(Debug)]
pub struct Webhook {
    _thread: Worker,
}

impl Webhook {
    /// Tells `target` from now on what becomes of the alarms of the site.
    ///
    /// # Errors
    /// There is no thread for it.
    pub fn start(
        target: Target,
        site: String,
        listed: AlarmHandle,
        alarms: TrackerAlarms,
    ) -> std::io::Result<Self> {
        let changes = listed.listen();
        let agent = agent(PATIENCE, None).map_err(std::io::Error::other)?;
        let work = move |stop: &AtomicBool| {
            Teller { agent: &agent, target: &target, site: &site, stop }.run(&changes, &listed);
            Ok(())
        };
        Ok(Self { _thread: Worker::start("webhook", alarms, work)? })
    }
}

struct Teller<'a> {
    agent: &'a Agent,
    target: &'a Target,
    site: &'a str,
    stop: &'a AtomicBool,
}

impl Teller<'_> {
    fn run(&self, changes: &Receiver<AlarmChange>, listed: &AlarmHandle) {
        while !self.stop.load(Ordering::Relaxed) {
            match changes.recv_timeout(LOOK) {
                Ok(change) => {
                    let told = self.tell(&change);
                    let failed = listed.count_told(told.is_ok());
                    if let Err(why) = told
                        && failed.is_power_of_two()
                    {
                        tracing::warn!(
                            "webhook at {}: {why}; {failed} not told since the start",
                            self.target
                        );
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    /// Tries until it is told, or given up.
    fn tell(&self, change: &AlarmChange) -> Result<(), ureq::Error> {
        let body =
            AlarmTold { event: change.became, site: self.site.to_owned(), alarm: change.alarm.clone() };
        let body = serde_json::to_string(&body).unwrap_or_default();
        let mut pauses = AGAIN.iter();
        loop {
            let request = self.agent.post(&self.target.0).header("Content-Type", "application/json");
            let why = match request.send(body.as_str()) {
                Ok(answer) if answer.status().is_success() => return Ok(()),
                Ok(answer) => ureq::Error::StatusCode(answer.status().as_u16()),
                Err(why) => why,
            };
            let Some(pause) = pauses.next() else { return Err(why) };
            let begun = Instant::now();
            while begun.elapsed() < *pause {
                if self.stop.load(Ordering::Relaxed) {
                    return Err(why);
                }
                std::thread::sleep(LOOK);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_addresses_of_http_are_taken_and_no_more_than_the_host_is_shown() {
        for wrong in ["", "here", "ftp://here/", "http://", "/path", "mqtt://here"] {
            assert_eq!(wrong.parse::<Target>(), Err(NoTarget), "{wrong}");
        }
        let target: Target =
            "https://me:secret@hooks.example:8443/services/secret?key=secret".parse().unwrap();
        assert_eq!(format!("{target} {target:?}"), "hooks.example Target(hooks.example)");
    }
}
