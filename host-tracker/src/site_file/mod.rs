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

pub(crate) mod replace;
mod text;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parking_lot::Mutex;
use sha2::{Digest, Sha256};
use tokio::sync::watch;

use kehai_tracking::calibration::session::Mounting;
use kehai_tracking::site::merge::{Merged, changes, merge};
use kehai_tracking::site::{Module, Site, SiteError};

/// Bits of a revision: so many of a number are exact in JSON.
const REVISION_BITS: u32 = 53;

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
    /// Of its text: another text has another one, and the same text the same, never 0.
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
    /// It was made from another revision, and cannot be merged, as what it was made from was not sent.
    #[error("the site was changed meanwhile (revision {now}, this one was made from {from}): load it again")]
    Changed {
        /// What it was made from.
        from: u64,
        /// What it is now.
        now: u64,
    },
    /// It was made from another revision, and somebody has to decide.
    #[error("{why}")]
    Conflict {
        /// What is to be decided, in words.
        why: String,
        /// The site in use.
        now: Box<Kept>,
        /// Both edits in one, and what both have changed.
        merged: Box<Merged>,
        /// What was changed meanwhile.
        theirs: Vec<String>,
    },
    /// The file was changed by hand, and what to do.
    #[error("the file was changed by hand meanwhile: {0}")]
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

/// A site as somebody has edited it.
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
        Ok(Self { path, kept: Mutex::new(kept), revisions: watch::Sender::new(revision) })
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
        Ok(Self { path: folder.join(name), kept: Mutex::new(kept), revisions: watch::Sender::new(revision) })
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

    /// Uses the file as it is now, if it was changed by hand, and calls `changed` with its site.
    ///
    /// # Errors
    /// It is no site.
    pub fn look(&self, changed: impl FnOnce(Site) -> Result<(), String>) -> Result<(), SaveError> {
        let mut kept = self.kept.lock();
        // One that is gone is written anew.
        let Ok(text) = fs::read_to_string(&self.path) else { return Ok(()) };
        if *text == *kept.text {
            return Ok(());
        }
        let site = Site::parse(&kept.name, &text)
            .map_err(|error| SaveError::ChangedOnDisk(format!("mend it, then save again: {error}")))?;
        self.take(&mut kept, text, site, changed).map(drop)
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

    /// Gives a module another name, and passes the site on.
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
            site.modules
                .iter_mut()
                .filter(|module| module.name == name)
                .for_each(|module| module.name = to.into());
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
        let mut kept = self.kept.lock();
        if fs::read_to_string(&self.path).is_ok_and(|text| *text != *kept.text) {
            return Err(SaveError::ChangedOnDisk("save again".to_owned()));
        }
        let site = next(&kept)?;
        site.check().map_err(SaveError::Wrong)?;
        let text = text::rewritten(&kept.text, &kept.site, &site).map_err(SaveError::Wrong)?;
        let file = || self.path.display().to_string();
        replace::replace(&self.path, text.as_bytes())
            .map_err(|error| SaveError::Failed { file: file(), error })?;
        self.take(&mut kept, text, site, changed)
    }

    /// Goes on with another text.
    fn take(
        &self,
        kept: &mut Kept,
        text: String,
        site: Site,
        changed: impl FnOnce(Site) -> Result<(), String>,
    ) -> Result<u64, SaveError> {
        let revision = revision(&text);
        let name = Arc::clone(&kept.name);
        *kept = Kept { name, revision, site: Arc::new(site.clone()), text: text.into() };
        changed(site).map_err(SaveError::Wrong)?;
        self.revisions.send_replace(revision);
        Ok(revision)
    }
}

/// The revision of a text.
fn revision(text: &str) -> u64 {
    let hash = Sha256::digest(text.as_bytes());
    let bits = hash.iter().take(8).fold(0, |bits: u64, byte| bits << 8 | u64::from(*byte));
    // Pages take 0 for none.
    (bits >> (u64::BITS - REVISION_BITS)).max(1)
}

/// Both edits in one, if nobody has to decide anything.
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
mod tests {
    use kehai_tracking::geometry::Pose;

    use super::*;

    const HOME: &str = "# where we live\n[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";

    fn mounting(name: &str, pose: Pose) -> Mounting {
        Mounting { name: name.to_owned(), pose, upside_down: false }
    }

    fn home(folder: &Path) -> SiteFile {
        let path = folder.join("home.toml");
        fs::write(&path, HOME).unwrap();
        SiteFile::load(&path).unwrap()
    }

    #[test]
    fn a_file_that_is_not_there_is_an_empty_site_and_made_by_the_first_save() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new.toml");
        assert!(SiteFile::load(&path).is_err());
        let file = SiteFile::load_or_begin(&path).unwrap();
        assert!(*file.current().site == Site::default() && !path.exists());
        let hall = Site { modules: vec![Module::unplaced("hall".into())], ..Site::default() };
        let edit = |revision| Edit { revision, base: None, site: hall.clone() };
        file.save(edit(Some(file.current().revision)), |_| Ok(())).unwrap();
        assert_eq!(load(&path).unwrap(), hall);
        let pose = Pose { at: kehai_tracking::geometry::Point::new(1.0, 2.0), yaw_rad: 0.0 };
        file.save_poses(&[mounting("hall", pose)], |_| Ok(())).unwrap();
        let placed = load(&path).unwrap().modules.remove(0);
        assert!(placed.placed && placed.y == 2.0, "{placed:?}");
        assert!(!fs::read_to_string(&path).unwrap().contains("placed"));
        assert!(SiteFile::load_or_begin(&folder.path().join("nowhere/new.toml")).is_err(), "no folder");
        let other = folder.path().join("other.toml");
        let late = SiteFile::load_or_begin(&other).unwrap();
        fs::write(&other, HOME).unwrap();
        assert!(matches!(late.save(edit(None), |_| Ok(())), Err(SaveError::ChangedOnDisk(_))));
    }

    fn renamed(file: &SiteFile, name: &str) -> Site {
        let mut site = (*file.current().site).clone();
        site.zones[0].name = name.to_owned();
        site
    }

    /// Made from what the file says now.
    fn of(file: &SiteFile, site: Site) -> Edit {
        Edit { revision: Some(file.current().revision), base: None, site }
    }

    #[test]
    fn a_saved_site_is_what_the_file_says() {
        let folder = tempfile::tempdir().unwrap();
        let file = home(folder.path());
        let mut told = None;
        let revision = file
            .save(of(&file, renamed(&file, "lounge")), |site| {
                told = Some(site);
                Ok(())
            })
            .unwrap()
            .revision;
        assert_eq!((revision, *file.revisions().borrow()), (file.current().revision, revision));
        let read = load(&folder.path().join("home.toml")).unwrap();
        assert_eq!(Some(&read), told.as_ref());
        assert_eq!(read.zones[0].name, "lounge");
        assert_eq!(*file.current().text, *HOME.replace("hall", "lounge"), "the comment stays");
        let former = replace::former(&folder.path().join("home.toml"), 1);
        assert_eq!(fs::read_to_string(former).unwrap(), HOME);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "something else was left beside it");
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
        let attic = Mounting { upside_down: true, ..mounting("attic", pose(3.0, 4.0, 0.0)) };
        let poses = [mounting("hall", pose(1.23456, -2.0, 0.5)), attic];
        file.save_poses(&poses, |_| Ok(())).unwrap();
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
        assert!(saved.contains("upside_down = true") && !site.modules[0].upside_down, "{saved}");
        // The right way up again, its line goes.
        file.save_poses(&[mounting("attic", pose(3.0, 4.0, 0.0))], |_| Ok(())).unwrap();
        assert!(!fs::read_to_string(&path).unwrap().contains("upside_down"));
        let site = load(&path).unwrap();
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
        file.save_poses(&[mounting("mat", Pose { at, yaw_rad: 0.5 })], |_| Ok(())).unwrap();
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
        let why = file.save(Edit { revision: None, base: None, site: wrong }, never).unwrap_err().to_string();
        assert_eq!(why, "zone \"hall\": polygon needs at least three corners");
        let old = Edit { revision: Some(7), ..of(&file, renamed(&file, "a")) };
        let stale = file.save(old, never).unwrap_err();
        assert!(matches!(stale, SaveError::Changed { from: 7, .. }), "{stale}");
        assert_eq!(fs::read_to_string(&path).unwrap(), HOME);
        fs::write(&path, format!("{HOME}# by hand\n")).unwrap();
        let by_hand = file.save(of(&file, renamed(&file, "a")), never).unwrap_err();
        assert!(matches!(by_hand, SaveError::ChangedOnDisk(_)), "{by_hand}");
        fs::write(&path, format!("{HOME}colour = 1\n")).unwrap();
        let why = file.look(never).unwrap_err().to_string();
        assert!(why.contains("mend it, then save again: home.toml:4: unknown field `colour`"), "{why}");
        assert_eq!(*file.current().text, *HOME);
    }

    #[test]
    fn a_page_from_before_a_restart_cannot_save_over_an_edit_by_hand_since() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("home.toml");
        let before = home(folder.path());
        let (page, base) = (of(&before, renamed(&before, "lounge")), (*before.current().site).clone());
        let again = SiteFile::load(&path).unwrap();
        assert_eq!(again.current().revision, before.current().revision, "the same text");
        fs::write(&path, HOME.replace("[1, 1]", "[1, 2]")).unwrap();
        let after = SiteFile::load(&path).unwrap();
        let refused = after.save(page.clone(), |_| panic!("told")).unwrap_err();
        assert!(matches!(refused, SaveError::Changed { .. }), "{refused}");
        // It says what it was made from: both have changed the one zone, and both versions are in the answer.
        let edit = Edit { base: Some(base), ..page };
        let SaveError::Conflict { why, merged, .. } = after.save(edit, |_| panic!("told")).unwrap_err()
        else {
            panic!("no conflict")
        };
        assert_eq!(why, "the site was changed meanwhile, and zone \"hall\" as well: say which to keep");
        let [conflict] = &merged.conflicts[..] else { panic!("{merged:?}") };
        assert_eq!(conflict.mine.as_ref().unwrap()["name"], "lounge");
        assert_eq!(conflict.theirs.as_ref().unwrap()["polygon"][2][1], 2.0);
        assert_eq!(fs::read_to_string(&path).unwrap(), HOME.replace("[1, 1]", "[1, 2]"));
    }

    #[test]
    fn edits_of_different_parts_are_merged_and_an_edit_by_hand_is_one_of_them() {
        let folder = tempfile::tempdir().unwrap();
        let file = home(folder.path());
        let path = folder.path().join("home.toml");
        let base = (*file.current().site).clone();
        let mine = Edit { base: Some(base.clone()), ..of(&file, renamed(&file, "lounge")) };
        fs::write(&path, format!("{HOME}\n# the north wall\n[[wall]]\npoints = [[0, 0], [9, 0]]\n")).unwrap();
        let mut told = Vec::new();
        file.look(|site| {
            told.push(site);
            Ok(())
        })
        .unwrap();
        let saved = file.save(mine, |_| Ok(())).unwrap();
        assert_eq!((saved.theirs, told.len()), (vec!["wall 1 added".to_owned()], 1));
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains("\"lounge\"") && text.contains("# the north wall"), "{text}");
        // They have taken away the zone that an entry of mine leads to: nobody has changed the same, and yet it does not fit.
        let now = (*file.current().site).clone();
        let mut mine = of(&file, now.clone());
        mine.base = Some(now.clone());
        mine.site
            .entries
            .push(toml::from_str("name = \"e\"\nline = [[0, 0], [1, 0]]\nzone = \"lounge\"").unwrap());
        file.save(of(&file, Site { zones: vec![], ..now }), |_| Ok(())).unwrap();
        let why = file.save(mine, |_| panic!("told")).unwrap_err().to_string();
        assert!(why.ends_with("does not fit: entry \"e\": there is no zone \"lounge\""), "{why}");
    }

    #[test]
    fn a_folder_that_is_gone_is_said_and_nothing_is_used() {
        let folder = tempfile::tempdir().unwrap();
        let file = home(folder.path());
        drop(folder);
        let error = file.save(of(&file, renamed(&file, "a")), |_| Ok(())).unwrap_err().to_string();
        assert!(error.contains("home.toml cannot be saved"), "{error}");
        assert_eq!(file.current().site.zones[0].name, "hall");
    }
}
