//! Files that `run` and `replay` write anew: a recording, lines of tracks. What an earlier run has written there is kept beside them.
//!
//! ```text
//!   day.mcap is missing or empty           ─▶ begun
//!   … a recording, or lines of tracks      ─▶ kept as day-2026-11-30T004410Z.mcap, by its last change; day.mcap is begun
//!   … any other file, as a site's          ─▶ refused, left as it is
//!   … a pipe, a terminal, /dev/stdout      ─▶ written to
//! ```

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read as _};
use std::path::{Path, PathBuf};

use jiff::Timestamp;

#[cfg(unix)]
use crate::owned_file::OF_PEOPLE;

/// Names behind which a file of the shell's may stand: what becomes of its content, the shell was told (`>`, `>>`).
const OF_SHELL: [&str; 4] = ["/dev/stdout", "/dev/stderr", "/dev/fd", "/proc"];

/// Begins `file`, empty; one that is made is not for every user of the machine: it shows people's paths.
///
/// # Errors
/// Something else is in it, or the system refuses; the file is as it was then.
pub fn begin(file: &Path) -> io::Result<File> {
    if let Some(former) = former(file)? {
        if !is_ours(&former)? {
            let why = "there is neither a recording nor lines of tracks in it, so it is not written over: choose \
                       another file, or remove it";
            return Err(io::Error::new(ErrorKind::AlreadyExists, why));
        }
        let kept = set_aside(&former)?;
        tracing::info!("{}: what was there is kept as {}", file.display(), kept.display());
    }
    let mut options = File::options();
    options.write(true).create(true).truncate(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, OF_PEOPLE);
    options.open(file)
}

/// The regular file there, if something is in it; itself, and not a link to it.
fn former(file: &Path) -> io::Result<Option<PathBuf>> {
    if OF_SHELL.iter().any(|name| file.starts_with(name)) {
        return Ok(None);
    }
    match fs::metadata(file) {
        Ok(data) if data.is_file() && data.len() > 0 => fs::canonicalize(file).map(Some),
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(None),
    }
}

/// Whether a file begins as a recording does, or a line of tracks.
fn is_ours(file: &Path) -> io::Result<bool> {
    let mut begin = Vec::new();
    File::open(file)?.take(mcap::MAGIC.len() as u64).read_to_end(&mut begin)?;
    Ok(begin == mcap::MAGIC || begin.starts_with(b"{"))
}

/// Gives the file a name with the time of its last change, of which there is none yet; that name.
fn set_aside(file: &Path) -> io::Result<PathBuf> {
    let changed = Timestamp::try_from(fs::metadata(file)?.modified()?).map_err(io::Error::other)?;
    let time = changed.strftime("%Y-%m-%dT%H%M%SZ").to_string();
    let kept = (1..=u32::MAX).map(|number| named(file, &time, number));
    let mut free = kept.filter(|kept| kept.symlink_metadata().is_err());
    let kept = free.next().ok_or(ErrorKind::AlreadyExists)?;
    fs::rename(file, &kept)?;
    Ok(kept)
}

/// `day.mcap` → `day-TIME.mcap`, then `day-TIME-2.mcap`.
fn named(file: &Path, time: &str, number: u32) -> PathBuf {
    let mut name = file.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{time}"));
    if number > 1 {
        name.push(format!("-{number}"));
    }
    if let Some(extension) = file.extension() {
        name.push(".");
        name.push(extension);
    }
    file.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write as _;
    use std::time::{Duration, SystemTime};

    /// 2026-11-30 00:44:10 UTC, s since 1970.
    const CHANGED_S: u64 = 1_795_999_450;

    fn changed_then(file: &Path, content: &[u8]) {
        fs::write(file, content).unwrap();
        let then = SystemTime::UNIX_EPOCH + Duration::from_secs(CHANGED_S);
        File::options().write(true).open(file).unwrap().set_modified(then).unwrap();
    }

    #[test]
    fn what_an_earlier_run_has_written_is_kept_beside() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let recording = [mcap::MAGIC, b"first"].concat();
        changed_then(&at("day.mcap"), &recording);
        begin(&at("day.mcap")).unwrap().write_all(b"{\"t\":0.1}\n").unwrap();
        assert_eq!(fs::read(at("day-2026-11-30T004410Z.mcap")).unwrap(), recording);
        changed_then(&at("day.mcap"), b"{\"t\":0.1}\n");
        begin(&at("day.mcap")).unwrap();
        assert_eq!(fs::read(at("day-2026-11-30T004410Z-2.mcap")).unwrap(), b"{\"t\":0.1}\n");
        begin(&at("day.mcap")).unwrap();
        begin(&at("new")).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4, "nothing is kept of an empty file");
    }

    #[test]
    fn any_other_file_is_refused_in_one_line_and_stays() {
        let folder = tempfile::tempdir().unwrap();
        let site = folder.path().join("home.toml");
        fs::write(&site, "[[zone]]\n").unwrap();
        let said = begin(&site).unwrap_err().to_string();
        assert!(said.contains("neither a recording") && said.lines().count() == 1, "{said}");
        assert_eq!(fs::read(&site).unwrap(), b"[[zone]]\n");
        assert!(begin(folder.path()).is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn what_shows_where_people_were_is_not_for_every_user() {
        use std::os::unix::fs::MetadataExt as _;
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("day.mcap");
        begin(&file).unwrap();
        assert_eq!(fs::metadata(&file).unwrap().mode() & 0o007, 0);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_followed_and_what_is_no_regular_file_is_written_to() {
        let folder = tempfile::tempdir().unwrap();
        let (link, file) = (folder.path().join("link"), folder.path().join("day.jsonl"));
        changed_then(&file, b"{}\n");
        std::os::unix::fs::symlink(&file, &link).unwrap();
        begin(&link).unwrap().write_all(b"{\"t\":1}\n").unwrap();
        assert_eq!(fs::read(&file).unwrap(), b"{\"t\":1}\n", "at its own place");
        assert!(folder.path().join("day-2026-11-30T004410Z.jsonl").exists());
        assert_eq!(former(Path::new("/dev/null")).unwrap(), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_file_that_the_shell_has_opened_is_not_set_aside() {
        use std::os::fd::AsRawFd as _;
        let shell = tempfile::NamedTempFile::new().unwrap();
        changed_then(shell.path(), b"{}\n");
        let opened = format!("/dev/fd/{}", shell.as_file().as_raw_fd());
        assert_eq!(former(Path::new(&opened)).unwrap(), None, "{opened}");
        assert!(former(shell.path()).unwrap().is_some(), "by its own name it is");
    }
}
