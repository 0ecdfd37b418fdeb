//! The site's file: read once, written whole, never half.
//!
//! ```text
//!   another site ─▶ checked ─▶ .home.toml.new, flushed ─▶ renamed to home.toml ─▶ in use
//!                     │ wrong        │ disk full             whatever happens, one of the two is there whole
//!                     └──────────────┴─▶ nothing has changed
//! ```
//!
//! Whatever saves it, only what has changed is written, with everything around it as it was, and the last files are kept beside it.
//! Its revision is that of its text: the same before and after a restart, another one after an edit by hand. An edit that was made
//! from an older revision is merged with what was saved since, or nothing is.

mod error;
pub(crate) mod replace;
mod text;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};

use parking_lot::Mutex;
use sha2::{Digest, Sha256};
use tokio::sync::watch;

use kehai_tracking::calibration::status::Mounting;
use kehai_tracking::site::merge::{Merged, changes, merge};
use kehai_tracking::site::{Module, Site};

use crate::store::pose::Source;
pub use error::{LoadError, SaveError};

/// Bits of a revision: so many of a number are exact in JSON.
const REVISION_BITS: u32 = 53;

/// The site's file, and what it says. Clones are the same file.
#[derive(Clone, Debug)]
pub struct SiteFile {
    path: PathBuf,
    /// Held for a moment alone: a client that only asks does not wait for a disk.
    kept: Arc<Mutex<Kept>>,
    /// Held while the file is read or written: one change at a time.
    changing: Arc<Mutex<()>>,
    revisions: watch::Sender<u64>,
    listeners: Arc<Mutex<Vec<Sender<SiteChange>>>>,
    /// Its site is that of several areas, each of which has a file of its own: there is none here, and none is written.
    is_together: bool,
}

/// A site that has come into use.
#[derive(Clone, Debug)]
pub struct SiteChange {
    /// The site.
    pub site: Arc<Site>,
    /// Whether the file was edited by hand, or written for a client.
    pub source: Source,
}

/// What the file says.
#[derive(Clone, Debug)]
pub struct Kept {
    /// The file's name, without its folder.
    pub name: Arc<str>,
    /// Of its text: another text has another one, and the same text the same, never 0.
    pub revision: u64,
    /// The site.
    pub site: Arc<Site>,
    /// The file's text.
    pub text: Arc<str>,
}

/// A site as a user has edited it.
#[derive(Clone, Debug)]
pub struct Edit {
    /// The revision it was made from; none: it takes the place of any.
    pub revision: Option<u64>,
    /// The site of that revision, by which it is merged with a newer one.
    pub base: Option<Site>,
    /// The edited site.
    pub site: Site,
}

/// What became of an edit.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Saved {
    /// The revision after it.
    pub revision: u64,
    /// What had been changed meanwhile, and is kept.
    pub theirs: Vec<String>,
}

impl SiteFile {
    /// Reads it.
    ///
    /// # Errors
    /// As [`load`].
    pub fn load(path: &Path) -> Result<Self, LoadError> {
        let (text, site) = read(path)?;
        // The file itself, not a link to it, is what will be replaced.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let name = path.file_name().unwrap_or_default().to_string_lossy().into();
        let revision = revision(&text);
        let kept = Kept { name, revision, site: Arc::new(site), text: text.into() };
        Ok(Self {
            path,
            kept: Arc::new(Mutex::new(kept)),
            changing: Arc::default(),
            revisions: watch::Sender::new(revision),
            listeners: Arc::default(),
            is_together: false,
        })
    }

    /// Reads it; if there is none, the site is empty, and the first save makes the file.
    ///
    /// # Errors
    /// As [`load`]; its folder is missing.
    pub fn load_or_begin(path: &Path) -> Result<Self, LoadError> {
        match Self::load(path) {
            Err(LoadError::Unreadable { error, .. }) if error.kind() == io::ErrorKind::NotFound => {}
            other => return other,
        }
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let name = path.file_name().unwrap_or_default();
        let folder = fs::canonicalize(folder)
            .map_err(|error| LoadError::Unreadable { file: folder.display().to_string(), error })?;
        let revision = revision("");
        let kept =
            Kept { name: name.to_string_lossy().into(), revision, site: Arc::default(), text: Arc::from("") };
        let (kept, revisions) = (Arc::new(Mutex::new(kept)), watch::Sender::new(revision));
        let (changing, listeners) = (Arc::default(), Arc::default());
        Ok(Self { path: folder.join(name), kept, changing, revisions, listeners, is_together: false })
    }

    /// The site of several areas, empty at first; `path` is where what belongs to it lies. It is shown, and cannot be saved.
    #[must_use]
    pub fn together(path: &Path) -> Self {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into();
        let kept = Kept { name, revision: revision(""), site: Arc::default(), text: Arc::from("") };
        let (revisions, kept) = (watch::Sender::new(kept.revision), Arc::new(Mutex::new(kept)));
        let (changing, listeners) = (Arc::default(), Arc::default());
        Self { path: path.to_owned(), kept, changing, revisions, listeners, is_together: true }
    }

    /// Whether its site is that of several areas.
    #[must_use]
    pub const fn is_together(&self) -> bool {
        self.is_together
    }

    /// Shows another site of all areas.
    pub fn show(&self, site: Site) {
        let mut kept = self.kept.lock();
        let text = serde_json::to_string(&site).unwrap_or_default();
        let revision = revision(&text);
        *kept = Kept { name: Arc::clone(&kept.name), revision, site: Arc::new(site), text: text.into() };
        self.revisions.send_replace(revision);
    }

    /// Where it is: what belongs to the site lies beside it.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What it says now.
    #[must_use]
    pub fn current(&self) -> Kept {
        self.kept.lock().clone()
    }

    /// The newest revision.
    #[must_use]
    pub fn revisions(&self) -> watch::Receiver<u64> {
        self.revisions.subscribe()
    }

    /// Every change from now on, once the site is in use.
    #[must_use]
    pub fn listen(&self) -> Receiver<SiteChange> {
        let (sender, receiver) = mpsc::channel();
        self.listeners.lock().push(sender);
        receiver
    }

    /// Uses the file as it is now, if it was changed by hand, and calls `changed` with its site.
    ///
    /// # Errors
    /// It is no site, or cannot be read.
    pub fn look(&self, changed: impl FnOnce(Site) -> Result<(), String>) -> Result<(), SaveError> {
        if self.is_together {
            return Ok(());
        }
        let _changing = self.changing.lock();
        let kept = self.current();
        let Some(text) = self.changed_on_disk(&kept)? else { return Ok(()) };
        let site = Site::parse(&kept.name, &text)
            .map_err(|error| SaveError::ChangedOnDisk(format!("mend it, then save again: {error}")))?;
        self.take(text, site, Source::File, changed).map(drop)
    }

    /// Saves an edit, calls `changed`, and publishes its revision. If the site was changed meanwhile both are merged.
    ///
    /// # Errors
    /// Why not; the file and the site in use are as they were.
    pub fn save(
        &self,
        edit: Edit,
        changed: impl FnOnce(Site) -> Result<(), String>,
    ) -> Result<Saved, SaveError> {
        let Edit { revision, base, site } = edit;
        let mut theirs = Vec::new();
        let merged = |kept: &Kept| match (revision, base) {
            (Some(from), _) if from == kept.revision => Ok(site),
            (Some(from), None) => Err(SaveError::Changed { from, now: kept.revision }),
            (Some(_), Some(base)) => {
                theirs = changes(&base, &kept.site);
                together(&base, &site, kept, &theirs)
            }
            (None, _) => Ok(site),
        };
        let revision = self.write(merged, changed)?;
        Ok(Saved { revision, theirs })
    }

    /// What would become of an edit: both in one, what both have changed, and what was changed meanwhile. Nothing is saved.
    #[must_use]
    pub fn compare(&self, base: &Site, mine: &Site) -> (Kept, Merged, Vec<String>) {
        let kept = self.current();
        let merged = merge(base, mine, &kept.site);
        let theirs = changes(base, &kept.site);
        (kept, merged, theirs)
    }

    /// Saves where modules and floors are, by their names, and nothing else. A module that the file does not have is added.
    ///
    /// # Errors
    /// As [`save`](Self::save).
    pub fn save_poses(
        &self,
        poses: &[Mounting],
        changed: impl FnOnce(Site) -> Result<(), String>,
    ) -> Result<u64, SaveError> {
        self.write(|kept| Ok(with_poses(&kept.site, poses)), changed)
    }

    /// Gives a module or a floor another name, and passes the site on.
    ///
    /// # Errors
    /// As [`save`](Self::save).
    pub fn rename_module(
        &self,
        name: &str,
        to: &str,
        changed: impl FnOnce(Site) -> Result<(), String>,
    ) -> Result<u64, SaveError> {
        let renamed = |kept: &Kept| {
            let mut site = (*kept.site).clone();
            let modules = site.modules.iter_mut().map(|module| &mut module.name);
            let names = modules.chain(site.floors.iter_mut().map(|floor| &mut floor.name));
            names.filter(|known| **known == name).for_each(|known| *known = to.into());
            Ok(site)
        };
        self.write(renamed, changed)
    }

    /// Writes the site that `next` makes of what is kept, and passes it on.
    fn write(
        &self,
        next: impl FnOnce(&Kept) -> Result<Site, SaveError>,
        changed: impl FnOnce(Site) -> Result<(), String>,
    ) -> Result<u64, SaveError> {
        if self.is_together {
            return Err(SaveError::Together);
        }
        let _changing = self.changing.lock();
        let kept = self.current();
        if self.changed_on_disk(&kept)?.is_some() {
            return Err(SaveError::ChangedOnDisk("save again".to_owned()));
        }
        let site = next(&kept)?;
        site.check().map_err(SaveError::Wrong)?;
        let text = text::rewritten(&kept.text, &kept.site, &site).map_err(SaveError::Wrong)?;
        let file = || self.path.display().to_string();
        replace::replace(&self.path, text.as_bytes())
            .map_err(|error| SaveError::Failed { file: file(), error })?;
        self.take(text, site, Source::Map, changed)
    }

    /// The file's text, if it is another than what is kept; none of a file that is gone, which is written anew.
    fn changed_on_disk(&self, kept: &Kept) -> Result<Option<String>, SaveError> {
        match fs::read_to_string(&self.path) {
            Ok(text) => Ok(Some(text).filter(|text| **text != *kept.text)),
            Err(error) => match error.kind() {
                io::ErrorKind::NotFound => Ok(None),
                // Bytes that are no text were put there by hand.
                io::ErrorKind::InvalidData => {
                    Err(SaveError::ChangedOnDisk(format!("mend it, then save again: {error}")))
                }
                _ => Err(SaveError::Failed { file: self.path.display().to_string(), error }),
            },
        }
    }

    /// Goes on with another text.
    fn take(
        &self,
        text: String,
        site: Site,
        source: Source,
        changed: impl FnOnce(Site) -> Result<(), String>,
    ) -> Result<u64, SaveError> {
        let revision = revision(&text);
        let change = SiteChange { site: Arc::new(site.clone()), source };
        let mut kept = self.kept.lock();
        let name = Arc::clone(&kept.name);
        *kept = Kept { name, revision, site: Arc::clone(&change.site), text: text.into() };
        drop(kept);
        changed(site).map_err(SaveError::Wrong)?;
        self.listeners.lock().retain(|listener| listener.send(change.clone()).is_ok());
        self.revisions.send_replace(revision);
        Ok(revision)
    }
}

/// The revision of a text.
pub(crate) fn revision(text: &str) -> u64 {
    let hash = Sha256::digest(text.as_bytes());
    let bits = hash.iter().take(8).fold(0, |bits: u64, byte| bits << 8 | u64::from(*byte));
    // Pages take 0 for none.
    (bits >> (u64::BITS - REVISION_BITS)).max(1)
}

/// Both edits in one, if the user has nothing to decide.
fn together(base: &Site, mine: &Site, kept: &Kept, theirs: &[String]) -> Result<Site, SaveError> {
    let merged = merge(base, mine, &kept.site);
    let why = if merged.conflicts.is_empty() {
        match merged.site.check() {
            Ok(()) => return Ok(merged.site),
            Err(wrong) => format!("the site was changed meanwhile, and together it does not fit: {wrong}"),
        }
    } else {
        let both: Vec<&str> = merged.conflicts.iter().map(|conflict| conflict.label.as_str()).collect();
        format!("the site was changed meanwhile, and {} as well: say which to keep", both.join(", "))
    };
    Err(SaveError::Conflict {
        why,
        now: Box::new(kept.clone()),
        merged: Box::new(merged),
        theirs: theirs.to_vec(),
    })
}

/// Reads the site in a file.
///
/// # Errors
/// It cannot be read, is not TOML, has unknown or missing keys, or contradicts itself.
pub fn load(path: &Path) -> Result<Site, LoadError> {
    read(path).map(|(_, site)| site)
}

fn read(path: &Path) -> Result<(String, Site), LoadError> {
    let file = path.display().to_string();
    match fs::read_to_string(path) {
        Ok(text) => Site::parse(&file, &text).map(|site| (text, site)).map_err(LoadError::Wrong),
        Err(error) => Err(LoadError::Unreadable { file, error }),
    }
}

/// A site with modules and floors elsewhere, to the millimetre and a hundredth of a degree.
fn with_poses(site: &Site, poses: &[Mounting]) -> Site {
    let mut site = site.clone();
    for Mounting { name, pose, upside_down } in poses {
        let upside_down = *upside_down;
        let [x, y] = [pose.at.x, pose.at.y].map(|metres| (metres * 1000.0).round() / 1000.0);
        let yaw_deg = (pose.yaw_rad.to_degrees() * 100.0).round() / 100.0;
        if let Some(floor) = site.floors.iter_mut().find(|floor| floor.name == *name) {
            (floor.x, floor.y, floor.yaw_deg) = (x, y, yaw_deg);
        } else if let Some(module) = site.modules.iter_mut().find(|module| module.name == *name) {
            (module.x, module.y, module.yaw_deg) = (x, y, yaw_deg);
            (module.upside_down, module.placed) = (upside_down, true);
        } else {
            let new = Module::unplaced(name.clone());
            site.modules.push(Module { x, y, yaw_deg, upside_down, placed: true, ..new });
        }
    }
    site
}

#[cfg(test)]
mod tests;
