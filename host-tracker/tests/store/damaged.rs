//! Databases that are damaged, in use by another tracker, or met by a clock that is wrong.

use super::*;

/// A database of a hundred frames, closed.
fn hundred(folder: &Folder, at_ms: u64) {
    let frames = (0..100).map(|tenth| frame(at_ms + tenth * 100, vec![walker(1, at_ms + tenth * 100)]));
    drop(written(folder, 365, frames));
}

/// Damages the bytes of a file.
type Damage = fn(&mut Vec<u8>);

#[test]
fn f12_a_damaged_database_is_set_aside_and_a_new_one_begun() {
    let damages: [(&str, Damage); 3] = [
        ("header", |bytes| bytes[..100].fill(0x5a)),
        ("page", |bytes| bytes[..4096].fill(0)),
        ("half", |bytes| bytes.truncate(bytes.len() / 2)),
    ];
    for (name, damage) in damages {
        let folder = Folder::new();
        hundred(&folder, unix_ms());
        let mut bytes = std::fs::read(folder.file()).unwrap();
        damage(&mut bytes);
        std::fs::write(folder.file(), &bytes).unwrap();
        let store =
            Store::open(&folder.file(), &site(), keep(365)).unwrap_or_else(|error| panic!("{name}: {error}"));
        store.see_waiting(frame(unix_ms(), vec![walker(2, unix_ms())]));
        drop(store);
        let reader = Reader::open(&folder.file()).unwrap();
        assert_eq!(reader.check().unwrap(), "ok", "{name}");
        let aside = |entry: std::io::Result<std::fs::DirEntry>| {
            let path = entry.unwrap().path();
            path.to_string_lossy().contains("kehai.db.damaged-").then_some(path)
        };
        let aside: Vec<_> = std::fs::read_dir(folder.0.path()).unwrap().filter_map(aside).collect();
        assert!(aside.iter().any(|path| std::fs::read(path).unwrap() == bytes), "{name}: {aside:?}");
    }
}

#[test]
fn f12_a_second_tracker_is_refused_as_long_as_the_first_one_runs() {
    let folder = Folder::new();
    let first = Store::open(&folder.file(), &site(), keep(30)).unwrap();
    let error = Store::open(&folder.file(), &site(), keep(30)).unwrap_err();
    assert!(error.to_string().contains("another tracker"), "{error}");
    drop(first);
    assert!(Store::open(&folder.file(), &site(), keep(30)).is_ok());
}

#[test]
fn f12_a_clock_ten_years_ahead_at_the_start_deletes_no_history() {
    let folder = Folder::new();
    let then_ms = unix_ms() - 400 * 86_400_000;
    hundred(&folder, then_ms);
    for _ in 0..2 {
        let store = Store::open(&folder.file(), &site(), keep(365)).unwrap();
        store.see_waiting(frame(unix_ms(), vec![walker(2, unix_ms())]));
        while store.state().doubt.is_none() {
            std::thread::sleep(Duration::from_millis(10));
        }
        // The last of the hundred frames is ten seconds nearer than 400 days.
        let doubt = store.state().doubt.unwrap();
        assert!(doubt.contains(" 399 days"), "{doubt}");
        drop(store);
        let kept = Reader::open(&folder.file()).unwrap().paths(then_ms, then_ms + 9000).unwrap();
        assert_eq!(kept.len(), 1);
    }
}
