//! The inputs and the actions of a door: fixed, closed lists.
//!
//! ```text
//!   card · number · contact · exit · seen · acknowledged · reset · time ─▶ machine ─▶ lock · alarm · refused · passage · named
//! ```

use schemars::JsonSchema;
use serde::Serialize;

use super::passage::Passage;
use super::terms::{Alarm, Card, Contact, Lock, Nonce, Refusal, Trouble};
use crate::geometry::Point;
use crate::jsonl::ZoneLine;
use crate::tracker::{LifeCycle, Origin, TrackId, TrackState};

/// What a track is to a door: decided by its origin and its life cycle alone.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Presence {
    /// A person, seen or occluded.
    Person,
    /// Never seen to come in: at a door, where the zone is secure, that is a person, too.
    Unexplained,
    /// A tentative track: a shade, until it walks.
    Doubtful,
    /// A part of this track: no body at all.
    PartOf(TrackId),
}

/// A track, as a door uses it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Body {
    /// Number of the track.
    pub id: TrackId,
    /// Where, m.
    pub at: Point,
    /// m/s.
    pub velocity: Point,
    /// Detected at this moment, and a person for sure.
    pub is_seen: bool,
    /// What it is.
    pub presence: Presence,
}

impl Body {
    /// Whether this is a person for sure, seen or occluded.
    #[must_use]
    pub const fn is_sure(&self) -> bool {
        matches!(self.presence, Presence::Person | Presence::Unexplained)
    }

    /// Whether this may be a person, and may be none.
    #[must_use]
    pub const fn is_doubtful(&self) -> bool {
        matches!(self.presence, Presence::Doubtful)
    }
}

impl From<&TrackState> for Body {
    fn from(track: &TrackState) -> Self {
        let presence = match (track.origin, track.state) {
            (Origin::PartOf(owner), _) => Presence::PartOf(owner),
            (Origin::Unexplained, _) => Presence::Unexplained,
            (Origin::Entered, LifeCycle::Tentative) => Presence::Doubtful,
            (Origin::Entered, LifeCycle::Confirmed | LifeCycle::Occluded) => Presence::Person,
        };
        let is_seen = track.state == LifeCycle::Confirmed;
        Self { id: track.id, at: track.at, velocity: track.velocity, is_seen, presence }
    }
}

/// What the tracker knows at one time.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Seen {
    /// All tracks.
    pub bodies: Vec<Body>,
    /// Probability of no person, of one, of two … in the door's zone, of those that may be counted.
    pub count_p: Vec<f64>,
    /// Share of the zone seen in the last 2 s.
    pub seen_share: f64,
    /// What is wrong with the modules.
    pub trouble: Option<Trouble>,
}

impl Seen {
    /// All tracks, and what is known of the door's zone, if anything is.
    #[must_use]
    pub fn of(tracks: &[TrackState], zone: Option<&ZoneLine>, trouble: Option<Trouble>) -> Self {
        Self {
            bodies: tracks.iter().map(Body::from).collect(),
            count_p: zone.map(|zone| zone.counted_p().to_vec()).unwrap_or_default(),
            seen_share: zone.map_or(0.0, ZoneLine::seen_share),
            trouble,
        }
    }
}

/// An input of a door.
#[derive(Clone, PartialEq, Debug)]
pub enum Event {
    /// A card was shown and is good: which cards may enter is not decided here.
    Card(Card),
    /// The entrant says how many people go in.
    Number(u32),
    /// The leaf.
    Contact(Contact),
    /// A person inside wants out.
    Exit,
    /// What the tracker knows.
    Seen(Seen),
    /// The lock is there, and waits for an order with this number.
    LockReady(Nonce),
    /// The lock has taken output number `id`.
    LockTaken(u64),
    /// The alarm has taken output number `id`.
    AlarmTaken(u64),
    /// A person in charge has looked after the alarm.
    Reset,
    /// Nothing but time.
    Time,
}

/// What the lock is to be, and for how long.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, JsonSchema)]
pub struct LockOrder {
    /// Number of the output.
    pub id: u64,
    /// What it is to be.
    pub lock: Lock,
    /// It locks by itself after so long, ms, if it is told nothing more. None: until the next order.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub for_ms: Option<u32>,
    /// The lock's newest number, if it has said one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nonce: Option<Nonce>,
}

/// What a door does.
#[derive(Clone, PartialEq, Debug)]
pub enum Action {
    /// The lock is to be so.
    Lock(LockOrder),
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
    /// This card was shown at the reader: by one of these tracks, or by none of them.
    Named {
        /// The card.
        card: Card,
        /// The place of the reader.
        reader: Point,
        /// The people before the line.
        by: Vec<TrackId>,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_track_is_to_a_door_follows_from_its_type_and_from_no_text() {
        let presence = |origin, state| {
            let track = TrackState {
                id: 1,
                at: Point::default(),
                velocity: Point::default(),
                covariance_m2: [0.01, 0.0, 0.01],
                state,
                existence: 1.0,
                reason: "unexplained",
                origin,
            };
            Body::from(&track).presence
        };
        assert_eq!(presence(Origin::Entered, LifeCycle::Tentative), Presence::Doubtful);
        assert_eq!(presence(Origin::Entered, LifeCycle::Occluded), Presence::Person);
        assert_eq!(presence(Origin::Unexplained, LifeCycle::Tentative), Presence::Unexplained);
        assert_eq!(presence(Origin::PartOf(2), LifeCycle::Tentative), Presence::PartOf(2));
    }
}
