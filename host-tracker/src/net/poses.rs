//! Alarms about the places of devices: one that was turned, moved or covered is named while people walk.
//!
//! ```text
//!   observations ─▶ PoseWatch ─▶ finding ─▶ alarm on the device's line
//!   backgrounds ────▶┘
//! ```
//!
//! An alarm stands until a walk has shown that the device is well, over a restart of the tracker, too, or until the site is changed.

use std::collections::BTreeMap;

use kehai_tracking::alarm::{AlarmKind, AlarmLine, Cause};
use kehai_tracking::alarm_list::{About, ListedAlarm};
use kehai_tracking::calibration::watch::PoseWatch;
use kehai_tracking::calibration::words;
use kehai_tracking::observation::Observation;
use kehai_tracking::session::Sessions;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::ModuleLine;

/// Watches over the places of a site's devices.
#[derive(Debug)]
pub struct Poses {
    watch: PoseWatch,
    /// What stood when an earlier process ended, by the device's place in the site.
    before: BTreeMap<usize, AlarmLine>,
}

impl Poses {
    /// Of the devices of this site.
    #[must_use]
    pub fn new(site: &Site) -> Self {
        Self { watch: PoseWatch::new(site), before: BTreeMap::new() }
    }

    /// Of the devices of this site, with the alarms of an earlier process that stood when it ended: without a person who walks none
    /// of them would be raised again.
    #[must_use]
    pub fn resume(site: &Site, alarms: &[ListedAlarm]) -> Self {
        let mut poses = Self::new(site);
        for alarm in alarms.iter().filter(|alarm| alarm.about == About::Module) {
            let Cause::Fault(kind @ (AlarmKind::Moved | AlarmKind::Blind)) = alarm.cause else { continue };
            if let Some(place) = site.modules.iter().position(|module| module.name == alarm.of) {
                poses.before.insert(place, AlarmLine::new(kind, alarm.text.clone()));
            }
        }
        poses
    }

    /// Uses what a device saw.
    pub fn observe(&mut self, observation: &Observation) {
        self.watch.observe(observation);
    }

    /// Adds what is wrong to `lines`, which begin with the site's devices in its order. Of a device that is silent, or
    /// covered, nothing more is said.
    pub fn raise(&mut self, sessions: &Sessions, lines: &mut [ModuleLine], now_us: u64) {
        for session in sessions.in_place() {
            if let Some(place) = session.place_in_site() {
                self.watch.know_walls(place, session.walls_mm());
            }
        }
        let findings = self.watch.findings(now_us as f64 * 1e-6);
        let is_found = |place: usize| findings.iter().any(|(found, _)| *found == place);
        self.before.retain(|&place, _| !self.watch.is_well(place) && !is_found(place));
        let found = findings.iter().map(|(place, finding)| {
            let (kind, text) = words::finding(finding);
            (*place, AlarmLine::new(kind, text))
        });
        for (place, alarm) in found.chain(self.before.clone()) {
            let Some(line) = lines.get_mut(place) else { continue };
            if !line.alarms.iter().any(|alarm| matches!(alarm.kind, AlarmKind::Silent | AlarmKind::Covered)) {
                line.alarms.push(alarm);
                line.alarms.sort_by_key(|alarm| std::cmp::Reverse(alarm.severity));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use kehai::centre::Estimator;

    use super::*;

    fn stood(of: &str, kind: AlarmKind) -> ListedAlarm {
        let cause = Cause::Fault(kind);
        ListedAlarm {
            id: 1,
            about: About::Module,
            of: of.to_owned(),
            cause,
            severity: cause.severity(),
            text: "it was turned".to_owned(),
            since_ms: 1,
            until_ms: None,
            acknowledged: None,
        }
    }

    #[test]
    fn what_only_a_walk_can_show_stands_over_a_restart_and_nothing_else_does() {
        let module = |name: &str| format!("[[module]]\nname = \"{name}\"\nx = 0\ny = 0\n");
        let site: Site = toml::from_str(&[module("left"), module("right")].concat()).unwrap();
        let alarms = [
            stood("right", AlarmKind::Moved),
            stood("left", AlarmKind::Slow),
            stood("gone", AlarmKind::Blind),
        ];
        let sessions = Sessions::new(Arc::new(site.clone()), Estimator::default());
        let raised = |mut poses: Poses| {
            let mut lines = [ModuleLine::default(), ModuleLine::default()];
            poses.raise(&sessions, &mut lines, 0);
            lines.map(|line| line.alarms.iter().map(|alarm| alarm.kind).collect::<Vec<_>>())
        };
        assert_eq!(raised(Poses::resume(&site, &alarms)), [vec![], vec![AlarmKind::Moved]]);
        assert_eq!(raised(Poses::new(&site)), [vec![], vec![]], "the site was changed");
    }
}
