//! The alarms of all areas: those about an area as a whole, and those that its tracker lists, each by a number of its own.

use std::collections::{BTreeMap, BTreeSet};

use super::area::Area;
use super::{AreaName, prefix};
use crate::alarm::{AlarmKind, Cause};
use crate::alarm_list::{About, ListedAlarm};

/// Which of an area's alarms.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Which {
    /// Nothing is heard of it, or not its site.
    Silent,
    /// Two trackers have its name.
    Shared,
    /// One that its tracker lists, by the number there.
    Listed(u64),
}

/// The number of each alarm of an area among those of all.
#[derive(Debug, Default)]
pub(super) struct Alarms {
    /// None: that about areas for which there is no room, whichever they are.
    numbers: BTreeMap<Option<(AreaName, Which)>, u64>,
    newest: u64,
}

impl Alarms {
    /// The alarms that stand at `now_us`, the oldest first; `refused` are areas that there is no room for, and since when there
    /// are such, ms since 1970.
    pub fn list(
        &mut self,
        areas: &BTreeMap<AreaName, Area>,
        (refused, refused_since_ms): (&BTreeMap<AreaName, u64>, u64),
        now_us: u64,
    ) -> Vec<ListedAlarm> {
        let mut all = Vec::new();
        let mut standing = BTreeSet::new();
        let mut number = |key: Option<(AreaName, Which)>| {
            standing.insert(key.clone());
            *self.numbers.entry(key).or_insert_with(|| {
                self.newest += 1;
                self.newest
            })
        };
        for (name, area) in areas {
            let said = area.said(now_us);
            if let Some(since_ms) = area.missed_since_ms {
                let text = match (&area.last, said) {
                    // What it has is not known, and so is what of that is gone.
                    (_, Some(_)) => format!(
                        "area {name} is heard, but has not said its site: look whether Zenoh lets its tracker be asked, and start that anew"
                    ),
                    (Some(_), None) => format!(
                        "nothing is heard of area {name}: look whether its tracker runs and is connected"
                    ),
                    (None, None) => {
                        format!("nothing was ever heard of area {name}: start its tracker with --area {name}")
                    }
                };
                let number = number(Some((name.clone(), Which::Silent)));
                all.push(of_area(name, number, (AlarmKind::Silent, text), since_ms));
            }
            let Some(last) = said else { continue };
            if let Some(since_ms) = area.shared_since_ms {
                let text = format!(
                    "two trackers say that they are area {name}, and what is shown of it changes from one to the other: start one of them with another --area"
                );
                let number = number(Some((name.clone(), Which::Shared)));
                all.push(of_area(name, number, (AlarmKind::SameName, text), since_ms));
            }
            all.extend(last.frame.alarms.iter().map(|alarm| {
                prefix::alarm(name, alarm, number(Some((name.clone(), Which::Listed(alarm.id)))))
            }));
        }
        if let Some((first, _)) = refused.first_key_value() {
            let text =
                format!("{} areas are too many, {first} among them: nothing of them is shown", refused.len());
            all.push(of_area(first, number(None), (AlarmKind::Silent, text), refused_since_ms));
        }
        self.numbers.retain(|key, _| standing.contains(key));
        all.sort_by_key(|alarm| alarm.since_ms);
        all
    }
}

/// An alarm about an area as a whole.
fn of_area(area: &AreaName, id: u64, (kind, text): (AlarmKind, String), since_ms: u64) -> ListedAlarm {
    ListedAlarm {
        id,
        about: About::Area,
        of: area.to_string(),
        cause: Cause::Fault(kind),
        severity: kind.severity(),
        text,
        since_ms,
        until_ms: None,
        acknowledged: None,
    }
}
