//! The plan that modules have measured: walls, rooms and ways in, from what they learned of the empty place.
//!
//! ```text
//!   backgrounds, poses ─▶ walls   straight pieces, laid together, joined at corners
//!                           └──▶ rooms   what is seen empty between them, parted at doors ─▶ zones
//!                                  └──▶ entries   gaps of a door's width that beams pass
//! ```
//!
//! Nothing is changed by it: a [`Proposal`] has the parts that a site lacks, in the site's own form. Everything here is a plain
//! function; the same backgrounds give the same plan.

mod grid;
mod pieces;
mod rooms;
#[cfg(test)]
mod tests;
mod walls;

use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;

use walls::Plan;

use crate::geometry::{Point, distance_to_segment};
use crate::observation::View;
use crate::session::upside_down::Beams;
use crate::session::{Session, Sessions};
use crate::site::{Entry, Site, Wall, Zone};

/// A wall is there already if one of the site is as near as this, m: what a hand on the map is off, and a wall is thick.
const KNOWN_M: f64 = 0.2;

/// Between two places of a wall that are looked at, m.
const STEP_M: f64 = 0.1;

/// What a module learned of the empty place.
#[derive(Clone, Debug)]
pub struct Background {
    /// Where it is, and where its beams point.
    pub view: View,
    /// Range of the wall that each beam ends at, mm; 0 where there is none.
    pub walls_mm: Arc<[u16]>,
    /// Up to which range each beam is empty, mm; 0: not known.
    pub empty_mm: Arc<[u16]>,
}

impl Background {
    /// Whether a place was seen empty.
    fn sees(&self, forward: Point, at: Point) -> bool {
        let (range_m, beam) = self.view.beam_ahead(forward, at);
        beam.is_some_and(|beam| range_m < self.empty_m(beam))
    }

    /// Up to which range a beam is empty, m.
    fn empty_m(&self, beam: u16) -> f64 {
        self.empty_mm.get(usize::from(beam)).map_or(0.0, |&range_mm| f64::from(range_mm) * 1e-3)
    }
}

/// The backgrounds of a site's modules by their names, as far as they are known, whether a module is placed or not.
#[must_use]
pub fn backgrounds(sessions: &Sessions, site: &Site) -> Vec<(String, Background)> {
    let background = |session: &Session| {
        let view = session.view()?;
        let name = site.modules.get(view.module)?.name.clone();
        let (walls_mm, empty_mm) = (Arc::clone(session.walls_mm()), Arc::clone(session.empty_mm()?));
        Some((name, Background { view: View::clone(view), walls_mm, empty_mm }))
    };
    sessions.iter().filter_map(background).collect()
}

/// The same of the modules that `site` has a place for, seen from there and the way up that it says: it may be newer than what is
/// tracked by.
#[must_use]
pub fn placed(backgrounds: Vec<(String, Background)>, site: &Site) -> Vec<Background> {
    let place = |(name, background): (String, Background)| {
        let module = site.modules.iter().find(|module| module.name == name && module.placed)?;
        let background = hung(background, module.upside_down)?;
        Some(Background { view: View { pose: module.pose(), ..background.view }, ..background })
    };
    backgrounds.into_iter().filter_map(place).collect()
}

/// A background of a module that hangs this way up: turned over, its beams are numbered from the other end. None where no beams
/// have such numbers.
fn hung(background: Background, upside_down: bool) -> Option<Background> {
    let Background { view, walls_mm, empty_mm } = background;
    if view.upside_down == upside_down {
        return Some(Background { view, walls_mm, empty_mm });
    }
    let beams = Beams::new(view.geometry, true)?;
    let turned = |list: Arc<[u16]>| list.iter().rev().copied().collect();
    let view = View { geometry: *beams.used(), upside_down, ..view };
    Some(Background { view, walls_mm: turned(walls_mm), empty_mm: turned(empty_mm) })
}

/// Parts that a site lacks.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Proposal {
    /// Walls.
    #[serde(rename = "wall")]
    pub walls: Vec<Wall>,
    /// Rooms, as zones whose people are counted.
    #[serde(rename = "zone")]
    pub zones: Vec<Zone>,
    /// Gaps through which people come into these rooms.
    #[serde(rename = "entry")]
    pub entries: Vec<Entry>,
}

/// What the backgrounds say of a place that `site` does not have yet.
#[must_use]
pub fn propose(backgrounds: &[Background], site: &Site) -> Proposal {
    let Plan { lines, doors, cracks } = walls::plan(backgrounds);
    let known: Vec<(Point, Point)> = site.walls.iter().flat_map(Wall::sides).collect();
    let is_new = |line: &&Vec<Point>| {
        let places: Vec<Point> = places(line).collect();
        let near =
            |place: &&Point| known.iter().any(|&(from, to)| distance_to_segment(**place, from, to) < KNOWN_M);
        2 * places.iter().filter(near).count() < places.len()
    };
    let walls = lines.iter().filter(is_new).map(|line| wall(line)).collect();
    let sides = lines.iter().flat_map(|line| line.windows(2).map(|ends| (ends[0], ends[1])));
    let sides: Vec<(Point, Point)> = sides.chain(known.iter().copied()).chain(cracks).collect();
    let (zones, entries) = rooms::rooms(backgrounds, &sides, &doors, site);
    Proposal { walls, zones, entries }
}

/// Places along a line of corners, a step apart.
fn places(line: &[Point]) -> impl Iterator<Item = Point> + '_ {
    line.windows(2).flat_map(|ends| along(ends[0], ends[1]))
}

/// Places between two ends, a step apart; at least their middle.
fn along(from: Point, to: Point) -> impl Iterator<Item = Point> {
    let count = ((to - from).length() / STEP_M).round().max(1.0) as usize;
    (0..count).map(move |number| from + (to - from) * ((number as f64 + 0.5) / count as f64))
}

fn wall(line: &[Point]) -> Wall {
    Wall::of(line.iter().map(|&corner| rounded(corner)).collect())
}

/// To the centimetre: no plan is better.
fn rounded(place: Point) -> [f64; 2] {
    [place.x, place.y].map(|metres| (metres * 100.0).round() / 100.0)
}
