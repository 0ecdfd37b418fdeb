//! The floor plan: what a site says of where people can be, and which detections are no people for their place.
//!
//! ```text
//!   ━━━ walls    ┄┄┄ entries    ▭ enclosed zone    ▨ mover    ░ excluded
//! ```

use super::walls::Walls;
use crate::cells::Areas;
use crate::geometry::Point;
use crate::observation::Detection;
use crate::site::{Mover, Site};

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct FloorPlan {
    /// Walls and entries.
    pub walls: Walls,
    /// Zones that are entered through entries alone.
    pub enclosed: Areas,
    /// Where door leaves and curtains move.
    pub movers: Areas,
    /// Where no track begins.
    pub excluded: Areas,
}

impl FloorPlan {
    /// Of a site.
    #[must_use]
    pub fn of(site: &Site) -> Self {
        let movers = site.movers.iter().map(Mover::corners).collect();
        Self {
            walls: Walls::of(site),
            enclosed: site.enclosed(),
            movers: Areas::of(movers),
            excluded: site.excluded(),
        }
    }

    /// Whether a detection is a door leaf or a curtain: all of it is where one moves.
    #[must_use]
    pub fn is_mover(&self, seen: &Detection) -> bool {
        self.movers.one_holds(&seen.outline)
    }

    /// Whether a module that sees from `from` sees this behind a wall that no beam passes.
    #[must_use]
    pub fn is_reflection(&self, from: Point, seen: &Detection) -> bool {
        self.walls.is_reflection(from, seen.outline[1])
    }
}
