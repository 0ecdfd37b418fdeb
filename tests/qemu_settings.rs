//! Settings that the real firmware image could not start with, in QEMU: it starts, and is heard again by DHCP.

#[path = "support/board.rs"]
mod board;

use std::path::PathBuf;

use board::{host_of, image, start, wait_for};
use kehai::link::Store;
use kehai::store::flash::FlashStore;
use kehai::wire::{EventKind, Message};
use kehai_emulator::pc::flash::{Flash, PAGE_LEN};
use kehai_emulator::qemu::Line;
use kehai_emulator::serve::UdpSensor;
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::model::URG_04LX;
use kehai_emulator::urg::{Config, Urg};

/// Bytes of the image's flash.
const FLASH_LEN: usize = 128 * 1024;
/// Bytes of the file that QEMU takes for it.
const FILE_LEN: u64 = 16 * 1024 * 1024;
/// Key of the settings in the store.
const SETTINGS: u8 = 1;

/// Flash with these settings as they stand, as an older firmware stored them unchecked.
struct Unchecked(PathBuf);

impl Unchecked {
    fn new(settings: &str) -> Self {
        let path = std::env::temp_dir().join(format!("kehai-settings-{}", std::process::id()));
        let flash = Flash::open(&path, FLASH_LEN / PAGE_LEN).unwrap();
        let mut store = FlashStore::new(flash, 0..FLASH_LEN as u32).unwrap();
        embassy_futures::block_on(store.save(SETTINGS, settings.as_bytes())).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_len(FILE_LEN).unwrap();
        Self(path)
    }
}

impl Drop for Unchecked {
    fn drop(&mut self) {
        // It may be gone with the whole folder.
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn a_stored_address_that_bricked_older_images_leads_to_dhcp_and_is_said() {
    let Some(image) = image() else { return };
    for address in ["224.0.0.1/24", "255.255.255.255/30", "239.1.2.3/4,239.1.2.4"] {
        let flash = Unchecked::new(&format!("name=hall\naddress={address}\nskip=1\n"));
        let sensor =
            UdpSensor::new(Urg::new(Config::new(URG_04LX), Box::new(StillRoom::new(URG_04LX.geometry)), 0));
        let sensor = sensor.unwrap();
        let mut board = start(image, Line::AnySpeed(&sensor), Some(&flash.0));
        wait_for(&mut board, "address 10.0.2.15/24");
        let mut host = host_of(&board);
        host.subscribe();
        host.look(|_, message| match message {
            Message::Health(health) => {
                health.events.iter().any(|event| event.kind == EventKind::AddressUnusable).then_some(())
            }
            _ => None,
        });
    }
}
