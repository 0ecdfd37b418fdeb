//! Areas over Zenoh: what the tracker of an area publishes, and what puts all areas together.
//!
//! ```text
//!   kehai-tracker run --area campus/east ─ publish ─▶ kehai/campus/east/frame    ten times a second; dropped where it cannot be sent
//!                                          answer ──▶ kehai/campus/east/site     the site, when it is asked for
//!                                          token ───▶ kehai/campus/east/alive    gone as soon as the tracker is
//!   kehai-tracker site campus ◀── kehai/campus/*/frame, …/site, …/alive ──▶ map, HTTP, MQTT
//! ```
//!
//! Each area goes on alone without Zenoh. Who may connect, and over what, is said by Zenoh's own configuration (docs/areas.md).
//!
//! Source: Zenoh 1.x, liveliness tokens and queryables; <https://zenoh.io/docs/manual/abstractions/>.
//!
//! | file | what |
//! |---|---|
//! | `settings` | which area, and how Zenoh is reached |
//! | `keys` | the keys of an area in Zenoh |
//! | `link` | the session |
//! | `area` | what the tracker of an area publishes |
//! | `campus` | all areas put together |
//! | `heard` | what is heard of them, and what of it is lost |
//! | `shown` | where the picture of all goes |
//! | `together` | the service that shows it |

#[cfg(feature = "zenoh")]
mod area;
#[cfg(feature = "zenoh")]
mod campus;
#[cfg(feature = "zenoh")]
mod heard;
#[cfg(feature = "zenoh")]
mod keys;
#[cfg(feature = "zenoh")]
mod link;
mod settings;
#[cfg(feature = "zenoh")]
mod shown;
#[cfg(feature = "zenoh")]
mod together;

#[cfg(feature = "zenoh")]
use std::borrow::Cow;

#[cfg(feature = "zenoh")]
use serde::{Deserialize, Serialize};

#[cfg(feature = "zenoh")]
use kehai_tracking::areas::AreaFrame;
#[cfg(feature = "zenoh")]
use kehai_tracking::site::Site;
#[cfg(feature = "zenoh")]
use kehai_tracking::snapshot::Snapshot;

#[cfg(feature = "zenoh")]
pub(crate) use link::{newest, one_line, open};
pub use settings::{AreaPlace, AreaSettings, Network};
#[cfg(feature = "zenoh")]
pub use {
    area::Area,
    campus::{Campus, CampusSettings},
    link::LinkError,
    together::{Together, TogetherError, TogetherSettings},
};

/// A frame on its way, in JSON. Its parts stand beside each other, as numbers within a flattened part cannot be read when some other
/// crate has switched on `serde_json`'s `arbitrary_precision`.
#[cfg(feature = "zenoh")]
#[derive(Debug, Serialize, Deserialize)]
struct Said<'a> {
    /// Of the site in use: another one is asked for.
    site_revision: u64,
    /// As in [`AreaFrame`].
    epoch: u64,
    /// As in [`AreaFrame`].
    number: u64,
    /// What the tracker says.
    frame: Cow<'a, Snapshot>,
}

#[cfg(feature = "zenoh")]
impl From<Said<'_>> for AreaFrame {
    fn from(Said { epoch, number, frame, .. }: Said<'_>) -> Self {
        Self { epoch, number, frame: frame.into_owned() }
    }
}

/// The site of an area, in JSON.
#[cfg(feature = "zenoh")]
#[derive(Debug, Serialize, Deserialize)]
struct SiteSaid<'a> {
    revision: u64,
    site: Cow<'a, Site>,
}
