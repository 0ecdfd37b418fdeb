//! The daemon from its start to its end.

use super::*;
use crate::store::reader::Reader;

/// As if it were stopped while the program is busy: no snapshot has been taken.
#[test]
fn what_came_just_before_the_end_is_in_the_database() {
    let folder = tempfile::tempdir().unwrap();
    let (file, site) = (folder.path().join("home.db"), folder.path().join("home.toml"));
    let settings = Settings {
        site: SiteFile::load_or_begin(&site).unwrap(),
        modules: Vec::new(),
        discover: false,
        tracker: Selected::default(),
        record: None,
        database: Some(Database { file: file.clone(), keep: Keep::USUAL, restore: false }),
        map: None,
        mqtt: None,
        webhook: None,
        card_key: None,
        keys: None,
        clear: Clear::default(),
        links: LinkSettings::default(),
    };
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
