//! Where a pixel looks: the camera's optics and how it hangs.
//!
//! ```text
//!             z up                       image: column ─▶ right, row ─▶ down
//!             │  ◩ camera, height_m      depth: along the optical axis
//!             │ ╱ ╲ pitch_deg down
//!             │╱    ╲                    ground frame: x forward, y left, z up, metres;
//!    ─────────┴───────╲──────▶ x         origin on the floor below the camera
//! ```
//!
//! A pinhole without distortion: cameras hand out rectified depth.

use std::path::Path;

use serde::Deserialize;

/// A place in the ground frame: x forward, y left, z up, m.
pub type Place = [f32; 3];

/// Optics and pose, as in the camera's TOML file.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Horizontal field of view, degrees.
    pub fov_deg: f32,
    /// Height of the lens above the floor, m.
    pub height_m: f32,
    /// How far it looks down from the horizontal, degrees; negative: up.
    #[serde(default)]
    pub pitch_deg: f32,
    /// Frames a second.
    pub frames_per_s: f32,
    /// Height from which on points count as a body's, m: see [`Camera::plane_m`].
    pub above_m: Option<f32>,
}

/// Why a camera file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CameraError {
    /// It cannot be read.
    #[error("{file}: {error}")]
    Io {
        /// The file.
        file: String,
        /// What the system says.
        error: std::io::Error,
    },
    /// It is not what a camera file is.
    #[error("{file}: {error}")]
    Toml {
        /// The file.
        file: String,
        /// Line and reason.
        error: Box<toml::de::Error>,
    },
    /// A value cannot be.
    #[error("{file}: `{key}` must be {bound}")]
    Value {
        /// The file.
        file: String,
        /// The key.
        key: &'static str,
        /// What it may be.
        bound: &'static str,
    },
}

impl Camera {
    /// Reads a camera file.
    ///
    /// # Errors
    /// [`CameraError`], one line.
    pub fn open(file: &Path) -> Result<Self, CameraError> {
        let name = || file.display().to_string();
        let text = std::fs::read_to_string(file).map_err(|error| CameraError::Io { file: name(), error })?;
        let camera: Self = toml::from_str(&text)
            .map_err(|error| CameraError::Toml { file: name(), error: Box::new(error) })?;
        match camera.fault() {
            Some((key, bound)) => Err(CameraError::Value { file: name(), key, bound }),
            None => Ok(camera),
        }
    }

    /// The first value that cannot be, and what it may be.
    #[must_use]
    pub fn fault(&self) -> Option<(&'static str, &'static str)> {
        // A lens that covers 170° is no pinhole; 10 m is the highest a reach of 5 m makes any sense of, twice.
        let checks = [
            ((16..=4096).contains(&self.width), "width", "16 to 4096 pixels"),
            ((16..=4096).contains(&self.height), "height", "16 to 4096 pixels"),
            ((10.0..=150.0).contains(&self.fov_deg), "fov_deg", "10 to 150"),
            ((0.1..=10.0).contains(&self.height_m), "height_m", "0.1 to 10"),
            ((-80.0..=80.0).contains(&self.pitch_deg), "pitch_deg", "-80 to 80, positive looks down"),
            ((0.1..=120.0).contains(&self.frames_per_s), "frames_per_s", "0.1 to 120"),
            (self.above_m.is_none_or(|above_m| (0.1..=2.0).contains(&above_m)), "above_m", "0.1 to 2"),
        ];
        checks.into_iter().find(|(good, ..)| !good).map(|(_, key, bound)| (key, bound))
    }

    /// Time between two frames, µs.
    #[must_use]
    pub fn period_us(&self) -> u64 {
        (1e6 / f64::from(self.frames_per_s)).round() as u64
    }

    /// Height from which on points count as a body's, m. Unless set: the camera's own, after the paper (people touch
    /// less above it), but no higher than 1 m, the paper's camera.
    #[must_use]
    pub fn plane_m(&self) -> f32 {
        self.above_m.unwrap_or(self.height_m.min(1.0))
    }

    /// Focal length in pixels.
    #[must_use]
    pub fn focal_px(&self) -> f32 {
        self.width as f32 / 2.0 / (self.fov_deg.to_radians() / 2.0).tan()
    }

    /// Where what a pixel measures is.
    #[must_use]
    pub fn place(&self, column: usize, row: usize, depth_mm: u16) -> Place {
        let [x, y, z] = self.ray(column, row);
        let depth_m = f32::from(depth_mm) / 1000.0;
        [depth_m * x, depth_m * y, self.height_m + depth_m * z]
    }

    /// What a metre of depth adds to the camera's place, through the middle of a pixel.
    #[must_use]
    pub fn ray(&self, column: usize, row: usize) -> Place {
        let focal_px = self.focal_px();
        let right = (column as f32 + 0.5 - self.width as f32 / 2.0) / focal_px;
        let down = (row as f32 + 0.5 - self.height as f32 / 2.0) / focal_px;
        let (sin, cos) = self.pitch_deg.to_radians().sin_cos();
        [cos - sin * down, -right, -sin - cos * down]
    }

    /// Column and row (not rounded) and depth in m of a place; None behind the camera. It may lie outside the image.
    #[must_use]
    pub fn pixel(&self, [x, y, z]: Place) -> Option<([f32; 2], f32)> {
        let (sin, cos) = self.pitch_deg.to_radians().sin_cos();
        let up = z - self.height_m;
        let (depth_m, down_m) = (x * cos - up * sin, -(x * sin + up * cos));
        let focal_px = self.focal_px();
        let column = self.width as f32 / 2.0 - y / depth_m * focal_px - 0.5;
        let row = self.height as f32 / 2.0 + down_m / depth_m * focal_px - 0.5;
        (depth_m > 0.0).then_some(([column, row], depth_m))
    }
}

#[cfg(test)]
pub(crate) const SMALL: Camera = Camera {
    width: 80,
    height: 60,
    fov_deg: 70.0,
    height_m: 1.0,
    pitch_deg: 0.0,
    frames_per_s: 5.0,
    above_m: None,
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_and_its_pixel_are_each_others_inverse() {
        for pitch_deg in [-20.0, 0.0, 25.0] {
            let camera = Camera { pitch_deg, ..SMALL };
            for (column, row) in [(0, 0), (79, 59), (40, 10)] {
                let ([back_column, back_row], depth_m) =
                    camera.pixel(camera.place(column, row, 3000)).unwrap();
                assert!((back_column - column as f32).abs() < 1e-3 && (back_row - row as f32).abs() < 1e-3);
                assert!((depth_m - 3.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn left_is_left_up_is_up_and_pitch_looks_down() {
        let [x, y, z] = SMALL.place(0, 0, 2000);
        // Half the field of view is 35°; the middle of the outermost pixel is half a pixel inside.
        assert!((x - 2.0).abs() < 1e-6 && (y - 2.0 * 35f32.to_radians().tan() * 39.5 / 40.0).abs() < 1e-5);
        assert!(z > 1.0);
        let down = Camera { pitch_deg: 30.0, ..SMALL };
        let [.., z] = down.place(40, 30, 2000);
        assert!((z - (1.0 - 2.0 * 0.5)).abs() < 0.05, "{z}");
        assert_eq!(SMALL.pixel([-1.0, 0.0, 1.0]), None);
    }

    #[test]
    fn a_camera_file_is_refused_in_one_line_that_names_the_key() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("cam.toml");
        let open = |text: &str| {
            std::fs::write(&file, text).unwrap();
            Camera::open(&file).map_err(|error| error.to_string())
        };
        let good = "width = 320\nheight = 240\nfov_deg = 70\nheight_m = 1.0\nframes_per_s = 5\n";
        assert_eq!(open(good).unwrap().period_us(), 200_000);
        assert!(open(&good.replace("70", "nan")).unwrap_err().ends_with("`fov_deg` must be 10 to 150"));
        assert!(open(&good.replace("320", "3")).unwrap_err().contains("`width` must be"));
        assert!(open("width = 320").unwrap_err().contains("missing field"));
        assert!(Camera::open(Path::new("/nonexistent/cam.toml")).is_err());
    }
}
