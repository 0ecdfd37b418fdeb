//! A part of a site, all kinds alike: what it is, its name, its corners.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a part of a site is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A module.
    Module,
    /// A floor of pressure panels.
    Floor,
    /// A wall.
    Wall,
    /// A zone.
    Zone,
    /// An entry.
    Entry,
    /// A counting line.
    Line,
    /// A mover.
    Mover,
    /// An area in which no person is counted.
    Exclude,
    /// A guarded door.
    Door,
    /// A reader of cards or tags.
    Reader,
}

impl Kind {
    /// Its key in a site file.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Module => "module",
            Self::Floor => "floor",
            Self::Wall => "wall",
            Self::Zone => "zone",
            Self::Entry => "entry",
            Self::Line => "line",
            Self::Mover => "mover",
            Self::Exclude => "exclude",
            Self::Door => "door",
            Self::Reader => "reader",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.key())
    }
}

/// A part of a site, all kinds alike.
pub trait Part: Clone + PartialEq + Serialize {
    /// What it is.
    const KIND: Kind;

    /// Its name; empty if it has none.
    fn name(&self) -> &str;

    /// The same under another name; itself if such parts have none.
    #[must_use]
    fn named(&self, name: &str) -> Self;

    /// Its corners, or its place.
    fn corners(&self) -> Vec<[f64; 2]>;

    /// What people call the part of this number.
    fn label(&self, index: usize) -> String {
        match self.name() {
            "" => format!("{} {}", Self::KIND, index + 1),
            name => format!("{} \"{name}\"", Self::KIND),
        }
    }
}
