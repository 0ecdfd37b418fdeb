//! Circles of imports between the files of a crate, and between its subjects: what lies beside its root, a file or a folder.
//!
//! ```text
//!   scene.rs:12 uses variation.rs          each file of a circle needs all others to be understood,
//!   variation.rs:7 uses scene.rs           so the circle is one file cut in pieces
//!
//!   door/doors.rs uses tracker.rs          each file is above or below the other two, and yet
//!   tracker.rs uses door/terms.rs          neither the door nor the tracker is understood first
//! ```
//!
//! File A uses file B when A's code names an item that B defines, through whatever path: re-exports are
//! followed to the definition, so that an address in a `mod.rs` is not taken for its contents. `mod child;`
//! and `pub use child::Item;` alone are no use of the child. A child may name the items of the modules that it
//! lies in: it is a part of them, as an `impl` of the parent's type in a file of its own is. Children of one
//! parent are files like any others. What `#[cfg(test)]` holds is left out.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pathfinding::directed::strongly_connected_components::strongly_connected_components;

use crate::modules::Modules;

/// Files or subjects that use each other, by whatever way round.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Circle {
    /// Its uses, sorted; each of its files or subjects is the user of one and the used of another.
    pub uses: Vec<Use>,
}

/// The first place where a file uses another one.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Use {
    /// The file that uses.
    pub user: PathBuf,
    /// Its line, from 1.
    pub line: usize,
    /// The path as it is written there.
    pub path: String,
    /// The file that is used.
    pub used: PathBuf,
}

/// All circles of a crate: one between files that are subjects of their own is both, and told once.
#[must_use]
pub fn find(modules: &Modules) -> Vec<Circle> {
    let mut circles = between_files(modules);
    for circle in between_subjects(modules) {
        if !circles.contains(&circle) {
            circles.push(circle);
        }
    }
    circles
}

/// The circles between the files of a crate.
#[must_use]
pub fn between_files(modules: &Modules) -> Vec<Circle> {
    between(modules, |file| Some(file.to_owned()))
}

/// The circles between the subjects of a crate: the files and the folders beside its root. The root itself puts all together.
#[must_use]
pub fn between_subjects(modules: &Modules) -> Vec<Circle> {
    let root = modules.0.first().map(|root| root.file.as_path());
    let folder = root.and_then(Path::parent);
    between(modules, |file| {
        let inside = file.strip_prefix(folder?).ok().filter(|_| Some(file) != root)?;
        Some(Path::new(inside.components().next()?.as_os_str()).with_extension(""))
    })
}

/// The circles between places, each of which holds some files.
fn between(modules: &Modules, place_of: impl Fn(&Path) -> Option<PathBuf>) -> Vec<Circle> {
    let mut uses: BTreeMap<(PathBuf, PathBuf), Use> = BTreeMap::new();
    for ((user, used), first) in self::uses(modules) {
        if let (Some(user), Some(used)) = (place_of(user), place_of(used))
            && user != used
        {
            uses.entry((user, used)).or_insert(first);
        }
    }
    let places: Vec<&Path> = uses.keys().map(|(user, _)| user.as_path()).collect();
    let used_by = |place: &&Path| {
        uses.keys().filter(|(user, _)| user == place).map(|(_, used)| used.as_path()).collect::<Vec<_>>()
    };
    let mut circles: Vec<Circle> = strongly_connected_components(&places, used_by)
        .into_iter()
        .filter(|places| places.len() > 1)
        .map(|places| {
            let is_inside = |(user, used): &(PathBuf, PathBuf)| {
                places.contains(&user.as_path()) && places.contains(&used.as_path())
            };
            let uses = uses.iter().filter(|(ends, _)| is_inside(ends));
            Circle { uses: uses.map(|(_, first)| first.clone()).collect() }
        })
        .collect();
    circles.sort_by(|a, b| a.uses.cmp(&b.uses));
    circles
}

fn uses(modules: &Modules) -> BTreeMap<(&Path, &Path), Use> {
    let mut uses: BTreeMap<(&Path, &Path), Use> = BTreeMap::new();
    for (id, module) in modules.0.iter().enumerate() {
        for mention in &module.mentions {
            let Some(used) = modules.file_of(id, &mention.path) else { continue };
            if used == module.file || modules.is_inside(id, used) {
                continue;
            }
            let found = Use {
                user: module.file.clone(),
                line: mention.line,
                path: mention.path.join("::"),
                used: used.to_owned(),
            };
            let first = uses.entry((&module.file, used)).or_insert_with(|| found.clone());
            if found.line < first.line {
                *first = found;
            }
        }
    }
    uses
}

impl Circle {
    /// For people, with file names from `folder` on.
    #[must_use]
    pub fn text(&self, folder: &Path) -> String {
        let folder = folder.canonicalize().unwrap_or_default();
        let short = |path: &Path| path.strip_prefix(&folder).unwrap_or(path).display().to_string();
        let line = |each: &Use| {
            format!("  {}:{} uses {} of {}", short(&each.user), each.line, each.path, short(&each.used))
        };
        let lines: Vec<String> = self.uses.iter().map(line).collect();
        format!("circle of imports:\n{}", lines.join("\n"))
    }
}
