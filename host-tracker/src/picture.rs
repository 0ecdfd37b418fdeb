//! A picture of the place under the map, and where it lies there: beside the site's file.
//!
//! ```text
//!   home.toml ─┬─ home.picture        the bytes, as they came: PNG or SVG
//!              └─ home.picture.json   where it lies
//!
//!   upper left corner (x, y) ●───────▶ width, turned counter-clockwise by turn_deg; m_per_px to each pixel
//!                            │
//!                            ▼ height
//! ```
//!
//! Nothing is decided by it: it is for eyes.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::owned_file;

/// Longest picture, bytes: a scan of a plan in A3 at 200 dots to the inch, as PNG.
pub const LONGEST: usize = 8 << 20;

/// Largest side, pixels: what browsers draw.
const SIDE: f64 = 16_384.0;

/// Farthest place, m: as a site's.
const FARTHEST_M: f64 = 10_000.0;

/// What a picture is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// PNG (ISO 15948).
    Png,
    /// SVG, which a browser draws as an image and whose scripts do not run then.
    Svg,
}

impl Kind {
    /// What these bytes are; none if they are neither.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
            return Some(Self::Png);
        }
        let text = std::str::from_utf8(bytes).ok()?.trim_start_matches('\u{feff}');
        is_svg(text).then_some(Self::Svg)
    }

    /// Its media type.
    #[must_use]
    pub const fn media_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::Svg => "image/svg+xml",
        }
    }
}

/// Whether the first element of a document is `svg`, behind its declaration, comments and document type.
fn is_svg(mut text: &str) -> bool {
    loop {
        text = text.trim_start();
        let end = match text {
            _ if text.starts_with("<?") => "?>",
            _ if text.starts_with("<!--") => "-->",
            _ if text.starts_with("<!") => ">",
            _ => {
                let name = text.strip_prefix("<svg").and_then(|rest| rest.chars().next());
                return name.is_some_and(|next| next.is_whitespace() || next == '>' || next == '/');
            }
        };
        let Some((_, rest)) = text.split_once(end) else { return false };
        text = rest;
    }
}

/// Where a picture lies.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// Its upper left corner, m.
    pub x: f64,
    /// See `x`.
    pub y: f64,
    /// Where its upper side goes, counter-clockwise.
    pub turn_deg: f64,
    /// How large a pixel is, m.
    pub m_per_px: f64,
    /// Its size, pixels.
    pub width: f64,
    /// See `width`.
    pub height: f64,
}

impl Place {
    /// What is wrong with it.
    ///
    /// # Errors
    /// The first number that cannot be used.
    pub fn check(&self) -> Result<(), &'static str> {
        let within = |value: f64, most: f64| value.is_finite() && value.abs() <= most;
        let is_length = |value: f64, most: f64| value > 0.0 && within(value, most);
        match self {
            _ if !within(self.x, FARTHEST_M) || !within(self.y, FARTHEST_M) => {
                Err("x and y must be within 10 km")
            }
            _ if !within(self.turn_deg, 360.0) => Err("turn_deg must be from -360 to 360"),
            _ if !is_length(self.m_per_px, 100.0) => Err("m_per_px must be above 0, up to 100"),
            _ if !is_length(self.width, SIDE) || !is_length(self.height, SIDE) => {
                Err("width and height must be above 0, up to 16384")
            }
            _ => Ok(()),
        }
    }
}

/// Why a picture is not kept.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// Its bytes are neither PNG nor SVG.
    #[error("this is neither a PNG nor an SVG picture")]
    Unknown,
    /// Where it is to lie.
    #[error("{0}")]
    Place(&'static str),
    /// There is none to be placed.
    #[error("there is no picture")]
    Missing,
    /// The disk.
    #[error("{}: {error}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What the system says.
        error: io::Error,
    },
}

/// Where a site's picture is kept.
#[derive(Clone, Debug)]
pub struct PictureFile {
    picture: PathBuf,
    place: PathBuf,
}

impl PictureFile {
    /// Beside a site's file.
    #[must_use]
    pub fn beside(site: &Path) -> Self {
        let picture = site.with_extension("picture");
        Self { place: picture.with_extension("picture.json"), picture }
    }

    /// The picture; none if there is none.
    ///
    /// # Errors
    /// It cannot be read, or is no picture.
    pub fn load(&self) -> Result<Option<(Kind, Vec<u8>)>, PictureError> {
        let bytes = match fs::read(&self.picture) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(PictureError::File { file: self.picture.clone(), error }),
        };
        let kind = Kind::of(&bytes).ok_or(PictureError::Unknown)?;
        Ok(Some((kind, bytes)))
    }

    /// Where it lies; none if there is no picture, or it has not been placed.
    #[must_use]
    pub fn place(&self) -> Option<Place> {
        let text = fs::read_to_string(&self.place).ok().filter(|_| self.picture.exists())?;
        serde_json::from_str(&text).ok()
    }

    /// Keeps a picture in the place of the one before; it has no place yet.
    ///
    /// # Errors
    /// It is none, or the disk.
    pub fn save(&self, bytes: &[u8]) -> Result<Kind, PictureError> {
        let kind = Kind::of(bytes).ok_or(PictureError::Unknown)?;
        removed(&self.place)?;
        written(&self.picture, bytes)?;
        Ok(kind)
    }

    /// Says where it lies.
    ///
    /// # Errors
    /// Numbers that cannot be used, no picture, or the disk.
    pub fn lay(&self, place: &Place) -> Result<(), PictureError> {
        place.check().map_err(PictureError::Place)?;
        if !self.picture.exists() {
            return Err(PictureError::Missing);
        }
        written(&self.place, serde_json::to_string(place).unwrap_or_default().as_bytes())
    }

    /// Removes it.
    ///
    /// # Errors
    /// The disk.
    pub fn remove(&self) -> Result<(), PictureError> {
        removed(&self.place)?;
        removed(&self.picture)
    }
}

fn written(file: &Path, bytes: &[u8]) -> Result<(), PictureError> {
    let write = owned_file::folder_of(file).and_then(|folder| owned_file::write(file, &folder, bytes));
    write.map_err(|error| PictureError::File { file: file.to_path_buf(), error })
}

fn removed(file: &Path) -> Result<(), PictureError> {
    match fs::remove_file(file) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(PictureError::File { file: file.to_path_buf(), error })
        }
        Ok(()) | Err(_) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PNG: &[u8] = b"\x89PNG\r\n\x1a\nthe rest";
    const SVG: &[u8] =
        b"<?xml version=\"1.0\"?>\n<!-- <html> -->\n<!DOCTYPE svg>\n<svg width=\"4\" height=\"3\"></svg>";
    const PLACE: Place =
        Place { x: -1.0, y: 2.0, turn_deg: 90.0, m_per_px: 0.01, width: 400.0, height: 300.0 };

    #[test]
    fn only_pictures_are_kept_whatever_they_are_called() {
        assert_eq!([Kind::of(PNG), Kind::of(SVG)], [Some(Kind::Png), Some(Kind::Svg)]);
        let others: [&[u8]; 7] = [
            b"",
            b"<html><svg></svg></html>",
            b"<svgfoo>",
            b"<!-- <svg>",
            b"GIF89a",
            b"\xff\xfe<svg>",
            b"svg",
        ];
        assert!(others.iter().all(|bytes| Kind::of(bytes).is_none()));
        let folder = tempfile::tempdir().unwrap();
        let file = PictureFile::beside(&folder.path().join("home.toml"));
        assert!(matches!(file.save(b"<html>"), Err(PictureError::Unknown)));
        assert!(file.load().unwrap().is_none() && file.place().is_none());
    }

    #[test]
    fn a_picture_lies_where_it_was_put_until_another_comes() {
        let folder = tempfile::tempdir().unwrap();
        let file = PictureFile::beside(&folder.path().join("home.toml"));
        assert!(matches!(file.lay(&PLACE), Err(PictureError::Missing)));
        file.save(SVG).unwrap();
        file.lay(&PLACE).unwrap();
        assert_eq!((file.load().unwrap(), file.place()), (Some((Kind::Svg, SVG.to_vec())), Some(PLACE)));
        for wrong in [f64::NAN, 0.0, -1.0, 1e6] {
            assert!(matches!(file.lay(&Place { m_per_px: wrong, ..PLACE }), Err(PictureError::Place(_))));
        }
        assert_eq!(file.place(), Some(PLACE), "a wrong place changes nothing");
        file.save(PNG).unwrap();
        assert_eq!(file.place(), None, "another picture has a place of its own");
        file.remove().unwrap();
        file.remove().unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
