//! How a module stands with its images when it starts.

use super::Version;
use super::notes::Stage;

/// What the image that runs is to its boot loader.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Run {
    /// It stays.
    Confirmed,
    /// It was swapped in and goes with the next start, unless it confirms itself.
    OnTrial,
}

/// What flash says of a module's images.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Standing {
    /// Most bytes of an image; 0: there is no boot loader, and no image is received.
    pub room: u32,
    /// The lowest version that may start; with an image on trial, once that is confirmed.
    pub least: Version,
    /// The image that runs.
    pub run: Run,
    /// What has become of the image received last, if hosts were not told.
    pub outcome: Option<Stage>,
}

impl Standing {
    /// Of a module without a boot loader.
    pub const NO_BOOT_LOADER: Self =
        Self { room: 0, least: Version([0; 3]), run: Run::Confirmed, outcome: None };
}
