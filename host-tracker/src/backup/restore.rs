//! Brings a backup back: all of it, or nothing.
//!
//! ```text
//!   archive ─▶ manifest: ours? not newer? ─▶ each file: the next of the manifest? its length, its SHA-256? ─▶ .NAME.restore
//!                                              └ anything else: what waits is removed, nothing has changed
//!   all of them there, the site can be used ─▶ plan ─▶ done
//! ```
//!
//! Nothing of an archive is a path: a file in it is a regular one with the very name of a [`Part`], or the archive is refused.

use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use tar::{Archive, Entries};

use super::archive::Summed;
use super::error::{BackupError, of};
use super::keys;
use super::manifest::{FORMAT, Known, LAYOUT, LONGEST, Manifest, NAME, Packed};
use super::part::{Part, Places};
use super::plan::{Plan, finish, hold, removed, waiting};
use crate::owned_file;
use crate::store::copy::is_known;
use kehai_tracking::site::Site;
use kehai_tracking::text::printable;

/// Longest part that is no database, bytes: more than any picture.
const LONGEST_PART: u64 = 256 << 20;

/// What was restored.
#[derive(Debug)]
pub struct Restored {
    /// What was in the archive.
    pub parts: Vec<Part>,
    /// When it was made, ms since 1970.
    pub made_ms: u64,
    /// The version that made it.
    pub program: String,
    /// Where the keys are that were there, if those of the archive are of another secret.
    pub keys_before: Option<PathBuf>,
}

/// Files that wait beside their places, and go if nothing comes of it.
#[derive(Default)]
struct Waiting {
    files: Vec<PathBuf>,
    is_wanted: bool,
}

impl Drop for Waiting {
    fn drop(&mut self) {
        if !self.is_wanted {
            // What cannot be removed is overwritten by the next one.
            self.files.iter().for_each(|file| drop(fs::remove_file(waiting(file))));
        }
    }
}

/// Puts everything of `archive` into `places`; what is there is replaced if `force` says so.
///
/// # Errors
/// One line. Nothing has changed then, or the next start goes on with it.
pub fn restore(archive: &Path, places: &Places, force: bool) -> Result<Restored, BackupError> {
    finish(&places.site)?;
    let _lock = hold(places.database.as_deref())?;
    let (plan, restored) = stage(archive, places, force)?;
    plan.commit(&places.site)?;
    plan.finish(&places.site)?;
    Ok(restored)
}

/// Checks all of it, and puts it beside its places.
pub(super) fn stage(archive: &Path, places: &Places, force: bool) -> Result<(Plan, Restored), BackupError> {
    let damaged = |why: String| BackupError::Damaged { archive: archive.to_path_buf(), why };
    let foreign = |why: String| BackupError::Foreign { archive: archive.to_path_buf(), why };
    let mut unpacked = Archive::new(GzDecoder::new(File::open(archive).map_err(of(archive))?));
    let mut entries = unpacked.entries().map_err(|error| foreign(error.to_string()))?;
    let manifest = manifest(archive, &mut entries)?;
    let parts = parts(archive, &manifest)?;
    let mut plan = Plan::default();
    for &part in &parts {
        let place = places.of(part).ok_or_else(|| BackupError::NoPlace(archive.to_path_buf()))?;
        if place.exists() && !force {
            return Err(BackupError::There(place));
        }
        if part == Part::Database {
            plan.database = Some(place.clone());
        }
        plan.put.push(place);
    }
    let mut staged = Waiting::default();
    let mut keys_before = None;
    for ((part, place), packed) in parts.iter().zip(&plan.put).zip(&manifest.parts) {
        let entry = next(&mut entries)
            .map_err(damaged)?
            .ok_or_else(|| damaged(format!("{} is missing", packed.name)))?;
        is_it(&entry, packed).map_err(foreign)?;
        staged.files.push(place.clone());
        let sha256 = unpack(entry, *part, place).map_err(|error| match error {
            Unpack::Reading(error) => damaged(format!("{}: {error}", packed.name)),
            Unpack::Writing(error) => of(place)(error),
        })?;
        if sha256 != packed.sha256 {
            return Err(damaged(format!("{} is not what was packed", packed.name)));
        }
        if *part == Part::Keys {
            keys_before = keys::join(place)?;
            plan.aside.extend(keys_before.iter().map(|name| (place.clone(), name.clone())));
        }
    }
    if next(&mut entries).map_err(damaged)?.is_some() {
        return Err(foreign("there is more in it than it says".to_owned()));
    }
    // The sum of the archive itself is behind its last byte.
    io::copy(&mut unpacked.into_inner(), &mut io::sink()).map_err(|error| damaged(error.to_string()))?;
    let site = waiting(&places.site);
    let text = fs::read_to_string(&site).map_err(of(&site))?;
    Site::parse(&manifest.site, &text)
        .map_err(|error| foreign(format!("its site cannot be used: {error}")))?;
    let goes = Part::all().filter(|part| part.goes() && !parts.contains(part));
    plan.removed = goes.filter_map(|part| places.of(part)).filter(|place| place.exists()).collect();
    if !force && let Some(place) = plan.removed.first() {
        return Err(BackupError::There(place.clone()));
    }
    staged.is_wanted = true;
    let Manifest { made_ms, program, .. } = manifest;
    Ok((plan, Restored { parts, made_ms, program: printable(&program), keys_before }))
}

type Entry<'a> = tar::Entry<'a, GzDecoder<File>>;

fn next<'a>(entries: &mut Entries<'a, GzDecoder<File>>) -> Result<Option<Entry<'a>>, String> {
    entries.next().transpose().map_err(|error| error.to_string())
}

/// The first file of an archive.
fn manifest<'a>(archive: &Path, entries: &mut Entries<'a, GzDecoder<File>>) -> Result<Manifest, BackupError> {
    let foreign = |why: String| BackupError::Foreign { archive: archive.to_path_buf(), why };
    let entry = next(entries).map_err(foreign)?.ok_or_else(|| foreign("it is empty".to_owned()))?;
    if entry.path_bytes().as_ref() != NAME.as_bytes() || !entry.header().entry_type().is_file() {
        return Err(foreign(format!("it does not begin with {NAME}")));
    }
    let mut text = Vec::new();
    entry.take(LONGEST).read_to_end(&mut text).map_err(|error| foreign(error.to_string()))?;
    let unread = |error: serde_json::Error| foreign(format!("{NAME}: {error}"));
    let known: Known = serde_json::from_slice(&text).map_err(unread)?;
    if known.format != FORMAT {
        return Err(foreign(format!("{NAME} is of another program")));
    }
    let newer =
        |program: &str| BackupError::Newer { archive: archive.to_path_buf(), program: printable(program) };
    if known.layout > LAYOUT {
        return Err(newer(&known.program));
    }
    let manifest: Manifest = serde_json::from_slice(&text).map_err(unread)?;
    match manifest.database_layout.is_some_and(|layout| !is_known(layout)) {
        true => Err(newer(&known.program)),
        false => Ok(manifest),
    }
}

/// What a manifest says is in its archive: the site, and each part once.
fn parts(archive: &Path, manifest: &Manifest) -> Result<Vec<Part>, BackupError> {
    let foreign = |why: String| BackupError::Foreign { archive: archive.to_path_buf(), why };
    let mut parts: Vec<Part> = Vec::new();
    for packed in &manifest.parts {
        let Some(part) = Part::named(&packed.name).filter(|part| !parts.contains(part)) else {
            return Err(foreign(format!("{:?} is no part of a backup, or there twice", packed.name)));
        };
        if part != Part::Database && packed.bytes > LONGEST_PART {
            return Err(foreign(format!("{} is too long", packed.name)));
        }
        parts.push(part);
    }
    match parts.contains(&Part::Site) {
        true => Ok(parts),
        false => Err(foreign("it has no site".to_owned())),
    }
}

/// Whether an entry is what the manifest says comes next.
fn is_it(entry: &Entry<'_>, packed: &Packed) -> Result<(), String> {
    let name = entry.path_bytes();
    let name = String::from_utf8_lossy(&name);
    if name != packed.name || !entry.header().entry_type().is_file() {
        return Err(format!("{name:?} is in the place of {}", packed.name));
    }
    match entry.size() == packed.bytes {
        true => Ok(()),
        false => Err(format!("{} is {} bytes long instead of {}", packed.name, entry.size(), packed.bytes)),
    }
}

/// Why a file is not beside its place.
enum Unpack {
    Reading(io::Error),
    Writing(io::Error),
}

/// Writes an entry beside its place, and to the disk; its SHA-256.
fn unpack(entry: Entry<'_>, part: Part, place: &Path) -> Result<String, Unpack> {
    let file = waiting(place);
    let _ = removed(&file);
    let folder = owned_file::folder_of(place).map_err(Unpack::Writing)?;
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, part.mode());
    let mut out = options.open(&file).map_err(Unpack::Writing)?;
    let size = entry.size();
    let mut summed = Summed::new(entry);
    let mut buffer = vec![0; 1 << 16];
    let mut written = 0;
    loop {
        let read = summed.read(&mut buffer).map_err(Unpack::Reading)?;
        let Some(bytes) = buffer.get(..read).filter(|bytes| !bytes.is_empty()) else { break };
        out.write_all(bytes).map_err(Unpack::Writing)?;
        written += read as u64;
    }
    if written != size {
        return Err(Unpack::Reading(io::ErrorKind::UnexpectedEof.into()));
    }
    owned_file::give(&out, &folder).and_then(|()| out.sync_all()).map_err(Unpack::Writing)?;
    Ok(summed.sha256())
}
