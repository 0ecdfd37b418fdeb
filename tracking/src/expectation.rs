//! What count is to be expected of a site, by how much of it the modules see.
//!
//! ```text
//!   seen from two sides
//!        │      ·   ·  ●●         · a layout of a sampled room, simulated with so many people
//!        │   ·     ● ◉ ●          ◉ the site as its modules see it now
//!        │  ·   ·   ●             ● the ten layouts that see most nearly as much: their mean, the worst and the best of them
//!        └───────────────▶ seen by one
//! ```
//!
//! Nothing here is measured at the site, and nothing simulated of its very rooms: `kehai-sim plan` does that. The table is
//! what `kehai-sim expect` prints, `docs/tables/expected.csv`.

use std::sync::LazyLock;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ground::Share;

/// `room,m2,modules,one,two,people,exact,runs`, a line for each layout and number of people.
const TABLE: &str = include_str!("../../docs/tables/expected.csv");

/// As many layouts are like the site: of so many, a further one lies between the worst and the best nine times in eleven.
pub const ALIKE: usize = 10;

/// Layouts are not like the site if the shares differ by more, together: as one half of a small room from all of it.
const APART_MOST: f64 = 0.2;

/// Sites that are larger than the largest sampled room by more are not like it: twice as many modules are other sides' neighbours.
const LARGER_MOST: f64 = 2.0;

/// What is to be expected with so many people.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Expectation {
    /// So many people in the zones together.
    pub people: u32,
    /// Share of the time in which the count is right, on the mean of the layouts that are like this one.
    pub exact: f64,
    /// In the worst of them.
    pub worst: f64,
    /// In the best of them.
    pub best: f64,
    /// How many they are.
    pub layouts: usize,
}

/// A layout that was simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    room: u32,
    m2: f64,
    one: f64,
    two: f64,
    people: u32,
    exact: f64,
}

static LINES: LazyLock<Vec<Line>> = LazyLock::new(|| TABLE.lines().skip(1).filter_map(line).collect());

fn line(text: &str) -> Option<Line> {
    let mut fields = text.split(',');
    let mut next = || fields.next();
    let (room, m2, _modules) = (next()?.parse().ok()?, next()?.parse().ok()?, next()?);
    let (one, two) = (next()?.parse().ok()?, next()?.parse().ok()?);
    let (people, exact) = (next()?.parse().ok()?, next()?.parse().ok()?);
    Some(Line { room, m2, one, two, people, exact })
}

/// What is to be expected of zones of which the modules see this, for each number of people that was simulated; empty where no
/// simulated layout is like it.
#[must_use]
pub fn expectations(seen: &Share) -> Vec<Expectation> {
    let largest_m2 = LINES.iter().map(|line| line.m2).fold(0.0, f64::max);
    // Where nothing is seen nothing is counted, however many rooms were simulated.
    if seen.one == 0.0 || seen.m2 > LARGER_MOST * largest_m2 {
        return Vec::new();
    }
    let mut people: Vec<u32> = LINES.iter().map(|line| line.people).collect();
    people.sort_unstable();
    people.dedup();
    people.into_iter().filter_map(|people| of(&LINES, seen, people)).collect()
}

/// Of these lines, with so many people.
fn of(lines: &[Line], seen: &Share, people: u32) -> Option<Expectation> {
    let apart = |line: &Line| libm::hypot(line.one - seen.one, line.two - seen.two);
    let mut alike: Vec<&Line> =
        lines.iter().filter(|line| line.people == people && apart(line) <= APART_MOST).collect();
    // Of equal ones the first, on every machine.
    alike.sort_by(|one, other| apart(one).total_cmp(&apart(other)));
    alike.truncate(ALIKE);
    (alike.len() == ALIKE).then(|| Expectation {
        people,
        exact: alike.iter().map(|line| line.exact).sum::<f64>() / ALIKE as f64,
        worst: alike.iter().map(|line| line.exact).fold(1.0, f64::min),
        best: alike.iter().map(|line| line.exact).fold(0.0, f64::max),
        layouts: ALIKE,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(one: f64, two: f64, m2: f64) -> Share {
        Share { m2, one, two, ..Share::default() }
    }

    #[test]
    fn every_line_of_the_table_is_read() {
        assert_eq!(LINES.len(), TABLE.lines().count() - 1);
        assert!(LINES.len() > 500, "{}", LINES.len());
        assert_eq!(
            line("3,20.5,2,0.91,0.25,4,0.973,2").map(|line| (line.room, line.people, line.exact)),
            Some((3, 4, 0.973))
        );
        for wrong in ["", "3,20.5,2,0.91,0.25,4", "3,20.5,2,x,0.25,4,0.973,2"] {
            assert_eq!(line(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn the_ten_that_see_most_nearly_as_much_are_asked() {
        let line = |number: u32, people| {
            let share = f64::from(number) * 0.01;
            Line { room: number, m2: 20.0, one: 0.8 + share, two: 0.3, people, exact: 0.5 + share }
        };
        let lines: Vec<Line> = (0..20).map(|number| line(number, 2)).chain([line(5, 4)]).collect();
        let found = of(&lines, &seen(0.799, 0.3, 20.0), 2).unwrap();
        assert_eq!((found.worst, found.best, found.layouts), (0.5, 0.59, 10));
        assert!((found.exact - 0.545).abs() < 1e-9, "{found:?}");
        assert_eq!(of(&lines, &seen(0.8, 0.3, 20.0), 4), None, "one is not ten");
        assert_eq!(of(&lines, &seen(0.8, 0.9, 20.0), 2), None, "none is like it");
    }

    #[test]
    fn where_no_room_is_like_the_site_nothing_is_expected() {
        assert_eq!(expectations(&seen(0.0, 0.0, 20.0)), []);
        assert_eq!(expectations(&Share::default()), []);
        assert_eq!(expectations(&seen(0.98, 0.8, 1000.0)), []);
        let well = expectations(&seen(0.98, 0.8, 20.0));
        assert_eq!(well.iter().map(|found| found.people).collect::<Vec<_>>(), [1, 2, 4, 6]);
        let poor = expectations(&seen(0.6, 0.1, 20.0));
        for (well, poor) in well.iter().zip(&poor) {
            assert!(well.worst <= well.exact && well.exact <= well.best, "{well:?}");
            // One person alone is counted as well by either.
            let as_well = if well.people == 1 { 0.01 } else { 0.0 };
            assert!(
                well.exact > poor.exact - as_well,
                "modules that see more count better: {well:?} {poor:?}"
            );
        }
        assert!(well.is_sorted_by(|fewer, more| fewer.exact >= more.exact - 0.02), "{well:?}");
    }

    /// Each layout is expected from the rooms other than its own: what docs/plan.md says of how sure it is.
    #[test]
    fn of_the_rooms_left_out_most_lie_between_the_worst_and_the_best() {
        for people in [1, 2, 4, 6] {
            let (mut asked, mut within, mut off) = (0, 0, 0.0);
            let mut own = 0;
            for line in LINES.iter().filter(|line| line.people == people) {
                own += 1;
                let others: Vec<Line> =
                    LINES.iter().filter(|other| other.room != line.room).copied().collect();
                let Some(found) = of(&others, &seen(line.one, line.two, line.m2), people) else { continue };
                asked += 1;
                within += u32::from((found.worst..=found.best).contains(&line.exact));
                off += (found.exact - line.exact).abs();
            }
            let (share, off) = (f64::from(within) / f64::from(asked), off / f64::from(asked));
            println!(
                "{people}: {asked} of {own} layouts, {:.0} % within, {:.1} points off",
                100.0 * share,
                100.0 * off
            );
            assert!(share > 0.75, "{people}: {share}");
        }
    }
}
