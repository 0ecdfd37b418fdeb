//! The tables of how sure counts are: scores of every group, and the bins of what was said; as Markdown and as CSV.
//!
//! ```text
//! | all own worlds         | moments | right, % | said, % | Brier | reliability | resolution | … |   a line a group, a
//! | kehai, zone            |         |          |         |       |             |            |   |   tracker and what was asked
//!
//! | own worlds: said, %    | kehai, zone: true, %                      |   a line a bin
//! | 95 to 98               | 93.1 [91–95] of 412, said 96.6            |
//! ```

use std::fmt::Write as _;
use std::io::{self, Write};

use super::counts::{Asked, Judged, Run};

/// Scores, then bins of the pooled groups.
#[must_use]
pub fn markdown(judged: &[Judged]) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "| worlds | tracker, what is asked | runs | seconds | right, % | said of it, % | Brier score | reliability | \
         resolution | uncertainty |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|"
    );
    for Judged { group, tracker, asked, runs, found } in judged {
        let _ = writeln!(
            text,
            "| {group} | {tracker}, {} | {runs} | {} | {:.1} | {:.1} | {:.4} | {:.4} | {:.4} | {:.4} |",
            asked.name(),
            found.moments,
            100.0 * found.right,
            100.0 * found.sure,
            found.brier,
            found.reliability,
            found.resolution,
            found.uncertainty,
        );
    }
    for one in judged.iter().filter(|one| one.is_pooled()) {
        let _ = write!(
            text,
            "\n| {}, {}, {}: said, % | in the mean, % | true, % | questions | as good as |\n|---|--:|--:|--:|--:|\n",
            one.group,
            one.tracker,
            one.asked.name()
        );
        for bin in &one.found.bins {
            let interval = bin.interval();
            let _ = writeln!(
                text,
                "| {} to {} | {:.2} | {:.2} [{:.1}–{:.1}] | {} | {:.0} |",
                percent(bin.from),
                percent(bin.to),
                100.0 * bin.said,
                100.0 * bin.share(),
                100.0 * interval.low,
                100.0 * interval.high,
                bin.questions,
                bin.effective,
            );
        }
    }
    text
}

/// 2.5 as `2.5`, 95 as `95`.
fn percent(share: f64) -> String {
    format!("{}", (share * 1e4).round() / 100.0)
}

/// Every bin of every group.
///
/// # Errors
/// What the writer says.
pub fn write_bins(judged: &[Judged], to: impl Write) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(to);
    csv.write_record([
        "worlds",
        "tracker",
        "asked",
        "from",
        "to",
        "questions",
        "said",
        "hits",
        "low",
        "high",
        "effective",
    ])?;
    for Judged { group, tracker, asked, found, .. } in judged {
        for bin in &found.bins {
            let interval = bin.interval();
            let numbers = [bin.from, bin.to, bin.said, interval.low, interval.high, bin.effective]
                .map(|n| format!("{n:.6}"));
            let [from, to, said, low, high, effective] = &numbers;
            let (questions, hits) = (bin.questions.to_string(), bin.hits.to_string());
            csv.write_record([
                group,
                tracker,
                asked.name(),
                from,
                to,
                &questions,
                said,
                &hits,
                low,
                high,
                effective,
            ])?;
        }
    }
    csv.flush()
}

/// Every second of every run.
///
/// # Errors
/// What the writer says.
pub fn write_seconds(runs: &[Run], to: impl Write) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(to);
    csv.write_record(["worlds", "row", "seed", "tracker", "t_s", "people", "asked", "p"])?;
    for run in runs {
        for heard in &run.heard {
            for (asked, p) in Asked::ALL.iter().zip(&heard.said) {
                let p: Vec<String> = p.iter().map(|p| format!("{p:.6}")).collect();
                csv.write_record([
                    &run.group,
                    &run.row,
                    &run.seed.to_string(),
                    &run.tracker,
                    &format!("{:.1}", heard.t_s),
                    &heard.people.to_string(),
                    asked.name(),
                    &p.join(" "),
                ])?;
            }
        }
    }
    csv.flush()
}
