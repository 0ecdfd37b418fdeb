//! The daemon from its start to its end.

use kehai_tracking::alarm::Cause;
use kehai_tracking::alarm_list::{About, ListedAlarm};
use kehai_tracking::door::Alarm;

use super::*;
use crate::site_file::Edit;
use crate::store::reader::Reader;

fn in_file(file: &Path) -> Database {
    Database { file: file.to_owned(), keep: Keep::USUAL, restore: false }
}

/// A tracker of this site that keeps what happens in `database`, if in any, and is alone.
fn settings(site: SiteFile, database: Option<Database>) -> Settings {
    Settings {
        site,
        modules: Vec::new(),
        discover: false,
        tracker: Selected::default(),
        record: None,
        database,
        map: None,
        mqtt: None,
        webhook: None,
        card_key: None,
        keys: None,
        clear: Clear::default(),
        links: LinkSettings::default(),
    }
}

/// As if it were stopped while the program is busy: no snapshot has been taken.
#[test]
fn what_came_just_before_the_end_is_in_the_database() {
    let folder = tempfile::tempdir().unwrap();
    let (file, site) = (folder.path().join("home.db"), folder.path().join("home.toml"));
    let settings = settings(SiteFile::load_or_begin(&site).unwrap(), Some(in_file(&file)));
    let daemon = Daemon::start(settings, |_| {}).unwrap();
    let mut frames = daemon.service.frames();
    while frames.borrow_and_update().unix_ms == 0 {
        std::thread::sleep(Duration::from_millis(10));
    }
    let state = daemon.stop().unwrap().unwrap();
    assert!(state.written > 0, "{state:?}");
    let newest = Reader::open(&file).unwrap().snapshot().unwrap().unwrap();
    assert_eq!(newest.unix_ms, frames.borrow().unix_ms);
}

#[test]
fn an_edit_by_hand_is_kept_as_the_files_and_one_of_a_client_as_the_maps() {
    let folder = tempfile::tempdir().unwrap();
    let (database, path) = (folder.path().join("home.db"), folder.path().join("home.toml"));
    let at = |x: u32| format!("[[module]]\nname = \"left\"\nx = {x}\ny = 2\n");
    std::fs::write(&path, at(1)).unwrap();
    let file = SiteFile::load(&path).unwrap();
    let mut daemon = Daemon::start(settings(file.clone(), Some(in_file(&database))), |_| {}).unwrap();
    let passed_on = |daemon: &mut Daemon| {
        // A row of its own millisecond.
        std::thread::sleep(Duration::from_millis(5));
        while !matches!(daemon.next(Duration::from_secs(1)), Next::Snapshot(_)) {}
    };
    passed_on(&mut daemon);
    std::fs::write(&path, at(3)).unwrap();
    assert!(daemon.read_site_anew().unwrap());
    passed_on(&mut daemon);
    let mut site = (*file.current().site).clone();
    site.modules[0].x = 4.0;
    file.save(Edit { revision: None, base: None, site }, |site| daemon.service.sites().change(site)).unwrap();
    passed_on(&mut daemon);
    daemon.stop().unwrap();
    let poses = Reader::open(&database).unwrap().poses().unwrap();
    let kept: Vec<(f64, Source)> = poses.iter().map(|pose| (pose.x_m, pose.source)).collect();
    assert_eq!(kept, [(1.0, Source::File), (3.0, Source::File), (4.0, Source::Map)]);
}

#[test]
fn a_site_is_not_read_anew_while_an_alarm_of_a_door_stands() {
    let folder = tempfile::tempdir().unwrap();
    let site = folder.path().join("home.toml");
    let text = |door: &str| {
        format!(
            "[[zone]]\nname = \"area\"\npolygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]\nsecure = true\n
            [[door]]\nname = \"{door}\"\nzone = \"area\"\nline = [[-0.45, 1], [0.45, 1]]\nfail = \"secure\"\n"
        )
    };
    std::fs::write(&site, text("front")).unwrap();
    let daemon = Daemon::start(settings(SiteFile::load_or_begin(&site).unwrap(), None), |_| {}).unwrap();
    let cause = Cause::Door(Alarm::Followed);
    let alarm = ListedAlarm {
        id: 1,
        about: About::Door,
        of: "front".to_owned(),
        cause,
        severity: cause.severity(),
        text: String::new(),
        since_ms: 1,
        until_ms: None,
        acknowledged: None,
    };
    daemon.doors().resume(&[alarm]);
    std::fs::write(&site, text("back")).unwrap();
    let refused = daemon.read_site_anew().unwrap_err();
    assert!(matches!(refused, SaveError::InUse(_)), "{refused}");
    assert_eq!(daemon.file.current().site.doors[0].name, "front");
    daemon.stop().unwrap();
}
