//! Archives that are hostile, damaged, foreign or newer, and restorations that are killed at every step.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;
use kehai::seal::Key;
use kehai_tracking::keys::Keys;
use tar::{Builder, EntryType, Header};

use super::plan::{Plan, Step, hold};
use super::restore::stage;
use super::*;
use crate::key_file;

const SITE: &str = "# home\n[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1, 0], [1, 1]]\n";

/// A folder with everything of a site.
pub(super) struct Home {
    folder: tempfile::TempDir,
    pub(super) places: Places,
}

impl Home {
    /// With nothing in it.
    fn empty() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (site, database) = (folder.path().join("home.toml"), folder.path().join("home.db"));
        Self { folder, places: Places { site, database: Some(database), keys: None } }
    }

    /// With every part, each of this mark.
    pub(super) fn full(mark: &str) -> Self {
        let home = Self::empty();
        for part in Part::all() {
            let file = home.places.of(part).unwrap();
            match part {
                Part::Site => fs::write(file, format!("{SITE}# {mark}\n")).unwrap(),
                Part::Database => database(&file, mark),
                Part::Keys => keys(&file, mark),
                part => fs::write(file, format!("{} of {mark}", part.name())).unwrap(),
            }
        }
        home
    }

    /// Every file but locks, by its name.
    fn files(&self) -> BTreeMap<String, Vec<u8>> {
        let entries = fs::read_dir(self.folder.path()).unwrap().map(|entry| entry.unwrap().path());
        let name = |file: &PathBuf| file.file_name().unwrap().to_string_lossy().into_owned();
        let all = entries.filter(|file| !name(file).ends_with("-lock"));
        all.map(|file| (name(&file), fs::read(&file).unwrap())).collect()
    }

    pub(super) fn backup(&self) -> PathBuf {
        let archive = self.folder.path().with_extension("tar.gz");
        make(&self.places, true, &archive, true).unwrap();
        archive
    }
}

/// A database in which this is written.
fn database(file: &Path, mark: &str) {
    let connection = rusqlite::Connection::open(file).unwrap();
    connection
        .execute_batch(&format!(
            "PRAGMA user_version = 1; CREATE TABLE run (run); CREATE TABLE path (path); CREATE TABLE snapshot (frame);
             CREATE TABLE mark (mark TEXT); INSERT INTO mark VALUES ('{mark}');"
        ))
        .unwrap();
}

/// A file of keys whose secret is this mark.
fn keys(file: &Path, mark: &str) {
    let mut secret = [0; 32];
    secret.iter_mut().zip(mark.bytes()).for_each(|(slot, byte)| *slot = byte);
    key_file::save(file, &Keys::new(Key(secret))).unwrap();
}

/// A hostile archive of these files: name, kind, content.
fn archive(folder: &Path, files: &[(&str, EntryType, &[u8])]) -> PathBuf {
    let path = folder.join("hostile.tar.gz");
    let mut builder = Builder::new(GzEncoder::new(File::create(&path).unwrap(), Compression::fast()));
    for (name, kind, content) in files {
        let mut header = Header::new_gnu();
        // Not by `set_path`, which refuses what a hostile archive has.
        header.as_gnu_mut().unwrap().name[..name.len()].copy_from_slice(name.as_bytes());
        header.set_entry_type(*kind);
        header.set_size(content.len() as u64);
        if kind.is_symlink() {
            header.set_link_name("/etc/passwd").unwrap();
        }
        header.set_cksum();
        builder.append(&header, *content).unwrap();
    }
    builder.into_inner().unwrap().finish().unwrap().flush().unwrap();
    path
}

fn sha256(content: &[u8]) -> String {
    use sha2::Digest;
    sha2::Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn manifest(parts: &[(&str, &[u8])]) -> serde_json::Value {
    let part = |(name, content): &(&str, &[u8])| serde_json::json!({ "name": name, "bytes": content.len(), "sha256": sha256(content) });
    let parts: Vec<serde_json::Value> = parts.iter().map(part).collect();
    serde_json::json!({
        "format": "kehai-backup", "layout": 1, "program": "9.9.9", "made_ms": 0, "site": "home.toml",
        "database_layout": null, "parts": parts,
    })
}

#[test]
fn what_was_kept_is_there_again_and_what_was_not_is_gone() {
    let (old, new) = (Home::full("old"), Home::full("new"));
    fs::remove_file(new.places.of(Part::Picture).unwrap()).unwrap();
    let archive = new.backup();
    #[cfg(unix)]
    {
        let mode = std::os::unix::fs::PermissionsExt::mode(&fs::metadata(&archive).unwrap().permissions());
        assert_eq!(mode & 0o777, 0o600);
    }
    let before = old.files();
    let why = restore(&archive, &old.places, false).unwrap_err().to_string();
    assert!(why.contains("home.toml is there already") && why.contains("--force"), "{why}");
    assert_eq!(old.files(), before);
    fs::write(old.folder.path().join("home.db-wal"), "a log of the old database").unwrap();
    let restored = restore(&archive, &old.places, true).unwrap();
    assert_eq!(restored.parts.len(), Part::all().count() - 1);
    let mut files = old.files();
    let keys_before = files.remove("home.keys.before-restore");
    assert_eq!(keys_before.as_ref(), before.get("home.keys"), "those of another secret");
    assert_eq!(files.keys().collect::<Vec<_>>(), new.files().keys().collect::<Vec<_>>());
    for (name, content) in new.files() {
        assert!(name == "home.db" || files[&name] == content, "{name}");
    }
    let mark: String = rusqlite::Connection::open(old.places.of(Part::Database).unwrap())
        .unwrap()
        .query_row("SELECT mark FROM mark", [], |row| row.get(0))
        .unwrap();
    assert_eq!(mark, "new");
    #[cfg(unix)]
    for part in Part::all().filter(|part| part.is_secret()) {
        let file = fs::metadata(old.places.of(part).unwrap()).unwrap();
        assert_eq!(std::os::unix::fs::PermissionsExt::mode(&file.permissions()) & 0o777, 0o600, "{part:?}");
    }
}

#[test]
fn the_key_of_cards_is_kept_with_the_database_only_if_that_is_said() {
    let home = Home::full("home");
    let archive = home.folder.path().join("without.tar.gz");
    let made = make(&home.places, false, &archive, false).unwrap();
    assert!(!made.parts.contains(&Part::CardKey) && made.parts.contains(&Part::Database));
    assert!(matches!(make(&home.places, false, &archive, false), Err(BackupError::There(_))));
    let other = Home::full("other");
    let key = other.places.of(Part::CardKey).unwrap();
    let before = fs::read(&key).unwrap();
    restore(&archive, &other.places, true).unwrap();
    assert_eq!(fs::read(&key).unwrap(), before, "it is the machine's own");
}

#[test]
fn no_file_of_an_archive_goes_anywhere_but_to_its_place() {
    let outside = tempfile::tempdir().unwrap();
    let target = outside.path().join("evil");
    let absolute = target.to_string_lossy().into_owned();
    let site = SITE.as_bytes();
    let names =
        ["../evil", "../../evil", absolute.as_str(), "site.toml/../../evil", "./site.toml", "evil", ".."];
    for name in names {
        let home = Home::empty();
        // Named in the manifest, too; and put in the place of what it names.
        for manifest in [
            manifest(&[("site.toml", site), (name, b"evil")]),
            manifest(&[("site.toml", site), ("site.access", b"evil")]),
        ] {
            let text = manifest.to_string();
            let files = [
                ("manifest.json", EntryType::Regular, text.as_bytes()),
                ("site.toml", EntryType::Regular, site),
                (name, EntryType::Regular, &b"evil"[..]),
            ];
            let archive = archive(outside.path(), &files);
            let why = restore(&archive, &home.places, true).unwrap_err();
            assert!(matches!(why, BackupError::Foreign { .. }), "{name}: {why}");
            assert_eq!(why.to_string().lines().count(), 1, "{why}");
        }
        assert!(home.files().is_empty(), "{name}: {:?}", home.files());
        assert!(!target.exists() && !home.folder.path().with_file_name("evil").exists());
    }
    for kind in [EntryType::Symlink, EntryType::Link, EntryType::Directory, EntryType::Fifo, EntryType::Block]
    {
        let home = Home::empty();
        let text = manifest(&[("site.toml", b"")]).to_string();
        let files = [("manifest.json", EntryType::Regular, text.as_bytes()), ("site.toml", kind, b"")];
        let why = restore(&archive(outside.path(), &files), &home.places, true).unwrap_err();
        assert!(matches!(why, BackupError::Foreign { .. }), "{kind:?}: {why}");
        assert!(home.files().is_empty(), "{kind:?}");
    }
}

#[test]
fn a_link_that_waits_in_the_place_of_a_file_is_not_followed() {
    let (home, other) = (Home::full("new"), Home::full("old"));
    let precious = other.folder.path().join("precious");
    fs::write(&precious, "precious").unwrap();
    let place = other.places.of(Part::Site).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(&precious, plan::waiting(&place)).unwrap();
    restore(&home.backup(), &other.places, true).unwrap();
    assert_eq!(fs::read_to_string(&precious).unwrap(), "precious");
    assert!(fs::read_to_string(&place).unwrap().contains("# new"));
}

/// Where the sum of a header is in it (POSIX ustar).
const SUM: std::ops::Range<usize> = 148..156;

/// The content of a file, whole, if its sum is right.
fn unpacked(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut content = Vec::new();
    GzDecoder::new(bytes).read_to_end(&mut content).ok().map(|_| content)
}

#[test]
fn what_is_damaged_foreign_or_newer_changes_nothing_and_is_one_line() {
    let (home, old) = (Home::full("new"), Home::full("old"));
    let whole = home.backup();
    let bytes = fs::read(&whole).unwrap();
    let before = old.files();
    let file = old.folder.path().with_extension("wrong");
    let refused = |bytes: &[u8], what: &str| {
        fs::write(&file, bytes).unwrap();
        let why = restore(&file, &old.places, true).expect_err(what).to_string();
        assert_eq!((why.lines().count(), old.files() == before), (1, true), "{what}: {why}");
        why
    };
    // Cut anywhere, changed anywhere.
    for share in 0..16 {
        let at = bytes.len() * share / 16;
        refused(&bytes[..at], "cut");
        let mut changed = bytes.clone();
        changed[at.max(12)] ^= 0x10;
        // A bit of a code that no byte has is none of the content.
        if unpacked(&changed) != unpacked(&bytes) {
            refused(&changed, "changed");
        }
    }
    refused(&bytes[..bytes.len() - 1], "without its last byte");
    assert!(refused(b"Dear Anna", "a letter").contains("no backup of kehai-tracker"));
    let folder = tempfile::tempdir().unwrap();
    let site = SITE.as_bytes();
    let with = |change: &dyn Fn(&mut serde_json::Value), content: &[u8]| {
        let mut manifest = manifest(&[("site.toml", content)]);
        change(&mut manifest);
        let text = manifest.to_string();
        let files = [
            ("manifest.json", EntryType::Regular, text.as_bytes()),
            ("site.toml", EntryType::Regular, content),
        ];
        refused(&fs::read(archive(folder.path(), &files)).unwrap(), &text)
    };
    assert!(with(&|manifest| manifest["layout"] = 2.into(), site).contains("made by kehai-tracker 9.9.9"));
    let newer = |manifest: &mut serde_json::Value| {
        manifest["layout"] = 2.into();
        manifest["program"] = "9\n\u{1b}[2J".into();
    };
    assert!(with(&newer, site).contains("made by kehai-tracker 9\u{fffd}\u{fffd}[2J,"));
    assert!(with(&|manifest| manifest["database_layout"] = 99.into(), site).contains("newer than this one"));
    assert!(with(&|manifest| manifest["format"] = "other".into(), site).contains("another program"));
    assert!(with(&|manifest| manifest["parts"] = serde_json::json!([]), site).contains("has no site"));
    assert!(with(&|manifest| manifest["parts"][0]["sha256"] = "00".into(), site).contains("is damaged"));
    assert!(with(&|manifest| manifest["parts"][0]["bytes"] = 3.into(), site).contains("bytes long"));
    assert!(with(&|_| (), b"[[window]]\n").contains("its site cannot be used"));
    // The library cites what is in the place of a number.
    let files = [("manifest.json", EntryType::Regular, &b"{}"[..]), ("site.toml", EntryType::Regular, site)];
    let mut tar = unpacked(&fs::read(archive(folder.path(), &files)).unwrap()).unwrap();
    tar[SUM].copy_from_slice(b"\n\x1b[2J\n7\0");
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(&tar).unwrap();
    assert!(refused(&packed.finish().unwrap(), "a header").contains("\u{fffd}\u{fffd}[2J\u{fffd}7"));
}

#[test]
fn the_version_that_an_archive_names_moves_no_terminal() {
    let (folder, home) = (tempfile::tempdir().unwrap(), Home::empty());
    let mut manifest = manifest(&[("site.toml", SITE.as_bytes())]);
    manifest["program"] = "9\n\u{1b}[2J".into();
    let text = manifest.to_string();
    let files = [
        ("manifest.json", EntryType::Regular, text.as_bytes()),
        ("site.toml", EntryType::Regular, SITE.as_bytes()),
    ];
    let restored = restore(&archive(folder.path(), &files), &home.places, true).unwrap();
    assert_eq!(restored.program, "9\u{fffd}\u{fffd}[2J");
}

#[test]
fn killed_at_any_step_it_is_the_old_site_or_the_new_one() {
    let archive = Home::full("new").backup();
    let whole = Home::full("old");
    restore(&archive, &whole.places, true).unwrap();
    let new = whole.files();
    let steps = |home: &Home| -> (Plan, Vec<Step>) {
        let (plan, _) = stage(&archive, &home.places, true).unwrap();
        let steps = plan.steps();
        (plan, steps)
    };
    let many = steps(&Home::full("old")).1.len();
    assert!(many > 10, "{many}");
    // Before the plan is written nothing has changed, and the next one begins anew.
    let home = Home::full("old");
    let before = home.files();
    let _ = steps(&home);
    assert!(!finish(&home.places.site).unwrap());
    let seen = home.files().into_iter().filter(|(name, _)| !name.ends_with(".restore"));
    assert_eq!(seen.collect::<BTreeMap<_, _>>(), before);
    restore(&archive, &home.places, true).unwrap();
    assert_eq!(home.files(), new);
    for killed in 0..=many {
        let home = Home::full("old");
        fs::write(home.folder.path().join("home.db-wal"), "the old log").unwrap();
        let (plan, steps) = steps(&home);
        plan.commit(&home.places.site).unwrap();
        steps.iter().take(killed).for_each(|step| step.take().unwrap());
        assert!(finish(&home.places.site).unwrap(), "{killed}");
        assert_eq!(home.files().keys().collect::<Vec<_>>(), new.keys().collect::<Vec<_>>(), "{killed}");
        assert!(home.files() == new, "{killed}: a mix");
        assert!(!finish(&home.places.site).unwrap());
    }
}

#[test]
fn nothing_is_restored_under_a_tracker_that_runs() {
    let (archive, home) = (Home::full("new").backup(), Home::full("old"));
    let before = home.files();
    let tracker = hold(home.places.database.as_deref()).unwrap();
    assert!(tracker.is_some());
    let why = restore(&archive, &home.places, true).unwrap_err();
    assert!(matches!(why, BackupError::Running(_)), "{why}");
    assert_eq!(home.files(), before);
    drop(tracker);
    restore(&archive, &home.places, true).unwrap();
}

/// In the place of a share whose folder cannot be synced: one that may be written and not opened. Root may open it, too.
#[cfg(unix)]
#[test]
fn a_backup_into_a_folder_that_cannot_be_synced_is_made() {
    use std::os::unix::fs::PermissionsExt as _;
    let (home, share) = (Home::full("here"), tempfile::tempdir().unwrap());
    let may = |mode| fs::set_permissions(share.path(), fs::Permissions::from_mode(mode)).unwrap();
    may(0o300);
    let archive = share.path().join("home.tar.gz");
    let made = make(&home.places, false, &archive, false);
    may(0o700);
    assert!(made.is_ok() && archive.exists(), "{made:?}");
}
