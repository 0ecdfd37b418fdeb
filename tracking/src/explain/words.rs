//! Reasons in words: nowhere else are there any. A line each, the most important first.

use super::Reasons;
use super::alarm::{AlarmCondition, DeviceCondition, Measured, Unit};
use super::glance::Why;
use super::person::{Life, PersonReasons, Sighting};
use super::zone::{Patch, ZoneReasons};
use crate::occupancy::ZoneKnown;
use crate::zones::facts::Inside;
use crate::zones::verdict::{Role, Verdict};

/// In words.
#[must_use]
pub fn words(reasons: &Reasons) -> Vec<String> {
    match reasons {
        Reasons::Zone(zone) => of_zone(zone),
        Reasons::Person(person) => of_person(person),
        Reasons::Alarm(devices) => devices.iter().map(of_device).collect(),
    }
}

fn of_zone(zone: &ZoneReasons) -> Vec<String> {
    let mut lines = vec![match (zone.is_line, zone.count, zone.state) {
        (true, _, ZoneKnown::Known) => "seen: no person crosses it unseen".to_owned(),
        (true, _, ZoneKnown::Partly) => "partly seen: a gap is as wide as a body".to_owned(),
        (true, _, ZoneKnown::Unknown) => "not seen: who crosses it now is not counted".to_owned(),
        (false, Some(count), ZoneKnown::Partly) => format!("{}, at least", people(count)),
        (false, Some(count), _) => people(count),
        (false, None, _) => "the number of people is not known".to_owned(),
    }];
    lines.extend(zone.verdict.map(verdict));
    let percent = zone.seen_share * 100.0;
    lines.push(match zone.unseen.first() {
        None => format!("{percent:.0} % seen"),
        Some(_) => format!("{percent:.0} % seen, not:"),
    });
    let unit = if zone.is_line { "m" } else { "m²" };
    lines.extend(zone.unseen.iter().map(|part| patch(part, unit)));
    if zone.unseen_more > 0.0 {
        lines.push(format!("  and {:.1} {unit} in smaller parts", zone.unseen_more));
    }
    lines.extend(zone.inside.iter().map(inside));
    lines
}

fn people(count: u32) -> String {
    match count {
        0 => "no person".to_owned(),
        1 => "1 person".to_owned(),
        _ => format!("{count} people"),
    }
}

fn verdict(verdict: Verdict) -> String {
    match verdict {
        Verdict::Seen => "known: enough of it is seen".to_owned(),
        Verdict::Begins { for_s } => {
            format!(
                "unknown: modules have only just begun to look; for {for_s:.1} s more, until all in view can have been found"
            )
        }
        Verdict::Moved { for_s } => {
            format!(
                "unknown: a module that looks there was moved; for {for_s:.1} s more, until all in view can have been found"
            )
        }
        Verdict::HardlySeen => "unknown: hardly anything of it is seen".to_owned(),
        Verdict::PartlySeen => "partly known: a person may stand where nothing is seen".to_owned(),
        Verdict::NotFoundAgain { for_s } => format!(
            "partly known: after a gap a person is being found, and may have been there all the time; for {for_s:.1} s more"
        ),
        Verdict::LeftUnseen => {
            "partly known: who was in it is believed to have left, and no module has looked since".to_owned()
        }
        Verdict::MayHide { m2 } => format!(
            "partly known: since a module was away, {m2:.1} m² that were seen before are not: a person may stand there"
        ),
    }
}

fn patch(part: &Patch, unit: &str) -> String {
    let Patch { size, at: [x, y], .. } = part;
    let seen = part.seen_ago_s.map_or_else(|| "never seen".to_owned(), |s| format!("seen {} ago", age(s)));
    let size = if *size < 0.1 { format!("{size:.2}") } else { format!("{size:.1}") };
    format!("  {size} {unit} around ({x:.1}, {y:.1}): {}; {seen}", why(part.why, part.module.as_deref()))
}

/// Why a module does not see a place.
fn why(why: Why, module: Option<&str>) -> String {
    let from = module.map_or_else(String::new, |module| format!(", from {module}"));
    match why {
        Why::Seen => format!("seen{from}"),
        Why::Person { track: Some(track) } => format!("behind person {track}{from}"),
        Why::Person { track: None } => {
            format!("behind a person or thing that was not there before{from}")
        }
        Why::Silent => format!("{} says nothing", module.unwrap_or("its module")),
        Why::NotJudged => {
            format!("{} cannot judge that direction", module.unwrap_or("its module"))
        }
        Why::Thing => format!("behind a thing that belongs to the room{from}"),
        Why::Wall => format!("behind a wall{from}"),
        Why::OutOfView => "beside the view of every module".to_owned(),
        Why::TooFar => "farther than any module sees".to_owned(),
        Why::NoModule => "no module has reported yet".to_owned(),
    }
}

fn inside(one: &Inside) -> String {
    let Inside { track, role, is_inside, probability } = one;
    let percent = probability * 100.0;
    let what = match (is_inside, role) {
        (false, _) => "at its edge, not counted here",
        (true, Role::Counted) => "counted",
        (true, Role::Tentative) => "not counted: not sure yet",
        (true, Role::Unexplained) => "not counted: never seen to come in, and has not moved; perhaps a thing",
        (true, Role::Part) => "not counted: a part of another person",
    };
    format!("track {track}: {what} (there with {percent:.0} %)")
}

fn of_person(person: &PersonReasons) -> Vec<String> {
    let PersonReasons { track, existence, .. } = person;
    let existence = existence * 100.0;
    let mut lines = vec![match person.life {
        Life::Seen => format!("person {track} is seen (there with {existence:.0} %)"),
        Life::Hidden => format!(
            "person {track} is hidden, and believed to be there with {existence:.0} %: no place to go has been seen empty"
        ),
        Life::Tentative => format!("track {track} is not sure yet, and not counted"),
        Life::Unexplained => format!(
            "track {track} was never seen to come in and has not moved since: perhaps a thing, not counted unless the zone is secure"
        ),
        Life::Part { of } => format!("track {track} is a part of person {of}, and not counted"),
    }];
    if let Some((born, [x, y])) = person.born_ago_s.zip(person.born_at) {
        lines.push(format!("first seen {} ago at ({x:.1}, {y:.1})", age(born)));
    }
    if !person.note.is_empty() {
        lines.push(format!("last: {}", person.note));
    }
    if person.zones.is_empty() {
        lines.push("in no zone".to_owned());
    } else {
        lines.push(format!("in {}", person.zones.join(", ")));
    }
    lines.extend(person.modules.iter().map(sighting));
    if person.modules.is_empty() {
        lines.push("no module reaches that place".to_owned());
    }
    lines
}

fn sighting(sighting: &Sighting) -> String {
    let Sighting { module, seen_ago_s, why: cause } = sighting;
    let seen =
        seen_ago_s.map_or_else(|| "has never seen it".to_owned(), |s| format!("saw it {} ago", age(s)));
    match cause {
        Why::Seen if seen_ago_s.is_some_and(|s| s < 1.0) => format!("{module} sees it"),
        Why::Seen => format!("{module} {seen}; it looks there"),
        _ => format!("{module} {seen}; now: {}", why(*cause, None)),
    }
}

fn of_device(device: &DeviceCondition) -> String {
    let DeviceCondition { device, condition } = device;
    let Some(condition) = condition else { return format!("{device}: nothing is measured for it now") };
    let AlarmCondition { is_on, holds, for_s, raise_s, measured, .. } = condition;
    let figure = measured.map_or_else(String::new, |measured| format!(": {}", figure(measured)));
    match (is_on, holds) {
        (true, true) => format!("{device}: rings{figure}"),
        (true, false) => format!("{device}: rings still, and its cause is over for {}{figure}", age(*for_s)),
        (false, true) => format!(
            "{device}: does not ring yet: its cause has lasted for {}, and must last {}{figure}",
            age(*for_s),
            age(*raise_s)
        ),
        (false, false) => format!("{device}: does not ring{figure}"),
    }
}

fn figure(Measured { value, limit, unit }: Measured) -> String {
    let percent = |share: f64| share * 100.0;
    match unit {
        Unit::SilentS => format!("heard {} ago, limit {}", age(value), age(limit)),
        Unit::DamagedShare => {
            format!("{:.1} % of the scans come damaged, limit {:.0} %", percent(value), percent(limit))
        }
        Unit::CoveredDeg => format!("over {value:.0}° the background is not seen, limit {limit:.0}°"),
        Unit::ScansHz => format!("{value:.1} scans a second arrive, limit {limit:.1}"),
        Unit::ClockS => {
            format!("times are known to {:.1} ms, limit {:.0} ms", value * 1e3, limit * 1e3)
        }
        Unit::MissingShare => {
            format!(
                "{:.1} % of the beams return nothing usable, limit {:.0} %",
                percent(value),
                percent(limit)
            )
        }
    }
}

/// A time in its largest unit of which there are at least one and a half.
fn age(s: f64) -> String {
    match s {
        s if s < 9.95 => format!("{s:.1} s"),
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.0} h", s / 3600.0),
        s => format!("{:.0} days", s / 86_400.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ages_are_told_in_the_largest_unit() {
        assert_eq!(
            [0.31, 12.0, 100.0, 7200.0, 500_000.0].map(age),
            ["0.3 s", "12 s", "2 min", "2 h", "6 days"]
        );
    }
}
