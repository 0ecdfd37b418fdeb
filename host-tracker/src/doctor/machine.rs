//! From facts about the machine to findings: its clock, and systemd's service.

use super::facts::{Activity, Clock, Service};
use super::finding::{About, Finding};

/// Whether systemd's service runs.
pub(super) fn service(service: Option<&Service>) -> Finding {
    let about = About::Service;
    let name = "kehai-tracker";
    match service {
        None => Finding::unknown(
            about,
            "systemd does not run here",
            "see that what starts the tracker here also starts it again when it ends, as a container's restart policy does",
        ),
        Some(Service::Unknown(why)) => {
            let advice = "ask as root: sudo kehai-tracker doctor; or systemctl status kehai-tracker";
            Finding::unknown(about, format!("systemd does not say how {name} is ({why})"), advice)
        }
        Some(Service::NotInstalled) => Finding::wrong(
            about,
            format!("systemd knows no {name}"),
            "install the package (docs/install.md), or name the site that is meant: kehai-tracker doctor SITE.toml",
        ),
        Some(Service::Installed { activity: Activity::Failed, .. }) => Finding::wrong(
            about,
            format!("{name} has failed"),
            "journalctl -u kehai-tracker -n 50 says why; then sudo systemctl restart kehai-tracker",
        ),
        Some(Service::Installed { activity: Activity::Inactive | Activity::Other, .. }) => {
            Finding::wrong(about, format!("{name} does not run"), "sudo systemctl start kehai-tracker")
        }
        Some(Service::Installed { activity: Activity::Starting, .. }) => Finding::warning(
            about,
            format!("{name} is being started"),
            "look again in a minute; if it stays so: journalctl -u kehai-tracker -n 50",
        ),
        Some(Service::Installed { activity: Activity::Active, enabled, restarts }) => {
            runs(name, *enabled, *restarts)
        }
    }
}

fn runs(name: &str, enabled: Option<bool>, restarts: Option<u32>) -> Finding {
    let about = About::Service;
    match (enabled, restarts) {
        (Some(false), _) => Finding::warning(
            about,
            format!("{name} runs, and does not start with the machine"),
            "sudo systemctl enable kehai-tracker",
        ),
        (_, Some(times @ 1..)) => Finding::warning(
            about,
            format!("{name} runs, and had to be started again ({times} times since it was started by hand)"),
            "journalctl -u kehai-tracker says why",
        ),
        (Some(true), Some(0)) => Finding::ok(about, format!("{name} runs, and starts with the machine")),
        (None, _) | (_, None) => Finding::unknown(
            about,
            format!("{name} runs; systemd does not say all of it"),
            "systemctl status kehai-tracker",
        ),
    }
}

/// Whether the clock is set by another.
pub(super) fn clock(clock: Clock) -> Finding {
    match clock {
        Clock::Synchronised => Finding::ok(About::Clock, "set by a time server"),
        Clock::Free => Finding::warning(
            About::Clock,
            "no time server sets it: what is kept has wrong times, and messages to doors count as late",
            "sudo timedatectl set-ntp true, or install chrony",
        ),
        Clock::Unknown => Finding::unknown(
            About::Clock,
            "the system does not say whether a time server sets it",
            "look yourself, in a container on its host: timedatectl",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::super::finding::Verdict;
    use super::*;

    #[test]
    fn a_service_is_fine_only_if_it_runs_starts_with_the_machine_and_stays() {
        let of = |activity, enabled, restarts| {
            service(Some(&Service::Installed { activity, enabled, restarts })).verdict
        };
        assert_eq!(of(Activity::Active, Some(true), Some(0)), Verdict::Ok);
        assert_eq!(of(Activity::Active, Some(false), Some(0)), Verdict::Warning);
        assert_eq!(of(Activity::Active, Some(true), Some(3)), Verdict::Warning);
        assert_eq!(of(Activity::Active, None, Some(0)), Verdict::Unknown);
        assert_eq!(of(Activity::Active, Some(true), None), Verdict::Unknown);
        assert_eq!(of(Activity::Starting, Some(true), Some(0)), Verdict::Warning);
        for down in [Activity::Failed, Activity::Inactive, Activity::Other] {
            assert_eq!(of(down, Some(true), Some(0)), Verdict::Wrong, "{down:?}");
        }
        assert_eq!(service(Some(&Service::NotInstalled)).verdict, Verdict::Wrong);
        assert_eq!(service(Some(&Service::Unknown("no bus".into()))).verdict, Verdict::Unknown);
        assert_eq!(service(None).verdict, Verdict::Unknown);
    }

    #[test]
    fn a_clock_of_which_nothing_is_known_is_not_fine() {
        let of = |state| clock(state).verdict;
        assert_eq!(of(Clock::Synchronised), Verdict::Ok);
        assert_eq!(of(Clock::Free), Verdict::Warning);
        assert_eq!(of(Clock::Unknown), Verdict::Unknown);
    }
}
