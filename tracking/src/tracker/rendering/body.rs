//! A body: a cloud of where it may be, and the odds that it is there at all.
//!
//! ```text
//!   begun_s ── supported_s ─ ─ ─ unseen      log odds of existence  −7 ····· 0 ····· 7
//! ```

use super::cloud::Cloud;
use super::ground::{AHEAD_S, Ground, Passage, Sighting, Way};
use super::modules::Whereabouts;
use super::openings::Openings;

/// A body is not seen when no scan has spoken for it for so long, s.
pub const UNSEEN_S: f64 = 0.3;

/// Nor is it when no scan at all has looked for it for so long, s: reports of a camera, five a second, are lost and late.
pub const UNHEARD_S: f64 = 0.5;

/// Bounds of the log odds: one in a thousand.
pub const SURE: f64 = 7.0;

/// A body that is believed in.
#[derive(Clone, Debug)]
pub struct Body {
    pub id: u64,
    pub confirmed: bool,
    /// Log odds that it is there, and those with which it began.
    pub log_odds: f64,
    pub prior: f64,
    pub cloud: Cloud,
    /// When it began, and when a scan last spoke for it, s.
    pub begun_s: f64,
    pub supported_s: f64,
    /// Where that was.
    pub sighting: Sighting,
    /// Until when it was doubted for what may have left, s.
    pub doubted_s: f64,
    /// Until when it was beside a body that is older, s: it may be an arm of that one.
    pub accompanied_s: f64,
    /// Whether it is not seen though it was looked for: it mostly stands. As of the scan that is being taken.
    pub hidden: bool,
}

impl Body {
    /// One that begins now, with these log odds.
    pub fn begin(id: u64, prior: f64, cloud: Cloud) -> Self {
        let begun_s = cloud.at_s();
        Self {
            id,
            confirmed: false,
            log_odds: prior,
            prior,
            cloud,
            begun_s,
            supported_s: begun_s,
            sighting: Sighting::default(),
            doubted_s: begun_s,
            accompanied_s: f64::NEG_INFINITY,
            hidden: false,
        }
    }

    /// Where it is, as far as it is known.
    pub fn whereabouts(&self) -> Whereabouts {
        let moments = self.cloud.moments();
        Whereabouts { at: moments.at, variance_m2: moments.variance_m2(), at_s: self.cloud.at_s() }
    }

    /// Probability that it is there.
    pub fn existence(&self) -> f64 {
        1.0 / (1.0 + libm::exp(-self.log_odds))
    }

    /// Whether no scan has spoken for it lately.
    pub fn is_unseen(&self, at_s: f64) -> bool {
        at_s - self.supported_s > UNSEEN_S
    }

    /// Whether it is said to be seen: a scan that has looked for it in vain says more than none.
    pub fn is_in_view(&self, at_s: f64) -> bool {
        let was_looked_for = self.cloud.at_s() > self.supported_s;
        at_s - self.supported_s <= if was_looked_for { UNSEEN_S } else { UNHEARD_S }
    }

    /// Whether it is not seen though a scan has looked for it since it was. Call it before the cloud is predicted: a person
    /// who walks while no module says anything goes on walking.
    pub fn is_hidden(&self, at_s: f64) -> bool {
        self.is_unseen(at_s) && self.cloud.at_s() > self.supported_s
    }

    /// What the place of an unseen body is uncertain by beside its cloud, m: a walk that the cloud did not foresee.
    pub fn kernel_m(&self, at_s: f64) -> f64 {
        0.15 + 0.25 * (at_s - self.supported_s).clamp(0.0, 2.0)
    }

    /// Where it may go.
    pub fn way<'a>(&self, ground: Ground<'a>, at_s: f64) -> Way<'a> {
        let stands_open = |openings: &Openings| openings.are_near(self.cloud.moments().at);
        let passage = match self.sighting.passage {
            _ if self.is_unseen(at_s) && ground.openings.is_some_and(stands_open) => Passage::Through,
            Passage::InView if self.is_unseen(at_s) => Passage::None,
            Passage::Through if at_s - self.supported_s > AHEAD_S => Passage::None,
            passage => passage,
        };
        Way { ground, passage, is_open: false }
    }
}
