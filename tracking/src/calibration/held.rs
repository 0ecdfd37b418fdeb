//! A calibration that leaves another module in its place than the first.
//!
//! ```text
//!   walk of 0 1 2 ─▶ walk of 2 1 0 ─▶ module 0 held ─▶ poses of 2 1 0 ─▶ poses of 0 1 2
//! ```
//!
//! Everything else here holds module 0, so that the held one and the first change numbers on the way in, and back on the way out.

use std::borrow::Cow;

use super::room::Outline;
use super::upside_down;
use super::walk::Walk;
use super::{Calibration, Hang, Refusal, align, calibrate};
use crate::geometry::Pose;

/// The module that stays in its place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// Its number; never a floor's.
    pub module: usize,
    /// Its place.
    pub pose: Pose,
}

impl Held {
    /// As [`calibrate`].
    ///
    /// # Errors
    /// As [`calibrate`].
    pub fn calibrate(&self, walk: &Walk, rooms: &[Option<Outline>]) -> Result<Calibration, Refusal> {
        let mut rooms = rooms.to_vec();
        self.change(&mut rooms);
        let mut found =
            calibrate(&self.walk(walk), self.pose, &rooms).map_err(|refusal| self.refusal(refusal))?;
        self.change(&mut found.modules);
        for pair in &mut found.pairs {
            let (one, other) = self.pair(pair.modules);
            pair.modules = (one.min(other), one.max(other));
        }
        found.pairs.sort_by_key(|pair| pair.modules);
        Ok(found)
    }

    /// First poses of all modules, as [`align::all`].
    ///
    /// # Errors
    /// As [`align::all`].
    pub fn align(&self, walk: &Walk) -> Result<Vec<Pose>, Refusal> {
        let poses = align::all(&self.walk(walk), self.pose);
        let mut poses = poses.map_err(|refusal| self.refusal(refusal))?;
        self.change(&mut poses);
        Ok(poses)
    }

    /// How all modules hang, as [`upside_down::find`]: this one as it is observed.
    #[must_use]
    pub fn hangs(&self, walk: &Walk) -> Vec<Hang> {
        let mut hangs = upside_down::find(&self.walk(walk));
        self.change(&mut hangs);
        hangs
    }

    fn walk<'a>(&self, walk: &'a Walk) -> Cow<'a, Walk> {
        if self.module == 0 { Cow::Borrowed(walk) } else { Cow::Owned(walk.with_first(self.module)) }
    }

    /// The number of a module on the other side.
    const fn number(&self, module: usize) -> usize {
        if module == self.module {
            0
        } else if module == 0 {
            self.module
        } else {
            module
        }
    }

    const fn pair(&self, (one, other): (usize, usize)) -> (usize, usize) {
        (self.number(one), self.number(other))
    }

    /// A list by module as the other side has it.
    fn change<T>(&self, list: &mut [T]) {
        if self.module < list.len() {
            list.swap(0, self.module);
        }
    }

    fn refusal(&self, refusal: Refusal) -> Refusal {
        match refusal {
            Refusal::Apart { module } => Refusal::Apart { module: self.number(module) },
            Refusal::Short { modules, common_s } => Refusal::Short { modules: self.pair(modules), common_s },
            Refusal::Narrow { modules, spread_m } => {
                Refusal::Narrow { modules: self.pair(modules), spread_m }
            }
            Refusal::Contradiction { modules, share } => {
                Refusal::Contradiction { modules: self.pair(modules), share }
            }
            Refusal::Vague { module, within_m, within_rad } => {
                Refusal::Vague { module: self.number(module), within_m, within_rad }
            }
            Refusal::Alone | Refusal::Unsolved | Refusal::SiteChanged => refusal,
        }
    }
}
