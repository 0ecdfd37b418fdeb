//! From facts about files to findings: the site, what is secret beside it, the database and its disk.

use std::path::Path;

use kehai_tracking::site::Site;

use super::facts::{
    DatabaseFact, DatabaseState, MapFact, OptionsState, Secret, SecretFile, SecretState, SiteFact, SiteState,
};
use super::finding::{About, Finding};

/// A disk with less is full within days: the database's log grows to 4 MB, and an entrance with 5000 passages a day needs 1.3 MB
/// for each (`docs/tracker.md`).
const FULL_BYTES: u64 = 20_000_000;

/// What a year of a home takes (`docs/tracker.md`: 0.47 GB).
const SCARCE_BYTES: u64 = 500_000_000;

/// What is done when a file may not be read.
const AS_ROOT: &str = "ask as root: sudo kehai-tracker doctor";

/// What is not fine with the options of the service, if something is not.
pub(super) fn options(state: &OptionsState) -> Option<Finding> {
    let about = About::Options;
    match state {
        OptionsState::Usable => None,
        OptionsState::Denied(file) => {
            Some(Finding::unknown(about, format!("{} may not be read", file.display()), AS_ROOT))
        }
        OptionsState::Wrong(why) => {
            let advice = "correct KEHAI_OPTIONS in that file, then sudo systemctl restart kehai-tracker";
            Some(Finding::wrong(about, why.clone(), advice))
        }
    }
}

/// Whether the site can be used, and whether something in it is still to be done.
pub(super) fn site(fact: &SiteFact, is_served: bool) -> Vec<Finding> {
    let (about, file) = (About::Site, fact.file.display());
    let advice = "name the site that is meant: kehai-tracker doctor SITE.toml";
    match &fact.state {
        SiteState::Missing if is_served => vec![Finding::warning(
            about,
            format!("{file}: there is none yet"),
            "open the map: it guides from the modules to a site, and makes the file",
        )],
        SiteState::Missing => vec![Finding::wrong(about, format!("{file}: there is no such file"), advice)],
        SiteState::Denied => vec![Finding::unknown(about, format!("{file} may not be read"), AS_ROOT)],
        SiteState::Wrong(why) => {
            let advice =
                format!("correct it, or copy back what the map kept of it before its last save: {file}.bak1");
            vec![Finding::wrong(about, why.clone(), advice)]
        }
        SiteState::Read(site) => {
            let mut findings = content(&file.to_string(), site);
            if fact.owned == Some(false) {
                let text = format!(
                    "{file} belongs to another than its folder: the tracker may not read it, or the map not save it"
                );
                findings.push(Finding::warning(about, text, chown(&fact.file)));
            }
            findings
        }
    }
}

/// What gives a file to the owner of its folder.
fn chown(file: &Path) -> String {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    format!("sudo chown --reference={} {}", folder.display(), file.display())
}

fn content(file: &str, site: &Site) -> Vec<Finding> {
    let about = About::Site;
    let of = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let (devices, zones) = (site.modules.len() + site.floors.len(), site.zones.len());
    let mut findings =
        vec![Finding::ok(about, format!("{file}: {}, {}", of(devices, "device"), of(zones, "zone")))];
    let mut warn = |text: String, advice: &'static str| {
        findings.push(Finding::warning(about, format!("{file}: {text}"), advice));
    };
    if devices == 0 {
        warn("no module: nothing is seen".into(), "open the map: modules that are found wait in its tray");
    }
    if zones == 0 && site.lines.is_empty() {
        warn("neither zone nor counting line: nothing is counted".into(), "draw one on the map: Edit site");
    }
    for module in site.modules.iter().filter(|module| !module.placed) {
        let text = format!("module {} has no place: nothing that it sees is used", module.name);
        warn(text, "place it on the map, or let the map find its place by walking");
    }
    for (index, module) in site.modules.iter().enumerate().filter(|(_, module)| module.placed) {
        let same = |other: &&kehai_tracking::site::Module| {
            other.placed && (other.x, other.y, other.yaw_deg) == (module.x, module.y, module.yaw_deg)
        };
        if let Some(other) = site.modules.get(index + 1..).and_then(|rest| rest.iter().find(same)) {
            let text = format!("modules {} and {} are at one place", module.name, other.name);
            warn(text, "one of them was never placed: place it on the map");
        }
    }
    findings
}

/// Whether a file with secrets is there, for its owner alone, and can be used.
pub(super) fn secret(fact: &SecretFile, map: Option<&MapFact>) -> Finding {
    let about = match fact.secret {
        Secret::Keys => About::Keys,
        Secret::Users => About::Users,
        Secret::Cards => About::Cards,
        Secret::Certificate => About::Certificate,
    };
    let file = fact.file.display();
    match &fact.state {
        SecretState::Missing { needed } => missing(about, &fact.file, *needed, map),
        SecretState::Denied => Finding::unknown(about, format!("{file} may not be looked at"), AS_ROOT),
        SecretState::There { mode: Some(mode), .. } if mode & 0o077 != 0 => Finding::wrong(
            about,
            format!("others may read or write {file} (its mode is {:03o})", mode & 0o777),
            format!("sudo chmod 600 {file}, and renew what is in it if others use this machine"),
        ),
        SecretState::There { owned: Some(false), .. } => Finding::wrong(
            about,
            format!("{file} belongs to another than its folder: the tracker may not read it"),
            chown(&fact.file),
        ),
        SecretState::There { content: Some(Err(why)), .. } => {
            Finding::wrong(about, why.clone(), "restore it from a backup: kehai-tracker restore")
        }
        SecretState::There { mode: None, .. } | SecretState::There { owned: None, .. } => {
            Finding::unknown(about, format!("{file} is there; whose it is the system does not say"), AS_ROOT)
        }
        SecretState::There { content: None, .. } => Finding::unknown(
            about,
            format!("{file} is for its owner alone; what is in it may not be read"),
            AS_ROOT,
        ),
        SecretState::There { content: Some(Ok(0)), .. } if about == About::Users => {
            without_users(&fact.file, map)
        }
        SecretState::There { content: Some(Ok(_)), .. } => {
            Finding::ok(about, format!("{file}, for its owner alone"))
        }
    }
}

/// Of a file that is not there.
fn missing(about: About, file: &Path, needed: bool, map: Option<&MapFact>) -> Finding {
    let shown = file.display();
    match about {
        About::Users => without_users(file, map),
        _ if needed => Finding::wrong(
            about,
            format!("{shown}: there is no such file, and the tracker was told to use it"),
            "restore it from a backup (kehai-tracker restore), or correct the option",
        ),
        About::Keys => Finding::warning(
            about,
            "the modules have no keys: each program in this network can speak for them",
            "give each its key: kehai-tracker module claim (docs/security.md)",
        ),
        _ => Finding::ok(about, format!("{shown} is made when it is needed")),
    }
}

/// Of a site for which no user can log in.
fn without_users(file: &Path, map: Option<&MapFact>) -> Finding {
    let about = About::Users;
    let advice = || {
        format!("kehai-tracker user add NAME --role admin --site {}", file.with_extension("toml").display())
    };
    match map {
        None => Finding::ok(about, "no user can log in, and no map is served"),
        Some(map) if map.first_admin => Finding::warning(
            about,
            format!("{}: no user can log in yet", file.display()),
            "at its next start the tracker makes the user admin, and says the password in its log",
        ),
        Some(map) if map.is_reached && map.insecure => Finding::wrong(
            about,
            format!("the map at {} is open: everybody in the network may do everything", map.address),
            advice(),
        ),
        Some(map) if map.is_reached => Finding::wrong(
            about,
            format!(
                "the map at {} is for the network, and no user can log in: the tracker does not start",
                map.address
            ),
            advice(),
        ),
        Some(_) => {
            Finding::warning(about, "everybody on this machine may do everything on the map", advice())
        }
    }
}

/// Whether the database can be used, and has room.
pub(super) fn database(fact: Option<&DatabaseFact>) -> Vec<Finding> {
    let about = About::Database;
    let Some(fact) = fact else {
        return vec![Finding::ok(about, "none is asked for: nothing is kept")];
    };
    let (file, parent) = (fact.file.display(), fact.file.parent().unwrap_or(Path::new(".")));
    let state = match &fact.state {
        DatabaseState::Missing { folder: true } => Finding::ok(about, format!("{file} is made at the start")),
        DatabaseState::Missing { folder: false } => Finding::wrong(
            about,
            format!("{file}: its folder is missing"),
            format!(
                "make it, for the user that runs the tracker: sudo install -d -o USER {}",
                parent.display()
            ),
        ),
        DatabaseState::Denied => Finding::unknown(about, format!("{file} may not be read"), AS_ROOT),
        DatabaseState::Wrong(why) => Finding::wrong(
            about,
            why.clone(),
            "stop the tracker, then kehai-tracker restore BACKUP, or move the file away: a new one is made",
        ),
        DatabaseState::Read { layout, newest, .. } if layout > newest => Finding::wrong(
            about,
            format!("{file} was written by a newer version (layout {layout}, this one knows {newest})"),
            "install that version again",
        ),
        DatabaseState::Read { layout, newest, written: Some(_) } if layout < newest => Finding::ok(
            about,
            format!("{file}: layout {layout}, made {newest} at the next start of this version"),
        ),
        DatabaseState::Read { layout, written: Some(true), .. } => {
            Finding::ok(about, format!("{file}: layout {layout}, a tracker writes it"))
        }
        DatabaseState::Read { layout, written: Some(false), .. } => {
            Finding::ok(about, format!("{file}: layout {layout}, no tracker writes it now"))
        }
        DatabaseState::Read { layout, written: None, .. } => Finding::unknown(
            about,
            format!("{file}: layout {layout}; whether a tracker writes it cannot be said"),
            AS_ROOT,
        ),
    };
    vec![state, disk(&fact.file, fact.free_bytes)]
}

fn disk(file: &Path, free_bytes: Option<u64>) -> Finding {
    let (about, shown) = (About::Disk, file.display());
    let room = "delete files on that disk, or keep fewer days: --keep-days";
    let Some(bytes) = free_bytes else {
        let text = format!("how much room there is for {shown} the system does not say");
        return Finding::unknown(about, text, "df -h, on this machine, says it");
    };
    let text = format!("{} MB are free for {shown}", bytes / 1_000_000);
    match bytes {
        0..FULL_BYTES => Finding::wrong(about, text, room),
        FULL_BYTES..SCARCE_BYTES => Finding::warning(about, text, room),
        SCARCE_BYTES.. => Finding::ok(about, text),
    }
}
