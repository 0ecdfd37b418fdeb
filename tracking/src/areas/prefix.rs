//! The names of an area's zones, lines, doors and modules among those of all areas: `hall` of `east` is `east/hall`.

use super::AreaName;
use crate::alarm_list::{About, ListedAlarm};
use crate::floor::FloorLine;
use crate::jsonl::ZoneLine;
use crate::occupancy::ZoneKnown;
use crate::site::Site;
use crate::snapshot::{DeviceState, Snapshot};

fn put(area: &AreaName, name: &mut String) {
    *name = format!("{area}/{name}");
}

/// The site of an area with the names that it has among all. What leads to the only zone that counts says so: among all there are more.
pub fn site(area: &AreaName, mut site: Site) -> Site {
    let mut counting = site.zones.iter().filter(|zone| zone.count).map(|zone| zone.name.clone());
    let only = counting.next().filter(|_| counting.next().is_none());
    // Where none is marked, all count: among all areas only a mark says so.
    if !site.zones.iter().any(|zone| zone.count) {
        site.zones.iter_mut().for_each(|zone| zone.count = true);
    }
    for entry in &mut site.entries {
        entry.zone = entry.zone.take().or_else(|| only.clone());
        entry.zone.iter_mut().for_each(|zone| put(area, zone));
        put(area, &mut entry.name);
    }
    for door in &mut site.doors {
        put(area, &mut door.name);
        put(area, &mut door.zone);
    }
    site.modules.iter_mut().for_each(|module| put(area, &mut module.name));
    site.zones.iter_mut().for_each(|zone| put(area, &mut zone.name));
    site.lines.iter_mut().for_each(|line| put(area, &mut line.name));
    site.movers.iter_mut().for_each(|mover| put(area, &mut mover.name));
    site.excludes.iter_mut().for_each(|exclude| put(area, &mut exclude.name));
    site.readers.iter_mut().for_each(|reader| put(area, &mut reader.name));
    site.floors.iter_mut().for_each(|floor| put(area, &mut floor.name));
    site
}

/// Adds what an area of this site has said last to the picture of all: zones, lines, doors, modules. Its tracks are people of all areas.
pub fn add(area: &AreaName, site: Option<&Site>, frame: &Snapshot, to: &mut Snapshot) {
    for (name, zone) in &frame.line.zones {
        to.line.zones.insert(format!("{area}/{name}"), zone.clone());
    }
    to.lines.extend(frame.lines.iter().cloned().map(|mut line| {
        put(area, &mut line.name);
        line
    }));
    to.dwell.extend(frame.dwell.iter().cloned().map(|mut dwell| {
        put(area, &mut dwell.zone);
        dwell
    }));
    to.doors.extend(frame.doors.iter().cloned().map(|mut door| {
        put(area, &mut door.name);
        // The numbers of its tracks are those of the area.
        door.names.clear();
        door
    }));
    to.floors.extend(frame.floors.iter().cloned().map(|mut floor| {
        put(area, &mut floor.name);
        floor
    }));
    // What was found beside them is another area's, or no area's; without a site it is not known which these are.
    to.modules.extend(site.iter().flat_map(|site| frame.own_modules(site)).cloned().map(|mut module| {
        put(area, &mut module.name);
        module
    }));
}

/// Adds what is known of an area that is not heard: nothing of its zones, lines, modules and floors, by the names that its site and its
/// last frame have. Of its doors it is said that their tracker says nothing.
pub fn add_unheard(area: &AreaName, site: Option<&Site>, last: Option<&Snapshot>, to: &mut Snapshot) {
    let of_site = site.iter().flat_map(|site| &site.zones).map(|zone| &zone.name);
    let of_last = last.iter().flat_map(|last| last.line.zones.keys());
    for name in of_site.chain(of_last) {
        to.line.zones.insert(format!("{area}/{name}"), ZoneLine::unknown());
    }
    let Some(last) = last else { return };
    to.lines.extend(last.lines.iter().cloned().map(|mut line| {
        put(area, &mut line.name);
        line.state = ZoneKnown::Unknown;
        line
    }));
    to.doors.extend(last.doors.iter().cloned().map(|mut door| {
        put(area, &mut door.name);
        door.unheard()
    }));
    to.floors.extend(last.floors.iter().map(|floor| FloorLine {
        name: format!("{area}/{}", floor.name),
        columns: floor.columns,
        unknown_from: Some(0),
        ..FloorLine::default()
    }));
    to.modules.extend(site.iter().flat_map(|site| last.own_modules(site)).cloned().map(|mut module| {
        put(area, &mut module.name);
        module.state = DeviceState::Missing;
        module.alarms.clear();
        module.sees.clear();
        module
    }));
}

/// An alarm of an area, by `number`, which no alarm of another area has.
pub fn alarm(area: &AreaName, alarm: &ListedAlarm, number: u64) -> ListedAlarm {
    let mut alarm = alarm.clone();
    alarm.id = number;
    match alarm.about {
        About::Tracker | About::Area => (alarm.about, alarm.of) = (About::Area, area.to_string()),
        About::Module | About::Door | About::Zone => put(area, &mut alarm.of),
    }
    alarm
}
