//! Ablation switches: each idea of the tracker can be left out by name, so that its worth is measured.

use std::fmt;
use std::str::FromStr;

use ::kehai::centre::{Estimator, TWO_POINT_RADIUS_MM};

/// An idea.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Idea {
    /// Occluded people stay.
    Persistence,
    /// Places seen empty end them.
    FreeSpace,
    /// Wide candidates are divided between the people they cover.
    Division,
    /// A remainder beside a person is a part of that person.
    Limbs,
    /// Births gather evidence.
    StrictBirths,
    /// A track that appears inside is first matched with the occluded tracks.
    Relink,
    /// Two tracks on one person are separated.
    Twins,
    /// Occluded tracks are where no module looks.
    Shadow,
    /// Centres lie between the silhouettes, not at a fixed radius behind the outline.
    Silhouette,
    /// What came in with a person, or appeared inside, may be a thing until it stirs.
    Doubt,
    /// What keeps its place beside a person and is longer than a body is a part of that person.
    Parts,
    /// A person and that person's parts are one rigid body, with room for nothing else.
    Vehicles,
    /// Detections of another size than a track's are less likely its own.
    Size,
}

impl Idea {
    /// All of them, by name.
    pub const NAMED: [(Self, &str); 13] = [
        (Self::Persistence, "persistence"),
        (Self::FreeSpace, "free-space"),
        (Self::Division, "division"),
        (Self::Limbs, "limbs"),
        (Self::StrictBirths, "strict-births"),
        (Self::Relink, "relink"),
        (Self::Twins, "twins"),
        (Self::Shadow, "shadow"),
        (Self::Silhouette, "silhouette"),
        (Self::Doubt, "doubt"),
        (Self::Parts, "parts"),
        (Self::Vehicles, "vehicles"),
        (Self::Size, "size"),
    ];
}

impl fmt::Display for Idea {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = Self::NAMED.iter().find(|(idea, _)| idea == self);
        f.write_str(named.map_or("", |(_, name)| name))
    }
}

impl FromStr for Idea {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        Self::NAMED.iter().find(|(_, name)| *name == text).map(|(idea, _)| *idea).ok_or(())
    }
}

/// Which ideas are used: all by default.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Ideas {
    without: Option<Idea>,
}

impl Ideas {
    /// All but one.
    #[must_use]
    pub const fn without(idea: Idea) -> Self {
        Self { without: Some(idea) }
    }

    /// Whether an idea is used.
    #[must_use]
    pub fn has(&self, idea: Idea) -> bool {
        self.without != Some(idea)
    }

    /// How it finds centres.
    #[must_use]
    pub fn estimator(&self) -> Estimator {
        if self.has(Idea::Silhouette) {
            Estimator::Silhouette
        } else {
            Estimator::TwoPoint { radius_mm: TWO_POINT_RADIUS_MM }
        }
    }

    /// The one left out.
    #[must_use]
    pub const fn missing(&self) -> Option<Idea> {
        self.without
    }
}
