//! What a picture shows.

/// The content of a picture.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// First line.
    pub title: String,
    /// Second line: the figures that matter.
    pub subtitle: String,
    /// The background of each beam, in beam order.
    pub background: Vec<BeamShown>,
    /// The scans in time order.
    pub scans: Vec<ScanShown>,
    /// True positions of people (empty for a recording).
    pub truth: Vec<TruthShown>,
}

/// The background of one beam.
#[derive(Clone, Copy, Debug)]
pub struct BeamShown {
    /// Direction, counter-clockwise from forward.
    pub bearing_rad: f64,
    /// Its background.
    pub kind: BeamKind,
}

impl BeamShown {
    /// Where its wall is, in m, if it has one.
    #[must_use]
    pub fn wall_m(&self) -> Option<[f64; 2]> {
        match self.kind {
            BeamKind::Wall { range_m, .. } => {
                Some([range_m * self.bearing_rad.cos(), range_m * self.bearing_rad.sin()])
            }
            BeamKind::Open { .. } | BeamKind::Unknown => None,
        }
    }
}

/// The background of a beam: what it measures in the empty room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BeamKind {
    /// Something solid at this distance.
    Wall {
        /// Distance in m.
        range_m: f64,
        /// A second, nearer distance that is background as well (an open door's leaf).
        near_m: Option<f64>,
    },
    /// Often no return; a reading nearer than the limit, if there is one, is foreground.
    Open {
        /// Distance in m.
        limit_m: Option<f64>,
    },
    /// Not judged.
    Unknown,
}

/// One scan.
#[derive(Clone, Debug, Default)]
pub struct ScanShown {
    /// Time in s.
    pub t_s: f64,
    /// Foreground points in m, x forward, y left.
    pub foreground: Vec<[f64; 2]>,
    /// Candidates.
    pub candidates: Vec<CandidateShown>,
}

/// One candidate.
#[derive(Clone, Copy, Debug)]
pub struct CandidateShown {
    /// Estimated centre of the person, in m.
    pub centre_m: [f64; 2],
    /// Too narrow for a person seen whole.
    pub narrow: bool,
}

/// One person at one moment.
#[derive(Clone, Copy, Debug)]
pub struct TruthShown {
    /// Time in s.
    pub t_s: f64,
    /// Position in m, in the sensor's frame.
    pub position_m: [f64; 2],
}

impl Picture {
    /// Start and end of the scans, in s; never equal.
    pub(super) fn span_s(&self) -> (f64, f64) {
        let first = self.scans.first().map_or(0.0, |scan| scan.t_s);
        let last = self.scans.last().map_or(first, |scan| scan.t_s);
        (first, last.max(first + 0.1))
    }
}
