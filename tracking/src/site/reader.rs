//! A reader of cards or tags: near which place it reads, or where on the floor each of its pixels is.
//!
//! ```toml
//! [[reader]]                  # reads what comes within its reach
//! name = "hall"
//! x = 1.0
//! y = 0.2
//! reach_m = 0.8
//!
//! [[reader]]                  # a camera that finds tags: pixel (u, v, 1) → floor, row by row
//! name = "camera"
//! homography = [0.01, 0.0, -3.2, 0.0, 0.012, 0.4, 0.0, 0.0002, 1.0]
//! sigma_m = 0.1
//! ```
//!
//! Source: the projection of a camera's pixels to the floor by a homography, Ota et al. 2006 (docs/bibliography.md, B).

use nalgebra::Matrix3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::wrong::Wrongs;
use crate::geometry::Point;

/// Spread of a place that a camera found, unless its reader says otherwise, m: half a body's width. Calibration on the
/// floor, and a tag that is worn above it.
const SIGMA_M: f64 = 0.2;

/// Longest reach, m: beyond it, that something was read says nothing about where.
const REACH_MAX_M: f64 = 100.0;

/// A reader.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "ReaderText", into = "ReaderText")]
pub struct Reader {
    /// Its name.
    pub name: String,
    /// Where it reads.
    pub reads: Reads,
}

/// Where a reader reads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reads {
    /// What comes near it.
    Near {
        /// Its place.
        at: Point,
        /// How far it reads, m.
        reach_m: f64,
    },
    /// What its camera sees.
    Pixels {
        /// Pixel (u, v, 1) to a place on the floor, row by row.
        homography: [f64; 9],
        /// Spread of such a place along each axis, m.
        sigma_m: f64,
    },
}

impl Reads {
    /// The place on the floor of a pixel; none of one that shows no floor.
    #[must_use]
    pub fn floor(&self, u: f64, v: f64) -> Option<Point> {
        let Self::Pixels { homography: [a, b, c, d, e, f, g, h, i], .. } = self else { return None };
        let scale = g * u + h * v + i;
        let at = Point::new((a * u + b * v + c) / scale, (d * u + e * v + f) / scale);
        (at.x.is_finite() && at.y.is_finite()).then_some(at)
    }
}

/// A reader as a file has it.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ReaderText {
    /// Its name.
    name: String,
    /// Its place, m, with `y` and `reach_m`; or else it has a `homography`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    x: Option<f64>,
    /// See `x`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    y: Option<f64>,
    /// How far it reads, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reach_m: Option<f64>,
    /// Of a camera: pixel (u, v, 1) to a place on the floor, row by row.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    homography: Option<[f64; 9]>,
    /// Spread of such a place along each axis, m; 0.2 if it is not said.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    sigma_m: Option<f64>,
}

impl TryFrom<ReaderText> for Reader {
    type Error = String;

    fn try_from(text: ReaderText) -> Result<Self, String> {
        let ReaderText { name, x, y, reach_m, homography, sigma_m } = text;
        let reads = match (x, y, reach_m, homography, sigma_m) {
            (Some(x), Some(y), Some(reach_m), None, None) => Reads::Near { at: Point::new(x, y), reach_m },
            (None, None, None, Some(homography), sigma_m) => {
                Reads::Pixels { homography, sigma_m: sigma_m.unwrap_or(SIGMA_M) }
            }
            _ => {
                return Err(format!(
                    "reader \"{name}\": it has x, y and reach_m, or homography with or without sigma_m"
                ));
            }
        };
        Ok(Self { name, reads })
    }
}

impl From<Reader> for ReaderText {
    fn from(Reader { name, reads }: Reader) -> Self {
        let none = Self { name, x: None, y: None, reach_m: None, homography: None, sigma_m: None };
        match reads {
            Reads::Near { at, reach_m } => {
                Self { x: Some(at.x), y: Some(at.y), reach_m: Some(reach_m), ..none }
            }
            Reads::Pixels { homography, sigma_m } => {
                Self { homography: Some(homography), sigma_m: Some(sigma_m), ..none }
            }
        }
    }
}

/// What is wrong with the readers of a site beside their names.
pub(super) fn check(readers: &[Reader], said: &mut Wrongs) {
    for (index, reader) in readers.iter().enumerate() {
        let (key, metres) = match &reader.reads {
            Reads::Near { reach_m, .. } => ("reach_m", reach_m),
            Reads::Pixels { homography, .. } if !is_one_to_one(homography) => {
                let what = "homography: maps the picture to a line, or is no numbers";
                said.part(index, reader, "homography", what);
                continue;
            }
            Reads::Pixels { sigma_m, .. } => ("sigma_m", sigma_m),
        };
        if !(*metres > 0.0 && *metres <= REACH_MAX_M) {
            let what = format!("{key}: must be above 0 and at most {REACH_MAX_M}, is {metres}");
            said.part(index, reader, key, &what);
        }
    }
}

/// Whether no two pixels have the same place. A homography is known up to a factor, so its size decides nothing.
fn is_one_to_one(homography: &[f64; 9]) -> bool {
    let matrix = Matrix3::from_row_slice(homography);
    let size = matrix.norm();
    size.is_finite() && size > 0.0 && (matrix / size).determinant().abs() > f64::EPSILON
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::Site;

    const NEAR: &str = "[[reader]]\nname = \"hall\"\nx = 1.0\ny = 0.2\nreach_m = 0.8\n";
    const CAMERA: &str =
        "[[reader]]\nname = \"camera\"\nhomography = [0.01, 0, -3.2, 0, 0.012, 0.4, 0, 0.0002, 1]\n";

    #[test]
    fn readers_are_read_and_written() {
        let site = Site::parse("x.toml", &format!("{NEAR}{CAMERA}")).unwrap();
        let [near, camera] = site.readers.as_slice() else { panic!("two readers") };
        assert_eq!(near.reads, Reads::Near { at: Point::new(1.0, 0.2), reach_m: 0.8 });
        let place = camera.reads.floor(320.0, 100.0).unwrap();
        assert!((place - Point::new(0.0, 1.6 / 1.02)).length() < 1e-12, "{place:?}");
        assert_eq!((near.reads.floor(1.0, 1.0), camera.reads.floor(0.0, -5000.0)), (None, None));
        let text = toml::to_string(&site).unwrap();
        assert_eq!(Site::parse("y.toml", &text).unwrap(), site);
    }

    #[test]
    fn mistakes_are_named() {
        let wrong = |text: &str| Site::parse("x.toml", text).unwrap_err().to_string();
        assert_eq!(wrong(&format!("{NEAR}{NEAR}")), "x.toml: two readers are named \"hall\": rename one");
        let both = wrong(&NEAR.replace("x = 1.0", "sigma_m = 1.0"));
        assert!(both.contains("reader \"hall\": it has x, y and reach_m, or homography"), "{both}");
        assert!(wrong(&NEAR.replace("0.8", "0")).contains("reach_m: must be above 0"));
        assert!(wrong(&NEAR.replace("1.0", "1e9")).contains("reader \"hall\": 1000000000 is no place"));
        assert!(
            wrong(&CAMERA.replace("0, 0.012, 0.4", "0.02, 0, -6.4"))
                .contains("homography: maps the picture to a line")
        );
        assert!(wrong(&CAMERA.replace("0.012", "nan")).contains("homography: maps the picture to a line"));
        assert!(wrong(&CAMERA.replace(", 1]", "]")).starts_with("x.toml:3: invalid length 8"));
        assert!(wrong(&CAMERA.replace("name", "title")).contains("unknown field `title`"));
    }
}
