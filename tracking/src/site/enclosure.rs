//! Which zones are enclosed: said to be, or surrounded by walls and entries.
//!
//! ```text
//!   ┏━━━━━━━━━━┓  wall               ┏━━━━━━━━━━┓
//!   ┃╭────────╮┃                     ┃╭────────╮┃
//!   ┃│  zone  │┃  enclosed           ┃│  zone  ╎   a doorway that is not drawn: not enclosed
//!   ┃╰────────╯┃                     ┃╰────────╯┃
//!   ┗━━━┄┄┄┄━━━┛  entry              ┗━━━┄┄┄┄━━━┛
//! ```

use super::{Blocks, Entry, Site, Wall, Zone};
use crate::cells::Areas;
use crate::geometry::{Point, bounds, distance_to_segment};

/// The edge of a surrounded zone is nowhere farther from walls and entries, m. The narrowest doorway is 0.7 m wide, so that the middle of
/// one that is not drawn is 0.35 m from its jambs; and no person fits between a zone and a wall that are so near each other.
const BESIDE_M: f64 = 0.3;

/// Distance between the places of an edge that are looked at, m: fine beside what the doorway leaves, 0.05 m on both sides.
const GRAIN_M: f64 = 0.05;

impl Site {
    /// Zones that people enter and leave through entries alone, in the order of the file.
    pub fn enclosed_zones(&self) -> impl Iterator<Item = &Zone> {
        self.zones.iter().filter(|zone| zone.enclosed || self.surrounds(zone))
    }

    /// Their areas.
    #[must_use]
    pub fn enclosed(&self) -> Areas {
        Areas::of(self.enclosed_zones().map(Zone::corners).collect())
    }

    /// Whether walls and entries surround a zone, and one entry at least leads into it.
    fn surrounds(&self, zone: &Zone) -> bool {
        let corners = zone.corners();
        let Some((low, high)) = bounds(corners.iter().copied()) else { return false };
        let is_near = |&(from, to): &(Point, Point)| {
            from.x.max(to.x) > low.x - BESIDE_M
                && from.x.min(to.x) < high.x + BESIDE_M
                && from.y.max(to.y) > low.y - BESIDE_M
                && from.y.min(to.y) < high.y + BESIDE_M
        };
        let entries: Vec<_> = self.entries.iter().map(Entry::ends).filter(is_near).collect();
        let stops_people = |wall: &&Wall| wall.stops(Blocks::People);
        let walls = self.walls.iter().filter(stops_people).flat_map(Wall::sides).filter(is_near);
        let pieces: Vec<_> = walls.chain(entries.iter().copied()).collect();
        let is_beside = |place: Point, pieces: &[(Point, Point)]| {
            pieces.iter().any(|&(from, to)| distance_to_segment(place, from, to) <= BESIDE_M)
        };
        let mut leads_in = false;
        let ends = corners.iter().zip(corners.iter().cycle().skip(1));
        for (from, to) in ends {
            let side = *to - *from;
            let steps = (side.length() / GRAIN_M).ceil().max(1.0);
            for step in 0..steps as u32 {
                let place = *from + side * (f64::from(step) / steps);
                if !is_beside(place, &pieces) {
                    return false;
                }
                leads_in |= is_beside(place, &entries);
            }
        }
        leads_in
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of 4 m by 3 m with a door in its lower wall.
    const ROOM: &str = "[[wall]]\npoints = [[2, 0], [4, 0], [4, 3], [0, 3], [0, 0], [1, 0]]\n\
        [[entry]]\nname = 'door'\nline = [[1, 0], [2, 0]]\nzone = 'room'\n";
    const ZONE: &str =
        "[[zone]]\nname = 'room'\npolygon = [[0.2, 0.2], [3.8, 0.2], [3.8, 2.8], [0.2, 2.8]]\n";

    fn is_enclosed(site: &str) -> bool {
        let site: Site = toml::from_str(site).unwrap();
        site.enclosed_zones().count() == 1
    }

    #[test]
    fn a_zone_between_walls_and_entries_is_enclosed_without_being_said_to_be() {
        assert!(is_enclosed(&format!("{ROOM}{ZONE}")));
    }

    #[test]
    fn a_doorway_that_is_not_drawn_opens_a_zone() {
        let open = ROOM.replace("[4, 3], [0, 3]", "[4, 3], [3, 3]]\n[[wall]]\npoints = [[2.3, 3], [0, 3]");
        assert!(!is_enclosed(&format!("{open}{ZONE}")));
        assert!(is_enclosed(&format!("{open}{ZONE}enclosed = true\n")), "but what is said holds");
    }

    #[test]
    fn walls_without_an_entry_enclose_nothing_that_people_come_into() {
        let closed = ROOM
            .replace("[1, 0]]\n[[entry]]", "[2, 0]]\n[[entry]]")
            .replace("[[1, 0], [2, 0]]", "[[8, 0], [9, 0]]");
        assert!(!is_enclosed(&format!("{closed}{ZONE}")));
    }

    #[test]
    fn a_curtain_stops_beams_and_encloses_nothing() {
        let curtain = ROOM.replace("[1, 0]]\n", "[1, 0]]\nblocks = ['beams']\n");
        assert!(!is_enclosed(&format!("{curtain}{ZONE}")));
    }

    #[test]
    fn a_part_of_a_room_is_not_enclosed() {
        assert!(!is_enclosed(&format!("{ROOM}{}", ZONE.replace("3.8", "2.0"))));
    }
}
