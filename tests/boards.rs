//! The parts of the QEMU board that touch no register, tested on the PC: their tests are beside them.

#[path = "../src/bin/mps2-an386/storage.rs"]
mod storage;
#[path = "../src/bin/mps2-an386/uptime.rs"]
mod uptime;

#[test]
fn the_storage_is_whole_pages() {
    assert!(storage::STORAGE_LEN.is_multiple_of(storage::PAGE_LEN));
}
