//! A file that is there whole, or as it was before: one that was cut in its midst would look like a shorter table.
//!
//! ```text
//!   rows ─▶ .counts.csv.new ─▶ on disk ─▶ counts.csv
//! ```

use std::fs;
use std::io;
use std::path::Path as File;

use crate::owned_file;

/// Puts what `write` writes, into a file beside it, in the place of `file`, or of what that links to; it has the rights and the owner
/// of the file that it replaces. What is no regular file, such as a pipe, is written to.
///
/// # Errors
/// What `write` or the system says; `file` is as it was.
pub fn put(file: &File, write: impl FnOnce(&File) -> io::Result<()>) -> io::Result<()> {
    let former = fs::metadata(file).ok();
    if former.as_ref().is_some_and(|former| !former.is_file()) {
        return write(file);
    }
    let file = &fs::canonicalize(file).unwrap_or_else(|_| file.to_owned());
    let beside = owned_file::beside(file);
    let finish = || {
        // Windows flushes only what is open for writing.
        let new = fs::File::options().write(true).open(&beside)?;
        if let Some(former) = &former {
            owned_file::take_after(&new, former)?;
        }
        new.sync_all()?;
        fs::rename(&beside, file)
    };
    let put = write(&beside).and_then(|()| finish());
    if put.is_err() {
        // It may not even be there.
        let _ = fs::remove_file(&beside);
    }
    put
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn f12_a_file_that_could_not_be_written_to_its_end_is_as_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("counts.csv");
        put(&file, |file| fs::write(file, "of before\n")).unwrap();
        let cut = put(&file, |file| {
            fs::write(file, "a half")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(cut.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read_to_string(&file).unwrap(), "of before\n");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn a_file_keeps_its_rights_and_a_link_to_it_its_place() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        let [file, link] = ["paths.csv", "newest.csv"].map(|name| folder.path().join(name));
        fs::write(&file, "of before\n").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o600)).unwrap();
        symlink(&file, &link).unwrap();
        put(&link, |file| fs::write(file, "new\n")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new\n");
        assert_eq!(fs::metadata(&file).unwrap().permissions().mode() & 0o777, 0o600);
    }
}
