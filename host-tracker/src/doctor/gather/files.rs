//! Looks at files, and changes none.

use std::fs::{self, Metadata};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::access::file::AccessFile;
use crate::doctor::facts::{
    DatabaseFact, DatabaseState, Secret, SecretFile, SecretState, SiteFact, SiteState,
};
use crate::key_file;
use crate::site_file::{self, LoadError};
use crate::store::card::CardKey;
use crate::store::lock::is_taken;
use crate::store::reader::Reader;
use crate::store::{NEWEST_LAYOUT, Unfit};

/// The site.
pub(super) fn site(file: &Path) -> SiteFact {
    let state = match site_file::load(file) {
        Ok(site) => SiteState::Read(Box::new(site)),
        Err(LoadError::Unreadable { error, .. }) if error.kind() == ErrorKind::NotFound => SiteState::Missing,
        Err(LoadError::Unreadable { error, .. }) if error.kind() == ErrorKind::PermissionDenied => {
            SiteState::Denied
        }
        Err(error) => SiteState::Wrong(error.to_string()),
    };
    let owned = fs::metadata(file).ok().and_then(|data| owned(file, &data));
    SiteFact { file: file.to_path_buf(), owned, state }
}

/// What is secret beside it.
pub(super) fn secrets(site: &Path, keys: Option<PathBuf>, fact: &SiteFact) -> Vec<SecretFile> {
    let keys_needed = keys.is_some();
    let keys = keys.unwrap_or_else(|| key_file::beside(site));
    let content = |loaded: Result<usize, String>| move |_: &Path| loaded;
    let known = key_file::load(&keys).map(|keys| keys.map_or(0, |keys| keys.devices().count()));
    let users = AccessFile::beside(site);
    let entries = users.load().map(|directory| directory.users.len() + directory.tokens.len());
    let mut all = vec![
        secret(Secret::Keys, keys, keys_needed, content(known.map_err(|error| error.to_string()))),
        secret(
            Secret::Users,
            users.path().to_path_buf(),
            false,
            content(entries.map_err(|error| error.to_string())),
        ),
    ];
    let readable =
        |file: &Path| fs::read(file).map(|_| 1).map_err(|error| format!("{}: {error}", file.display()));
    let has_cards =
        matches!(&fact.state, SiteState::Read(site) if !(site.doors.is_empty() && site.readers.is_empty()));
    if has_cards {
        all.push(secret(Secret::Cards, CardKey::beside(site), false, readable));
    }
    let certificate = site.with_extension("key.pem");
    if certificate.exists() {
        all.push(secret(Secret::Certificate, certificate, false, readable));
    }
    all
}

fn secret(
    secret: Secret,
    file: PathBuf,
    needed: bool,
    content: impl FnOnce(&Path) -> Result<usize, String>,
) -> SecretFile {
    let state = match fs::metadata(&file) {
        Err(error) if error.kind() == ErrorKind::NotFound => SecretState::Missing { needed },
        Err(_) => SecretState::Denied,
        Ok(data) => {
            // What may not be read is not wrong.
            let may = fs::File::open(&file).is_ok();
            SecretState::There {
                mode: mode(&data),
                owned: owned(&file, &data),
                content: may.then(|| content(&file)),
            }
        }
    };
    SecretFile { secret, file, state }
}

#[cfg(unix)]
#[allow(clippy::unnecessary_wraps, reason = "elsewhere files have no mode")]
fn mode(data: &Metadata) -> Option<u32> {
    Some(std::os::unix::fs::MetadataExt::mode(data))
}

#[cfg(not(unix))]
fn mode(_: &Metadata) -> Option<u32> {
    None
}

/// Whether it belongs to whom its folder belongs to.
#[cfg(unix)]
fn owned(file: &Path, data: &Metadata) -> Option<bool> {
    use std::os::unix::fs::MetadataExt;
    let folder = fs::metadata(folder(file)).ok()?;
    Some(folder.uid() == data.uid())
}

#[cfg(not(unix))]
fn owned(_: &Path, _: &Metadata) -> Option<bool> {
    None
}

fn folder(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The database, and the disk under it.
pub(super) fn database(file: &Path) -> DatabaseFact {
    let state = match fs::File::open(file) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            DatabaseState::Missing { folder: folder(file).is_dir() }
        }
        Err(error) if error.kind() == ErrorKind::PermissionDenied => DatabaseState::Denied,
        Err(error) => DatabaseState::Wrong(format!("{}: {error}", file.display())),
        Ok(_) => {
            let wrong = |error: &dyn std::fmt::Display| {
                let (error, shown) = (error.to_string(), file.display().to_string());
                DatabaseState::Wrong(if error.contains(&shown) { error } else { format!("{shown}: {error}") })
            };
            match Reader::look(file).map(|reader| reader.layout()) {
                Ok(Ok(Ok(layout) | Err(Unfit::Newer(layout)))) => {
                    DatabaseState::Read { layout, newest: NEWEST_LAYOUT, written: is_taken(file) }
                }
                Ok(Ok(Err(unfit))) => wrong(&unfit),
                Ok(Err(error)) => wrong(&error),
                Err(error) => wrong(&error),
            }
        }
    };
    DatabaseFact { file: file.to_path_buf(), state, free_bytes: free(folder(file)) }
}

#[cfg(unix)]
fn free(folder: &Path) -> Option<u64> {
    let disk = rustix::fs::statvfs(folder).ok()?;
    disk.f_bavail.checked_mul(disk.f_frsize)
}

#[cfg(not(unix))]
fn free(_: &Path) -> Option<u64> {
    None
}
