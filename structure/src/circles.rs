//! Circles of imports between the files of a crate.
//!
//! ```text
//!   scene.rs:12 uses variation.rs          each file of a circle needs all others to be understood,
//!   variation.rs:7 uses scene.rs           so the circle is one file cut in pieces
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

/// Files that use each other, by whatever way round.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Circle {
    /// Its uses, sorted; each of its files is the user of one and the used of another.
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

/// The circles of a crate.
#[must_use]
pub fn find(modules: &Modules) -> Vec<Circle> {
    let uses = uses(modules);
    let files: Vec<&Path> = uses.keys().map(|(user, _)| *user).collect();
    let used_by = |file: &&Path| {
        uses.keys().filter(|(user, _)| user == file).map(|(_, used)| *used).collect::<Vec<_>>()
    };
    let mut circles: Vec<Circle> = strongly_connected_components(&files, used_by)
        .into_iter()
        .filter(|files| files.len() > 1)
        .map(|files| {
            let inside = |ends: &(&Path, &Path)| files.contains(&ends.0) && files.contains(&ends.1);
            Circle {
                uses: uses.iter().filter(|(ends, _)| inside(ends)).map(|(_, first)| first.clone()).collect(),
            }
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
