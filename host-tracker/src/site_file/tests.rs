//! Files of sites: saved, refused, merged, changed by hand.

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
fn a_floor_gets_another_name_as_a_module_does() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("home.toml");
    let floor = "[[floor]] # the mat\nname = \"mat\"\nx = 1.0\ny = 2.0\ncolumns = 24\nrows = 20\n";
    let text = format!("[[module]]\nname = \"hall\"\nx = 0.0\ny = 0.0\n\n{floor}");
    fs::write(&path, &text).unwrap();
    let file = SiteFile::load(&path).unwrap();
    file.rename_module("mat", "rug", |_| Ok(())).unwrap();
    file.rename_module("hall", "stairs", |_| Ok(())).unwrap();
    let saved = fs::read_to_string(&path).unwrap();
    assert_eq!(saved, text.replace("\"mat\"", "\"rug\"").replace("hall", "stairs"));
}

#[test]
fn the_pose_of_a_floor_is_saved_in_its_own_table() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("home.toml");
    let text = "[[floor]] # the mat\nname = \"mat\"\nx = 1.0 # by ruler\ny = 2.0\ncolumns = 24\nrows = 20\n";
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
    assert!(why.contains("mend it, then save again: home.toml:5: unknown field `colour`"), "{why}");
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
    let SaveError::Conflict { why, merged, .. } = after.save(edit, |_| panic!("told")).unwrap_err() else {
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
    // They have taken away the zone that an entry of mine leads to: no part was changed twice, and yet it does not fit.
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

#[test]
fn a_file_that_cannot_be_read_is_neither_gone_nor_unchanged_and_is_never_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let file = home(folder.path());
    // As an editor writes "café" in Latin-1.
    let by_hand = [HOME.as_bytes(), b"# caf\xe9\n"].concat();
    fs::write(file.path(), &by_hand).unwrap();
    let looked = file.look(|_| panic!("told")).unwrap_err();
    assert!(matches!(looked, SaveError::ChangedOnDisk(_)), "{looked}");
    let saved = file.save(of(&file, renamed(&file, "lounge")), |_| panic!("told")).unwrap_err();
    assert!(matches!(saved, SaveError::ChangedOnDisk(_)), "{saved}");
    assert_eq!(fs::read(file.path()).unwrap(), by_hand);
    fs::remove_file(file.path()).unwrap();
    fs::create_dir(file.path()).unwrap();
    let looked = file.look(|_| panic!("told")).unwrap_err();
    assert!(matches!(looked, SaveError::Failed { .. }), "{looked}");
    fs::remove_dir(file.path()).unwrap();
    file.look(|_| panic!("told")).unwrap();
    file.save(of(&file, renamed(&file, "lounge")), |_| Ok(())).unwrap();
}

#[test]
fn what_the_file_says_is_known_while_it_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = home(folder.path());
    let asking = file.clone();
    let asked = |_: Site| {
        let (tell, told) = mpsc::channel();
        std::thread::spawn(move || tell.send(asking.current().revision));
        told.recv_timeout(std::time::Duration::from_secs(10)).map(drop).map_err(|error| error.to_string())
    };
    file.save(of(&file, renamed(&file, "lounge")), asked).unwrap();
}
