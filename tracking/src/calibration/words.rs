//! Calibration as an installer hears it: where to walk, how good it is, why it is not.

use crate::alarm::AlarmKind;

use super::advice::Advice;
use super::names::Names;
use super::told::{Grade, Place, Quality, Side};
use super::watch::Finding;
use super::{Calibration, ENOUGH_S, Placed, Refusal};

/// Where to walk next.
#[must_use]
pub fn advice(advice: &Advice, names: &Names) -> String {
    match advice {
        Advice::Alone { module } => format!(
            "several people are in view of {}: only one may walk, the others leave; these moments are not used",
            names.of(*module)
        ),
        Advice::Begin => format!(
            "walk about in front of {}, at an ordinary pace and two steps away from walls",
            names.of(0)
        ),
        Advice::Reach { module } if names.is_floor(*module) => format!(
            "nothing links the floor {0} with the modules yet: walk across {0}, from edge to edge, where a module sees you",
            names.of(*module)
        ),
        Advice::Reach { module } => format!(
            "nothing links {0} with the others yet: walk from them to {0} and back, through where both can see you",
            names.of(*module)
        ),
        Advice::Together { modules, .. } if names.has_floor(*modules) => {
            let (one, floor) = names.pair(*modules);
            format!(
                "walk across the floor {floor} where {one} sees you, straight on beyond its edges, each time another way"
            )
        }
        Advice::Together { modules: (one, other), place, .. } => format!(
            "walk where {} and {} both see you{}, in wide loops",
            names.of(*one),
            names.of(*other),
            place.map_or_else(String::new, |at| format!(
                ", for example {}",
                place_in_words(Place::of(at), names.of(*one))
            )),
        ),
        Advice::Enough => "enough: you may stop".to_owned(),
    }
}

fn place_in_words(Place { steps, side }: Place, of: &str) -> String {
    let side = match side {
        Side::Ahead => "straight ahead",
        Side::AheadLeft => "ahead to its left",
        Side::AheadRight => "ahead to its right",
        Side::Left => "on its left",
        Side::Right => "on its right",
    };
    format!("{steps} step{} from {of}, {side}", if steps == 1 { "" } else { "s" })
}

/// Why there is no result, and what to do.
#[must_use]
pub fn refusal(refusal: &Refusal, names: &Names) -> String {
    match refusal {
        Refusal::Alone => "only what sees you together with a module can be placed, and there is one at most: the place of a \
                           single module needs no walk, that of a floor a module beside it"
            .to_owned(),
        Refusal::Apart { module } if names.is_floor(*module) => format!(
            "no module has seen you walk on the floor {0}: walk across it, from edge to edge, where a module sees you; if none \
             looks there, it needs a ruler",
            names.of(*module)
        ),
        Refusal::Apart { module } => format!(
            "{0} has not seen you together with any other module: walk from the others to {0} and back; if no place is in \
             view of both, it needs a ruler, or a module between",
            names.of(*module)
        ),
        Refusal::Short { modules, common_s } if names.has_floor(*modules) => {
            let (one, floor) = names.pair(*modules);
            format!(
                "{one} has seen you walk on the floor {floor} for {common_s:.0} s only, and nothing else links them: walk across \
                 it for {ENOUGH_S:.0} s, straight on beyond its edges"
            )
        }
        Refusal::Short { modules: (one, other), common_s } => format!(
            "{0} and {1} have seen you together for {common_s:.0} s only, and nothing else links them: walk where both see you \
             for {2:.0} s; if there is no such place, they overlap too little",
            names.of(*one),
            names.of(*other),
            ENOUGH_S,
        ),
        Refusal::Narrow { modules, spread_m } if names.has_floor(*modules) => {
            let (one, floor) = names.pair(*modules);
            format!(
                "{one} has seen you on one part of the floor {floor} only ({spread_m:.1} m about its middle): walk across all of \
                 it, from edge to edge"
            )
        }
        Refusal::Narrow { modules: (one, other), spread_m } => format!(
            "{} and {} have seen you at one place only ({spread_m:.1} m about its middle): walk in wide loops through all that \
             both see",
            names.of(*one),
            names.of(*other),
        ),
        Refusal::Contradiction { modules: (one, other), share } => format!(
            "what {} and {} saw fits together for {:.0} % of the time only: was another person walking, or a module moved \
             meanwhile? Begin anew, alone",
            names.of(*one),
            names.of(*other),
            share * 100.0,
        ),
        Refusal::Vague { module, within_m, within_rad } => format!(
            "where {0} is remains uncertain by {1:.0} cm and {2:.0}°: walk longer, in wide loops, where {0} and its neighbours \
             see you",
            names.of(*module),
            within_m * 100.0,
            within_rad.to_degrees(),
        ),
        Refusal::Unsolved => "what was seen is no walk of one person: begin anew, alone".to_owned(),
        Refusal::SiteChanged => {
            "modules or floors of the site were added, taken away, renamed, moved or turned over during the walk: begin anew".to_owned()
        }
    }
}

/// How good the whole is, in one sentence.
#[must_use]
pub fn quality(calibration: &Calibration) -> String {
    let Some(Quality { grade, apart_m, wall_m, within_m }) = Quality::of(calibration) else {
        return "one module alone: x and y are measured from it".to_owned();
    };
    let grade = match grade {
        Grade::VeryGood => "very good",
        Grade::Good => "good",
        Grade::Fair => "fair: people are followed, and a longer walk would make it better",
        Grade::Poor => "poor: walk longer, in wide loops",
    };
    let walls = wall_m.map_or_else(
        || ", the backgrounds share too little wall to help".to_owned(),
        |wall_m| format!(", {wall_m:.0} m of wall seen by two fit, too"),
    );
    format!(
        "{grade}: two modules see you {:.0} cm apart{walls}; every module is within {:.0} cm of where it is said to be",
        apart_m * 100.0,
        within_m * 100.0
    )
}

/// A module's or a floor's place, how well it is known, how far the module's clock may be off, and which way up it hangs;
/// `upside_down` is how the site has it.
#[must_use]
pub fn placed(placed: &Placed, (module, held): (usize, usize), upside_down: bool, names: &Names) -> String {
    let (within_m, within_rad) = placed.bounds();
    let (pose, name) = (&placed.pose, names.of(module));
    let place =
        format!("{name}: x {:.2} m, y {:.2} m, yaw {:.1}°", pose.at.x, pose.at.y, pose.yaw_rad.to_degrees());
    if within_m == 0.0 {
        return format!("{place}, held fixed");
    }
    let (within_cm, within_deg) = (within_m * 100.0, within_rad.to_degrees());
    if names.is_floor(module) {
        return format!("{place}, its outer corner within {within_cm:.0} cm and {within_deg:.1}°");
    }
    let clock_ms = placed.clock_within_s() * 1e3;
    let hangs = hang(placed, upside_down, names.of(held));
    format!(
        "{place}, within {within_cm:.0} cm and {within_deg:.1}°; its clock within {clock_ms:.0} ms; {hangs}"
    )
}

/// Which way up a module hangs, and how clearly the walk says so.
fn hang(placed: &Placed, upside_down: bool, held: &str) -> String {
    let way = |upside_down: bool| if upside_down { "head down" } else { "upright" };
    let is = way(upside_down != placed.hang.turned);
    match placed.hang.apart_m {
        None => format!("{is}, as the site has it: the walk does not say"),
        Some((right_m, wrong_m)) => {
            let news = if placed.hang.turned { ", other than the site had it" } else { "" };
            let [right_cm, wrong_cm] = [right_m, wrong_m].map(|apart_m| apart_m * 100.0);
            format!(
                "{is} if {held} hangs as the site has it{news}: so it fits within {right_cm:.0} cm, the other way up within \
                 {wrong_cm:.0} cm"
            )
        }
    }
}

/// What was found about a module's place: the alarm's name and what it says.
#[must_use]
pub fn finding(finding: &Finding) -> (AlarmKind, String) {
    match finding {
        Finding::Moved { turn_rad, shift_m } => {
            let turned = format!("turned by about {:.0}° to the {}", turn_rad.to_degrees().abs(), side(*turn_rad));
            let moved = format!("moved by about {shift_m:.1} m");
            let what = match (turn_rad.to_degrees().abs() > 3.0, *shift_m > 0.2) {
                (true, true) => format!("{turned} and {moved}"),
                (false, true) => moved,
                _ => turned,
            };
            (AlarmKind::Moved, format!("it was {what}: put it back, or run kehai-tracker calibrate; until then it misplaces people"))
        }
        Finding::Covered => {
            (AlarmKind::Blind, "something before it hides everything: people walk in its view and it sees none; take it away".to_owned())
        }
        Finding::Past => (
            AlarmKind::Blind,
            "people walk in its view and it looks past them: was it lifted or tilted? Put it back at its height".to_owned(),
        ),
    }
}

fn side(turn_rad: f64) -> &'static str {
    if turn_rad > 0.0 { "left" } else { "right" }
}
