//! A floor of pressure panels: where its panels are.
//!
//! ```toml
//! [[floor]]
//! name = "mat"        # the device's name or identity
//! x = -1.0            # the outer corner of panel (0, 0)
//! y = 0.0
//! yaw_deg = 0.0       # where columns go; rows go to the left of it
//! columns = 24
//! rows = 24
//! pitch_m = 0.08      # side of a panel
//! ```
//!
//! Source: the panels of Ota et al. 2006 (docs/bibliography.md, B): 8 cm.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Site;
use super::limits::FARTHEST_M;
use super::wrong::{Wrongs, number};
use crate::geometry::{Point, Pose};

/// Side of a panel, m: smaller ones tell nothing more of a foot; in one of half a metre two people stand.
const PITCH_M: std::ops::RangeInclusive<f64> = 0.01..=0.5;

/// A floor of pressure panels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Floor {
    /// Its name, MAC or instance name.
    pub name: String,
    /// The outer corner of panel (0, 0).
    pub x: f64,
    /// The same.
    pub y: f64,
    /// Where columns go.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Columns.
    pub columns: u8,
    /// Rows.
    pub rows: u8,
    /// Side of a panel.
    #[serde(default = "default_pitch_m")]
    pub pitch_m: f64,
}

/// Paper B's panels.
const fn default_pitch_m() -> f64 {
    0.08
}

impl Floor {
    /// The corner of panel (0, 0), and where columns go.
    #[must_use]
    pub fn corner(&self) -> Pose {
        Pose { at: Point::new(self.x, self.y), yaw_rad: self.yaw_deg.to_radians() }
    }

    /// What is wrong with it: the key, if it is one, and a sentence without its name.
    fn fault(&self) -> Option<(Option<&'static str>, String)> {
        let panels = usize::from(self.columns) * usize::from(self.rows);
        if [self.x, self.y].iter().any(|metres| metres.is_nan() || metres.abs() > FARTHEST_M) {
            return Some((None, format!("x and y must be metres, at most {FARTHEST_M} from the origin")));
        }
        if !self.yaw_deg.is_finite() {
            return Some((Some("yaw_deg"), "yaw_deg must be a number".to_owned()));
        }
        if !(1..=kehai::floor::PANELS).contains(&panels) {
            let most = kehai::floor::PANELS;
            return Some((None, format!("columns and rows: 1 to {most} panels in all, not {panels}")));
        }
        let (low, high) = (PITCH_M.start(), PITCH_M.end());
        (!PITCH_M.contains(&self.pitch_m)).then(|| {
            let is = number(self.pitch_m);
            (Some("pitch_m"), format!("pitch_m: must be from {low} to {high}, is {is}"))
        })
    }
}

/// What is wrong with the floors of a site beside their names.
pub(super) fn check(site: &Site, said: &mut Wrongs) {
    for (index, floor) in site.floors.iter().enumerate() {
        if let Some((key, what)) = floor.fault() {
            said.part(index, floor, key, &what);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAT: &str = "[[floor]]\nname = \"mat\"\nx = 1\ny = 2\ncolumns = 24\nrows = 24\n";

    fn said(text: &str) -> String {
        Site::parse("home.toml", text).unwrap_err().to_string()
    }

    #[test]
    fn a_floor_is_read_and_what_is_wrong_with_it_is_one_line() {
        let site = Site::parse("home.toml", MAT).unwrap();
        assert_eq!(site.floors[0].pitch_m, 0.08);
        let again = Site::parse("home.toml", &toml::to_string(&site).unwrap());
        assert_eq!(again.unwrap(), site);
        assert_eq!(said(&format!("{MAT}{MAT}")), "home.toml: two floors are named \"mat\": rename one");
        let large = "home.toml: floor \"mat\": columns and rows: 1 to 1024 panels in all, not 1200";
        assert_eq!(said(&MAT.replace("rows = 24", "rows = 50")), large);
        assert!(said(&MAT.replace("rows = 24", "rows = 0")).ends_with("not 0"));
        assert!(said(&MAT.replace("x = 1", "x = nan")).contains("x and y must be metres"));
        assert!(said(&format!("{MAT}pitch_m = 5")).ends_with("pitch_m: must be from 0.01 to 0.5, is 5"));
        assert!(said(&format!("{MAT}pitch_m = 0.08\ncolour = 1")).contains("unknown field `colour`"));
        let both = format!("{MAT}[[module]]\nname = \"mat\"\nx = 0\ny = 0\n");
        assert!(
            said(&both).ends_with("a floor and a module are named \"mat\": rename one"),
            "{}",
            said(&both)
        );
        assert!(Site::parse("home.toml", &both.replace("\"mat\"\nx = 0", "\"left\"\nx = 0")).is_ok());
    }
}
