//! Loads of a member of the group: the objects and bodies are those of the scenes of the same names.
//!
//! ```text
//!             front_m
//!         ┌─────────────┐        heading ▲
//!         │  pushchair  │
//!         └─────────────┘
//!             ( person )◀─ side_m ─▶
//!              back_m
//! ```

use crate::world::body::Body;
use crate::world::prop::Carried;
use crate::world::scene::{PersonSpec, Scene};
use crate::world::visit::{DOOR_Y_M, Habit};

/// A thing that comes through the door with a person.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Load {
    /// The person sits in it.
    Wheelchair,
    /// In tow, behind and to the right.
    Suitcase,
    /// Pushed ahead.
    Pushchair,
}

/// Half the width of the area before the door, less a hand's breadth to the modules on its walls, m.
const HALF_AREA_M: f64 = 0.85;

/// Gap between a load and the closed leaf, m.
const BEFORE_LEAF_M: f64 = 0.15;

/// A load, as its scene describes it.
#[derive(Clone, Debug)]
pub struct Loaded {
    person: PersonSpec,
    /// Its parts, in the frame of the person.
    pub parts: Vec<Carried>,
    /// How far it reaches ahead of the person's middle, m.
    pub front_m: f64,
    /// How far it reaches behind, m.
    pub back_m: f64,
    /// How far it reaches to the farther side, m.
    pub side_m: f64,
}

impl Load {
    const fn scene(self) -> &'static str {
        match self {
            Self::Wheelchair => "wheelchair",
            Self::Suitcase => "suitcase",
            Self::Pushchair => "pushchair",
        }
    }

    /// Reads it from its scene.
    ///
    /// # Errors
    /// The built-in scene is broken, in one line.
    pub fn read(self) -> Result<Loaded, String> {
        let scene = Scene::load(self.scene()).map_err(|error| error.to_string())?;
        let person = scene.people.into_iter().next().ok_or("the load's scene has no person")?;
        let parts = scene.carried;
        let corners = || {
            parts
                .iter()
                .flat_map(|part| part.polygon.iter().map(move |[x, y]| (part.ahead_m + x, part.left_m + y)))
        };
        let most = |of: fn((f64, f64)) -> f64| corners().map(of).fold(0.0, f64::max);
        let (front_m, back_m, side_m) = (most(|(x, _)| x), most(|(x, _)| -x), most(|(_, y)| y.abs()));
        Ok(Loaded { person, parts, front_m, back_m, side_m })
    }
}

impl Loaded {
    /// The body of the person with this load.
    #[must_use]
    pub fn body(&self, own: Body) -> Body {
        Body {
            section: self.person.section,
            half_width_m: self.person.half_width_m.unwrap_or(own.half_width_m),
            half_depth_m: self.person.half_depth_m.unwrap_or(own.half_depth_m),
            ..own
        }
    }

    /// `habit`, reduced to the places with room for the load.
    pub(crate) fn room(&self, habit: &Habit) -> Habit {
        let side_m = (HALF_AREA_M - self.side_m).max(0.0);
        let ahead_m = DOOR_Y_M - BEFORE_LEAF_M - self.front_m;
        Habit {
            x: (habit.x.0.max(-side_m), habit.x.1.min(side_m)),
            y: (habit.y.0, habit.y.1.min(ahead_m)),
            ..*habit
        }
    }
}
