//! Makes a backup. A tracker may run meanwhile.
//!
//! ```text
//!   site.db ─▶ .FILE.db, a copy ─┐
//!   the other parts ─────────────┴▶ SHA-256 ─▶ .FILE.new, mode 0600 ─▶ on disk ─▶ FILE
//! ```

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::write::GzEncoder;
use tar::{Builder, Header};

use super::archive::{Summed, file_beside};
use super::error::{BackupError, of};
use super::manifest::{FORMAT, LAYOUT, Manifest, NAME, Packed};
use super::part::{Part, Places};
use crate::owned_file;
use crate::store::copy::copy;
use kehai_tracking::snapshot::unix_ms;

/// A backup that was made.
#[derive(Debug)]
pub struct Made {
    /// What is in it.
    pub parts: Vec<Part>,
    /// How large it is, bytes.
    pub bytes: u64,
}

/// A file that goes when this is dropped.
struct Temporary(PathBuf);

impl Drop for Temporary {
    fn drop(&mut self) {
        // It may be in its place by now.
        let _ = fs::remove_file(&self.0);
    }
}

/// What is to be packed: read once, so that a file that is replaced meanwhile is the old or the new one, or the copy of the
/// database, which no other program writes.
enum Content {
    Read(Vec<u8>),
    Copied,
}

/// Writes everything that is at `places` into `archive`; the key of cards only `with_card_key`: with it and the database a card's
/// number can be tried out.
///
/// # Errors
/// One line. Whatever happens, `archive` is the old or the new one.
pub fn make(places: &Places, with_card_key: bool, archive: &Path, force: bool) -> Result<Made, BackupError> {
    if archive.exists() && !force {
        return Err(BackupError::There(archive.to_path_buf()));
    }
    let copied = Temporary(file_beside(archive, "db"));
    let database = places.database.as_deref().filter(|file| file.exists());
    // One that a kill has left is not gone on with.
    let _ = fs::remove_file(&copied.0);
    let database_layout = database.map(|file| copy(file, &copied.0)).transpose()?;
    let (mut parts, mut packed, mut contents) = (Vec::new(), Vec::new(), Vec::new());
    for part in Part::all() {
        let read = match part {
            Part::CardKey if !with_card_key => continue,
            Part::Database if database.is_none() => continue,
            Part::Database => sum(&copied.0).map(|sum| (Content::Copied, sum)).map_err(of(&copied.0))?,
            part => {
                let Some(file) = places.of(part) else { continue };
                match fs::read(&file) {
                    Ok(bytes) => {
                        let sum = summed(bytes.as_slice()).map_err(of(&file))?;
                        (Content::Read(bytes), sum)
                    }
                    Err(error) if error.kind() == io::ErrorKind::NotFound && part != Part::Site => continue,
                    Err(error) => return Err(of(&file)(error)),
                }
            }
        };
        let (content, (bytes, sha256)) = read;
        parts.push(part);
        packed.push(Packed { name: part.name(), bytes, sha256 });
        contents.push(content);
    }
    let site = places.site.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let manifest = Manifest {
        format: FORMAT.to_owned(),
        layout: LAYOUT,
        program: env!("CARGO_PKG_VERSION").to_owned(),
        made_ms: unix_ms(),
        site,
        database_layout,
        parts: packed,
    };
    let new = Temporary(file_beside(archive, "new"));
    let bytes = write(&new.0, &manifest, &contents, &copied.0).map_err(of(archive))?;
    fs::rename(&new.0, archive).map_err(of(archive))?;
    owned_file::sync_folder_of(archive);
    Ok(Made { parts, bytes })
}

fn sum(file: &Path) -> io::Result<(u64, String)> {
    summed(File::open(file)?)
}

fn summed(content: impl Read) -> io::Result<(u64, String)> {
    let mut summed = Summed::new(content);
    let bytes = io::copy(&mut summed, &mut io::sink())?;
    Ok((bytes, summed.sha256()))
}

fn write(new: &Path, manifest: &Manifest, contents: &[Content], database: &Path) -> io::Result<u64> {
    let _ = fs::remove_file(new);
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let zipped = GzEncoder::new(options.open(new)?, Compression::fast());
    let mut archive = Builder::new(zipped);
    let text = serde_json::to_vec_pretty(manifest)?;
    let seconds = manifest.made_ms / 1000;
    append(&mut archive, NAME, text.len() as u64, seconds, text.as_slice())?;
    for (packed, content) in manifest.parts.iter().zip(contents) {
        match content {
            Content::Read(bytes) => {
                append(&mut archive, &packed.name, packed.bytes, seconds, bytes.as_slice())?
            }
            Content::Copied => {
                append(&mut archive, &packed.name, packed.bytes, seconds, File::open(database)?)?
            }
        }
    }
    let file = archive.into_inner()?.finish()?;
    file.sync_all()?;
    Ok(file.metadata()?.len())
}

fn append(
    archive: &mut Builder<impl Write>,
    name: &str,
    bytes: u64,
    seconds: u64,
    content: impl Read,
) -> io::Result<()> {
    let mut header = Header::new_gnu();
    header.set_size(bytes);
    header.set_mode(0o600);
    header.set_mtime(seconds);
    archive.append_data(&mut header, name, content)
}
