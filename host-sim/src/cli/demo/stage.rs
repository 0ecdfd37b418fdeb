//! Where a demo plays: the rooms of a scene, or the entrance with every kind of source.

use std::error::Error;
use std::net::SocketAddr;
use std::path::Path;

use host_sim::building::Building;
use host_sim::entrance::gate::{self, Gate};
use host_sim::entrance::tags;
use host_sim::world::scene::{BUILT_IN, Scene};
use kehai_tracking::geometry::Point;
use kehai_tracking::site::Site;

/// What the entrance is called.
const ENTRANCE: &str = "entrance";

/// A person as the demo knows it.
pub struct Person {
    /// Where, m.
    pub at: Point,
    /// What the person's tag says.
    pub tag: Option<String>,
}

/// The place, with everything switched on.
pub enum Stage {
    Scene(Box<Scene>, Box<Building>),
    Entrance(Box<Gate>),
}

impl Stage {
    /// Switches on what is called so.
    ///
    /// # Errors
    /// There is no such scene, or a fault in it; no port or thread is available.
    pub fn start(name: &str, seed: Option<u64>) -> Result<Self, Box<dyn Error>> {
        if name == ENTRANCE {
            return Ok(Self::Entrance(Box::new(Gate::start(seed.unwrap_or(1))?)));
        }
        if BUILT_IN.iter().all(|(known, _)| *known != name) && !Path::new(name).exists() {
            let known: Vec<&str> = BUILT_IN.iter().map(|(known, _)| *known).collect();
            return Err(format!(
                "there is no scene \"{name}\": give a scene's FILE.toml, or one of {ENTRANCE}, {}",
                known.join(", ")
            )
            .into());
        }
        let scene = Scene::load(name)?;
        let building = Building::announced(&scene, seed.unwrap_or(scene.seed))?;
        Ok(Self::Scene(Box::new(scene), Box::new(building)))
    }

    /// What it is, in a sentence.
    pub fn about(&self) -> &str {
        match self {
            Self::Scene(scene, _) => &scene.about,
            Self::Entrance(_) => gate::ABOUT,
        }
    }

    pub fn site(&self) -> &Site {
        match self {
            Self::Scene(scene, _) => &scene.site,
            Self::Entrance(gate) => gate.site(),
        }
    }

    /// Where its devices listen.
    pub fn addresses(&self) -> Vec<SocketAddr> {
        let listed = match self {
            Self::Scene(_, building) => building.modules(),
            Self::Entrance(gate) => gate.devices().listed(),
        };
        listed.iter().map(|(_, address)| *address).collect()
    }

    /// How many of its devices announce themselves: floors do not.
    pub fn announced(&self) -> usize {
        self.addresses().len() - self.site().floors.len()
    }

    /// Time since it began, s.
    pub fn now_s(&self) -> f64 {
        match self {
            Self::Scene(_, building) => building.now_s(),
            Self::Entrance(gate) => gate.devices().now_s(),
        }
    }

    /// When it ends, s.
    pub fn duration_s(&self) -> f64 {
        match self {
            Self::Scene(_, building) => building.world().duration_s(),
            Self::Entrance(gate) => gate.duration_s(),
        }
    }

    /// The people now.
    pub fn people(&self) -> Vec<Person> {
        match self {
            Self::Scene(_, building) => {
                let people = building.world().truth(building.now_s()).people;
                people.iter().map(|one| Person { at: Point::new(one.x, one.y), tag: None }).collect()
            }
            Self::Entrance(gate) => {
                let people = gate.people_at(gate.devices().now_s());
                people.iter().map(|one| Person { at: one.at, tag: tags::tag(one.person) }).collect()
            }
        }
    }
}
