//! The tracker by its name, with one part of it left out, so that the part's worth is measured (an ablation), with fewer
//! samples and rays, so that their worth is, or with another draw of its random numbers, so that chance is.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use super::Rendering;
use crate::site::Site;
use crate::tracker::{Model, Tracker};

/// A part of the tracker.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Part {
    /// A first look with a tempered likelihood.
    Annealing,
    /// Existence by the best quarter of the cloud; without it, by its mean.
    BestQuarter,
    /// Two bodies do not share a place.
    Apart,
    /// How much room a confirmed body has beside the others says nothing of its existence.
    Room,
    /// An unseen body mostly stands.
    Standing,
    /// A body that a scan contradicts is looked for farther away.
    Surprise,
    /// A body that comes into view in an enclosed zone was hidden there.
    Conservation,
    /// A datum is 15 cm of silhouette; without it, a beam.
    Datum,
    /// The edge of a silhouette is soft.
    SoftEdge,
    /// Bodies that took each other's outline exchange their numbers.
    Names,
    /// Unseen bodies cross no entry.
    Entries,
    /// Arms and what is carried make a body deeper.
    Depth,
    /// A body may stretch out an arm.
    Arms,
    /// What is beside an older body from its birth on is an arm of that one until it has been elsewhere.
    Company,
    /// What is within a confirmed body's reach may be its arm, and has to show more than one.
    Limbs,
    /// A body last seen in an enclosed zone is there until it is seen outside.
    Inside,
    /// Unseen bodies cross an entry near which a person was just seen to leave.
    Openings,
    /// A box that keeps its place within a person's reach is that person's.
    Tow,
    /// When two bodies came as one and part, the one that stays behind may be a thing.
    PutDown,
    /// A body that no scan has looked for since it was seen is tried where something comes into view that no body explains.
    Reappearance,
    /// A person who was lost on the way in may come into view inside.
    Missing,
}

impl Part {
    /// All of them, by name.
    pub const NAMED: [(Self, &str); 21] = [
        (Self::Annealing, "annealing"),
        (Self::BestQuarter, "best-quarter"),
        (Self::Apart, "apart"),
        (Self::Room, "room"),
        (Self::Standing, "standing"),
        (Self::Surprise, "surprise"),
        (Self::Conservation, "conservation"),
        (Self::Datum, "datum"),
        (Self::SoftEdge, "soft-edge"),
        (Self::Names, "names"),
        (Self::Entries, "entries"),
        (Self::Depth, "depth"),
        (Self::Arms, "arms"),
        (Self::Company, "company"),
        (Self::Limbs, "limbs"),
        (Self::Inside, "inside"),
        (Self::Openings, "openings"),
        (Self::Tow, "tow"),
        (Self::PutDown, "put-down"),
        (Self::Reappearance, "reappearance"),
        (Self::Missing, "missing"),
    ];
}

/// How many samples and rays there are, of all.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Detail {
    /// All of them.
    #[default]
    Whole,
    /// One of two.
    Half,
    /// One of four.
    Quarter,
}

impl Detail {
    /// Those with fewer, by name.
    const NAMED: [(Self, &str); 2] = [(Self::Half, "kehai-half"), (Self::Quarter, "kehai-quarter")];

    /// One of so many is there.
    pub(super) const fn divisor(self) -> usize {
        match self {
            Self::Whole => 1,
            Self::Half => 2,
            Self::Quarter => 4,
        }
    }
}

/// The tracker as a model.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RenderingModel {
    /// The part that is left out.
    pub without: Option<Part>,
    /// How many samples and rays it has.
    pub detail: Detail,
    /// Of the random numbers: a draw of the samples.
    pub seed: u64,
}

impl Default for RenderingModel {
    fn default() -> Self {
        Self { without: None, detail: Detail::Whole, seed: SEED }
    }
}

impl RenderingModel {
    pub(super) fn has(self, part: Part) -> bool {
        self.without != Some(part)
    }
}

/// Random numbers of a tracker without a draw of its own.
const SEED: u64 = 1;

const NAME: &str = "kehai";
const WITHOUT: &str = "kehai-without-";
const DRAW: &str = "kehai-draw-";

impl fmt::Display for RenderingModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let named = |without: Part| Part::NAMED.iter().find(|(part, _)| *part == without);
        match self.without.and_then(named) {
            Some((_, name)) => write!(f, "{WITHOUT}{name}"),
            None if self.seed != SEED => write!(f, "{DRAW}{}", self.seed),
            None => {
                let fewer = Detail::NAMED.iter().find(|(detail, _)| *detail == self.detail);
                f.write_str(fewer.map_or(NAME, |(_, name)| name))
            }
        }
    }
}

/// No such variant of this tracker.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct UnknownVariant;

impl FromStr for RenderingModel {
    type Err = UnknownVariant;

    fn from_str(text: &str) -> Result<Self, UnknownVariant> {
        let part = |name: &str| Part::NAMED.iter().find(|(_, own)| *own == name).map(|(part, _)| *part);
        if let Some(seed) = text.strip_prefix(DRAW) {
            let seed = seed.parse().map_err(|_| UnknownVariant)?;
            return Ok(Self { seed, ..Self::default() });
        }
        match text.strip_prefix(WITHOUT) {
            Some(name) => Ok(Self { without: Some(part(name).ok_or(UnknownVariant)?), ..Self::default() }),
            None if text == NAME => Ok(Self::default()),
            None => {
                let (detail, _) = Detail::NAMED.iter().find(|(_, own)| *own == text).ok_or(UnknownVariant)?;
                Ok(Self { detail: *detail, ..Self::default() })
            }
        }
    }
}

impl Model for RenderingModel {
    fn estimator(&self) -> kehai::centre::Estimator {
        kehai::centre::Estimator::default()
    }

    fn build(&self, site: &Arc<Site>) -> Box<dyn Tracker> {
        Box::new(Rendering::new(site, *self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_is_left_out_by_its_name() {
        for (part, name) in Part::NAMED {
            let model: RenderingModel = format!("{WITHOUT}{name}").parse().unwrap();
            assert!(!model.has(part) && model.to_string() == format!("{WITHOUT}{name}"));
        }
        assert_eq!("kehai".parse(), Ok(RenderingModel::default()));
        for (detail, name) in Detail::NAMED {
            let model: RenderingModel = name.parse().unwrap();
            assert!(model.detail == detail && model.to_string() == name);
        }
        let drawn: RenderingModel = "kehai-draw-7".parse().unwrap();
        assert!(drawn.seed == 7 && drawn.to_string() == "kehai-draw-7");
        assert!("kehai-draw-x".parse::<RenderingModel>().is_err());
        assert!("kehai-without-bodies".parse::<RenderingModel>().is_err());
    }
}
