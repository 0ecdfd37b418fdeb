//! A pressure floor in a site, datagram by datagram: people are counted, and a floor that falls silent leaves its zone
//! *unknown*, never *empty*.
#![allow(missing_docs, reason = "a test program")]

#[path = "intake/tracker.rs"]
mod tracker;

use std::sync::Arc;

use kehai::floor::{Bits, Fault, READING_US};
use kehai::wire::{
    DATAGRAM_MAX, FaultyPanel, Identity, Info, List, Message, ModuleId, Pressed, ReportHead, Subscribed,
};
use kehai_tracking::alarm::AlarmKind;
use kehai_tracking::occupancy::{ZoneKnown, ZoneLine};
use kehai_tracking::session::subscription::Subscription;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use proptest::prelude::*;
use tracker::tracker;

const SITE: &str = "[[floor]]\nname = \"mat\"\nx = 0\ny = 0\ncolumns = 24\nrows = 24\n
    [[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1.92, 0], [1.92, 1.92], [0, 1.92]]\ncount = true\n";

/// Between two lines, µs.
const LINE_US: u64 = 100_000;

const fn device(number: u8) -> ModuleId {
    ModuleId([2, 0, 0, 0, 0, number])
}

/// A floor, a host that follows it, and their one time. The device's clock is that of the host.
struct Rig {
    site_tracker: SiteTracker,
    identity: Identity,
    sequence: u32,
}

impl Rig {
    fn new(site: &str) -> Self {
        let site = Arc::new(Site::parse("test.toml", site).unwrap());
        Self {
            site_tracker: SiteTracker::new(&site, tracker()),
            identity: Identity { module: device(1), boot: 1 },
            sequence: 0,
        }
    }

    fn receive(&mut self, message: &Message<'_>, now_us: u64) {
        let mut bytes = [0; DATAGRAM_MAX];
        let length = message.encode(self.identity, &mut bytes).unwrap();
        assert!(self.site_tracker.receive(&bytes[..length], now_us).is_none(), "a floor has no scans");
    }

    /// What a device answers once it is asked.
    fn meet(&mut self, name: &str, now_us: u64) {
        let info = Info {
            request_id: 1,
            version_min: 1,
            version_max: 1,
            firmware: "",
            build: "",
            board: "",
            name,
            uptime_us: 0,
            setup: 1,
            background_version: 0,
            sensor: None,
        };
        self.receive(&Message::Info(info), now_us);
        let subscribed = Subscribed {
            request_id: 2,
            t1: now_us.to_le_bytes(),
            t2_us: now_us,
            t3_us: now_us,
            lease_ms: 5000,
            may_control: false,
            subscribers: 1,
        };
        self.receive(&Message::Subscribed(subscribed), now_us);
    }

    /// A reading of a mat of 24 rows and so many columns, made at `at_us`.
    fn press_on(&mut self, columns: u8, down: &[usize], at_us: u64, now_us: u64) {
        let mut bits = Bits::default();
        down.iter().for_each(|panel| bits.set(*panel, true));
        self.sequence += 1;
        let head = ReportHead { sequence: self.sequence, setup: 1, stamp_us: at_us, ..ReportHead::default() };
        let bytes = bits.bytes(usize::from(columns) * 24);
        let pressed = Pressed { head, columns, rows: 24, down: List::new(bytes), faulty: List::new(&[]) };
        self.receive(&Message::Pressed(pressed), now_us);
    }

    fn press(&mut self, down: &[usize], faulty: &[FaultyPanel], now_us: u64) {
        let mut bits = Bits::default();
        down.iter().for_each(|panel| bits.set(*panel, true));
        self.sequence += 1;
        let head =
            ReportHead { sequence: self.sequence, setup: 1, stamp_us: now_us, ..ReportHead::default() };
        let pressed = Pressed {
            head,
            columns: 24,
            rows: 24,
            down: List::new(bits.bytes(576)),
            faulty: List::new(faulty),
        };
        self.receive(&Message::Pressed(pressed), now_us);
    }

    fn hall(&mut self, at_us: u64) -> ZoneLine {
        self.site_tracker.estimate(at_us as f64 * 1e-6).zones["hall"].clone()
    }
}

/// The panels under a walker to and fro along x, from 0.6 to 1.3 m: a step of 0.35 m every 0.5 s, both feet down for 0.1 s.
fn soles(at_us: u64) -> Vec<usize> {
    let (step, into_us) = (at_us / 500_000, at_us % 500_000);
    let foot = |step: u64| {
        let along = [0_usize, 1, 2, 1][(step % 4) as usize];
        let (column, row) = (7 + along * 4, if step.is_multiple_of(2) { 10 } else { 13 });
        (0..3).map(move |toe| row * 24 + column + toe)
    };
    let mut down: Vec<usize> = foot(step).collect();
    if into_us < 100_000 && step > 0 {
        down.extend(foot(step - 1));
    }
    down
}

#[test]
fn a_person_on_the_floor_is_counted_and_one_who_has_left_is_not() {
    let mut rig = Rig::new(SITE);
    rig.meet("mat", 1000);
    let mut counts = Vec::new();
    for reading in 1..=120_u64 {
        let at_us = reading * READING_US;
        // Empty for 3.3 s, then a person, and empty again.
        let down = if (30..90).contains(&reading) { soles(at_us) } else { Vec::new() };
        rig.press(&down, &[], at_us);
        let hall = rig.hall(at_us + 10_000);
        counts.push((hall.state(), hall.count()));
    }
    assert_eq!(counts[0], (ZoneKnown::Unknown, None), "no person can have been found yet");
    assert_eq!(counts[20], (ZoneKnown::Known, Some(0)), "nothing pressed is not silence");
    for reading in [40, 50, 60, 70, 80, 88] {
        assert_eq!(counts[reading], (ZoneKnown::Known, Some(1)), "reading {reading}");
    }
    assert_eq!(counts[110], (ZoneKnown::Known, Some(0)));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Whenever the floor is unplugged while a person walks on it, no line says that the hall is empty, and within 3 s
    /// all of it is unknown; when it comes back, no person is missing either.
    #[test]
    fn a_floor_that_is_unplugged_is_unknown_within_3_s_and_never_empty(
        unplugged_us in 3_000_000_u64..12_000_000,
        away_us in 0_u64..6_000_000,
        phase_us in 0_u64..LINE_US,
    ) {
        let mut rig = Rig::new(SITE);
        rig.meet("mat", 1000);
        let back_us = unplugged_us + away_us;
        let (mut reading, mut line) = (1, 1);
        loop {
            let (reading_us, line_us) = (reading * READING_US, line * LINE_US + phase_us);
            if line_us > back_us + 4_000_000 {
                break;
            }
            if reading_us <= line_us {
                if !(unplugged_us..back_us).contains(&reading_us) {
                    rig.press(&soles(reading_us), &[], reading_us);
                }
                reading += 1;
                continue;
            }
            line += 1;
            let hall = rig.hall(line_us);
            prop_assert_ne!(hall.count(), Some(0), "at {} µs of {}: {:?}", line_us, unplugged_us, hall);
            if (unplugged_us + 3_000_000..back_us).contains(&line_us) {
                prop_assert_eq!(hall.state(), ZoneKnown::Unknown);
                prop_assert!(rig.site_tracker.estimate(line_us as f64 * 1e-6).tracks.is_empty());
            }
        }
        // After a gap of half a second this walker, whose left foot always comes down at one place, is in one of some
        // five hundred taken for two, of whom one walks on the spot there.
        prop_assert!(rig.hall(line * LINE_US).count() >= Some(1), "found again");
    }
}

#[test]
fn a_panel_that_does_not_work_is_not_known_to_be_empty_and_is_named() {
    let mut rig = Rig::new(SITE);
    rig.site_tracker.sessions_mut().meet(device(1), &Subscription::default(), 0);
    rig.meet("mat", 1000);
    let dead: Vec<FaultyPanel> =
        (0..32).map(|panel| FaultyPanel { panel: panel * 18, fault: Fault::Dead }).collect();
    let stuck = [FaultyPanel { panel: 49, fault: Fault::Stuck }];
    for reading in 1..=30_u64 {
        rig.press(&[], if reading < 20 { &stuck } else { &dead }, reading * READING_US);
        let line = rig.site_tracker.sessions_mut().get_mut(device(1)).unwrap().line(
            "mat",
            &[],
            reading * READING_US,
        );
        let alarms = line.unwrap().alarms;
        let panels = alarms.iter().find(|alarm| alarm.kind == AlarmKind::Panels).expect("an alarm");
        let wanted =
            if reading < 20 { "always down: (1, 2):" } else { "never down: (0, 0), (18, 0), (12, 1)" };
        assert!(panels.text.contains(wanted), "{}", panels.text);
        let hall = rig.hall(reading * READING_US);
        if reading == 18 {
            let share = hall.seen_share();
            assert!((0.98..1.0).contains(&share), "one cell of a hundred: {share}");
        } else if reading >= 20 {
            // Those of 32 dead panels are not seen any more.
            assert_eq!((hall.state(), hall.count()), (ZoneKnown::Partly, None), "{}", hall.seen_share());
        }
    }
}

#[test]
fn where_the_list_of_faulty_panels_is_full_nothing_behind_it_is_known() {
    let mut rig = Rig::new(SITE);
    rig.site_tracker.sessions_mut().meet(device(1), &Subscription::default(), 0);
    rig.meet("mat", 1000);
    // Half of the panels, those above row 11, are stuck: the first 32 are named.
    let named: Vec<FaultyPanel> =
        (0..32).map(|panel| FaultyPanel { panel: 288 + panel, fault: Fault::Stuck }).collect();
    for reading in 1..=60_u64 {
        rig.press(&[], &named, reading * READING_US);
    }
    let hall = rig.hall(60 * READING_US);
    assert_eq!((hall.state(), hall.count()), (ZoneKnown::Partly, None));
    assert!(hall.seen_share() < 0.51, "{}", hall.seen_share());
    assert_eq!(rig.site_tracker.floors()[0].unknown_from, Some(320), "the map shows it");
}

#[test]
fn where_panels_stop_working_under_a_person_the_zone_is_not_empty() {
    let mut rig = Rig::new(SITE);
    rig.meet("mat", 1000);
    // A reading before any that counts, and five seconds of one person.
    let stands: Vec<usize> =
        [10, 13].iter().flat_map(|row| (0..3).map(move |toe| row * 24 + 11 + toe)).collect();
    (1..=45_u64).for_each(|reading| rig.press(&stands, &[], reading * READING_US));
    let hall = rig.hall(45 * READING_US);
    assert_eq!((hall.state(), hall.count()), (ZoneKnown::Known, Some(1)));
    // Now nothing is known from row 9 on, where the person stands.
    let stopped: Vec<FaultyPanel> =
        (0..32).map(|panel| FaultyPanel { panel: 216 + panel, fault: Fault::Dead }).collect();
    for reading in 46..=80_u64 {
        rig.press(&[], &stopped, reading * READING_US);
        for tenth in 0..2 {
            let hall = rig.hall(reading * READING_US + tenth * 50_000);
            assert_ne!(hall.count(), Some(0), "reading {reading}: {}", hall.seen_share());
        }
    }
}

#[test]
fn what_is_down_and_does_not_work_is_no_foot() {
    let mut rig = Rig::new(SITE);
    rig.meet("mat", 1000);
    let down: Vec<usize> =
        [10, 13].iter().flat_map(|row| (0..3).map(move |toe| row * 24 + 11 + toe)).collect();
    let stuck: Vec<FaultyPanel> =
        down.iter().map(|panel| FaultyPanel { panel: *panel as u16, fault: Fault::Stuck }).collect();
    (1..=45_u64).for_each(|reading| rig.press(&down, &stuck, reading * READING_US));
    assert!(rig.site_tracker.estimate(5.0).tracks.is_empty());
    let floors = rig.site_tracker.floors();
    assert_eq!((floors[0].down.len(), floors[0].stuck.len()), (0, 6));
}

#[test]
fn a_panel_that_works_again_is_seen_once_a_foot_on_it_would_have_been_found() {
    let mut rig = Rig::new(SITE);
    rig.site_tracker.sessions_mut().meet(device(1), &Subscription::default(), 0);
    rig.meet("mat", 1000);
    let unread = [FaultyPanel { panel: 300, fault: Fault::Dead }];
    let share = |rig: &mut Rig, reading: u64| rig.hall(reading * READING_US).seen_share();
    (1..=60_u64).for_each(|reading| rig.press(&[], &unread, reading * READING_US));
    assert!(share(&mut rig, 60) < 1.0);
    (61..=68_u64).for_each(|reading| rig.press(&[], &[], reading * READING_US));
    assert!(share(&mut rig, 68) < 1.0, "not within a second");
    (69..=70_u64).for_each(|reading| rig.press(&[], &[], reading * READING_US));
    assert_eq!(share(&mut rig, 70), 1.0);
}

#[test]
fn a_floor_of_another_size_is_not_used_and_says_so() {
    let mut rig = Rig::new(&SITE.replace("columns = 24", "columns = 20"));
    rig.site_tracker.sessions_mut().meet(device(1), &Subscription::default(), 0);
    rig.meet("mat", 1000);
    for reading in 1..=20_u64 {
        rig.press(&soles(reading * READING_US), &[], reading * READING_US);
    }
    assert_eq!(rig.hall(20 * READING_US).state(), ZoneKnown::Unknown);
    assert_eq!(rig.site_tracker.sessions().drops().unplaced, 20);
    let line = rig
        .site_tracker
        .sessions_mut()
        .get_mut(device(1))
        .unwrap()
        .line("mat", &[], 20 * READING_US)
        .unwrap();
    let kinds: Vec<AlarmKind> = line.alarms.iter().map(|alarm| alarm.kind).collect();
    assert!(kinds.contains(&AlarmKind::FloorSize), "{kinds:?}");
}

#[test]
fn numbers_of_people_are_never_used_again_when_the_floor_is_moved() {
    let mut rig = Rig::new(SITE);
    rig.meet("mat", 1000);
    let mut ids = Vec::new();
    for reading in 1..=90_u64 {
        let at_us = reading * READING_US;
        rig.press(&soles(at_us), &[], at_us);
        if reading == 45 {
            ids.extend(rig.site_tracker.estimate(at_us as f64 * 1e-6).tracks.iter().map(|track| track.id));
            let moved = SITE.replace("x = 0\n", "x = 0.1\n");
            rig.site_tracker.change_site(&Arc::new(Site::parse("test.toml", &moved).unwrap()));
            assert_eq!(rig.hall(at_us).state(), ZoneKnown::Unknown);
        }
    }
    let after = rig.site_tracker.estimate(90.0 * READING_US as f64 * 1e-6).tracks;
    assert_eq!((ids.len(), after.len()), (1, 1));
    assert!(after[0].id > ids[0], "{} after {}", after[0].id, ids[0]);
}
#[test]
fn readings_that_are_lost_make_no_second_body() {
    for lost in 1..=4 {
        for first in 30..60 {
            let mut rig = Rig::new(SITE);
            rig.meet("mat", 1000);
            for reading in (1..=120).filter(|reading| !(first..first + lost).contains(reading)) {
                rig.press(&soles(reading * READING_US), &[], reading * READING_US);
            }
            let hall = rig.hall(120 * READING_US);
            assert_eq!(hall.count(), Some(1), "{lost} lost from {first}");
        }
    }
}

/// Two mats side by side, as if the panels of `SITE` were those of both.
const TWO: &str = "[[floor]]\nname = \"west\"\nx = 0\ny = 0\ncolumns = 12\nrows = 24\n
    [[floor]]\nname = \"east\"\nx = 0.96\ny = 0\ncolumns = 12\nrows = 24\n
    [[zone]]\nname = \"hall\"\npolygon = [[0, 0], [1.92, 0], [1.92, 1.92], [0, 1.92]]\ncount = true\n";

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Two mats are read at different times, and each reading takes up to 100 ms: a person who walks from one to the other is one.
    #[test]
    fn the_order_in_which_readings_arrive_changes_no_count(
        late_us in prop::collection::vec(0_u64..100_000, 240),
        between_us in 0_u64..READING_US,
    ) {
        let mut rig = Rig::new(TWO);
        for (mat, name) in [(1, "west"), (2, "east")] {
            rig.identity.module = device(mat);
            rig.meet(name, 1000);
        }
        let mut arrivals: Vec<(u64, u64, usize)> = late_us
            .iter()
            .enumerate()
            .map(|(number, late_us)| {
                let (reading, mat) = (number as u64 / 2 + 1, number % 2);
                let at_us = reading * READING_US + if mat == 1 { between_us } else { 0 };
                (at_us + late_us, at_us, mat)
            })
            .collect();
        arrivals.sort_unstable();
        let mut sequences = [0; 2];
        for (now_us, at_us, mat) in arrivals {
            rig.identity.module = device(mat as u8 + 1);
            sequences[mat] += 1;
            rig.sequence = sequences[mat] - 1;
            let on_mat = |panel: &usize| (panel % 24 / 12 == mat).then(|| panel / 24 * 12 + panel % 12);
            let down: Vec<usize> = soles(at_us).iter().filter_map(on_mat).collect();
            rig.press_on(12, &down, at_us, now_us);
            if now_us > 4_000_000 {
                let hall = rig.hall(now_us);
                prop_assert_eq!(hall.count(), Some(1), "at {} µs: {:?}", now_us, hall);
            }
        }
    }

    /// Whatever a device that poses as a floor says.
    #[test]
    fn no_reading_is_a_panic(
        columns in any::<u8>(),
        rows in any::<u8>(),
        down in prop::collection::vec(any::<u8>(), 0..128),
        faulty in prop::collection::vec((any::<u16>(), any::<bool>()), 0..32),
        stamps_us in prop::collection::vec(0_u64..20_000_000, 1..20),
    ) {
        let mut rig = Rig::new(SITE);
        rig.meet("mat", 1000);
        let faulty: Vec<FaultyPanel> = faulty
            .iter()
            .map(|(panel, stuck)| {
                FaultyPanel { panel: *panel, fault: if *stuck { Fault::Stuck } else { Fault::Dead } }
            })
            .collect();
        for (number, stamp_us) in (0..).zip(&stamps_us) {
            let head = ReportHead { sequence: number, setup: 1, stamp_us: *stamp_us, ..ReportHead::default() };
            let (down, faulty) = (List::new(&down), List::new(&faulty));
            let mut bytes = [0; DATAGRAM_MAX];
            let pressed = Message::Pressed(Pressed { head, columns, rows, down, faulty });
            if let Ok(length) = pressed.encode(rig.identity, &mut bytes) {
                rig.site_tracker.receive(&bytes[..length], 1_000_000);
            }
            rig.hall(1_000_000 + u64::from(number) * LINE_US);
        }
    }
}
