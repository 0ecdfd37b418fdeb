//! The ideas the tracker is made of, each of which can be left out.

use std::fmt;
use std::str::FromStr;

/// An idea.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Idea {
    /// Go on believing in hidden people.
    Persistence,
    /// Places seen empty end them.
    FreeSpace,
    /// Wide candidates are divided between the people they cover.
    Division,
    /// What is left over beside somebody is a part of him.
    Limbs,
    /// Births gather evidence.
    StrictBirths,
    /// Who appears inside is first looked for among the hidden.
    Relink,
    /// Two tracks on one person are parted.
    Twins,
}

impl Idea {
    /// All of them, by name.
    pub const NAMED: [(Self, &str); 7] = [
        (Self::Persistence, "persistence"),
        (Self::FreeSpace, "free-space"),
        (Self::Division, "division"),
        (Self::Limbs, "limbs"),
        (Self::StrictBirths, "strict-births"),
        (Self::Relink, "relink"),
        (Self::Twins, "twins"),
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

    /// The one left out.
    #[must_use]
    pub const fn missing(&self) -> Option<Idea> {
        self.without
    }
}
