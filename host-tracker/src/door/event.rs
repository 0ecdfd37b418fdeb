//! What a door is told, and what it does: fixed, closed lists.
//!
//! ```text
//!   card · number · contact · exit · seen · acknowledged · reset · time ─▶ machine ─▶ lock · alarm · refused · passage · named
//! ```

use serde::{Deserialize, Serialize};

use super::passage::Passage;
use crate::geometry::Point;
use crate::jsonl::{TrackLine, TracksLine};
use crate::trackers::LifeCycle;

/// A card, as a hash that only this site can make: the number on it is never kept.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Card(pub u128);

impl Card {
    /// Its first four digits: enough to tell the cards of a room apart, too few to find one by.
    #[must_use]
    pub fn label(self) -> String {
        String::from(self).chars().take(4).collect()
    }
}

impl From<Card> for String {
    fn from(card: Card) -> Self {
        format!("{:032x}", card.0)
    }
}

impl TryFrom<String> for Card {
    type Error = std::num::ParseIntError;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        u128::from_str_radix(&text, 16).map(Self)
    }
}

/// Whether the leaf is shut.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Contact {
    /// It is not.
    Open,
    /// It is.
    Shut,
}

/// What the lock is to be. It inhibits entry only: from inside the handle always opens.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lock {
    /// Nobody may enter.
    #[default]
    Locked,
    /// Those who were counted may enter.
    Unlocked,
    /// Somebody inside has asked to leave: the door opens for them, and whoever enters is an alarm.
    Exit,
}

/// Why there is an alarm.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Alarm {
    /// More went in than were let in.
    Followed,
    /// Somebody came into the zone while the door was unlocked.
    RanIn,
    /// Somebody of the group came back out, or left the zone, while the door was unlocked.
    TurnedBack,
    /// A card that has just gone in was shown again.
    PassedBack,
    /// Somebody went in while nobody was let in.
    WentIn,
    /// The leaf does not shut.
    HeldOpen,
    /// What happens at the door is not known.
    Trouble,
}

/// Why a door does not know what happens.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trouble {
    /// Nothing has been seen since the start.
    Starting,
    /// The tracker says nothing any more.
    NoFrames,
    /// A module says nothing any more.
    ModuleLost,
    /// Hardly anything of the zone is seen.
    Unseen,
}

/// Why something that came in changes nothing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Refusal {
    /// A number without a card.
    #[error("no card was shown: show a card first")]
    NoCard,
    /// Another card during a passage.
    #[error("a passage is under way: wait until the door is locked again")]
    Busy,
    /// The same card again while it is asked for the number.
    #[error("this card was taken already: enter the number of people")]
    SameCard,
    /// A number that nobody means.
    #[error("the number of people must be from 1 to the door's people_max")]
    Number,
    /// An alarm or a trouble must be over first.
    #[error("the door is in alarm or trouble: it takes no cards until that is over")]
    NotNow,
    /// An acknowledgement of what is no longer said.
    #[error("what is acknowledged is not what is said now")]
    OldAcknowledgement,
    /// Nothing to reset.
    #[error("there is no alarm to reset")]
    NoAlarm,
}

/// Somebody, as a door sees them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Body {
    /// Number of the track.
    pub id: u64,
    /// Where, m.
    pub at: Point,
    /// m/s.
    pub velocity: Point,
    /// Seen at this moment, and somebody for sure.
    pub is_seen: bool,
    /// Somebody for sure, seen or hidden.
    pub is_sure: bool,
    /// Nobody saw them come in.
    pub is_unexplained: bool,
}

impl From<&TrackLine> for Body {
    fn from(track: &TrackLine) -> Self {
        let is_unexplained = track.reason.starts_with("unexplained");
        Self {
            id: track.id,
            at: Point::new(track.x, track.y),
            velocity: Point::new(track.vx, track.vy),
            is_seen: track.state == LifeCycle::Confirmed,
            // Where somebody comes in whom nobody saw come in, that is somebody, too.
            is_sure: track.state != LifeCycle::Tentative || is_unexplained,
            is_unexplained,
        }
    }
}

/// What the tracker knows at one time.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Seen {
    /// Everybody.
    pub bodies: Vec<Body>,
    /// Probability of nobody, of one, of two … in the door's zone.
    pub count_p: Vec<f64>,
    /// Share of the zone seen in the last 2 s.
    pub seen_share: f64,
    /// What is wrong with the modules.
    pub trouble: Option<Trouble>,
}

impl Seen {
    /// What a line says of a zone.
    #[must_use]
    pub fn of(line: &TracksLine, zone: &str, trouble: Option<Trouble>) -> Self {
        let zone = line.zones.get(zone);
        Self {
            bodies: line.tracks.iter().map(Body::from).collect(),
            count_p: zone.map(|zone| zone.p.clone()).unwrap_or_default(),
            seen_share: zone.map_or(0.0, |zone| zone.seen_share),
            trouble,
        }
    }
}

/// What a door is told.
#[derive(Clone, PartialEq, Debug)]
pub enum Event {
    /// A card was shown and is good: who may enter is not decided here.
    Card(Card),
    /// The entrant says how many people go in.
    Number(u32),
    /// The leaf.
    Contact(Contact),
    /// Somebody inside wants out.
    Exit,
    /// What the tracker knows.
    Seen(Seen),
    /// The lock has taken output number `id`.
    LockTaken(u64),
    /// The alarm has taken output number `id`.
    AlarmTaken(u64),
    /// Somebody in charge has looked after the alarm.
    Reset,
    /// Nothing but time.
    Time,
}

/// What a door does.
#[derive(Clone, PartialEq, Debug)]
pub enum Action {
    /// The lock is to be so; said again every second until `id` is acknowledged.
    Lock {
        /// Number of the output.
        id: u64,
        /// What it is to be.
        lock: Lock,
    },
    /// The alarm is to be so; said again every second until `id` is acknowledged.
    Alarm {
        /// Number of the output.
        id: u64,
        /// What for; none: it is over.
        alarm: Option<Alarm>,
    },
    /// What came in changed nothing.
    Refused(Refusal),
    /// A passage is over.
    Passage(Box<Passage>),
    /// This card was shown by one of these tracks, each so probably; what is missing to 1: by nobody of them.
    Named {
        /// The card.
        card: Card,
        /// Tracks, and how probable each is.
        likelihoods: Vec<(u64, f64)>,
    },
}
