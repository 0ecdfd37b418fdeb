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
//! Which side of the horizon is the floor: with P from floor to picture, P (x, y, 1) = λ (u, v, 1), and λ > 0 before the camera. Of a
//! camera whose lens is h above the floor det P = −f² h, however it is turned and tilted: u goes right, v down, and the site's y is left of
//! its x. The homography is s P⁻¹ with any s, so its third row times (u, v, 1) is s/λ, and its determinant is −s³/(f² h): before the
//! camera the two differ in sign. What is behind it would else be told of a pixel above the horizon.
//!
//! Source: the projection of a camera's pixels to the floor by a homography, Ota et al. 2006 (docs/bibliography.md, B).

use nalgebra::Matrix3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::wrong::{Wrongs, number};
use crate::geometry::Point;

/// Spread of a place that a camera found, unless its reader says otherwise, m: half a body's width. Calibration on the
/// floor, and a tag that is worn above it.
const SIGMA_M: f64 = 0.2;

/// Longest reach, m: beyond it, that something was read says nothing about where.
const REACH_MAX_M: f64 = 100.0;

/// Columns and rows of a picture count from 0 and are fewer.
const PICTURE_PX: f64 = 8192.0;

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
    /// The place on the floor of a pixel; none of one that shows no floor: on the horizon or above it.
    #[must_use]
    pub fn floor(&self, u: f64, v: f64) -> Option<Point> {
        let Self::Pixels { homography, .. } = self else { return None };
        let [a, b, c, d, e, f, g, h, i] = homography;
        let scale = g * u + h * v + i;
        let at = Point::new((a * u + b * v + c) / scale, (d * u + e * v + f) / scale);
        let is_before = scale * side(homography) > 0.0;
        (is_before && at.x.is_finite() && at.y.is_finite()).then_some(at)
    }
}

/// A number of the sign that the third row of a homography times (u, v, 1) has where the picture shows the floor. If a whole picture
/// is on one side of the horizon, that is the floor's, also in a mirrored one.
fn side(homography: &[f64; 9]) -> f64 {
    let [.., g, h, i] = *homography;
    let corners = [i, i + g * PICTURE_PX, i + h * PICTURE_PX, i + (g + h) * PICTURE_PX];
    let is_whole = corners.iter().all(|at| *at >= 0.0) || corners.iter().all(|at| *at <= 0.0);
    if is_whole { corners.iter().sum() } else { -Matrix3::from_row_slice(homography).determinant() }
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
            let is = number(*metres);
            let what = format!("{key}: must be above 0 and at most {REACH_MAX_M}, is {is}");
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

    /// From the floor to the picture of a camera 2.5 m above (0, 0) that looks along x and down by `pitch_deg`, rolled by
    /// `roll_deg`, with a focal length of 500 pixels and its axis at pixel (320, 240).
    fn to_picture(pitch_deg: f64, roll_deg: f64) -> Matrix3<f64> {
        let ((sin, cos), (roll_sin, roll_cos)) =
            (pitch_deg.to_radians().sin_cos(), roll_deg.to_radians().sin_cos());
        let upright = Matrix3::new(0.0, -1.0, 0.0, -sin, 0.0, 2.5 * cos, cos, 0.0, 2.5 * sin);
        let roll = Matrix3::new(roll_cos, -roll_sin, 0.0, roll_sin, roll_cos, 0.0, 0.0, 0.0, 1.0);
        Matrix3::new(500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0) * roll * upright
    }

    #[test]
    fn a_pixel_above_the_horizon_shows_no_floor_however_the_camera_is_turned_and_the_homography_scaled() {
        for (pitch_deg, roll_deg) in [(10.0, 0.0), (10.0, 90.0), (20.0, 180.0), (20.0, -135.0), (60.0, 30.0)]
        {
            let to_picture = to_picture(pitch_deg, roll_deg);
            for factor in [1.0, -1.0, 40.0, -1e-3] {
                let to_floor = to_picture.try_inverse().unwrap() * factor;
                let homography = std::array::from_fn(|index| to_floor[(index / 3, index % 3)]);
                let reads = Reads::Pixels { homography, sigma_m: SIGMA_M };
                let told = |x: f64, y: f64| {
                    let pixel = to_picture * nalgebra::Vector3::new(x, y, 1.0);
                    reads.floor(pixel[0] / pixel[2], pixel[1] / pixel[2])
                };
                let place = told(6.0, -1.5).unwrap();
                assert!((place - Point::new(6.0, -1.5)).length() < 1e-6, "{place:?}");
                assert_eq!(told(-20.0, 1.0), None, "behind a camera {pitch_deg}° down, rolled {roll_deg}°");
            }
        }
    }

    #[test]
    fn of_a_picture_below_the_horizon_each_pixel_shows_the_floor_also_of_a_mirrored_one() {
        let site = Site::parse("x.toml", CAMERA).unwrap();
        let reads = site.readers[0].reads;
        assert!(reads.floor(0.0, 0.0).is_some() && reads.floor(4000.0, 3000.0).is_some());
        assert_eq!(reads.floor(0.0, -6000.0), None);
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
