//! A site that was edited while people are followed: what of the old one still holds.
//!
//! ```text
//!   before   left ●  right ●            zone hall ▭   zone study ▭
//!   now      left ●   right  ●  new ●   zone hall ▭   zone study ▱
//!            stands   moved     new     the same      cells where they were
//! ```

use super::{Module, Site};

/// A site, and the one before it.
#[derive(Clone, Copy, Debug)]
pub struct SiteChange<'a> {
    /// Until now.
    pub before: &'a Site,
    /// From now on.
    pub now: &'a Site,
}

impl<'a> SiteChange<'a> {
    /// The number before of a module that stands where it stood, by its number now. None if it is new or has moved: what
    /// was known by it of places does not hold any more.
    #[must_use]
    pub fn stands(&self, number: usize) -> Option<usize> {
        let module = self.now.modules.get(number)?;
        let before = self.number_before(module)?;
        let was = self.before.modules.get(before)?;
        (looks_alike(was, module) && was.placed == module.placed).then_some(before)
    }

    /// The same of each module, in the order of their numbers now.
    #[must_use]
    pub fn numbers_before(&self) -> Vec<Option<usize>> {
        (0..self.now.modules.len()).map(|number| self.stands(number)).collect()
    }

    /// The number now of the module that had this number before, wherever it stands. None if none has its name.
    #[must_use]
    pub fn number_now(&self, before: usize) -> Option<usize> {
        let was = self.before.modules.get(before)?;
        self.now.modules.iter().position(|module| module.name == was.name)
    }

    /// Modules that have moved: as they were, with their number then, and as they are.
    pub fn moved(&self) -> impl Iterator<Item = (usize, &'a Module, &'a Module)> {
        let Self { before, now } = *self;
        now.modules.iter().filter_map(move |module| {
            let number = self.number_before(module)?;
            let was = before.modules.get(number)?;
            // By one that was not placed nothing was known.
            (was.placed && (!looks_alike(was, module) || !module.placed)).then_some((number, was, module))
        })
    }

    fn number_before(&self, module: &Module) -> Option<usize> {
        self.before.modules.iter().position(|was| was.name == module.name)
    }
}

/// Whether what a module sees is where it was.
fn looks_alike(was: &Module, is: &Module) -> bool {
    was.pose() == is.pose() && was.upside_down == is.upside_down
}

#[cfg(test)]
mod tests {
    use super::*;

    fn site(modules: &[(&str, f64)]) -> Site {
        let module = |(name, x): &(&str, f64)| format!("[[module]]\nname = \"{name}\"\nx = {x:?}\ny = 0.0\n");
        toml::from_str(&modules.iter().map(module).collect::<String>()).unwrap()
    }

    #[test]
    fn a_module_stands_if_its_name_and_pose_are_the_same_whatever_its_number() {
        let before = site(&[("left", 0.0), ("right", 1.0), ("gone", 5.0)]);
        let mut now = site(&[("new", 3.0), ("left", 0.0), ("right", 1.5)]);
        now.modules[1].height_m = 0.9;
        let change = SiteChange { before: &before, now: &now };
        assert_eq!([0, 1, 2, 3].map(|number| change.stands(number)), [None, Some(0), None, None]);
        assert_eq!([0, 1, 2, 3].map(|number| change.number_now(number)), [Some(1), Some(2), None, None]);
        let mut turned = before.clone();
        turned.modules[0].upside_down = true;
        let over = SiteChange { before: &before, now: &turned };
        assert_eq!((over.stands(0), over.stands(1), over.moved().count()), (None, Some(1), 1));
        let moved: Vec<_> = change.moved().map(|(number, was, is)| (number, was.x, is.x)).collect();
        assert_eq!(moved, [(1, 1.0, 1.5)]);
    }
}
