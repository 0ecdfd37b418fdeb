//! Who comes through the entrance, and when.
//!
//! ```text
//!   each direction: parties by a Poisson process ─┬─ alone ─────────── now and then stops, and puts the bag down
//!                                                 ├─ two adults ────── side by side, somewhat staggered
//!                                                 └─ adult and child ─ the same, slower
//! ```
//!
//! Statures of adults: 1.65 ± 0.09 m, both sexes (AIST body dimension database, 1991–92: 1.71 and 1.59 m); children from 0.9 m on.

use crate::world::random::{Purpose, Stream};

/// Parties of one direction, in a second: so that the number of people at a time is the paper's.
const PARTIES_PER_S: f64 = 0.08;

/// Share of the parties that are two adults, and that are an adult with a child.
const PAIRS: f64 = 0.25;
const FAMILIES: f64 = 0.2;

/// Share of those who walk alone, who are children.
const CHILDREN: f64 = 0.03;

/// Share of the people with a bag, and of those who stop on the way.
const BAGS: f64 = 0.4;
const STOPS: f64 = 0.15;

/// Distances from the camera at which people pass, m.
const LANES_M: (f64, f64) = (1.3, 4.3);

/// Two who walk together are so far apart, side by side and along the way, m.
const BESIDE_M: (f64, f64) = (0.55, 0.75);
const STAGGER_M: (f64, f64) = (0.0, 0.35);

/// Which way a party goes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Way {
    /// Towards positive y, to the camera's left.
    Left,
    /// Towards negative y.
    Right,
}

impl Way {
    /// Sign of the velocity's y.
    #[must_use]
    pub const fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// A stop on the way.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Stop {
    /// Where, along y, m.
    pub y_m: f64,
    /// How long, s.
    pub lasts_s: f64,
}

/// A person of the run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Role {
    /// Number in the run.
    pub person: u16,
    /// When the person comes, s.
    pub from_s: f64,
    /// Which way.
    pub way: Way,
    /// Distance from the camera, m.
    pub lane_m: f64,
    /// How far behind the first of the party, m.
    pub behind_m: f64,
    /// Wanted speed, m/s.
    pub speed_mps: f64,
    /// m
    pub stature_m: f64,
    /// Half the torso's width and depth at a stature of 1.7 m, m.
    pub half_axes_m: (f64, f64),
    /// Whether there is a bag.
    pub has_bag: bool,
    /// A stop; the bag stands on the floor meanwhile.
    pub stop: Option<Stop>,
}

/// Everybody of a run that lasts `until_s`, in the order of their coming.
#[must_use]
pub fn cast(seed: u64, until_s: f64) -> Vec<Role> {
    let mut roles = Vec::new();
    for (number, way) in [Way::Left, Way::Right].into_iter().enumerate() {
        let mut stream = Stream::new(seed, Purpose::Entrance, [0, number as u64]);
        let mut at_s = 0.0;
        loop {
            at_s += -libm::log(1.0 - stream.uniform()) / PARTIES_PER_S;
            if at_s >= until_s {
                break;
            }
            party(at_s, way, &mut stream, &mut roles);
        }
    }
    roles.sort_by(|one, other| one.from_s.total_cmp(&other.from_s));
    for (number, role) in roles.iter_mut().enumerate() {
        role.person = number as u16;
    }
    roles
}

/// Adds a party.
fn party(from_s: f64, way: Way, stream: &mut Stream, roles: &mut Vec<Role>) {
    let kind = stream.uniform();
    let (is_pair, is_family) = (kind < PAIRS, (PAIRS..PAIRS + FAMILIES).contains(&kind));
    let is_child = !is_pair && !is_family && stream.chance(CHILDREN);
    let speed_mps =
        if is_family { stream.between(0.6, 0.9) } else { (1.0 + 0.2 * stream.normal()).clamp(0.6, 1.6) };
    let adult_m = |stream: &mut Stream| (1.65 + 0.09 * stream.normal()).clamp(1.45, 1.9);
    let child_m = |stream: &mut Stream| stream.between(0.9, 1.3);
    let first_m = if is_child { child_m(stream) } else { adult_m(stream) };
    let mut role = Role {
        person: 0,
        from_s,
        way,
        lane_m: stream.between(LANES_M.0, LANES_M.1),
        behind_m: 0.0,
        speed_mps,
        stature_m: first_m,
        half_axes_m: (stream.between(0.20, 0.25), stream.between(0.12, 0.16)),
        has_bag: !is_child && stream.chance(BAGS),
        stop: None,
    };
    if !is_pair && !is_family && stream.chance(STOPS) {
        role.stop = Some(Stop { y_m: stream.between(-1.0, 1.0), lasts_s: stream.between(1.5, 5.0) });
    }
    roles.push(role);
    if is_pair || is_family {
        let side = if role.lane_m > 0.5 * (LANES_M.0 + LANES_M.1) { -1.0 } else { 1.0 };
        roles.push(Role {
            lane_m: role.lane_m + side * stream.between(BESIDE_M.0, BESIDE_M.1),
            behind_m: stream.between(STAGGER_M.0, STAGGER_M.1),
            stature_m: if is_family { child_m(stream) } else { adult_m(stream) },
            half_axes_m: (stream.between(0.20, 0.25), stream.between(0.12, 0.16)),
            has_bag: is_pair && stream.chance(BAGS),
            ..role
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_party_comes_from_both_sides() {
        let all: Vec<Role> = (0..20).flat_map(|seed| cast(seed, 170.0)).collect();
        assert_eq!(all, (0..20).flat_map(|seed| cast(seed, 170.0)).collect::<Vec<_>>());
        for way in [Way::Left, Way::Right] {
            let own = || all.iter().filter(|role| role.way == way);
            assert!(own().any(|role| role.stature_m < 1.2) && own().any(|role| role.behind_m > 0.0));
            assert!(own().any(|role| role.has_bag && role.stop.is_some()));
        }
        assert!(all.iter().all(|role| (0.5..5.0).contains(&role.lane_m) && role.stature_m >= 0.9));
    }
}
