//! Where frames come from.
//!
//! ```text
//!   folder   hall/000001.png, 000002.png …   16-bit grey, mm, in the order of their names
//!   file     hall.raw                        width · height values of u16, little endian, mm, frame after frame
//! ```
//!
//! A recording states no times: frame `n` was taken at `n · period`. A frame that cannot be read keeps its slot, so
//! that the ones after it keep their times.

use std::fs::{self, File};
use std::io::{BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

use crate::camera::Camera;
use crate::frame::{Blind, Frame};

/// Frames one after another, at the rate and of the size of a camera.
pub trait Frames: Send {
    /// The next frame, or why it cannot be used; None at the end.
    fn next_frame(&mut self) -> Option<Result<Frame, BadFrame>>;
}

/// A frame that says nothing: one line with file, fault and remedy. Its slot counts as not seen, never as empty.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{place}: {fault}")]
pub struct BadFrame {
    /// File, and which frame of it.
    pub place: String,
    /// What is wrong with it.
    pub fault: Fault,
    /// When it would have been taken, µs since the source began.
    pub stamp_us: u64,
}

/// What is wrong with a frame.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Fault {
    /// The system cannot read it.
    #[error("cannot be read: {0}")]
    Io(String),
    /// It is no PNG, or a broken one.
    #[error("is torn or no PNG ({0}); record it again")]
    Torn(String),
    /// Not 16-bit grey.
    #[error("holds {0}, not 16-bit grey; export depth in mm as 16-bit PNG")]
    Format(String),
    /// Not of the camera's size.
    #[error(
        "is {found_width} × {found_height} pixels, the camera file says {width} × {height}; correct one of the two"
    )]
    Size {
        /// Columns found.
        found_width: usize,
        /// Rows found.
        found_height: usize,
        /// Columns of the camera.
        width: usize,
        /// Rows of the camera.
        height: usize,
    },
    /// The file ends in the middle of a frame.
    #[error("ends after {found} of {needed} bytes; is width or height in the camera file wrong?")]
    Short {
        /// Bytes there are.
        found: usize,
        /// Bytes of a frame.
        needed: usize,
    },
    /// Nothing was seen.
    #[error("{0}")]
    Blind(Blind),
}

/// Why a recording cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The system does not let us.
    #[error("{place}: {error}")]
    Io {
        /// Which file or folder.
        place: String,
        /// What the system says.
        error: std::io::Error,
    },
    /// A folder without images.
    #[error("{0}: holds no .png file; give a folder of 16-bit PNGs, or a .raw file")]
    Empty(String),
}

/// The recording at `place`: a folder of PNGs, or a raw file.
///
/// # Errors
/// [`OpenError`], one line.
pub fn open(place: &Path, camera: &Camera) -> Result<Box<dyn Frames>, OpenError> {
    let failed = |error| OpenError::Io { place: place.display().to_string(), error };
    if fs::metadata(place).map_err(failed)?.is_dir() {
        Ok(Box::new(Folder::open(place, camera)?))
    } else {
        let file = BufReader::new(File::open(place).map_err(failed)?);
        Ok(Box::new(Raw::new(place.display().to_string(), file, camera)))
    }
}

/// A frame with something in it, of the camera's size.
fn checked(
    (width, height): (usize, usize),
    depth_mm: Vec<u16>,
    camera: &Camera,
    stamp_us: u64,
) -> Result<Frame, Fault> {
    let wrong = || Fault::Size {
        found_width: width,
        found_height: height,
        width: camera.width,
        height: camera.height,
    };
    if (width, height) != (camera.width, camera.height) {
        return Err(wrong());
    }
    let frame = Frame::new(width, height, depth_mm, stamp_us).ok_or_else(wrong)?;
    frame.blind().map_or(Ok(frame), |blind| Err(Fault::Blind(blind)))
}

/// PNGs in a folder, in the order of their names.
pub struct Folder {
    files: Vec<PathBuf>,
    camera: Camera,
    taken: usize,
}

impl Folder {
    /// Lists the folder; the images are read one at a time.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn open(folder: &Path, camera: &Camera) -> Result<Self, OpenError> {
        let failed = |error| OpenError::Io { place: folder.display().to_string(), error };
        let mut files = Vec::new();
        for entry in fs::read_dir(folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            if path.extension().is_some_and(|end| end.eq_ignore_ascii_case("png")) {
                files.push(path);
            }
        }
        files.sort();
        if files.is_empty() {
            return Err(OpenError::Empty(folder.display().to_string()));
        }
        Ok(Self { files, camera: *camera, taken: 0 })
    }
}

impl Frames for Folder {
    fn next_frame(&mut self) -> Option<Result<Frame, BadFrame>> {
        let file = self.files.get(self.taken)?;
        let stamp_us = self.taken as u64 * self.camera.period_us();
        self.taken += 1;
        let frame = read_png(file, &self.camera)
            .and_then(|(size, depth_mm)| checked(size, depth_mm, &self.camera, stamp_us));
        Some(frame.map_err(|fault| BadFrame { place: file.display().to_string(), fault, stamp_us }))
    }
}

/// Size and values of a 16-bit grey PNG. One of another size than the camera's is not decoded: it may be huge.
fn read_png(file: &Path, camera: &Camera) -> Result<((usize, usize), Vec<u16>), Fault> {
    let torn = |error: png::DecodingError| match error {
        png::DecodingError::IoError(error) if error.kind() != ErrorKind::UnexpectedEof => {
            Fault::Io(error.to_string())
        }
        error => Fault::Torn(error.to_string()),
    };
    let opened = File::open(file).map_err(|error| Fault::Io(error.to_string()))?;
    let mut reader = png::Decoder::new(BufReader::new(opened)).read_info().map_err(torn)?;
    let (colour, depth) = reader.output_color_type();
    if (colour, depth) != (png::ColorType::Grayscale, png::BitDepth::Sixteen) {
        return Err(Fault::Format(format!("{colour:?} of {} bits", depth as u8)));
    }
    let size = (reader.info().width as usize, reader.info().height as usize);
    if size != (camera.width, camera.height) {
        return Ok((size, Vec::new()));
    }
    let mut bytes = vec![0; size.0 * size.1 * 2];
    reader.next_frame(&mut bytes).map_err(torn)?;
    Ok((size, bytes.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect()))
}

/// Frames one behind the other in a file, or any other stream of bytes. They end where it cannot be read: what came after
/// would begin within a frame.
pub struct Raw<R> {
    name: String,
    /// None: no more can be read.
    reader: Option<R>,
    camera: Camera,
    taken: u64,
}

impl<R> Raw<R> {
    /// Those of a camera; `name` is what the stream is called in messages.
    pub const fn new(name: String, reader: R, camera: &Camera) -> Self {
        Self { name, reader: Some(reader), camera: *camera, taken: 0 }
    }
}

impl<R: Read + Send> Frames for Raw<R> {
    fn next_frame(&mut self) -> Option<Result<Frame, BadFrame>> {
        let (width, height) = (self.camera.width, self.camera.height);
        let (needed, stamp_us) = (width * height * 2, self.taken * self.camera.period_us());
        let mut bytes = Vec::with_capacity(needed);
        let read = self.reader.as_mut()?.take(needed as u64).read_to_end(&mut bytes);
        self.taken += 1;
        let frame = match read {
            Ok(0) => return None,
            Ok(found) if found < needed => Err(Fault::Short { found, needed }),
            Ok(_) => {
                let values = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
                checked((width, height), values.collect(), &self.camera, stamp_us)
            }
            Err(error) => {
                self.reader = None;
                Err(Fault::Io(error.to_string()))
            }
        };
        let place = || format!("{}, frame {}", self.name, self.taken);
        Some(frame.map_err(|fault| BadFrame { place: place(), fault, stamp_us }))
    }
}

/// Writes a frame as a 16-bit grey PNG.
///
/// # Errors
/// What the system or the encoder says.
pub fn write_png(file: &Path, frame: &Frame) -> Result<(), Box<dyn std::error::Error>> {
    let size = [u32::try_from(frame.width())?, u32::try_from(frame.height())?];
    let mut encoder = png::Encoder::new(File::create(file)?, size[0], size[1]);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let bytes: Vec<u8> = frame.depth_mm().iter().flat_map(|value_mm| value_mm.to_be_bytes()).collect();
    Ok(encoder.write_header()?.write_image_data(&bytes)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::SMALL;

    fn frame(value_mm: u16) -> Frame {
        Frame::new(SMALL.width, SMALL.height, vec![value_mm; SMALL.width * SMALL.height], 0).unwrap()
    }

    fn lines(frames: &mut dyn Frames) -> Vec<String> {
        std::iter::from_fn(|| frames.next_frame())
            .map(|frame| match frame {
                Ok(frame) => format!("{} at {}", frame.depth_mm()[0], frame.stamp_us),
                Err(bad) => bad.to_string(),
            })
            .collect()
    }

    #[test]
    fn a_folder_gives_its_frames_in_order_and_bad_ones_keep_their_slots() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        write_png(&path("1.png"), &frame(1000)).unwrap();
        write_png(&path("2.png"), &frame(0)).unwrap();
        write_png(&path("3.png"), &frame(u16::MAX)).unwrap();
        write_png(&path("4.png"), &Frame::new(2, 1, vec![7, 7], 0).unwrap()).unwrap();
        let whole = fs::read(path("1.png")).unwrap();
        fs::write(path("5.png"), &whole[..whole.len() / 2]).unwrap();
        fs::write(path("6.png"), b"no image").unwrap();
        write_png(&path("7.png"), &frame(2000)).unwrap();
        fs::write(path("readme.txt"), b"not a frame").unwrap();
        let lines = lines(&mut *open(folder.path(), &SMALL).unwrap());
        assert_eq!(lines.len(), 7, "{lines:?}");
        assert_eq!((&*lines[0], &*lines[6]), ("1000 at 0", "2000 at 1200000"));
        for (line, said) in lines[1..6].iter().zip([
            "2.png: no pixel has a depth",
            "3.png: every pixel is at the end of the scale",
            "4.png: is 2 × 1 pixels, the camera file says 80 × 60",
            "5.png: is torn or no PNG",
            "6.png: is torn or no PNG",
        ]) {
            assert!(line.contains(said) && !line.contains('\n'), "{line}");
        }
    }

    #[test]
    fn a_raw_file_gives_whole_frames_and_names_a_rest() {
        let mut bytes: Vec<u8> = [1000u16, 1234]
            .iter()
            .flat_map(|&value_mm| vec![value_mm; 80 * 60])
            .flat_map(u16::to_le_bytes)
            .collect();
        bytes.extend([1, 2, 3]);
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(file.path(), bytes).unwrap();
        let lines = lines(&mut *open(file.path(), &SMALL).unwrap());
        assert_eq!(lines[..2], ["1000 at 0", "1234 at 200000"]);
        assert!(
            lines[2].ends_with(
                "frame 3: ends after 3 of 9600 bytes; is width or height in the camera file wrong?"
            )
        );
    }

    #[test]
    fn a_stream_that_breaks_off_is_told_once_and_ends() {
        struct Broken(usize);
        impl Read for Broken {
            fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
                let read = bytes.len().min(self.0);
                self.0 -= read;
                bytes[..read].fill(7);
                if read == 0 { Err(std::io::Error::other("unplugged")) } else { Ok(read) }
            }
        }
        let mut frames = Raw::new("camera".into(), Broken(80 * 60 * 2 + 5), &SMALL);
        let told: Vec<String> = (0..4)
            .map_while(|_| frames.next_frame())
            .map(|frame| frame.map_or_else(|bad| bad.to_string(), |frame| frame.depth_mm()[0].to_string()))
            .collect();
        assert_eq!(told, ["1799", "camera, frame 2: cannot be read: unplugged"]);
    }

    #[test]
    fn a_place_without_frames_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let said = |place: &Path| open(place, &SMALL).err().unwrap().to_string();
        assert!(said(folder.path()).contains("holds no .png file"));
        assert!(said(&folder.path().join("none")).contains("none: "));
    }

    #[test]
    fn an_image_of_8_bits_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = File::create(folder.path().join("1.png")).unwrap();
        let mut encoder = png::Encoder::new(file, 80, 60);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.write_header().unwrap().write_image_data(&[9; 4800]).unwrap();
        let lines = lines(&mut *open(folder.path(), &SMALL).unwrap());
        assert!(lines[0].contains("holds Grayscale of 8 bits, not 16-bit grey"), "{lines:?}");
    }
}
