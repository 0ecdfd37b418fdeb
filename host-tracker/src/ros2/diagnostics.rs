//! How the modules are, and what is known of people, as `diagnostic_msgs/msg/DiagnosticArray`.
//!
//! ```text
//!   kehai_tracker: people         OK known · WARN a part is not seen · STALE nothing is known
//!   kehai_tracker: module NAME    OK watching · WARN learning, storing …, or an alarm · ERROR one by which it is blind · STALE missing
//! ```

use kehai_tracking::alarm::Severity;
use kehai_tracking::occupancy::ZoneKnown;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{DeviceState, ModuleLine, Snapshot};

use super::messages::{DiagnosticArray, DiagnosticStatus, Header, KeyValue, Level};

/// One status of people, and one of each module of the site; what was found beside them may be another site's. `missed_scans` are those
/// that were not published.
pub fn diagnostics(snapshot: &Snapshot, site: &Site, missed_scans: u64) -> DiagnosticArray {
    let mut status = vec![people(snapshot, missed_scans)];
    status.extend(snapshot.own_modules(site).map(module));
    DiagnosticArray { header: Header::new("", snapshot.stamp_ns()), status }
}

fn people(snapshot: &Snapshot, missed_scans: u64) -> DiagnosticStatus {
    let total = snapshot.total;
    let (level, message) = match total.state {
        ZoneKnown::Known => (Level::Ok, "known"),
        ZoneKnown::Partly => (Level::Warn, "partly known: there may be more"),
        ZoneKnown::Unknown => (Level::Stale, "not known"),
    };
    let count = total.count.map_or("unknown".to_owned(), |count| count.to_string());
    DiagnosticStatus {
        level,
        name: "kehai_tracker: people".to_owned(),
        message: message.to_owned(),
        hardware_id: String::new(),
        values: vec![value("count", count), value("missed_scans", missed_scans.to_string())],
    }
}

fn module(module: &ModuleLine) -> DiagnosticStatus {
    let by_state = match module.state {
        DeviceState::Watching => Level::Ok,
        DeviceState::Missing => Level::Stale,
        DeviceState::Found | DeviceState::Searching | DeviceState::Learning | DeviceState::Storing => {
            Level::Warn
        }
    };
    let by_alarm = |severity| match severity {
        Severity::Notice | Severity::Degraded => Level::Warn,
        Severity::Failed => Level::Error,
    };
    let worst = module.alarms.iter().map(|alarm| by_alarm(alarm.severity)).max();
    // Of a module that is missing nothing is known, whatever it said last.
    let level = by_state.max(worst.unwrap_or_default());
    let message = module.alarms.first().map_or_else(|| module.state.to_string(), |alarm| alarm.text.clone());
    let seconds = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| format!("{value:.1}"));
    let share = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| format!("{value:.4}"));
    let unknown_share = (module.state != DeviceState::Missing).then_some(module.unknown_share);
    DiagnosticStatus {
        level,
        name: format!("kehai_tracker: module {}", module.name),
        message,
        hardware_id: module.id.clone(),
        values: vec![
            value("state", module.state.to_string()),
            value("scans_hz", format!("{:.1}", module.scans_hz)),
            value("lost_share", share(module.lost_share)),
            value("unknown_share", share(unknown_share)),
            value("silent_s", seconds(module.silent_s)),
        ],
    }
}

fn value(key: &str, value: String) -> KeyValue {
    KeyValue { key: key.to_owned(), value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::alarm::{AlarmKind, AlarmLine};
    use kehai_tracking::occupancy::Total;

    fn level(state: DeviceState, alarms: Vec<AlarmLine>) -> (Level, String) {
        let line = ModuleLine { name: "left".into(), state, alarms, ..ModuleLine::default() };
        let status = module(&line);
        assert_eq!(status.name, "kehai_tracker: module left");
        (status.level, status.message)
    }

    #[test]
    fn a_module_is_as_bad_as_its_state_and_its_worst_alarm() {
        let alarm = |kind| AlarmLine::new(kind, "clean it");
        let said = |level, message: &str| (level, message.to_owned());
        assert_eq!(level(DeviceState::Watching, vec![]), said(Level::Ok, "watching"));
        assert_eq!(level(DeviceState::Learning, vec![]), said(Level::Warn, "learning"));
        assert_eq!(level(DeviceState::Missing, vec![]), said(Level::Stale, "missing"));
        assert_eq!(
            level(DeviceState::Watching, vec![alarm(AlarmKind::Dirty)]),
            said(Level::Warn, "clean it")
        );
        assert_eq!(
            level(DeviceState::Watching, vec![alarm(AlarmKind::Covered)]),
            said(Level::Error, "clean it")
        );
        assert_eq!(
            level(DeviceState::Missing, vec![alarm(AlarmKind::Silent)]),
            said(Level::Stale, "clean it")
        );
    }

    #[test]
    fn how_much_a_module_sees_that_is_missing_is_unknown() {
        let said = |state| {
            let line = ModuleLine { state, unknown_share: 0.25, ..ModuleLine::default() };
            let values = module(&line).values.into_iter();
            values.filter(|one| one.key == "unknown_share").map(|one| one.value).collect::<Vec<_>>()
        };
        assert_eq!([said(DeviceState::Watching), said(DeviceState::Missing)], [["0.2500"], ["unknown"]]);
    }

    #[test]
    fn a_module_that_is_not_the_site_s_is_not_told() {
        let line = |name: &str, state| ModuleLine { name: name.into(), state, ..ModuleLine::default() };
        let strangers = [line("stranger", DeviceState::Found), line("switched-off", DeviceState::Missing)];
        let modules = [line("left", DeviceState::Missing)].into_iter().chain(strangers).collect();
        let site = Site::parse("site", "[[module]]\nname = \"left\"\nx = 0\ny = 0\n").unwrap();
        let status = diagnostics(&Snapshot { modules, ..Snapshot::default() }, &site, 0).status;
        let names: Vec<&str> = status.iter().map(|status| status.name.as_str()).collect();
        assert_eq!(names, ["kehai_tracker: people", "kehai_tracker: module left"]);
    }

    #[test]
    fn what_is_not_known_of_people_is_said() {
        let said = |count, state| {
            let snapshot = Snapshot { total: Total { count, state }, ..Snapshot::default() };
            let status = diagnostics(&snapshot, &Site::default(), 3).status.remove(0);
            (status.level, status.values[0].value.clone(), status.values[1].value.clone())
        };
        assert_eq!(said(Some(2), ZoneKnown::Known), (Level::Ok, "2".into(), "3".into()));
        assert_eq!(said(Some(2), ZoneKnown::Partly), (Level::Warn, "2".into(), "3".into()));
        assert_eq!(said(None, ZoneKnown::Unknown), (Level::Stale, "unknown".into(), "3".into()));
    }
}
