//! Which modules hang head down: such a module sees the mirror image of the walk that the others see.
//!
//! ```text
//!   by the others  ╭──╮       upright  ╭──╮      head down  ╭──╮     no turn and no shift lays a walk upon its mirror
//!                  │  ╰─               │  ╰─               ─╯  │     image, unless it goes along one straight line
//! ```
//!
//! For each pair of modules both are tried. The walk decides where one of them fits well and the other at least
//! `CLEARLY` times worse; from the first module on, along the pairs that say it most clearly, every module follows. Where
//! none decides, a module hangs as the site has it. A floor lies on its back in every building.

use super::align::apart_m;
use super::limits::LEAST_S;
use super::result::Hang;
use super::walk::{By, Walk};

/// How much farther apart two walks are that are laid upon each other the wrong way: bodies are a few centimetres apart the
/// right way, and a mirrored walk is off by twice what it is wide.
const CLEARLY: f64 = 2.0;

/// The right way two modules see a walker no farther apart than this, m: half of what still counts as one walker.
const FITS_M: f64 = 0.125;

/// One pair of modules.
struct Tried {
    modules: (usize, usize),
    /// Whether they hang differently.
    differ: bool,
    right_m: f64,
    wrong_m: f64,
}

impl Tried {
    fn ratio(&self) -> f64 {
        self.wrong_m / self.right_m.max(1e-3)
    }
}

/// How all modules hang, the first one being as it is observed.
#[must_use]
pub fn find(walk: &Walk) -> Vec<Hang> {
    let mut found = vec![Hang::default(); walk.modules()];
    let beams: Vec<bool> =
        (0..walk.modules()).map(|module| walk.measures(module) == Some(By::Beams)).collect();
    let pairs = walk.pairs().into_iter().filter(|((one, other), common_s)| {
        *common_s >= LEAST_S && [one, other].iter().all(|module| beams.get(**module) == Some(&true))
    });
    let tried: Vec<Tried> = pairs.filter_map(|(modules, _)| tried(walk, modules)).collect();
    let mut known = vec![false; walk.modules()];
    if let Some(first) = known.first_mut() {
        *first = true;
    }
    let is_known = |known: &[bool], module: usize| known.get(module) == Some(&true);
    loop {
        let open =
            tried.iter().filter(|pair| is_known(&known, pair.modules.0) != is_known(&known, pair.modules.1));
        let Some(pair) = open.max_by(|a, b| a.ratio().total_cmp(&b.ratio())) else { return found };
        let (from, to) = match pair.modules {
            (one, other) if is_known(&known, one) => (one, other),
            (one, other) => (other, one),
        };
        let turned = found.get(from).is_some_and(|from| from.turned) != pair.differ;
        if let (Some(hang), Some(known)) = (found.get_mut(to), known.get_mut(to)) {
            *hang = Hang { turned, apart_m: Some((pair.right_m, pair.wrong_m)) };
            *known = true;
        }
    }
}

/// Both ways, if one is clearly right.
fn tried(walk: &Walk, modules: (usize, usize)) -> Option<Tried> {
    let [same_m, other_m] = [false, true].map(|mirrored| apart_m(walk, modules, mirrored));
    let (same_m, other_m) = (same_m?, other_m?);
    let differ = other_m < same_m;
    let (right_m, wrong_m) = if differ { (other_m, same_m) } else { (same_m, other_m) };
    let pair = Tried { modules, differ, right_m, wrong_m };
    (pair.ratio() >= CLEARLY && right_m <= FITS_M).then_some(pair)
}
