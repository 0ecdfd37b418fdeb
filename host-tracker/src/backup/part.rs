//! What a backup is made of, by the name in the archive and by the place on this machine.
//!
//! ```text
//!   Part::Access   "site.access" in every archive   ─▶ /etc/kehai/site.access, home/flat.access, …
//! ```

use std::path::{Path, PathBuf};

use crate::access::file::AccessFile;
use crate::key_file;
use crate::site_file::replace::{KEPT, former};
use crate::store::card::CardKey;

/// A file of a backup.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Part {
    /// The site.
    Site,
    /// The site before the last edits, the newest is 1.
    Former(usize),
    /// The picture under the map.
    Picture,
    /// Where the picture lies.
    PicturePlace,
    /// What the simulator expects of the site.
    Expected,
    /// Users and tokens: secret.
    Access,
    /// The keys of modules: secret.
    Keys,
    /// The key by which cards are hashed: secret.
    CardKey,
    /// The tracker's own certificate.
    Certificate,
    /// Its key: secret.
    CertificateKey,
    /// What happened.
    Database,
}

impl Part {
    /// All of them, in the order of an archive.
    pub fn all() -> impl Iterator<Item = Self> {
        let first = [Self::Site, Self::Picture, Self::PicturePlace, Self::Expected, Self::Access, Self::Keys];
        let last = [Self::CardKey, Self::Certificate, Self::CertificateKey, Self::Database];
        first.into_iter().chain((1..=KEPT).map(Self::Former)).chain(last)
    }

    /// Its name in archives.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Former(number) => format!("site.toml.bak{number}"),
            Self::Database => "site.db".to_owned(),
            part => beside(Path::new("site.toml"), part).to_string_lossy().into_owned(),
        }
    }

    /// That of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::all().find(|part| part.name() == name)
    }

    /// Whether it is for its owner alone, and to be kept as a key is.
    #[must_use]
    pub const fn is_secret(self) -> bool {
        matches!(self, Self::Access | Self::Keys | Self::CardKey | Self::CertificateKey)
    }

    /// Its rights.
    pub(super) const fn mode(self) -> u32 {
        match self {
            Self::Site | Self::Former(_) | Self::Database => 0o640,
            Self::Certificate => 0o644,
            _ => 0o600,
        }
    }

    /// Whether one that is there goes when an archive has none. What is a machine's own stays: its certificate, the key of its
    /// cards, and what it has kept; and the keys of modules that were claimed after the backup.
    pub(super) const fn goes(self) -> bool {
        !matches!(
            self,
            Self::Keys | Self::CardKey | Self::Certificate | Self::CertificateKey | Self::Database
        )
    }
}

/// Beside the site's file.
fn beside(site: &Path, part: Part) -> PathBuf {
    match part {
        Part::Site | Part::Database => site.to_path_buf(),
        Part::Former(number) => former(site, number),
        Part::Picture => site.with_extension("picture"),
        Part::PicturePlace => site.with_extension("picture.json"),
        Part::Expected => site.with_extension("expected.json"),
        Part::Access => AccessFile::beside(site).path().to_path_buf(),
        Part::Keys => key_file::beside(site),
        Part::CardKey => CardKey::beside(site),
        Part::Certificate => site.with_extension("cert.pem"),
        Part::CertificateKey => site.with_extension("key.pem"),
    }
}

/// Where everything is on this machine.
#[derive(Clone, Debug)]
pub struct Places {
    /// The site's file.
    pub site: PathBuf,
    /// The database, if one is kept.
    pub database: Option<PathBuf>,
    /// The keys of modules, if not beside the site.
    pub keys: Option<PathBuf>,
}

impl Places {
    /// Where a part is, or is to be; none of a database that is not kept.
    #[must_use]
    pub fn of(&self, part: Part) -> Option<PathBuf> {
        match part {
            Part::Database => self.database.clone(),
            Part::Keys => Some(self.keys.clone().unwrap_or_else(|| beside(&self.site, part))),
            part => Some(beside(&self.site, part)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_part_has_a_name_and_a_place_of_its_own() {
        let names: Vec<String> = Part::all().map(Part::name).collect();
        assert_eq!(names.first().map(String::as_str), Some("site.toml"));
        for name in
            ["site.picture", "site.picture.json", "site.access", "site.keys", "site.card-key", "site.db"]
        {
            assert!(names.iter().any(|known| known == name), "{name}: {names:?}");
        }
        let mut unlike = names.clone();
        unlike.sort();
        unlike.dedup();
        assert_eq!(unlike.len(), names.len());
        assert!(names.iter().all(|name| !name.contains('/') && Part::named(name).unwrap().name() == *name));
        for foreign in
            ["", "..", "../site.toml", "/etc/passwd", "site.toml.bak10", "./site.toml", "SITE.TOML"]
        {
            assert_eq!(Part::named(foreign), None, "{foreign}");
        }
        let places = Places { site: "/etc/kehai/home.toml".into(), database: None, keys: None };
        assert_eq!(places.of(Part::Access), Some("/etc/kehai/home.access".into()));
        assert_eq!(places.of(Part::Former(2)), Some("/etc/kehai/home.toml.bak2".into()));
        assert_eq!(places.of(Part::Database), None);
    }
}
