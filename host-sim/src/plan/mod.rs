//! Where modules are to be mounted: places on the walls of a site, what they see with people standing about, and what the
//! simulator says of the best layouts.
//!
//! ```text
//!   site ─┬▶ places      every 0.25 m along walls, and corners   ┐
//!         └▶ ground      cells of the zones × sampled crowds     ├▶ sight ─▶ choose ─▶ the best three layouts
//!                                                                ┘                          │
//!   people who come in, walk and stand (`visit`) ─▶ simulator ─▶ share of exact counts (`expect`) ─▶ report, site file
//! ```
//!
//! Coverage by sensors with people in the way is submodular: what a further module adds is the less, the more are there. So the
//! greedy choice is at least 1 − 1/e of the best (Nemhauser, Wolsey and Fisher, "An analysis of approximations for maximizing
//! submodular set functions", 1978), and in rooms nearer than that.

pub mod bits;
pub mod choose;
pub mod expect;
pub mod ground;
pub mod layout;
pub mod places;
pub mod report;
pub mod rooms;
pub mod sample;
pub mod seen;
pub mod sight;
pub mod visit;

use crate::world::geometry::Pose;
use crate::world::optics::SensorModel;
use crate::world::scene::{Scene, SceneError};
use crate::world::site::Site;

/// What is planned.
#[derive(Clone, Debug)]
pub struct Task {
    /// Walls, zones and entries; with the modules that stay.
    pub site: Site,
    /// The sensor of every module.
    pub model: SensorModel,
    /// The scanning planes of new modules above the floor, m.
    pub height_m: f64,
    /// Share of the light that clothes give back: how far a person is seen depends on it.
    pub clothes: f64,
    /// People on the site.
    pub people: usize,
    /// Seed of the sampled crowds.
    pub seed: u64,
}

/// The least reflectance of the ordinary clothes of simulated people: [`crate::world::body::Body::random`].
pub const ORDINARY_CLOTHES: f64 = 0.55;

impl Task {
    /// The site as a scene without people and modules.
    ///
    /// # Errors
    /// None that a site which was read could have.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let mut scene = Scene::parse("plan", "[site]\n")?;
        scene.site = Site { modules: Vec::new(), ..self.site.clone() };
        Ok(scene)
    }
}

/// A place where a module can be mounted.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mount {
    /// Position and direction of the front step.
    pub pose: Pose,
    /// The scanning plane above the floor, m.
    pub height_m: f64,
}
