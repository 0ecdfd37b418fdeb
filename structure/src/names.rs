//! Which file defines what a path stands for.
//!
//! ```text
//!   crate::a::Item --> root has module a --> a hands on `Item` from c::Item --> defined in a/c.rs
//! ```
//!
//! Source: *The Rust Reference*, "Paths" and "Use declarations". Names of other crates, of the prelude, of
//! generics and of local variables resolve to nothing.

use std::collections::BTreeSet;
use std::path::Path;

use crate::modules::{ModuleId, Modules, Name};

enum Found {
    Module(ModuleId),
    /// Defined in this module.
    ItemOf(ModuleId),
}

/// The place of a segment in its path: what follows a `::` is inside of a module.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Place {
    Inside,
    Last,
}

/// Names that are being resolved: two modules may import all of each other.
type Open = BTreeSet<(ModuleId, String)>;

impl Modules {
    /// The file that defines what `path` stands for in `module`; none for a module itself.
    pub(crate) fn file_of(&self, module: ModuleId, path: &[String]) -> Option<&Path> {
        match self.resolve(module, path, &mut Open::new())? {
            Found::ItemOf(module) => Some(&self.0[module].file),
            Found::Module(_) => None,
        }
    }

    fn resolve(&self, module: ModuleId, path: &[String], open: &mut Open) -> Option<Found> {
        let mut found = Found::Module(module);
        for (index, segment) in path.iter().enumerate() {
            let place = if index + 1 == path.len() { Place::Last } else { Place::Inside };
            found = match (found, segment.as_str()) {
                // What is named inside of an item is written where the item is.
                (item @ Found::ItemOf(_), _) => return Some(item),
                (Found::Module(_), "crate") => Found::Module(0),
                (same @ Found::Module(_), "self") => same,
                (Found::Module(of), "super") => Found::Module(self.0[of].parent?),
                (Found::Module(of), name) => self.look_up(of, name, place, open)?,
            };
        }
        Some(found)
    }

    fn look_up(&self, module: ModuleId, name: &str, place: Place, open: &mut Open) -> Option<Found> {
        if !open.insert((module, name.to_owned())) {
            return None;
        }
        let found = self.look_up_own(module, name, place, open).or_else(|| {
            self.0[module].globs.iter().find_map(|glob| match self.resolve(module, glob, open)? {
                Found::Module(of) => self.look_up(of, name, place, open),
                Found::ItemOf(_) => None,
            })
        });
        open.remove(&(module, name.to_owned()));
        found
    }

    fn look_up_own(&self, module: ModuleId, name: &str, place: Place, open: &mut Open) -> Option<Found> {
        let names = self.0[module].names.get(name)?;
        let item = || names.iter().any(|name| matches!(name, Name::Item)).then_some(Found::ItemOf(module));
        let child = || {
            names.iter().find_map(|name| match name {
                Name::Module(child) => Some(Found::Module(*child)),
                _ => None,
            })
        };
        let mut alias = || {
            names.iter().find_map(|name| match name {
                Name::Alias(path) => self.resolve(module, path, open),
                _ => None,
            })
        };
        // `use serde::serde;` names a module or a crate first, not itself.
        match place {
            Place::Inside => child().or_else(alias).or_else(item),
            Place::Last => item().or_else(&mut alias).or_else(child),
        }
    }
}
