//! A hall that a range finder, a depth camera and a mat look at, each or all of them, and a host that follows them.
//!
//! ```text
//!               0 ┌────────────┐ 1.92 m
//!                 │   ●        │          ● stands       ◀▶ walks along x, from 0.7 to 1.3 m
//!   camera ◁──────│    ◀─▶     │──────▷ laser
//!   (−1.9, 0.96)  │  mat, zone │   (3.4, 0.96), turned round
//!                 └────────────┘
//! ```

use std::sync::Arc;

use kehai::floor::Bits;
use kehai::scan::GeometryParts;
use kehai::wire::{Info, List, Message, Pressed, Report, ReportHead, Size};
use kehai_tracking::geometry::{Point, Pose};
use kehai_tracking::occupancy::ZoneLine;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;

use super::fake::Fake;
use super::scene::{BEAMS, silhouettes};
use super::tracker::tracker;

/// What looks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    Laser,
    Camera,
    Mat,
}

impl Kind {
    pub const ALL: [Self; 3] = [Self::Laser, Self::Camera, Self::Mat];

    /// Between two of its reports, µs: 10, 5 (paper D's) and 9 Hz.
    pub const fn period_us(self) -> u64 {
        match self {
            Self::Laser => 100_000,
            Self::Camera => 200_000,
            Self::Mat => 111_111,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Laser => "laser",
            Self::Camera => "camera",
            Self::Mat => "mat",
        }
    }

    const fn site(self) -> &'static str {
        match self {
            Self::Laser => "[[module]]\nname = \"laser\"\nx = 3.4\ny = 0.96\nyaw_deg = 180\n",
            Self::Camera => "[[module]]\nname = \"camera\"\nx = -1.9\ny = 0.96\nheight_m = 1.0\n",
            Self::Mat => "[[floor]]\nname = \"mat\"\nx = 0\ny = 0\ncolumns = 24\nrows = 24\n",
        }
    }
}

const ZONE: &str = "[[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1.92, 0], [1.92, 1.92], [0, 1.92]]\n";

/// The fan of a camera 59° wide with 320 columns (`depth/src/fan.rs`).
const FAN: GeometryParts = GeometryParts {
    first_step: 0,
    last_step: 232,
    cluster: 1,
    front_step: 116,
    steps_per_turn: 1421,
    period_us: 200_000,
    range_min_mm: 20,
    range_max_mm: 10_000,
};

/// A grown person, half of whom is seen.
const SIZE: Size = Size { volume_l: 35, top_cm: 172 };

/// Who is in the hall.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum People {
    Walker,
    /// And one who stands.
    Both,
    /// One who paces up and down, 0.3 to 1.6 m, at up to 1.2 m/s; presses no panels.
    Pacing,
    /// Two who go through the hall and back, in opposite directions; they press no panels.
    Crossing,
}

/// The first panel of the foot that the walker has down for the half of a second `step`: column and row.
const fn foot(step: u64) -> (usize, usize) {
    let along = [0, 1, 2, 1][(step % 4) as usize];
    (7 + along * 4, if step.is_multiple_of(2) { 10 } else { 13 })
}

/// The walker is above each foot in the middle of its half second.
fn walker(at_us: u64) -> Point {
    let halves = (at_us + 250_000) as f64 / 500_000.0;
    let x_m = |step: u64| (foot(step).0 as f64 + 1.5) * 0.08;
    // The first step is that of 250 ms before the time 0.
    let (step, share) = (halves as u64, halves.fract());
    let before = step.saturating_sub(1);
    Point::new(x_m(before) + (x_m(step) - x_m(before)) * share, 0.96)
}

impl People {
    pub const fn press_panels(self) -> bool {
        matches!(self, Self::Walker | Self::Both)
    }

    fn places(self, at_us: u64) -> Vec<Point> {
        let stands = Point::new(0.8, 0.28);
        match self {
            Self::Walker => vec![walker(at_us)],
            Self::Both => vec![walker(at_us), stands],
            Self::Pacing => vec![Point::new(0.96 + 0.66 * (at_us as f64 * 1.82e-6).sin(), 0.96)],
            Self::Crossing => {
                // From 0.6 m before the zone to 0.6 m behind it, and back, at 1.2 m/s.
                let (way_m, length_m) = (at_us as f64 * 1.2e-6, 3.12);
                let along_m = length_m - (way_m % (2.0 * length_m) - length_m).abs();
                vec![Point::new(along_m - 0.6, 0.5), Point::new(length_m - along_m - 0.6, 1.42)]
            }
        }
    }

    /// Panels under their soles; both feet of the walker are down for 0.1 s.
    fn panels(self, at_us: u64) -> Bits {
        let (step, into_us) = (at_us / 500_000, at_us % 500_000);
        let last = (into_us < 100_000 && step > 0).then(|| foot(step - 1));
        let stands = if self == Self::Both { &[(9, 2), (9, 4)][..] } else { &[] };
        let feet = [foot(step)].into_iter().chain(last).chain(stands.iter().copied());
        let mut bits = Bits::default();
        for (column, row) in feet {
            (column..column + 3).for_each(|column| bits.set(row * 24 + column, true));
        }
        bits
    }
}

/// A device of the hall.
pub struct Source {
    pub kind: Kind,
    fake: Fake,
    asked: u32,
}

impl Source {
    fn new(kind: Kind) -> Self {
        let parts = if kind == Kind::Camera { FAN } else { BEAMS };
        // Clocks of three devices that were switched on one after the other.
        let offset_us = (kind as i64 + 1) * 77_000_000;
        let fake = Fake { parts, offset_us, ..Fake::new(kind as u8 + 1, 1, kind.name()) };
        Self { kind, fake, asked: 0 }
    }

    /// It is switched off and on again: another start, another time.
    pub const fn restart(&mut self) {
        self.fake.identity.boot += 1;
        self.fake.sequence = 0;
        self.fake.offset_us -= 5_000_000;
    }

    /// What it answers once it is asked.
    fn answers(&mut self, now_us: u64) -> Vec<Vec<u8>> {
        if self.kind != Kind::Mat {
            return [vec![self.fake.info(1)], self.fake.profile(), vec![self.exchange(now_us)]].concat();
        }
        let info = Info {
            request_id: 1,
            version_min: 1,
            version_max: 1,
            firmware: "",
            build: "",
            board: "",
            name: self.kind.name(),
            uptime_us: 0,
            setup: 1,
            background_version: 0,
            sensor: None,
        };
        vec![self.fake.say(&Message::Info(info)), self.exchange(now_us)]
    }

    /// An exchange of times.
    fn exchange(&mut self, now_us: u64) -> Vec<u8> {
        self.asked += 1;
        self.fake.subscribed(self.asked, now_us - 400, now_us)
    }

    /// Its report of a scan that began at `at_us`.
    pub fn report(&mut self, people: People, at_us: u64) -> Vec<u8> {
        self.fake.sequence += 1;
        let (sequence, stamp_us) = (self.fake.sequence, self.fake.clock_us(at_us));
        let head = ReportHead { sequence, setup: 1, stamp_us, ..ReportHead::default() };
        if self.kind == Kind::Mat {
            let bits = people.panels(at_us);
            let down = List::new(bits.bytes(24 * 24));
            let pressed = Pressed { head, columns: 24, rows: 24, down, faulty: List::new(&[]) };
            return self.fake.say(&Message::Pressed(pressed));
        }
        let (x, yaw_rad) = if self.kind == Kind::Laser { (3.4, std::f64::consts::PI) } else { (-1.9, 0.0) };
        let pose = Pose { at: Point::new(x, 0.96), yaw_rad };
        // When its beams pass the front.
        let parts = self.fake.parts;
        let front_us =
            u64::from(parts.period_us) * u64::from(parts.front_step) / u64::from(parts.steps_per_turn);
        let seen = silhouettes(people.places(at_us + front_us).into_iter(), pose, parts);
        let sizes = vec![SIZE; if self.kind == Kind::Camera { seen.len() } else { 0 }];
        let head = ReportHead { background_version: 1, ..head };
        let (candidates, sizes) = (List::new(&seen), List::new(&sizes));
        self.fake.say(&Message::Report(Report { head, candidates, unseen: List::default(), sizes }))
    }
}

/// The hall.
pub struct Hall {
    pub site_tracker: SiteTracker,
    pub sources: Vec<Source>,
}

impl Hall {
    pub fn new(kinds: &[Kind]) -> Self {
        let site = kinds.iter().map(|kind| kind.site()).collect::<String>() + ZONE;
        let site = Arc::new(Site::parse("hall.toml", &site).unwrap());
        let sources = kinds.iter().map(|kind| Source::new(*kind)).collect();
        Self { site_tracker: SiteTracker::new(&site, tracker()), sources }
    }

    pub fn hear(&mut self, bytes: &[u8], now_us: u64) {
        self.site_tracker.receive(bytes, now_us);
    }

    /// A source that is met, or has come back, answers.
    pub fn meet(&mut self, source: usize, now_us: u64) {
        for answer in self.sources[source].answers(now_us) {
            self.hear(&answer, now_us);
        }
    }

    pub fn exchange(&mut self, source: usize, now_us: u64) {
        let answer = self.sources[source].exchange(now_us);
        self.hear(&answer, now_us);
    }

    /// What is known at `now_us`.
    pub fn zone(&mut self, now_us: u64) -> ZoneLine {
        self.site_tracker.estimate(now_us as f64 * 1e-6).zones.remove("hall").unwrap()
    }
}
