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
}

impl fmt::Display for Remark {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BehindWall { module } => write!(
                out,
                "module {module:?} stands just behind a wall that it looks at, and is taken to stand before it: \
                 move the module or the wall"
            ),
        }
    }
}

/// What is strange in a site, in the order of its modules.
#[must_use]
pub fn remarks(site: &Site) -> Vec<Remark> {
    let walls = Walls::of(site);
    let is_behind_wall = |module: &&Module| {
        let pose = module.pose();
        module.placed && walls.seen_from(&pose) != pose.at
    };
    let behind = site.modules.iter().filter(is_behind_wall);
    behind.map(|module| Remark::BehindWall { module: module.name.clone() }).collect()
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
}
