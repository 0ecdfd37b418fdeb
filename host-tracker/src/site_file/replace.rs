//! Another text in the place of a file, with the last ones kept beside it.
//!
//! ```text
//!   home.toml.bak2 ◀─ home.toml.bak1 ◀─ home.toml ◀─ .home.toml.new, flushed
//!   …            renamed           linked       renamed          at every moment home.toml is there whole
//! ```

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::owned_file::{self, folder_of, sync_folder_of};

/// So many former files are kept: an evening of edits. The oldest is overwritten.
pub const KEPT: usize = 9;

/// The former file of a number, 1 the newest.
#[must_use]
pub fn former(path: &Path, number: usize) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{name}.bak{number}"))
}

/// Puts `bytes` in the place of a file: at every moment the old or the new one is there whole, also after a loss of power.
/// What was there is kept beside it. A file that root replaces still belongs to its owner: the service goes on to save it.
///
/// # Errors
/// Why not; the file is as it was.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let beside = owned_file::beside(path);
    let written =
        write_beside(&beside, path, bytes).and_then(|()| keep(path)).and_then(|()| fs::rename(&beside, path));
    if written.is_err() {
        // It may not even be there.
        let _ = fs::remove_file(&beside);
        return written;
    }
    sync_folder_of(path);
    Ok(())
}

fn write_beside(beside: &Path, path: &Path, bytes: &[u8]) -> io::Result<()> {
    // One that a power cut has left, or a link: what it leads to is not written, nor given away.
    let _ = fs::remove_file(beside);
    let mut file = File::options().write(true).create_new(true).open(beside)?;
    match fs::metadata(path) {
        Ok(former) => owned_file::take_after(&file, &former)?,
        // A new file, or one that cannot be asked.
        Err(_) => owned_file::give(&file, &folder_of(path)?)?,
    }
    file.write_all(bytes)?;
    file.sync_all()
}

/// Keeps the file under another name, and each kept one under the next.
fn keep(path: &Path) -> io::Result<()> {
    if !path.exists() {
        return Ok(());
    }
    for number in (1..KEPT).rev() {
        match fs::rename(former(path, number), former(path, number + 1)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            Ok(()) | Err(_) => {}
        }
    }
    // A link needs no room on the disk; not every file system has it.
    let newest = former(path, 1);
    fs::hard_link(path, &newest).or_else(|_| fs::copy(path, &newest).map(drop))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_files_are_kept_and_the_oldest_goes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("home.toml");
        for number in 0..KEPT + 3 {
            replace(&path, format!("{number}").as_bytes()).unwrap();
        }
        let text = |path: &Path| fs::read_to_string(path).unwrap();
        assert_eq!(text(&path), (KEPT + 2).to_string());
        for number in 1..=KEPT {
            assert_eq!(text(&former(&path, number)), (KEPT + 2 - number).to_string());
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1 + KEPT, "nothing else is left");
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_root_replaces_belongs_to_whom_it_belonged_to() {
        use std::os::unix::fs::{MetadataExt, chown};
        let folder = tempfile::tempdir().unwrap();
        let (path, new) = (folder.path().join("home.toml"), folder.path().join("new.toml"));
        fs::write(&path, "old").unwrap();
        // Only root may give files away; for others there is nothing to be seen.
        if chown(&path, Some(4242), Some(4243)).is_err() {
            return;
        }
        replace(&path, b"new").unwrap();
        let owner = |path: &Path| fs::metadata(path).map(|data| (data.uid(), data.gid())).unwrap();
        assert_eq!((fs::read_to_string(&path).unwrap().as_str(), owner(&path)), ("new", (4242, 4243)));
        chown(folder.path(), Some(4244), Some(4245)).unwrap();
        replace(&new, b"new").unwrap();
        assert_eq!(owner(&new), (4244, 4245), "a new file, to whom the folder does");
        replace(&path, b"newer").unwrap();
        assert_eq!(owner(&path), (4242, 4243));
    }

    #[test]
    fn a_file_that_cannot_be_kept_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("home.toml");
        fs::write(&path, "old").unwrap();
        // No folder takes the place of one that is not empty.
        for number in [KEPT - 1, KEPT] {
            fs::create_dir_all(former(&path, number).join("in the way")).unwrap();
        }
        assert!(replace(&path, b"new").is_err());
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert!(!folder.path().join(".home.toml.new").exists());
    }

    #[cfg(unix)]
    #[test]
    fn what_a_link_in_the_way_leads_to_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let (path, other) = (folder.path().join("home.toml"), folder.path().join("other"));
        fs::write(&path, "old").unwrap();
        fs::write(&other, "of another").unwrap();
        std::os::unix::fs::symlink(&other, folder.path().join(".home.toml.new")).unwrap();
        replace(&path, b"new").unwrap();
        assert_eq!(fs::read_to_string(&other).unwrap(), "of another");
        assert!(fs::symlink_metadata(&path).unwrap().is_file());
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    }
}
