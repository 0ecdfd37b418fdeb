//! Names of those that a walk places: modules first, floors behind them.

/// Names of the modules and of the floors behind them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names {
    /// All.
    pub all: Vec<String>,
    /// How many are modules; the others are floors.
    pub modules: usize,
}

impl Names {
    /// That of a module or a floor.
    #[must_use]
    pub fn of(&self, module: usize) -> &str {
        self.all.get(module).map_or("a module", String::as_str)
    }

    pub(super) const fn is_floor(&self, module: usize) -> bool {
        module >= self.modules
    }

    /// Whether one of two is a floor.
    pub(super) fn has_floor(&self, (one, other): (usize, usize)) -> bool {
        self.is_floor(one.max(other))
    }

    /// Those of two; a floor comes second.
    pub(super) fn pair(&self, (one, other): (usize, usize)) -> (&str, &str) {
        (self.of(one.min(other)), self.of(one.max(other)))
    }
}
