//! What is known of a zone, copied to be explained elsewhere.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::presence::{Presence, WHOLE};
use super::strip;
use super::verdict::{Role, Verdict};
use super::zone::{CELL_M, Cell, SEEN_S, Zone};
use crate::geometry::Point;
use crate::occupancy::ZoneKnown;
use crate::tracker::TrackId;

/// Most cells of a zone that are looked at one by one: 200 m² of them; of a larger one that is not seen, every second,
/// third, … in each direction, each for its neighbours.
pub const CELLS_MAX: usize = 5000;

/// Of a zone, as the tracker knows it.
#[derive(Clone, Debug)]
pub struct ZoneFacts {
    /// Its name.
    pub name: String,
    /// Whether it is a counting line.
    pub is_line: bool,
    /// What is said of it; of a line whether it is seen.
    pub state: ZoneKnown,
    /// How many are counted in it; none where that is not known, and of a line.
    pub count: Option<u32>,
    /// Why; none of a line.
    pub verdict: Option<Verdict>,
    /// Share of it that is seen.
    pub seen_share: f64,
    /// Its area, m²; of a line its length, m.
    pub size: f64,
    /// The tracks that may be in it.
    pub inside: Vec<Inside>,
    /// Cells that are not seen.
    pub unseen: Vec<UnseenCell>,
    /// Side of one of them, m.
    pub cell_m: f64,
}

/// A track that may be in a zone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Inside {
    /// Its number.
    pub track: TrackId,
    /// What it is to the count.
    pub role: Role,
    /// Whether its mean is inside: else it is at the edge, and not counted here.
    pub is_inside: bool,
    /// Probability that it is there at all and inside.
    pub probability: f64,
}

/// A cell that is not seen.
#[derive(Clone, Copy, Debug)]
pub struct UnseenCell {
    /// Its column and row.
    pub at: (i32, i32),
    /// Its middle.
    pub middle: Point,
    /// When it was seen last, s; negative infinity if never.
    pub seen_s: f64,
}

/// Of a zone, with the tracks that may be in it.
pub fn of_zone(zone: &Zone, inside: &[Presence<'_>], at_s: f64) -> ZoneFacts {
    let verdict = zone.verdict(inside, at_s);
    let state = verdict.known();
    let of = |presence: &Presence<'_>| Inside {
        track: presence.track.id,
        role: zone.role(presence.track),
        is_inside: presence.is_inside,
        probability: presence.track.existence * f64::from(presence.parts) / f64::from(WHOLE),
    };
    let (cell_m, unseen) = unseen(zone, at_s);
    ZoneFacts {
        name: zone.name.clone(),
        is_line: false,
        state,
        count: zone.count(inside, state, at_s),
        verdict: Some(verdict),
        seen_share: zone.seen_share(at_s),
        size: zone.cells.len() as f64 * CELL_M * CELL_M,
        inside: inside.iter().map(of).collect(),
        unseen,
        cell_m,
    }
}

/// Of a counting line.
pub fn of_line(line: &Zone, at_s: f64) -> ZoneFacts {
    let (cell_m, unseen) = unseen(line, at_s);
    ZoneFacts {
        name: line.name.clone(),
        is_line: true,
        state: strip::known(line, at_s),
        count: None,
        verdict: None,
        seen_share: line.seen_share(at_s),
        size: line.cells.len() as f64 * CELL_M,
        inside: Vec::new(),
        unseen,
        cell_m,
    }
}

/// The cells that are not seen, and the side of one; of too many every second, third, … in each direction, so much larger.
fn unseen(zone: &Zone, at_s: f64) -> (f64, Vec<UnseenCell>) {
    let is_unseen = |cell: &&Cell| at_s - cell.seen_s >= SEEN_S;
    let count = zone.cells.iter().filter(is_unseen).count();
    let each = (count as f64 / CELLS_MAX as f64).sqrt().ceil().max(1.0);
    let (low, _) = zone.around;
    let number = |offset_m: f64| (offset_m / CELL_M).floor() as i32;
    let stays = |place: i32| place.rem_euclid(each as i32) == each as i32 / 2;
    let unseen = |cell: &Cell| {
        let Point { x, y } = cell.middle - low;
        let (column, row) = (number(x), number(y));
        (each < 2.0 || stays(column) && stays(row)).then(|| UnseenCell {
            at: (column.div_euclid(each as i32), row.div_euclid(each as i32)),
            middle: cell.middle,
            seen_s: cell.seen_s,
        })
    };
    (each * CELL_M, zone.cells.iter().filter(is_unseen).filter_map(unseen).collect())
}
