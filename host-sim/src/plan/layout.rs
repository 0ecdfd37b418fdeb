//! Layouts: the places, what is seen from them, and the best three choices that differ.
//!
//! ```text
//!   best first place, second best 1 m away, … ─▶ greedy after each ─▶ sorted by value ─▶ three that are not the same
//! ```

use rayon::prelude::*;

use super::choose::{Choice, Number};
use super::ground::Ground;
use super::places::places;
use super::seen::Seen;
use super::sight::{Sight, sight};
use super::{Mount, Task};
use crate::world;
use crate::world::scene::SceneError;
use crate::world::site::Module;

/// As many first places are tried: twice as many as layouts are wanted, as some lead to the same.
const FIRSTS: usize = 6;

/// First places are so far apart, m: nearer ones see nearly the same.
const APART_M: f64 = 1.0;

/// Layouts are the same if every module of one has one of the other so near, m: two steps along a wall.
const SAME_M: f64 = 0.5;

/// All that layouts of a task are chosen from.
#[derive(Clone, Debug)]
pub struct Survey {
    /// The cells, and the crowds.
    pub ground: Ground,
    /// Where a module could be; only places from which some cell is seen.
    pub places: Vec<Mount>,
    /// What is seen from each.
    pub sights: Vec<Sight>,
    /// What the modules that stay see.
    pub kept: Vec<Sight>,
    task: Task,
}

/// Some places, and what they are worth.
#[derive(Clone, PartialEq, Debug)]
pub struct Layout {
    /// Their numbers in [`Survey::places`], in the order of the choice.
    pub places: Vec<usize>,
    /// Their value with the modules that stay, 0 to 1.
    pub value: f64,
}

impl Survey {
    /// Looks from all places of a task.
    ///
    /// # Errors
    /// As [`Task::scene`].
    pub fn of(task: &Task) -> Result<Self, SceneError> {
        let ground = Ground::of(task)?;
        let things = world::things(&task.scene()?);
        let look = |place: &Mount| sight(task, &ground, &things, place);
        let all = places(task);
        let looks: Vec<(Mount, Sight)> = all.par_iter().map(|place| (*place, look(place))).collect();
        let sees = |(_, sight): &(Mount, Sight)| sight.empty.count() > 0;
        let (places, sights) = looks.into_iter().filter(sees).unzip();
        let mount = |module: &Module| Mount { pose: module.pose(), height_m: module.height_m };
        let kept = task.kept().map(|module| look(&mount(module))).collect();
        Ok(Self { ground, places, sights, kept, task: task.clone() })
    }

    /// The choice between the places.
    #[must_use]
    pub fn choice(&self) -> Choice<'_> {
        let mut kept = Seen::nothing(self.ground.bits());
        self.kept.iter().for_each(|sight| kept.add(sight));
        Choice { sights: &self.sights, kept, open: self.ground.open.count() }
    }

    /// These places as a layout.
    #[must_use]
    pub fn layout(&self, places: Vec<usize>) -> Layout {
        let choice = self.choice();
        let value = choice.value(choice.seen(&places).worth());
        Layout { places, value }
    }

    /// The best layouts found, at most `most` that differ, the best first.
    #[must_use]
    pub fn best(&self, number: Number, most: usize) -> Vec<Layout> {
        let choice = self.choice();
        let greedy = choice.greedy(&[], number);
        let number = Number::Exactly(greedy.len());
        let mut layouts = vec![self.layout(greedy)];
        if number != Number::Exactly(0) {
            let firsts = self.firsts(&choice);
            let after = |first: &usize| self.layout(choice.greedy(&[*first], number));
            layouts.extend(firsts.par_iter().map(after).collect::<Vec<_>>());
        }
        layouts.sort_by(|one, other| other.value.total_cmp(&one.value));
        let mut best: Vec<Layout> = Vec::new();
        for layout in layouts {
            if best.len() < most && !best.iter().any(|known| self.is_same(known, &layout)) {
                best.push(layout);
            }
        }
        best
    }

    /// The places that add most as the first, each apart from those before.
    fn firsts(&self, choice: &Choice<'_>) -> Vec<usize> {
        let mut gains: Vec<(usize, u64)> =
            self.sights.iter().map(|sight| choice.kept.gain(sight)).enumerate().collect();
        gains.sort_by_key(|(_, gain)| std::cmp::Reverse(*gain));
        let mut firsts: Vec<usize> = Vec::new();
        for (place, _) in gains {
            let is_apart = |first: &usize| self.distance_m(*first, place) >= APART_M;
            if firsts.len() < FIRSTS && firsts.iter().all(is_apart) {
                firsts.push(place);
            }
        }
        firsts
    }

    fn distance_m(&self, one: usize, other: usize) -> f64 {
        match (self.places.get(one), self.places.get(other)) {
            (Some(one), Some(other)) => (one.pose.at - other.pose.at).length(),
            _ => f64::INFINITY,
        }
    }

    fn is_same(&self, one: &Layout, other: &Layout) -> bool {
        let has_near = |from: &Layout, to: &Layout| {
            from.places
                .iter()
                .all(|place| to.places.iter().any(|near| self.distance_m(*place, *near) <= SAME_M))
        };
        has_near(one, other) && has_near(other, one)
    }

    /// The modules of a layout: those that stay, and the new ones, each with a name of its own.
    #[must_use]
    pub fn modules(&self, layout: &Layout) -> Vec<Module> {
        let mut modules: Vec<Module> = self.task.kept().cloned().collect();
        for place in layout.places.iter().filter_map(|place| self.places.get(*place)) {
            let is_taken = |name: &String| {
                self.task.site.places().any(|(_, known)| known == name)
                    || modules.iter().any(|module| module.name == *name)
            };
            let Some(name) = (1..).map(|number| format!("planned {number}")).find(|name| !is_taken(name))
            else {
                continue;
            };
            let Mount { pose, height_m } = *place;
            modules.push(Module {
                name,
                x: rounded(pose.at.x, 1e3),
                y: rounded(pose.at.y, 1e3),
                yaw_deg: rounded(pose.yaw_rad.to_degrees(), 10.0),
                height_m,
                upside_down: false,
                placed: true,
                furniture: Vec::new(),
            });
        }
        modules
    }
}

/// To a part of the unit; an installer measures in millimetres and tenths of degrees at best.
fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts
}
