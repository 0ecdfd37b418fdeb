//! Holds what a surface says against what the tracker said: a zone that is said to be empty, a total, a figure of 0.
//!
//! ```text
//!   surface ─▶ Claim: "hall is empty, at 12:04:07.3" ─▶ Truth: known, and empty? ─┬─ right: counted
//!                                                                                 └─ false: named, with the seed
//! ```
//!
//! A surface of which no claim was right in all runs has not been judged, and fails, too.

use std::collections::BTreeMap;

use super::truth::{Moment, Told, What};

/// Of how many false claims the words are kept.
const NAMED: usize = 5;

/// When it is said to be so.
#[derive(Clone, Copy, Debug)]
pub enum When<'a> {
    /// At a moment; none: while nothing holds that the tracker has said.
    At(Option<&'a Moment>),
    /// All the time, ms since 1970, by what had been told.
    Over(u64, u64, Told<'a>),
}

/// What the surfaces have claimed so far.
#[derive(Debug, Default)]
pub struct Judge {
    right: BTreeMap<&'static str, usize>,
    wrong: BTreeMap<&'static str, Vec<String>>,
}

impl Judge {
    /// Takes that `surface` says that a place is empty, in these words.
    pub fn empty(&mut self, surface: &'static str, what: &What, when: When<'_>, words: &str) {
        let is_so = match when {
            When::At(moment) => moment.is_some_and(|moment| moment.says(what, true)),
            When::Over(from_ms, to_ms, told) => told.said_over(what, (from_ms, to_ms)).is_ok(),
        };
        if is_so {
            *self.right.entry(surface).or_default() += 1;
            return;
        }
        let said = match when {
            When::At(moment) => format!("{what:?} {words}, and the tracker says {moment:?}"),
            When::Over(from_ms, to_ms, told) => {
                let otherwise = told.said_over(what, (from_ms, to_ms)).err().flatten();
                format!("{what:?} {words} from {from_ms} to {to_ms}, and the tracker says {otherwise:?}")
            }
        };
        self.wrong.entry(surface).or_default().push(said);
    }

    /// Adds what another has judged.
    pub fn add(&mut self, other: Self) {
        for (surface, right) in other.right {
            *self.right.entry(surface).or_default() += right;
        }
        for (surface, wrong) in other.wrong {
            self.wrong.entry(surface).or_default().extend(wrong);
        }
    }

    /// What is false, in words; none if nothing is.
    pub fn falsehoods(&self) -> Option<String> {
        let told = |(surface, wrong): (&&str, &Vec<String>)| {
            let some: Vec<&str> = wrong.iter().take(NAMED).map(String::as_str).collect();
            format!("{surface}: {} false empties\n    {}", wrong.len(), some.join("\n    "))
        };
        let told: Vec<String> = self.wrong.iter().map(told).collect();
        (!told.is_empty()).then(|| told.join("\n"))
    }

    /// How often each surface has said so rightly.
    pub const fn right(&self) -> &BTreeMap<&'static str, usize> {
        &self.right
    }
}
