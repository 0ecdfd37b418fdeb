//! Where a body may go: not through walls, and unseen not to where no module sees.
//!
//! ```text
//!   ┃ wall of the site       · ─╳▶   no body passes
//!   ░ behind the background  · ─╳▶   an unseen body does not: it would have been seen to leave, or a closed door holds it
//!   ┄ entry                  · ─▶    a seen body crosses it to where a module sees, an unseen one if it stands open
//! ```

use super::model::{Part, RenderingModel};
use super::modules::Modules;
use super::openings::Openings;
use super::scan::Scan;
use crate::cells::Areas;
use crate::geometry::Point;
use crate::site::Site;
use crate::tracker::floor_plan::FloorPlan;
use crate::tracker::walls::Walls;

/// A body whose middle is nearer to an entry than this, m, would be in the leaf if a door were closed there: half of a
/// body's depth.
const NEAR_M: f64 = 0.15;

/// It is on its way through if it crosses the entry within this time, s, faster than this, m/s: half a slow walk.
pub const AHEAD_S: f64 = 1.0;
const LEAVING_MPS: f64 = 0.3;

/// One who is on the way in crosses an entry inwards within this time, s: at a slow walk of 0.5 m/s from 1.5 m before it.
const COMES_S: f64 = 3.0;

/// A step that is shorter crosses no wall and no entry unless one of its ends is beside it, m: what [`Walls::beside`] surely
/// holds on both sides.
const SHORT_M: f64 = 0.16;

/// Steps of a body that walks are mostly shorter from scan to scan, m: 3 m/s for 0.025 s.
const SMALL_M: f64 = 0.075;

/// Which entries a body may cross.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub enum Passage {
    /// None: it would be seen there.
    None,
    /// Those beyond which a module sees it.
    #[default]
    InView,
    /// Any: it was seen on its way through one.
    Through,
}

/// Where a body was when a scan last spoke for it, and where it went.
#[derive(Clone, Copy, Default, Debug)]
pub struct Sighting {
    /// The number of the enclosed zone it was in.
    pub inside: Option<usize>,
    /// Which entries it was about to cross.
    pub passage: Passage,
    /// Whether it was on its way in.
    pub comes_in: bool,
}

/// The floor plan of a site, the newest rays of its modules, and which entries stand open.
pub struct Terrain {
    pub plan: FloorPlan,
    pub modules: Modules,
    pub openings: Openings,
}

impl Terrain {
    pub fn of(site: &Site) -> Self {
        Self {
            plan: FloorPlan::of(site),
            modules: Modules::of(site.modules.len()),
            openings: Openings::default(),
        }
    }

    /// The ground while a scan is taken, which is not among those of `modules` meanwhile.
    pub fn ground<'a>(&'a self, model: RenderingModel, newest: &'a Scan) -> Ground<'a> {
        let guards = model.has(Part::Entries);
        let has_openings = model.has(Part::Openings);
        let FloorPlan { walls, enclosed, .. } = &self.plan;
        let openings = has_openings.then_some(&self.openings);
        Ground { walls, enclosed, guards, openings, modules: &self.modules, newest }
    }
}

/// The walls of the site, and what its modules see when nothing stands before them.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    pub walls: &'a Walls,
    /// Zones that people leave only by an entry.
    pub enclosed: &'a Areas,
    /// Whether entries stop bodies that no module sees.
    pub guards: bool,
    /// Entries that stand open, if they let an unseen body through.
    pub openings: Option<&'a Openings>,
    pub modules: &'a Modules,
    /// The scan that is being taken, which is not among those of `modules` meanwhile.
    pub newest: &'a Scan,
}

/// The ground for one body.
#[derive(Clone, Copy)]
pub struct Way<'a> {
    pub ground: Ground<'a>,
    pub passage: Passage,
    /// Whether no step that is shorter than [`SMALL_M`] is stopped.
    pub is_open: bool,
}

impl Way<'_> {
    /// The same for a body that is nowhere farther from a place than this, m.
    pub fn around(self, place: Point, radius_m: f64) -> Self {
        let Ground { walls, guards, .. } = self.ground;
        let is_free = || walls.are_farther(place, radius_m + SMALL_M);
        Self { is_open: !(guards && self.passage == Passage::None) && is_free(), ..self }
    }

    /// Whether a small step is not possible.
    pub fn stops(&self, from: Point, to: Point) -> bool {
        let off = to - from;
        let is_free = self.is_open && off.dot(off) < SMALL_M * SMALL_M;
        !is_free && self.ground.stops(from, to, self.passage)
    }
}

impl Ground<'_> {
    /// Whether a small step is not possible for a body.
    pub fn stops(&self, from: Point, to: Point, passage: Passage) -> bool {
        // Most steps are short and far from walls and entries.
        let (was_beside, is_beside) = (self.walls.beside(from), self.walls.beside(to));
        if !was_beside && !is_beside && (to - from).dot(to - from) < SHORT_M * SHORT_M {
            return self.guards && passage == Passage::None && self.leaves(from, to);
        }
        let crosses = self.walls.between(from, to);
        if (crosses && self.walls.wall_between(from, to))
            || (is_beside && self.touches_wall(to) && !(was_beside && self.touches_wall(from)))
        {
            return true;
        }
        match passage {
            _ if !self.guards => false,
            Passage::Through => false,
            Passage::InView => crosses && (!self.covers(to) || (self.comes_out(from, to) && !self.sees(to))),
            // People come in hidden behind others.
            Passage::None if crosses && self.walls.enters(from, to) => false,
            Passage::None => {
                crosses || (self.walls.stop(from, to) && !self.comes_up(to)) || self.leaves(from, to)
            }
        }
    }

    /// Where a body is that a scan has just spoken for, and where it goes.
    pub fn sighting(&self, at: Point, velocity: Point) -> Sighting {
        Sighting {
            inside: self.enclosed.around(at).next(),
            passage: self.passage(at, velocity),
            comes_in: self.walls.enters(at, at + velocity * COMES_S),
        }
    }

    fn passage(&self, at: Point, velocity: Point) -> Passage {
        let leads_out = velocity.length() > LEAVING_MPS
            && self.walls.entry_m(at) < NEAR_M
            && self.walls.between(at, at + velocity * AHEAD_S);
        if leads_out { Passage::Through } else { Passage::InView }
    }

    /// Whether the middle of a body cannot be at a place beside a wall or an entry, because half of it would be in a wall.
    fn touches_wall(&self, place: Point) -> bool {
        self.walls.entry_m(place) > NEAR_M
    }

    /// Whether it is the place of a body that stands before an entry, outside: the next step leads in.
    fn comes_up(&self, to: Point) -> bool {
        !self.enclosed.hold(to) && !self.touches_wall(to)
    }

    fn comes_out(&self, from: Point, to: Point) -> bool {
        self.enclosed.hold(from) && !self.enclosed.hold(to)
    }

    /// Whether a module sees a place now: no body stands before it.
    fn sees(&self, place: Point) -> bool {
        self.newest.sees(place) || self.modules.asked().any(|scan| scan.sees(place))
    }

    fn leaves(&self, from: Point, to: Point) -> bool {
        !self.covers(to) && self.covers(from)
    }

    /// Whether a module sees a place when nothing stands before it.
    fn covers(&self, place: Point) -> bool {
        self.modules.cover(place, self.newest)
    }
}

#[cfg(test)]
mod tests {
    use super::super::body::Body;
    use super::super::cloud::Cloud;
    use super::super::sample::Sample;
    use super::super::scan::Measured;
    use super::*;

    const SITE: &str = "[[zone]]\nname = 'a'\npolygon = [[0, -1], [2, -1], [2, 1], [0, 1]]\n\
        [[entry]]\nname = 'e'\nline = [[2, -1], [2, 1]]\nzone = 'a'\n\
        [[wall]]\npoints = [[0, 1], [2, 1]]";

    fn terrain(site: &str) -> Terrain {
        Terrain::of(&toml::from_str(site).unwrap())
    }

    /// A scan before a background at `reach_mm` all around.
    fn scan(reach_mm: u16) -> Scan {
        let mut scan = Scan::at_origin();
        scan.reach(reach_mm);
        scan
    }

    /// Whether a step along x or y is stopped; a background at `reach_mm` all around.
    fn stops(reach_mm: u16, from: Point, to: Point, passage: Passage) -> bool {
        let (terrain, scan) = (terrain(SITE), scan(reach_mm));
        terrain.ground(RenderingModel::default(), &scan).stops(from, to, passage)
    }

    #[test]
    fn a_body_in_view_crosses_an_entry_to_where_a_module_sees() {
        let (from, to) = (Point::new(1.95, 0.0), Point::new(2.05, 0.0));
        assert!(!stops(4000, from, to, Passage::InView));
        assert!(stops(4000, from, to, Passage::None));
    }

    #[test]
    fn a_hidden_body_leaves_by_an_entry_near_which_a_person_was_just_seen_to_leave() {
        let (at, to) = (Point::new(1.95, 0.0), Point::new(2.05, 0.0));
        let sample = Sample::new(at, Point::default(), Point::new(1.0, 0.0));
        let body = Body::begin(1, 5.0, Cloud::new(vec![sample], 0.0));
        let (mut terrain, scan) = (terrain(SITE), scan(4000));
        let leaves = |terrain: &Terrain, at_s| {
            !body.way(terrain.ground(RenderingModel::default(), &scan), at_s).stops(at, to)
        };
        assert!(!leaves(&terrain, 5.0));
        terrain.openings.note([to], 5.0);
        assert!(leaves(&terrain, 5.0));
        terrain.openings.note([], 9.0);
        assert!(!leaves(&terrain, 9.0));
    }

    #[test]
    fn a_hidden_body_comes_up_to_an_entry_and_in_step_by_step() {
        let mut x = 2.3;
        while x > 1.7 {
            let (from, to) = (Point::new(x, 0.0), Point::new(x - 0.03, 0.0));
            assert!(!stops(4000, from, to, Passage::None), "{x}");
            x -= 0.03;
        }
    }

    #[test]
    fn a_closed_door_holds_everybody_but_who_is_in_it() {
        let (from, to) = (Point::new(1.95, 0.0), Point::new(2.05, 0.0));
        assert!(stops(1900, from, to, Passage::InView));
        assert!(stops(1900, from, to, Passage::None));
        assert!(!stops(1900, from, to, Passage::Through));
    }

    #[test]
    fn no_body_leaves_an_enclosed_zone_into_the_shadow_of_another() {
        let terrain = terrain(&SITE.replace("1]]\n[[entry]]", "1]]\nenclosed = true\n[[entry]]"));
        let mut scan = scan(4000);
        let (inside, outside) = (Point::new(1.95, 0.0), Point::new(2.05, 0.0));
        for (measured, shadowed) in
            [(Measured::Hit(1.0), true), (Measured::Hit(1.9), false), (Measured::Free(4.0), false)]
        {
            scan.set(vec![measured; scan.beams()]);
            let ground = terrain.ground(RenderingModel::default(), &scan);
            assert_eq!(ground.stops(inside, outside, Passage::InView), shadowed, "{measured:?}");
            assert!(!ground.stops(outside, inside, Passage::InView), "people come in hidden behind others");
        }
    }

    #[test]
    fn an_open_way_stops_no_small_step_that_the_ground_would_not() {
        let (terrain, scan) = (terrain(SITE), scan(4000));
        let ground = terrain.ground(RenderingModel::default(), &scan);
        let way = |passage| Way { ground, passage, is_open: false };
        let mut open = 0;
        for number in 0..400 {
            let middle = Point::new(0.1 * f64::from(number % 20), 0.1 * f64::from(number / 20 - 10));
            let around = way(Passage::InView).around(middle, 0.1);
            open += i32::from(around.is_open);
            for turn in 0..12 {
                let from = middle + Point::towards(0.5 * f64::from(turn)) * 0.1;
                let to = from + Point::towards(0.7 * f64::from(turn)) * 0.07;
                assert_eq!(around.stops(from, to), way(Passage::InView).stops(from, to), "{from:?} {to:?}");
            }
            assert!(!way(Passage::None).around(middle, 0.1).is_open, "an unseen body crosses no entry");
        }
        assert!(open > 50 && open < 350, "{open} of 400");
    }

    #[test]
    fn no_body_passes_a_wall() {
        let (from, to) = (Point::new(1.0, 0.95), Point::new(1.0, 1.05));
        for passage in [Passage::None, Passage::InView, Passage::Through] {
            assert!(stops(4000, from, to, passage));
        }
    }
}
