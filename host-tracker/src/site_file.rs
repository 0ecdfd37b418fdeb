//! The site's file: read once, written whole, never half.
//!
//! ```text
//!   another site ─▶ checked ─▶ .home.toml.new, flushed ─▶ renamed to home.toml ─▶ in use
//!                     │ wrong        │ disk full             whatever happens, one of the two is there whole
//!                     └──────────────┴─▶ nothing has changed
//! ```
//!
//! Comments are not kept when the whole site is saved: the first line says so. Poses alone are changed where they stand, with
//! everything around them as it was. A file that was changed by hand meanwhile is not overwritten.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parking_lot::Mutex;
use tokio::sync::watch;
use toml_edit::{DocumentMut, Item, Table, value};

use kehai_tracking::geometry::Pose;
use kehai_tracking::site::{Site, SiteError};

/// First line of a file written here.
const HEAD: &str = "# Saved by kehai-tracker. Comments are not kept when the map saves again.\n\n";

/// The site's file, and what it says.
#[derive(Debug)]
pub struct SiteFile {
    path: PathBuf,
    kept: Mutex<Kept>,
    revisions: watch::Sender<u64>,
}

/// What the file says.
#[derive(Clone, Debug)]
pub struct Kept {
    /// The file's name, without its folder.
    pub name: Arc<str>,
    /// Counts the changes since the start, from 1.
    pub revision: u64,
    /// The site.
    pub site: Arc<Site>,
    /// The file's text.
    pub text: Arc<str>,
}

/// Why a site file cannot be used, in one line.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// It is missing, unreadable or no text.
    #[error("{file}: {error}")]
    Unreadable {
        /// The file.
        file: String,
        /// What the system says.
        error: io::Error,
    },
    /// It is no site.
    #[error(transparent)]
    Wrong(#[from] SiteError),
}

/// Why a site was not saved; nothing has changed then.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// It contradicts itself.
    #[error("{0}")]
    Wrong(String),
    /// It was made from another revision.
    #[error("the site was changed meanwhile (revision {now}, this one was made from {from}): load it again")]
    Changed {
        /// What it was made from.
        from: u64,
        /// What it is now.
        now: u64,
    },
    /// The file was changed by hand.
    #[error("{0} was changed by hand meanwhile: start the tracker anew to use it, then edit again")]
    ChangedOnDisk(String),
    /// The disk.
    #[error("{file} cannot be saved: {error}")]
    Failed {
        /// The file.
        file: String,
        /// What the system says.
        error: io::Error,
    },
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
        let kept = Kept { name, revision: 1, site: Arc::new(site), text: text.into() };
        Ok(Self { path, kept: Mutex::new(kept), revisions: watch::Sender::new(1) })
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

    /// Saves another site made from revision `from` (of any revision, if none is given), calls `changed`, and publishes
    /// its own revision.
    ///
    /// # Errors
    /// Why not; the file and the site in use are as they were.
    pub fn save(
        &self,
        site: Site,
        from: Option<u64>,
        changed: impl FnOnce(Site) -> Result<(), String>,
    ) -> Result<u64, SaveError> {
        site.check().map_err(SaveError::Wrong)?;
        let body = toml::to_string(&site).map_err(|error| SaveError::Wrong(error.to_string()))?;
        self.write(from, |_| Ok((format!("{HEAD}{body}"), site)), changed)
    }

    /// Saves where modules and floors are, by their names, and nothing else: comments and order stay. A module that the file does
    /// not have is added. Otherwise as [`save`](Self::save).
    ///
    /// # Errors
    /// Why not; the file and the site in use are as they were.
    pub fn save_poses(
        &self,
        poses: &[(String, Pose)],
        from: Option<u64>,
        changed: impl FnOnce(Site) -> Result<(), String>,
    ) -> Result<u64, SaveError> {
        let text = |kept: &Kept| {
            let text = with_poses(&kept.text, poses).map_err(SaveError::Wrong)?;
            let site = Site::parse(&kept.name, &text).map_err(|error| SaveError::Wrong(error.to_string()))?;
            Ok((text, site))
        };
        self.write(from, text, changed)
    }

    /// Writes another text in its place, and passes on the site that it holds.
    fn write(
        &self,
        from: Option<u64>,
        text: impl FnOnce(&Kept) -> Result<(String, Site), SaveError>,
        changed: impl FnOnce(Site) -> Result<(), String>,
    ) -> Result<u64, SaveError> {
        let mut kept = self.kept.lock();
        if let Some(from) = from.filter(|&from| from != kept.revision) {
            return Err(SaveError::Changed { from, now: kept.revision });
        }
        let file = self.path.display().to_string();
        if fs::read_to_string(&self.path).is_ok_and(|text| *text != *kept.text) {
            return Err(SaveError::ChangedOnDisk(file));
        }
        let (text, site) = text(&kept)?;
        replace(&self.path, text.as_bytes()).map_err(|error| SaveError::Failed { file, error })?;
        let revision = kept.revision + 1;
        *kept =
            Kept { name: Arc::clone(&kept.name), revision, site: Arc::new(site.clone()), text: text.into() };
        changed(site).map_err(SaveError::Wrong)?;
        self.revisions.send_replace(revision);
        Ok(revision)
    }
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

/// A site file's text with modules and floors elsewhere.
fn with_poses(text: &str, poses: &[(String, Pose)]) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| error.to_string())?;
    let is = |table: &Table, name: &str| table.get("name").and_then(Item::as_str) == Some(name);
    for (name, pose) in poses {
        let floors = document.get_mut("floor").and_then(Item::as_array_of_tables_mut);
        if let Some(floor) = floors.and_then(|floors| floors.iter_mut().find(|table| is(table, name))) {
            place(floor, pose);
            continue;
        }
        let modules =
            document.entry("module").or_insert(Item::ArrayOfTables(toml_edit::ArrayOfTables::new()));
        let modules = modules
            .as_array_of_tables_mut()
            .ok_or("the site's modules are not written as [[module]]: write them so, or save with the map")?;
        if !modules.iter().any(|table| is(table, name)) {
            let mut table = Table::new();
            table.insert("name", value(name));
            modules.push(table);
        }
        if let Some(table) = modules.iter_mut().find(|table| is(table, name)) {
            place(table, pose);
        }
    }
    Ok(document.to_string())
}

/// Writes a pose into the table of a module or a floor.
fn place(table: &mut Table, pose: &Pose) {
    let numbers = [
        ("x", (pose.at.x * 1000.0).round() / 1000.0),
        ("y", (pose.at.y * 1000.0).round() / 1000.0),
        ("yaw_deg", (pose.yaw_rad.to_degrees() * 100.0).round() / 100.0),
    ];
    for (key, number) in numbers {
        match table.get_mut(key).and_then(Item::as_value_mut) {
            // What stands around the number, a comment behind it included, stays.
            Some(old) => {
                let decor = old.decor().clone();
                *old = number.into();
                *old.decor_mut() = decor;
            }
            None => {
                table.insert(key, value(number));
            }
        }
    }
}

/// Puts `bytes` in the place of a file: at every moment the old or the new one is there whole, also after a
/// loss of power.
fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let beside = path.with_file_name(format!(".{name}.new"));
    let written = write_beside(&beside, path, bytes).and_then(|()| fs::rename(&beside, path));
    if written.is_err() {
        // It may not even be there.
        let _ = fs::remove_file(&beside);
        return written;
    }
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => File::open(folder)?.sync_all(),
        _ => Ok(()),
    }
}

fn write_beside(beside: &Path, path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(beside)?;
    if let Ok(metadata) = fs::metadata(path) {
        file.set_permissions(metadata.permissions())?;
    }
    file.write_all(bytes)?;
    file.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOME: &str = "# where we live\n[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";

    fn home(folder: &Path) -> SiteFile {
        let path = folder.join("home.toml");
        fs::write(&path, HOME).unwrap();
        SiteFile::load(&path).unwrap()
    }

    fn renamed(file: &SiteFile, name: &str) -> Site {
        let mut site = (*file.current().site).clone();
        site.zones[0].name = name.to_owned();
        site
    }

    #[test]
    fn a_saved_site_is_what_the_file_says() {
        let folder = tempfile::tempdir().unwrap();
        let file = home(folder.path());
        let mut told = None;
        let revision = file
            .save(renamed(&file, "lounge"), Some(1), |site| {
                told = Some(site);
                Ok(())
            })
            .unwrap();
        assert_eq!((revision, *file.revisions().borrow()), (2, 2));
        let read = load(&folder.path().join("home.toml")).unwrap();
        assert_eq!(Some(&read), told.as_ref());
        assert_eq!(read.zones[0].name, "lounge");
        assert!(file.current().text.starts_with("# Saved by kehai-tracker"));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "something was left beside it");
    }

    #[test]
    fn poses_are_saved_with_every_comment_in_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("home.toml");
        let text = "# where we live\n[[module]] # the first\nname = \"hall\"\nx = 1 # by ruler\ny = 2.0\nheight_m = 0.7\n\n# the yard\n\
                    [[zone]]\nname = \"yard\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";
        fs::write(&path, text).unwrap();
        let file = SiteFile::load(&path).unwrap();
        let pose = |x, y, yaw_rad| Pose { at: kehai_tracking::geometry::Point::new(x, y), yaw_rad };
        let poses =
            [("hall".to_owned(), pose(1.23456, -2.0, 0.5)), ("attic".to_owned(), pose(3.0, 4.0, 0.0))];
        file.save_poses(&poses, Some(1), |_| Ok(())).unwrap();
        let saved = fs::read_to_string(&path).unwrap();
        for part in [
            "# where we live\n[[module]] # the first",
            "x = 1.235 # by ruler\ny = -2.0\n",
            "height_m = 0.7",
            "# the yard\n[[zone]]",
            "yaw_deg = 28.65",
        ] {
            assert!(saved.contains(part), "{part:?} is not in\n{saved}");
        }
        let site = load(&path).unwrap();
        assert_eq!((site.modules.len(), site.modules[1].x, site.zones.len()), (2, 3.0, 1));
        assert_eq!(site, *file.current().site);
    }

    #[test]
    fn the_pose_of_a_floor_is_saved_in_its_own_table() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("home.toml");
        let text =
            "[[floor]] # the mat\nname = \"mat\"\nx = 1.0 # by ruler\ny = 2.0\ncolumns = 24\nrows = 20\n";
        fs::write(&path, text).unwrap();
        let file = SiteFile::load(&path).unwrap();
        let at = kehai_tracking::geometry::Point::new(3.0, -4.0);
        file.save_poses(&[("mat".to_owned(), Pose { at, yaw_rad: 0.5 })], Some(1), |_| Ok(())).unwrap();
        let saved = fs::read_to_string(&path).unwrap();
        assert!(
            saved.starts_with("[[floor]] # the mat\nname = \"mat\"\nx = 3.0 # by ruler\ny = -4.0\n"),
            "{saved}"
        );
        assert!(saved.contains("yaw_deg = 28.65") && !saved.contains("[[module]]"), "{saved}");
    }

    #[test]
    fn nothing_changes_when_a_site_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = home(folder.path());
        let path = folder.path().join("home.toml");
        let never = |_: Site| -> Result<(), String> { panic!("told of a refused site") };
        let mut wrong = renamed(&file, "hall");
        wrong.zones[0].polygon.truncate(2);
        let why = file.save(wrong, None, never).unwrap_err().to_string();
        assert_eq!(why, "zone \"hall\": polygon needs at least three corners");
        let stale = file.save(renamed(&file, "a"), Some(7), never).unwrap_err();
        assert!(matches!(stale, SaveError::Changed { from: 7, now: 1 }), "{stale}");
        assert_eq!(fs::read_to_string(&path).unwrap(), HOME);
        fs::write(&path, format!("{HOME}# by hand\n")).unwrap();
        let by_hand = file.save(renamed(&file, "a"), Some(1), never).unwrap_err();
        assert!(matches!(by_hand, SaveError::ChangedOnDisk(_)), "{by_hand}");
        assert_eq!(file.current().revision, 1);
    }

    #[test]
    fn a_folder_that_is_gone_is_said_and_nothing_is_used() {
        let folder = tempfile::tempdir().unwrap();
        let file = home(folder.path());
        drop(folder);
        let error = file.save(renamed(&file, "a"), None, |_| Ok(())).unwrap_err().to_string();
        assert!(error.contains("home.toml cannot be saved"), "{error}");
        assert_eq!(file.current().site.zones[0].name, "hall");
    }
}
