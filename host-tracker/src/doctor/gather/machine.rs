//! Asks the machine: timedatectl for its clock, systemctl for the service.
//!
//! Sources: timedatectl(1), `NTPSynchronized`; systemctl(1), `show`; sd_booted(3).

use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crate::doctor::facts::{Activity, Clock, Service};

/// A bus that does not answer within this time is none.
const PATIENCE: Duration = Duration::from_secs(5);

/// Between two looks.
const AGAIN: Duration = Duration::from_millis(20);

/// Whether the clock is set by another.
pub(super) fn clock() -> Clock {
    said_by_timedatectl(&said("timedatectl", &["show", "--property=NTPSynchronized", "--value"]))
}

fn said_by_timedatectl(said: &Result<String, String>) -> Clock {
    match said.as_deref().map(str::trim) {
        Ok("yes") => Clock::Synchronised,
        Ok("no") => Clock::Free,
        _ => Clock::Unknown,
    }
}

/// The service; none where systemd does not run.
pub(super) fn service() -> Option<Service> {
    let properties = "--property=LoadState,ActiveState,UnitFileState,NRestarts";
    Path::new("/run/systemd/system").is_dir().then(|| {
        match said("systemctl", &["show", "kehai-tracker", properties]) {
            Ok(text) => said_by_systemctl(&text),
            Err(why) => Service::Unknown(why),
        }
    })
}

fn said_by_systemctl(text: &str) -> Service {
    let value = |name: &str| {
        let mut pairs = text.lines().filter_map(|line| line.split_once('='));
        pairs.find(|(key, value)| *key == name && !value.is_empty()).map(|(_, value)| value)
    };
    match value("LoadState") {
        Some("not-found") => return Service::NotInstalled,
        Some("loaded") => {}
        other => return Service::Unknown(format!("its unit is {}", other.unwrap_or("not spoken of"))),
    }
    let activity = match value("ActiveState") {
        Some("active" | "reloading") => Activity::Active,
        Some("activating") => Activity::Starting,
        Some("failed") => Activity::Failed,
        Some("inactive" | "deactivating") => Activity::Inactive,
        _ => Activity::Other,
    };
    let enabled =
        value("UnitFileState").map(|state| matches!(state, "enabled" | "enabled-runtime" | "static"));
    Service::Installed {
        activity,
        enabled,
        restarts: value("NRestarts").and_then(|times| times.parse().ok()),
    }
}

/// What a program prints, if it ends well and soon.
fn said(program: &str, arguments: &[&str]) -> Result<String, String> {
    let mut command = Command::new(program);
    let quiet = command.args(arguments).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = quiet.spawn().map_err(|error| format!("{program}: {error}"))?;
    let begun = Instant::now();
    // What is asked for is a few lines: the pipe holds them until the program has ended.
    while child.try_wait().map_err(|error| format!("{program}: {error}"))?.is_none() {
        if begun.elapsed() > PATIENCE {
            // It may have ended at this moment.
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("{program} does not answer"));
        }
        thread::sleep(AGAIN);
    }
    let output = child.wait_with_output().map_err(|error| format!("{program}: {error}"))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(format!("{program}: {}", output.status)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_systemctl_says_is_read_and_what_it_does_not_say_is_unknown() {
        let text = "LoadState=loaded\nActiveState=active\nUnitFileState=enabled\nNRestarts=2\n";
        let service = |activity, enabled, restarts| Service::Installed { activity, enabled, restarts };
        assert_eq!(said_by_systemctl(text), service(Activity::Active, Some(true), Some(2)));
        let text = "LoadState=loaded\nActiveState=failed\nUnitFileState=disabled\nNRestarts=\n";
        assert_eq!(said_by_systemctl(text), service(Activity::Failed, Some(false), None));
        assert_eq!(said_by_systemctl("LoadState=not-found\nActiveState=inactive\n"), Service::NotInstalled);
        assert!(matches!(said_by_systemctl(""), Service::Unknown(_)));
        assert!(matches!(said_by_systemctl("LoadState=masked\n"), Service::Unknown(_)));
    }

    #[test]
    fn a_clock_is_only_synchronised_if_that_is_said() {
        let of = |text: &str| said_by_timedatectl(&Ok(text.to_owned()));
        assert_eq!((of("yes\n"), of("no\n"), of("")), (Clock::Synchronised, Clock::Free, Clock::Unknown));
        assert_eq!(said_by_timedatectl(&Err("no bus".into())), Clock::Unknown);
    }

    #[test]
    fn a_program_that_is_missing_fails_or_hangs_is_said_to() {
        assert!(said("kehai-no-such-program", &[]).unwrap_err().contains("kehai-no-such-program"));
        assert!(said("false", &[]).is_err());
        assert_eq!(said("echo", &["yes"]).unwrap(), "yes\n");
    }
}
