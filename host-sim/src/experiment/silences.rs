//! Paper B's floor with IDs that are not read for up to a minute: whether each is right again as soon as it is read.
//!
//! ```text
//!   people × seed ─▶ floor::silence ─▶ silences: not right within a second, still right at their end, the longest
//! ```

use std::ops::RangeInclusive;

use super::figure::Figure;
use super::findings::{Figures, Pooled, owned};
use super::jobs::Runs;
use crate::floor::silence::{self, PEOPLE, Silences};

/// Runs every number of people with these seeds.
///
/// # Errors
/// The kept file cannot be written.
pub fn run(seeds: &RangeInclusive<u64>, runs: &Runs) -> Result<Vec<Pooled>, String> {
    let jobs: Vec<(usize, u64)> =
        PEOPLE.into_iter().flat_map(|people| seeds.clone().map(move |seed| (people, seed))).collect();
    let results = runs.results("floor-silences", &jobs, |(people, seed)| Ok(silence::run(people, seed)))?;
    let pooled = |people: usize| {
        let own = results.range((people, 0)..=(people, u64::MAX));
        Pooled {
            trial: format!("B5 silences, {people} people"),
            tracker: "kehai".to_owned(),
            runs: own.map(|((_, seed), came)| (*seed, figures(came))).collect(),
        }
    };
    Ok(PEOPLE.map(pooled).into())
}

fn figures(came: &Silences) -> Figures {
    let Silences { times, kept, back, longest_s } = *came;
    owned(vec![
        ("silences", Figure::Sum(times as f64)),
        ("right name not back within 1 s, %", Figure::Share { yes: times - back, of: times }),
        ("right name at the end of the silence, %", Figure::Share { yes: kept, of: times }),
        ("longest until it is back, s", Figure::Most(longest_s)),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_says_what_was_late_and_the_longest_of_all_runs() {
        let came = |back, longest_s| Silences { times: 40, kept: 20, back, longest_s };
        let runs = [(3, figures(&came(39, 1.25))), (4, figures(&came(40, 0.5)))].into();
        let pooled = Pooled { trial: "B5".into(), tracker: "kehai".into(), runs };
        let words: Vec<String> = pooled.figures().iter().map(|(_, figure)| figure.words()).collect();
        assert_eq!(words, ["80", "1.2 [0–7]", "50 [39–61]", "1.25"]);
    }
}
