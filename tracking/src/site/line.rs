//! A counting line: people who walk across it are counted, in each direction.
//!
//! ```toml
//! [[line]]
//! name = "front"
//! from = [-1.0, -1.0]
//! to = [1.0, -1.0]
//! ```
//!
//! ```text
//!            ▲ in: to the left of from → to
//!   from ────┼────▶ to
//!            ▼ out
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Site;
use super::limits::no_place;
use super::wrong::Wrongs;
use crate::geometry::Point;

/// Shortest line, m: narrower passages let no person through. As the line of a door.
const SHORTEST_M: f64 = 0.3;

/// All lines together, m: 5000 cells of 0.2 m, which every scan may look at; a wide hall has some tens of metres.
const ALL_M: f64 = 1000.0;

/// A line across which people are counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CountingLine {
    /// Its name.
    pub name: String,
    /// Where it begins.
    pub from: [f64; 2],
    /// Where it ends. *In* is to the left of the way from one to the other.
    pub to: [f64; 2],
}

impl CountingLine {
    /// Its ends.
    #[must_use]
    pub fn ends(&self) -> (Point, Point) {
        (self.from.into(), self.to.into())
    }

    /// m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        let (from, to) = self.ends();
        (to - from).length()
    }
}

/// What is wrong with the lines of a site beside their names.
pub(super) fn check(site: &Site, said: &mut Wrongs) {
    let mut all_m = 0.0;
    for (index, line) in site.lines.iter().enumerate() {
        if let Some(what) = no_place(&[line.from, line.to]) {
            said.part(index, line, None, &what);
            continue;
        }
        let length_m = line.length_m();
        if length_m < SHORTEST_M {
            let what = format!("is {length_m:.2} m long: from and to must be {SHORTEST_M} m apart");
            said.part(index, line, None, &what);
        }
        all_m += length_m;
        if all_m > ALL_M {
            let what = format!("all lines together are longer than {ALL_M} m: make them shorter");
            said.part(index, line, None, &what);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRONT: &str = "[[line]]\nname = \"front\"\nfrom = [-1, -1]\nto = [1, -1]\n";

    fn said(text: &str) -> String {
        Site::parse("home.toml", text).unwrap_err().to_string()
    }

    #[test]
    fn a_line_is_read_and_what_is_wrong_with_it_is_one_sentence() {
        let site = Site::parse("home.toml", FRONT).unwrap();
        assert_eq!((site.lines[0].name.as_str(), site.lines[0].length_m()), ("front", 2.0));
        assert_eq!(Site::parse("home.toml", &toml::to_string(&site).unwrap()).unwrap(), site);
        assert_eq!(said(&format!("{FRONT}{FRONT}")), "home.toml: two lines are named \"front\": rename one");
        assert_eq!(said(&FRONT.replace("\"front\"", "\" \"")), "home.toml: line 1: has no name");
        assert!(said(&format!("{FRONT}colour = 1\n")).contains("unknown field `colour`"));
        assert!(said("[[line]]\nname = \"front\"\nfrom = [0, 0]\n").contains("missing field `to`"));
        assert!(said(&FRONT.replace("[1, -1]", "[nan, -1]")).contains("line \"front\": NaN is no place"));
        let short = "home.toml: line \"front\": is 0.10 m long: from and to must be 0.3 m apart";
        assert_eq!(said(&FRONT.replace("[1, -1]", "[-0.9, -1]")), short);
        let long = said(&FRONT.replace("[1, -1]", "[1001, -1]"));
        assert!(long.contains("all lines together are longer than 1000 m"), "{long}");
    }
}
