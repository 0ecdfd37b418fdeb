//! Images of the firmware for a module on a PC: a text that says what the image does, and bytes as many as an image has.
//!
//! ```text
//!   kehai-pc             what it is
//!   version 0.2.0        what the module says it runs
//!   fault none           what is wrong with it: none, hangs
//!   \0 …                 filling
//! ```
//!
//! The program that runs is always this one: an image only says as which version it shows itself, so that updates are tried
//! with everything but a processor. No image in the active slot: this program's own version.

use kehai::update::slots::Slots;

use super::flash::{Flash, PAGE_LEN, PAGES};

/// Begins an image.
const MAGIC: &str = "kehai-pc\n";

/// Longest text of an image.
const TEXT_MAX: usize = 256;

const PAGE: u32 = PAGE_LEN as u32;
const FIRST: u32 = PAGES as u32 * PAGE;

/// Where images are on a PC's flash: behind the settings, as large as on a board.
pub static SLOTS: Slots = Slots {
    notes: FIRST..FIRST + 2 * PAGE,
    state: FIRST + 2 * PAGE..FIRST + 4 * PAGE,
    active: FIRST + 4 * PAGE..FIRST + 68 * PAGE,
    spare: FIRST + 68 * PAGE..FIRST + 133 * PAGE,
};

/// Pages of a flash with room for images.
pub const PAGES_WITH_IMAGES: usize = PAGES + 133;

/// What is wrong with an image.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Fault {
    /// Nothing.
    #[default]
    None,
    /// It hangs from its start on, until the watchdog bites.
    Hangs,
}

/// An image.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Image {
    /// The version that it says it is.
    pub version: String,
    /// What is wrong with it.
    pub fault: Fault,
}

impl Image {
    /// The image in the active slot of this flash.
    #[must_use]
    pub fn active(flash: &Flash) -> Option<Self> {
        let contents = flash.contents();
        let slot = contents.get(SLOTS.active.start as usize..SLOTS.active.end as usize)?;
        let text = slot.get(..TEXT_MAX)?.split(|&byte| byte == 0).next()?;
        let text = std::str::from_utf8(text).ok()?.strip_prefix(MAGIC)?;
        let field = |name: &str| text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        let fault = match field("fault") {
            Some("hangs") => Fault::Hangs,
            _ => Fault::None,
        };
        Some(Self { version: field("version")?.to_owned(), fault })
    }

    /// Its bytes, so many.
    #[must_use]
    pub fn bytes(&self, len: usize) -> Vec<u8> {
        let fault = match self.fault {
            Fault::None => "none",
            Fault::Hangs => "hangs",
        };
        let mut bytes = format!("{MAGIC}version {}\nfault {fault}\n\0", self.version).into_bytes();
        let mut filling = (0..).map(|at: usize| (at.wrapping_mul(31) >> 3) as u8);
        bytes.resize_with(len.max(bytes.len()), || filling.next().unwrap_or_default());
        bytes
    }
}
