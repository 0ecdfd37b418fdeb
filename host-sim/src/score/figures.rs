//! The figures of a [`Tally`], as they are printed. A figure without data is absent.

use std::fmt;

use serde::Serialize;

use super::frame::share;
use super::scorer::Tally;
use super::trajectory::Mean;

/// Every figure. Shares are between 0 and 1; distances in metres; pooled over all frames and runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// Runs.
    pub runs: u64,
    /// Frames.
    pub frames: u64,
    /// People, frame by frame.
    pub people: u64,
    /// Tracks, frame by frame.
    pub tracks: u64,

    /// Share of the frames with the right number in the area.
    pub exact_count_rate: Option<f64>,
    /// People too many, mean of the frames.
    pub over_count: Option<f64>,
    /// People too few, mean of the frames.
    pub under_count: Option<f64>,

    /// 1 − (misses + false + switches) / people.
    pub mota: Option<f64>,
    /// Mean distance of the pairs, m.
    pub motp_m: Option<f64>,
    /// People that no track stands for.
    pub misses: u64,
    /// Tracks without a person (false positives).
    pub false_tracks: u64,
    /// Changes of a person's track (identity switches).
    pub id_switches: u64,
    /// People with no track at all within the gate.
    pub lost: u64,

    /// 2 IDTP / (people + tracks).
    pub idf1: Option<f64>,
    /// IDTP / tracks.
    pub id_precision: Option<f64>,
    /// IDTP / people.
    pub id_recall: Option<f64>,

    /// HOTA, mean over its levels.
    pub hota: Option<f64>,
    /// Its detection part.
    pub det_a: Option<f64>,
    /// Its association part.
    pub ass_a: Option<f64>,

    /// Mean GOSPA of the frames, m.
    pub gospa_m: Option<f64>,
    /// Mean over the frames of the part of GOSPA² that distances make, m².
    pub gospa_localisation_m2: Option<f64>,
    /// The part that people left over make, m².
    pub gospa_missed_m2: Option<f64>,
    /// The part that tracks left over make, m².
    pub gospa_false_m2: Option<f64>,

    /// Pairs / tracks.
    pub detection_precision: Option<f64>,
    /// Pairs / people.
    pub detection_recall: Option<f64>,
    /// 2 pairs / (people + tracks).
    pub detection_f: Option<f64>,
    /// Mean over the tracks of the share of their life spent with one person.
    pub trajectory_precision: Option<f64>,
    /// Mean over the people of the share of their stay spent with one track.
    pub trajectory_recall: Option<f64>,

    /// Share of the errors inside the ellipse that should hold 95 %.
    pub nees_coverage: Option<f64>,
    /// Mean NEES; 2 is right.
    pub nees_mean: Option<f64>,
    /// Pairs with a covariance.
    pub nees_pairs: u64,
    /// Of those, pairs with an invalid covariance (not positive definite).
    pub nees_improper: u64,

    /// Root mean square error of the people well seen, m.
    pub rms_visible_m: Option<f64>,
    /// Pairs in it.
    pub visible_pairs: u64,
    /// Root mean square error of the hidden, m.
    pub rms_hidden_m: Option<f64>,
    /// Pairs in it.
    pub hidden_pairs: u64,
}

impl Tally {
    /// The figures.
    #[must_use]
    pub fn figures(&self) -> Figures {
        let (clear, identity, gospa, nees) = (&self.clear, &self.identity, &self.gospa, &self.clear.nees);
        let (people, tracks, matches) = (clear.people as f64, clear.tracks as f64, clear.matches as f64);
        let counted = |sum: u64| share(sum as f64, self.counting.frames as f64);
        let in_frames = |sum: f64| share(sum, gospa.frames as f64);
        let scores = self.hota.scores();
        let wrong = (clear.misses() + clear.false_tracks() + clear.switches) as f64;
        let id_matches = identity.matches as f64;
        Figures {
            runs: self.runs,
            frames: clear.frames,
            people: clear.people,
            tracks: clear.tracks,
            exact_count_rate: counted(self.counting.exact),
            over_count: counted(self.counting.over),
            under_count: counted(self.counting.under),
            mota: share(wrong, people).map(|wrong| 1.0 - wrong),
            motp_m: share(clear.distance_m, matches),
            misses: clear.misses(),
            false_tracks: clear.false_tracks(),
            id_switches: clear.switches,
            lost: clear.lost,
            idf1: share(2.0 * id_matches, people + tracks),
            id_precision: share(id_matches, tracks),
            id_recall: share(id_matches, people),
            hota: scores.map(|scores| scores.hota),
            det_a: scores.map(|scores| scores.detection),
            ass_a: scores.map(|scores| scores.association),
            gospa_m: in_frames(gospa.gospa_m),
            gospa_localisation_m2: in_frames(gospa.localisation_m2),
            gospa_missed_m2: in_frames(gospa.missed_m2),
            gospa_false_m2: in_frames(gospa.false_m2),
            detection_precision: share(matches, tracks),
            detection_recall: share(matches, people),
            detection_f: share(2.0 * matches, people + tracks),
            trajectory_precision: Mean::over(&self.trajectory.tracks),
            trajectory_recall: Mean::over(&self.trajectory.people),
            nees_coverage: share(nees.inside as f64, nees.pairs as f64),
            nees_mean: share(nees.sum, (nees.pairs - nees.improper) as f64),
            nees_pairs: nees.pairs,
            nees_improper: nees.improper,
            rms_visible_m: clear.visible.rms_m(),
            visible_pairs: clear.visible.pairs,
            rms_hidden_m: clear.hidden.rms_m(),
            hidden_pairs: clear.hidden.pairs,
        }
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent =
            |value: Option<f64>| value.map_or("–".into(), |value| format!("{:.1} %", value * 100.0));
        let ratio = |value: Option<f64>| value.map_or("–".into(), |value| format!("{value:.3}"));
        let centimetres =
            |value: Option<f64>| value.map_or("–".into(), |value| format!("{:.1} cm", value * 100.0));
        writeln!(
            f,
            "  count        right in {}, {} too many, {} too few on average",
            percent(self.exact_count_rate),
            ratio(self.over_count),
            ratio(self.under_count)
        )?;
        writeln!(
            f,
            "  CLEAR MOT    MOTA {}, MOTP {}, {} misses, {} false, {} switches, {} lost",
            percent(self.mota),
            centimetres(self.motp_m),
            self.misses,
            self.false_tracks,
            self.id_switches,
            self.lost
        )?;
        writeln!(
            f,
            "  identity     IDF1 {}, precision {}, recall {}",
            ratio(self.idf1),
            ratio(self.id_precision),
            ratio(self.id_recall)
        )?;
        writeln!(
            f,
            "  HOTA         {}, detection {}, association {}",
            ratio(self.hota),
            ratio(self.det_a),
            ratio(self.ass_a)
        )?;
        writeln!(
            f,
            "  GOSPA        {}; its mean square: {} m² position, {} m² missed, {} m² false",
            centimetres(self.gospa_m),
            ratio(self.gospa_localisation_m2),
            ratio(self.gospa_missed_m2),
            ratio(self.gospa_false_m2)
        )?;
        writeln!(
            f,
            "  detection    precision {}, recall {}, F {}",
            percent(self.detection_precision),
            percent(self.detection_recall),
            percent(self.detection_f)
        )?;
        writeln!(
            f,
            "  trajectories precision {}, recall {}",
            percent(self.trajectory_precision),
            percent(self.trajectory_recall)
        )?;
        writeln!(
            f,
            "  covariance   {} inside the 95 % ellipse, mean NEES {} (2 is right), {} pairs, {} improper",
            percent(self.nees_coverage),
            ratio(self.nees_mean),
            self.nees_pairs,
            self.nees_improper
        )?;
        writeln!(
            f,
            "  RMS error    visible {} ({} pairs), hidden {} ({} pairs)",
            centimetres(self.rms_visible_m),
            self.visible_pairs,
            centimetres(self.rms_hidden_m),
            self.hidden_pairs
        )
    }
}
