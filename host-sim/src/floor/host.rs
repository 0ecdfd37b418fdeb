//! A host with a floor and a reader of tags: who is where, as its users are told.
//!
//! ```text
//!   reading, 9 Hz ─▶ SiteTracker ─▶ tracks, explanations ─▶ ╭───────╮ ─▶ an ID ─▶ its likeliest track ─▶ place
//!   tag ──────────────────────────────────────────────────▶ │ Names │
//!                                                           ╰───────╯
//! ```

use std::sync::Arc;

use kehai_tracking::card::Card;
use kehai_tracking::floor::{Plan, Reading};
use kehai_tracking::geometry::Point;
use kehai_tracking::names::{Names, Read, Sign};
use kehai_tracking::site::Site;
use kehai_tracking::site::floor::Floor;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::TrackState;

use super::tags::Tag;
use crate::baselines::Choice;

/// Spread of a tag's place as the tracker is told, m: calibration, and a tag that is worn on the chest.
const TAG_M: f64 = 0.1;

/// A site with nothing but this floor.
#[must_use]
pub fn site(plan: &Plan) -> Site {
    let Plan { corner, columns, rows, pitch_m } = *plan;
    let (x, y, yaw_deg) = (corner.at.x, corner.at.y, corner.yaw_rad.to_degrees());
    let floor = Floor { name: "floor".to_owned(), x, y, yaw_deg, columns, rows, pitch_m };
    Site { floors: vec![floor], ..Site::default() }
}

/// The host.
pub struct Host {
    site: Arc<Site>,
    site_tracker: SiteTracker,
    names: Names,
    tracks: Vec<TrackState>,
}

impl Host {
    /// Of a site, with nothing known.
    #[must_use]
    pub fn new(site: Site) -> Self {
        let site = Arc::new(site);
        let site_tracker = SiteTracker::new(&site, Choice::default());
        Self { site, site_tracker, names: Names::default(), tracks: Vec::new() }
    }

    /// Takes a reading of its floor, and says what is known then.
    pub fn read(&mut self, reading: &Reading) {
        self.site_tracker.read(reading);
        let known = self.site_tracker.estimate(reading.at_s);
        self.names.follow_explained(&known.tracks, &known.explanations, known.t_s);
        self.tracks = known.tracks;
    }

    /// Takes a tag that was read.
    pub fn tag(&mut self, at_s: f64, tag: &Tag) {
        let read = Read::Place { at: tag.at, covariance_m2: [TAG_M * TAG_M, 0.0, TAG_M * TAG_M] };
        // Before the first reading of the floor there is no track to be anybody.
        let _ = self.names.sign(&Sign { card: Card(tag.id.into()), at_s, read });
    }

    /// Where an ID most likely is.
    #[must_use]
    pub fn place_of(&self, id: u64) -> Option<Point> {
        let there = self.names.where_is(Card(id.into()), &self.site)?;
        let likeliest = there.name.tracks.first()?.track;
        self.tracks.iter().find(|track| track.id == likeliest).map(|track| track.at)
    }
}
