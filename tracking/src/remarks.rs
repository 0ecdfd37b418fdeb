//! What is strange in a site that can be used: one line each.
//!
//! ```text
//!   the room   ┃● ──▶       the file   ● ┃ ──▶       the module or the wall is some centimetres off
//! ```

use core::fmt;

use crate::site::{Module, Site};
use crate::tracker::walls::Walls;

/// Something that is better changed.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Remark {
    /// A module stands just behind a wall that it looks at. The tracker takes it to stand before it ([`Walls::seen_from`]).
    BehindWall {
        /// Its name.
        module: String,
    },
    /// An entry names no zone, and not exactly one counts: which zone it leads to is not clear.
    UnclearEntry {
        /// Its name.
        entry: String,
        /// How many zones count.
        counting: usize,
    },
}

impl fmt::Display for Remark {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BehindWall { module } => write!(
                out,
                "module {module:?} stands just behind a wall that it looks at, and is taken to stand before it: \
                 move the module or the wall"
            ),
            Self::UnclearEntry { entry, counting } => write!(
                out,
                "entry {entry:?} does not say which zone it leads to, and {counting} zones have count = true, not one: \
                 name its zone"
            ),
        }
    }
}

/// What is strange in a site, in the order of its modules, then of its entries. Before a zone is drawn an entry leads into none yet.
#[must_use]
pub fn remarks(site: &Site) -> Vec<Remark> {
    let walls = Walls::of(site);
    let is_behind_wall = |module: &&Module| {
        let pose = module.pose();
        module.placed && walls.seen_from(&pose) != pose.at
    };
    let behind = site.modules.iter().filter(is_behind_wall);
    let behind = behind.map(|module| Remark::BehindWall { module: module.name.clone() });
    let counting = site.zones.iter().filter(|zone| zone.count).count();
    let is_unclear = !site.zones.is_empty() && counting != 1;
    let unclear = site.entries.iter().filter(|entry| is_unclear && entry.zone.is_none());
    let unclear = unclear.map(|entry| Remark::UnclearEntry { entry: entry.name.clone(), counting });
    behind.chain(unclear).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A module at this height of a wall along x at 0, which looks up or down.
    fn remarked(y: f64, yaw_deg: f64, more: &str) -> usize {
        let site = format!(
            "[[module]]\nname = 'left'\nx = 1\ny = {y}\nyaw_deg = {yaw_deg}\n{more}\n\
             [[wall]]\npoints = [[-5, 0], [5, 0]]\n"
        );
        remarks(&Site::parse("site.toml", &site).unwrap()).len()
    }

    #[test]
    fn a_module_just_behind_a_wall_that_it_looks_at_is_remarked() {
        assert_eq!(remarked(-0.04, 90.0, ""), 1);
        assert_eq!(remarked(0.04, 90.0, ""), 0, "it hangs on its wall");
        assert_eq!(remarked(-0.04, -90.0, ""), 0, "it looks away from it");
        assert_eq!(remarked(-0.5, 90.0, ""), 0, "a wall across the room");
        assert_eq!(remarked(-0.04, 90.0, "placed = false"), 0, "where it is is not known yet");
    }

    #[test]
    fn an_entry_without_a_zone_is_remarked_where_not_exactly_one_counts() {
        let counting =
            |counts: &[bool], zone: &str| {
                let zones: String = (0..).zip(counts).map(|(number, counts)| {
                format!("[[zone]]\nname = '{number}'\npolygon = [[0, 0], [1, 0], [1, 1]]\ncount = {counts}\n")
            }).collect();
                let entry = format!("[[entry]]\nname = 'street'\nline = [[0, 0], [1, 0]]\n{zone}");
                remarks(&Site::parse("site.toml", &format!("{zones}{entry}")).unwrap())
            };
        for (counts, remarked) in [(&[][..], 0), (&[true], 0), (&[false], 1), (&[true, true], 1)] {
            assert_eq!(counting(counts, "").len(), remarked, "{counts:?}");
        }
        let said = counting(&[true, true], "")[0].to_string();
        assert_eq!(
            said,
            "entry \"street\" does not say which zone it leads to, and 2 zones have count = true, not one: name its zone"
        );
        assert!(counting(&[true, true], "zone = '0'").is_empty());
    }
}
