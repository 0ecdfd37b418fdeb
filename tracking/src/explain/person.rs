//! Why a track exists: born when and where, seen by whom when last, and what hides it from each module that does not see it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::glance::{Glance, Scene, Why};
use super::round::{ago_s, hundredth};
use crate::site::Site;
use crate::tracker::history::History;
use crate::tracker::{LifeCycle, Origin, TrackId, TrackState};

/// A module has seen a track just now if that is not longer ago, s: three scans of 0.1 s.
const NOW_S: f64 = 0.3;

/// Of a track, as the tracker knows it.
#[derive(Clone, Debug)]
pub struct PersonFacts {
    /// The track.
    pub state: TrackState,
    /// What it has been through; none where the tracker does not note it, and of a body on a floor.
    pub history: Option<History>,
    /// The zones it is in.
    pub zones: Vec<String>,
}

/// Why a track exists.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "is")]
pub enum Life {
    /// A module detects it.
    Seen,
    /// It was a person, and no place it may have gone to has been seen empty.
    Hidden,
    /// It is not sure yet.
    Tentative,
    /// It was never seen to come in, and has not moved since.
    Unexplained,
    /// It is a part of another.
    Part {
        /// That track.
        of: TrackId,
    },
}

/// A module, and what it has of a track.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Sighting {
    /// As the site calls it.
    pub module: String,
    /// When it detected the track last, s ago; null if never.
    pub seen_ago_s: Option<f64>,
    /// Why it does not see it now, where it is believed to be.
    pub why: Why,
}

/// Why a track exists, and who sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PersonReasons {
    /// Its number.
    pub track: TrackId,
    /// Why it is there.
    pub life: Life,
    /// Probability that a person is there at all.
    pub existence: f64,
    /// What happened to it last, in words.
    pub note: String,
    /// Where it is.
    pub at: [f64; 2],
    /// When it was detected first, s ago.
    pub born_ago_s: Option<f64>,
    /// Where.
    pub born_at: Option<[f64; 2]>,
    /// When any module detected it last, s ago.
    pub seen_ago_s: Option<f64>,
    /// Modules that have detected it, or whose range reaches it; who has seen it last comes first.
    pub modules: Vec<Sighting>,
    /// The zones it is in.
    pub zones: Vec<String>,
}

/// Explains a track at `at_s`.
#[must_use]
pub fn explain(
    facts: &PersonFacts,
    glances: &[Glance],
    site: &Site,
    tracks: &[TrackState],
    at_s: f64,
) -> PersonReasons {
    let PersonFacts { state, history, zones } = facts;
    // It does not hide itself.
    let others: Vec<TrackState> = tracks.iter().filter(|track| track.id != state.id).copied().collect();
    let scene = Scene::of(site, &others, at_s);
    let last_s = |module: usize| {
        let seen = history.iter().flat_map(|history| history.seen_by.iter());
        seen.filter(|(known, _)| *known == module).map(|(_, seen_s)| seen_s).next()
    };
    let mut modules: Vec<Sighting> = Vec::new();
    for glance in glances {
        let seen_ago_s = last_s(glance.module()).and_then(|seen_s| ago_s(seen_s, at_s));
        if seen_ago_s.is_none() && !glance.reaches(state.at) {
            continue;
        }
        let sees = state.state != LifeCycle::Occluded && seen_ago_s.is_some_and(|ago_s| ago_s <= NOW_S);
        let why = if sees { Why::Seen } else { glance.why(state.at, 0.0, &scene) };
        let module = site.modules.get(glance.module()).map_or_else(String::new, |module| module.name.clone());
        modules.push(Sighting { module, seen_ago_s, why });
    }
    let order = |one: &Sighting| one.seen_ago_s.unwrap_or(f64::INFINITY);
    modules.sort_by(|one, other| order(one).total_cmp(&order(other)));
    PersonReasons {
        track: state.id,
        life: life(state),
        existence: hundredth(state.existence),
        note: state.reason.to_owned(),
        at: [state.at.x, state.at.y].map(hundredth),
        born_ago_s: history.as_ref().and_then(|history| ago_s(history.first_s, at_s)),
        born_at: history.as_ref().map(|history| [history.first_at.x, history.first_at.y].map(hundredth)),
        seen_ago_s: history.as_ref().and_then(|history| ago_s(history.last_s, at_s)),
        modules,
        zones: zones.clone(),
    }
}

const fn life(track: &TrackState) -> Life {
    match (track.origin, track.state) {
        (Origin::PartOf(of), _) => Life::Part { of },
        (Origin::Unexplained, _) => Life::Unexplained,
        (Origin::Entered, LifeCycle::Tentative) => Life::Tentative,
        (Origin::Entered, LifeCycle::Confirmed) => Life::Seen,
        (Origin::Entered, LifeCycle::Occluded) => Life::Hidden,
    }
}
