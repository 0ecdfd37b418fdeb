//! Every transition by its name; the files beside this one have what else a door does, `tests_any` what holds whatever happens.

use super::machine::{NO_FRAMES_S, SEEN, SETTLED_S, SURE};
use super::transition::name;
use super::*;
use crate::geometry::Point;
use crate::site::Site;
use crate::site::door::tests::DOOR as SITE;

#[path = "tests_any.rs"]
mod any;
#[path = "tests_leaf.rs"]
mod leaf;
#[path = "tests_people.rs"]
mod people;
#[path = "tests_restart.rs"]
mod restart;
#[path = "tests_rules.rs"]
mod rules;
#[path = "tests_site.rs"]
mod site;

const ALICE: Card = Card(0xa11ce);
const BOB: Card = Card(0xb0b);

/// A door and what stands before it.
struct Stage {
    door: Machine,
    now_s: f64,
    bodies: Vec<Body>,
    trouble: Option<Trouble>,
    actions: Vec<Action>,
    transitions: Vec<(Phase, Cause, Phase)>,
}

impl Stage {
    fn with(site: &str) -> Self {
        let site = Site::parse("test", site).unwrap();
        let door = Machine::new(&site.doors[0], &site, 1).unwrap();
        let (bodies, actions, transitions) = (Vec::new(), Vec::new(), Vec::new());
        Self { door, now_s: 0.0, bodies, trouble: None, actions, transitions }
    }

    /// The process before ended with these alarms.
    fn after_restart(alarms: &[Alarm]) -> Self {
        let mut stage = Self::with(SITE);
        alarms.iter().for_each(|alarm| stage.door.resume(*alarm));
        stage.tell(Event::Time);
        stage
    }

    /// Well for two seconds, and shut.
    fn idle() -> Self {
        let mut stage = Self::with(SITE);
        stage.tell(Event::Contact(Contact::Shut));
        stage.wait(SETTLED_S + 0.2);
        assert_eq!(stage.door.phase(), Phase::Idle);
        stage
    }

    /// With this many people in the zone, and a card.
    fn asked(people: u64) -> Self {
        let mut stage = Self::idle();
        for id in 1..=people {
            stage.put(id, 0.4 * id as f64 - 0.8, 0.0);
        }
        stage.wait(0.3);
        stage.tell(Event::Card(ALICE));
        assert_eq!(stage.door.phase(), Phase::Asked);
        stage
    }

    fn checking(people: u64, number: u32) -> Self {
        let mut stage = Self::asked(people);
        stage.tell(Event::Number(number));
        assert_eq!(stage.door.phase(), Phase::Checking);
        stage
    }

    fn unlocked(people: u64) -> Self {
        let mut stage = Self::checking(people, people as u32);
        stage.wait(1.0);
        assert_eq!((stage.door.phase(), stage.door.lock()), (Phase::Unlocked, Lock::Unlocked));
        stage.tell(Event::Contact(Contact::Open));
        stage
    }

    fn closing(people: u64) -> Self {
        let mut stage = Self::unlocked(people);
        (1..=people).for_each(|id| stage.walk_in(id));
        assert_eq!((stage.door.phase(), stage.door.lock()), (Phase::Closing, Lock::Locked));
        stage
    }

    fn held_open() -> Self {
        let mut stage = Self::closing(1);
        stage.wait(6.5);
        assert_eq!(stage.door.phase(), Phase::HeldOpen);
        stage
    }

    fn put(&mut self, id: u64, x: f64, y: f64) {
        self.bodies.retain(|body| body.id != id);
        let velocity = Point::default();
        self.bodies.push(Body {
            id,
            at: Point::new(x, y),
            velocity,
            is_seen: true,
            presence: Presence::Person,
        });
    }

    fn walk_in(&mut self, id: u64) {
        for y in [0.6, 0.9, 1.05, 1.2, 1.5] {
            self.put(id, 0.0, y);
            self.wait(0.1);
        }
    }

    /// From beyond the line to the zone, for 0.8 s.
    fn walk_back(&mut self, id: u64) {
        let mut all = Vec::new();
        for y in [0.85, 0.75, 0.65, 0.55, 0.45, 0.35, 0.25, 0.15] {
            self.put(id, 0.0, y);
            self.bodies
                .iter_mut()
                .filter(|body| body.id == id)
                .for_each(|body| body.velocity = Point::new(0.0, -1.0));
            self.wait(0.1);
            all.append(&mut self.actions);
        }
        self.actions = all;
    }

    fn tell(&mut self, event: Event) {
        self.actions = self.door.step(event, self.now_s);
        self.transitions.extend(self.door.transitions());
    }

    fn seen(&self) -> Seen {
        let inside = self.bodies.iter().filter(|body| body.at.y < 1.0 && body.at.y > -1.0).count();
        let mut count_p = vec![0.0; inside + 1];
        count_p[inside] = 1.0;
        Seen { bodies: self.bodies.clone(), count_p, seen_share: 1.0, trouble: self.trouble }
    }

    /// Lets the tracker say what it sees for so long.
    fn wait(&mut self, seconds: f64) {
        let mut all = Vec::new();
        for _ in 0..(seconds / 0.1).round() as u32 {
            self.now_s += 0.1;
            let seen = self.seen();
            self.tell(Event::Seen(seen));
            all.append(&mut self.actions);
        }
        self.actions = all;
    }

    fn passage(&self) -> &Passage {
        let passage = |action: &Action| matches!(action, Action::Passage(_));
        match self.actions.iter().find(|action| passage(action)) {
            Some(Action::Passage(passage)) => passage,
            _ => panic!("no passage has ended: {:?}", self.actions),
        }
    }

    fn lock_orders(&self) -> Vec<LockOrder> {
        let order = |action: &Action| if let Action::Lock(order) = action { Some(*order) } else { None };
        self.actions.iter().filter_map(order).collect()
    }

    fn refusals(&self) -> Vec<Refusal> {
        let refusal = |action: &Action| if let Action::Refused(why) = action { Some(*why) } else { None };
        self.actions.iter().filter_map(refusal).collect()
    }
}

/// One test for each transition, and their names.
macro_rules! transitions {
    ($($name:ident: $stage:expr;)*) => {
        $(#[test]
        fn $name() {
            let stage: Stage = $stage;
            let wanted = stringify!($name).replace('_', "-");
            let taken: Vec<String> = stage.transitions.iter().map(|taken| name(*taken)).collect();
            assert_eq!(taken.last(), Some(&wanted), "{taken:?}");
        })*
        const TESTED: &[&str] = &[$(stringify!($name)),*];
    };
}

fn then(mut stage: Stage, happens: impl FnOnce(&mut Stage)) -> Stage {
    happens(&mut stage);
    stage
}

fn silence(stage: &mut Stage) {
    stage.now_s += NO_FRAMES_S + 0.1;
    stage.tell(Event::Time);
}

fn opens_and_one_goes_in(stage: &mut Stage) {
    stage.tell(Event::Contact(Contact::Open));
    stage.walk_in(9);
}

fn stays_open(stage: &mut Stage) {
    stage.tell(Event::Contact(Contact::Open));
    stage.wait(6.5);
}

fn again(card: Card) -> impl FnOnce(&mut Stage) {
    move |stage| stage.tell(Event::Card(card))
}

fn shuts(stage: &mut Stage) {
    stage.tell(Event::Contact(Contact::Shut));
    stage.wait(1.0);
}

fn alarmed() -> Stage {
    then(Stage::unlocked(1), again(ALICE))
}

transitions! {
    idle_card_asked: Stage::asked(1);
    idle_passed_back_alarmed: then(Stage::closing(1), |stage| {
        shuts(stage);
        stage.tell(Event::Card(ALICE));
    });
    idle_went_in_alarmed: then(Stage::idle(), opens_and_one_goes_in);
    idle_held_open_held_open: then(Stage::idle(), stays_open);
    idle_trouble_failed: then(Stage::idle(), silence);
    asked_number_checking: Stage::checking(1, 2);
    asked_timeout_idle: then(Stage::asked(1), |stage| stage.wait(31.0));
    asked_went_in_alarmed: then(Stage::asked(1), opens_and_one_goes_in);
    asked_held_open_held_open: then(Stage::asked(1), stays_open);
    asked_trouble_failed: then(Stage::asked(1), silence);
    checking_match_unlocked: Stage::unlocked(3);
    checking_mismatch_asked: then(Stage::checking(2, 1), |stage| stage.wait(4.2));
    checking_too_often_idle: then(Stage::checking(2, 1), |stage| {
        for _ in 0..2 {
            stage.wait(4.2);
            stage.tell(Event::Number(3));
        }
        stage.wait(4.2);
        assert_eq!(stage.passage().outcome, Outcome::Refused);
    });
    checking_went_in_alarmed: then(Stage::checking(2, 1), opens_and_one_goes_in);
    checking_held_open_held_open: then(Stage::asked(2), |stage| {
        stage.tell(Event::Contact(Contact::Open));
        stage.wait(4.0);
        stage.tell(Event::Number(1));
        stage.wait(2.5);
    });
    checking_trouble_failed: then(Stage::checking(2, 1), silence);
    unlocked_all_through_closing: Stage::closing(2);
    unlocked_timeout_closing: then(Stage::unlocked(1), |stage| stage.wait(8.0));
    unlocked_followed_alarmed: then(Stage::unlocked(1), |stage| {
        // Two people who were one track until the line.
        stage.put(1, 0.0, 0.95);
        stage.wait(0.1);
        stage.put(2, 0.3, 0.95);
        stage.wait(0.1);
        stage.put(1, 0.0, 1.2);
        stage.put(2, 0.3, 1.2);
        stage.wait(0.1);
        assert_eq!(stage.passage().alarm, Some(Alarm::Followed));
    });
    unlocked_ran_in_alarmed: then(Stage::unlocked(1), |stage| {
        stage.put(9, 0.0, -0.9);
        stage.wait(0.5);
        assert_eq!((stage.door.lock(), stage.passage().alarm), (Lock::Locked, Some(Alarm::RanIn)));
    });
    unlocked_turned_back_alarmed: then(Stage::unlocked(2), |stage| {
        stage.put(2, 0.0, -1.5);
        stage.wait(0.5);
        assert_eq!(stage.passage().alarm, Some(Alarm::TurnedBack));
    });
    unlocked_passed_back_alarmed: alarmed();
    unlocked_trouble_failed: then(Stage::unlocked(1), |stage| {
        stage.trouble = Some(Trouble::ModuleLost);
        stage.wait(0.1);
        assert_eq!((stage.door.lock(), stage.passage().outcome), (Lock::Locked, Outcome::Trouble));
    });
    closing_shut_idle: then(Stage::closing(2), |stage| {
        shuts(stage);
        let passage = stage.passage();
        assert_eq!((passage.outcome, passage.through.as_slice()), (Outcome::Complete, [1, 2].as_slice()));
    });
    closing_followed_alarmed: then(Stage::closing(1), |stage| {
        stage.put(2, 0.0, 0.5);
        stage.wait(0.1);
        stage.walk_in(2);
        assert_eq!(stage.door.lock(), Lock::Locked);
    });
    closing_turned_back_alarmed: then(Stage::closing(1), |stage| {
        stage.walk_back(1);
        assert_eq!(stage.passage().alarm, Some(Alarm::TurnedBack));
    });
    closing_passed_back_alarmed: then(Stage::closing(1), again(ALICE));
    closing_held_open_held_open: Stage::held_open();
    closing_trouble_failed: then(Stage::closing(1), silence);
    held_open_shut_idle: then(Stage::held_open(), |stage| {
        shuts(stage);
        assert_eq!(stage.passage().outcome, Outcome::HeldOpen);
    });
    held_open_followed_alarmed: then(Stage::held_open(), |stage| {
        stage.put(2, 0.0, 0.5);
        stage.wait(0.1);
        stage.walk_in(2);
    });
    held_open_went_in_alarmed: then(then(Stage::idle(), stays_open), |stage| stage.walk_in(2));
    held_open_turned_back_alarmed: then(Stage::held_open(), |stage| {
        // And stays there.
        stage.put(1, 0.0, 0.7);
        stage.wait(1.9);
        assert_eq!(stage.door.phase(), Phase::HeldOpen);
        stage.wait(0.3);
    });
    held_open_passed_back_alarmed: then(Stage::held_open(), again(ALICE));
    held_open_trouble_failed: then(Stage::held_open(), silence);
    alarmed_reset_idle: then(alarmed(), |stage| stage.tell(Event::Reset));
    alarmed_trouble_failed: then(alarmed(), silence);
    failed_recovered_idle: Stage::idle();
    failed_still_alarmed_alarmed: then(alarmed(), |stage| {
        silence(stage);
        stage.wait(SETTLED_S + 0.2);
    });
    failed_still_alarmed_held_open: then(Stage::held_open(), |stage| {
        silence(stage);
        stage.wait(SETTLED_S + 0.2);
    });
}

#[test]
fn every_transition_has_its_test() {
    let mut tested: Vec<String> = TESTED.iter().map(|name| name.replace('_', "-")).collect();
    let mut all: Vec<String> = TRANSITIONS.iter().map(|transition| name(*transition)).collect();
    tested.sort();
    all.sort();
    assert_eq!(tested, all);
}

#[test]
fn the_page_shows_every_transition_and_no_other() {
    let page = include_str!("../../../docs/door.md");
    let (_, rest) = page.split_once("<!-- transitions -->").unwrap();
    let (table, _) = rest.split_once("<!-- end: transitions -->").unwrap();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split('|').map(|cell| cell.trim().trim_matches('`')).collect();
        (cells.len() > 4 && cells[1] != "from" && !cells[1].starts_with('-')).then(|| cells[1..4].join("-"))
    };
    let rows: Vec<String> = table.lines().filter_map(row).collect();
    let all: Vec<String> = TRANSITIONS.iter().map(|transition| name(*transition)).collect();
    assert_eq!(rows, all);
    let drawn: Vec<String> = page
        .lines()
        .filter_map(|line| {
            let (from, rest) = line.trim().split_once(" --> ")?;
            let (to, causes) = rest.split_once(": ")?;
            let plain = |name: &str| name.replace('_', "-");
            Some(
                causes
                    .split(", ")
                    .map(|cause| format!("{}-{cause}-{}", plain(from), plain(to)))
                    .collect::<Vec<_>>(),
            )
        })
        .flatten()
        .collect();
    let sorted = |mut names: Vec<String>| {
        names.sort();
        names
    };
    assert_eq!(sorted(drawn), sorted(all), "the diagram");
}
