//! Two edits of one site become one, part by part; where both changed the same part, the user has to decide.
//!
//! ```text
//!             ╭─▶ mine    ─╮            base   mine   theirs     merged
//!   base ─────┤            ├─▶ merged   ▭      ▭      ▱          ▱
//!             ╰─▶ theirs  ─╯            ▭      ▱      ▭          ▱
//!                                       ▭      ▱      ◇          ▱ until it is decided: a conflict
//!                                       ▭      –      ◇          ◇ until it is decided
//!                                       –      ▱      ◇          both, unless their names are the same
//! ```
//!
//! Source: the three-way merge of diff3 (Khanna, Kunal and Pierce 2007), with parts in place of lines.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

use super::Site;
use super::pairs::pairs;
use super::part::{Kind, Part};

/// A part that both have changed, each in another way.
#[derive(Clone, PartialEq, Debug, Serialize, JsonSchema)]
pub struct Conflict {
    /// What it is.
    pub kind: Kind,
    /// What people call it.
    pub label: String,
    /// Its place in the merged site, which has mine there, or theirs if mine is none.
    pub index: usize,
    /// What I made of it; null: I took it away.
    pub mine: Option<Value>,
    /// What they made of it; null: they took it away.
    pub theirs: Option<Value>,
}

/// What became of two edits.
#[derive(Clone, PartialEq, Debug)]
pub struct Merged {
    /// The changes of both.
    pub site: Site,
    /// What is to be decided.
    pub conflicts: Vec<Conflict>,
}

/// Both edits of `base` in one.
#[must_use]
pub fn merge(base: &Site, mine: &Site, theirs: &Site) -> Merged {
    let mut conflicts = Vec::new();
    let said = &mut conflicts;
    let site = Site {
        modules: parts(&base.modules, &mine.modules, &theirs.modules, said),
        walls: parts(&base.walls, &mine.walls, &theirs.walls, said),
        zones: parts(&base.zones, &mine.zones, &theirs.zones, said),
        entries: parts(&base.entries, &mine.entries, &theirs.entries, said),
        lines: parts(&base.lines, &mine.lines, &theirs.lines, said),
        movers: parts(&base.movers, &mine.movers, &theirs.movers, said),
        excludes: parts(&base.excludes, &mine.excludes, &theirs.excludes, said),
        doors: parts(&base.doors, &mine.doors, &theirs.doors, said),
        readers: parts(&base.readers, &mine.readers, &theirs.readers, said),
        floors: parts(&base.floors, &mine.floors, &theirs.floors, said),
    };
    Merged { site, conflicts }
}

/// What was added, changed and taken away, as people call it.
#[must_use]
pub fn changes(before: &Site, after: &Site) -> Vec<String> {
    let mut all = Vec::new();
    let said = &mut all;
    list(&before.modules, &after.modules, said);
    list(&before.floors, &after.floors, said);
    list(&before.walls, &after.walls, said);
    list(&before.zones, &after.zones, said);
    list(&before.entries, &after.entries, said);
    list(&before.lines, &after.lines, said);
    list(&before.movers, &after.movers, said);
    list(&before.excludes, &after.excludes, said);
    list(&before.doors, &after.doors, said);
    list(&before.readers, &after.readers, said);
    all
}

fn list<P: Part>(before: &[P], after: &[P], said: &mut Vec<String>) {
    let found = pairs(before, after);
    for (index, (was, is)) in before.iter().zip(&found).enumerate() {
        match is.and_then(|is| Some((is, after.get(is)?))) {
            None => said.push(format!("{} removed", was.label(index))),
            Some((_, is)) if is == was => {}
            Some((place, is)) => said.push(format!("{} changed", is.label(place))),
        }
    }
    let added = after.iter().enumerate().filter(|(index, _)| !found.contains(&Some(*index)));
    said.extend(added.map(|(index, part)| format!("{} added", part.label(index))));
}

/// What a part is in the merged list.
enum Fate<P> {
    Kept(P),
    Gone,
    Open { mine: Option<P>, theirs: Option<P> },
}

/// The parts of one kind.
fn parts<P: Part>(base: &[P], mine: &[P], theirs: &[P], said: &mut Vec<Conflict>) -> Vec<P> {
    if theirs == base || mine == theirs {
        return mine.to_vec();
    }
    if mine == base {
        return theirs.to_vec();
    }
    let (of_mine, of_theirs) = (pairs(base, mine), pairs(base, theirs));
    let get = |list: &[P], found: &[Option<usize>], index: usize| -> Option<P> {
        list.get((*found.get(index)?)?).cloned()
    };
    // In their order, as the file has it, then what they took away and I changed, then what I added.
    let mut all: Vec<Fate<P>> = Vec::new();
    let was_base = |index: usize| of_theirs.iter().position(|found| *found == Some(index));
    let new_of_mine = mine.iter().enumerate().filter(|(index, _)| !of_mine.contains(&Some(*index)));
    let mut new_of_mine: Vec<Option<P>> = new_of_mine.map(|(_, part)| Some(part.clone())).collect();
    for (index, is) in theirs.iter().enumerate() {
        all.push(match was_base(index).and_then(|number| Some((number, base.get(number)?))) {
            Some((number, was)) => decide(Some(was), get(mine, &of_mine, number), Some(is.clone())),
            None => {
                let same = |part: &&mut Option<P>| {
                    part.as_ref().is_some_and(|part| {
                        part == is || (!part.name().is_empty() && part.name() == is.name())
                    })
                };
                let twin = new_of_mine.iter_mut().find(same).and_then(Option::take);
                match twin {
                    Some(twin) => decide(None, Some(twin), Some(is.clone())),
                    None => Fate::Kept(is.clone()),
                }
            }
        });
    }
    for (number, was) in base.iter().enumerate().filter(|(number, _)| of_theirs.get(*number) == Some(&None)) {
        all.push(decide(Some(was), get(mine, &of_mine, number), None));
    }
    all.extend(new_of_mine.into_iter().flatten().map(Fate::Kept));
    let mut merged: Vec<P> = Vec::with_capacity(all.len());
    for fate in all {
        match fate {
            Fate::Kept(part) => merged.push(part),
            Fate::Gone => {}
            Fate::Open { mine, theirs } => {
                let Some(part) = mine.clone().or_else(|| theirs.clone()) else { continue };
                let index = merged.len();
                let text = |part: Option<P>| part.and_then(|part| serde_json::to_value(part).ok());
                let (kind, label) = (P::KIND, theirs.as_ref().unwrap_or(&part).label(index));
                said.push(Conflict { kind, label, index, mine: text(mine), theirs: text(theirs) });
                merged.push(part);
            }
        }
    }
    merged
}

fn decide<P: Part>(base: Option<&P>, mine: Option<P>, theirs: Option<P>) -> Fate<P> {
    if mine == theirs {
        return mine.map_or(Fate::Gone, Fate::Kept);
    }
    if mine.as_ref() == base {
        return theirs.map_or(Fate::Gone, Fate::Kept);
    }
    if theirs.as_ref() == base {
        return mine.map_or(Fate::Gone, Fate::Kept);
    }
    Fate::Open { mine, theirs }
}

#[cfg(test)]
#[path = "merge_tests.rs"]
mod tests;
