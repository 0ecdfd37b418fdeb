//! Frames of a depth camera that say nothing, from their files to the host: each is counted and told, and none says *empty*.

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

use kehai_depth::device::FanSource;
use kehai_depth::frame::Frame;
use kehai_depth::source::{self, write_png};
use kehai_tracking::occupancy::ZoneKnown;
use kehai_tracking::site_tracker::SiteTracker;

use super::live::LOW;
use super::pacing::{COME_S, IN_S, Source, entrance, plan, site};
use super::{CAMERA, Entrance};
use crate::baselines::Choice;
use crate::run::unit::{Plan, Unit};

/// Frames of an empty entrance, of a person in it, that say nothing, and of the person again.
const EMPTY: usize = 100;
const BEFORE: usize = 40;
const BLIND: usize = 50;
const AFTER: usize = 25;

/// The zone of a source that sees nothing is unknown within so long, s.
const UNKNOWN_S: f64 = 3.0;

/// Writes the frames into a folder: those that say nothing are torn, of another size, all zero, and saturated.
fn record(folder: &std::path::Path) {
    let (empty, person) = (Entrance::pacing(0, EMPTY), entrance(1));
    let first = ((IN_S - COME_S) * f64::from(CAMERA.frames_per_s)) as usize;
    let flat = |width: usize, value_mm: u16| {
        Frame::new(width, CAMERA.height, vec![value_mm; width * CAMERA.height], 0).unwrap()
    };
    let shot = |entrance: &Entrance, number: usize| entrance.shot(number).unwrap().frame;
    for number in 0..EMPTY + BEFORE + BLIND + AFTER {
        let file = folder.join(format!("{number:04}.png"));
        let walked = first + number.saturating_sub(EMPTY) % 50;
        let is_blind = (EMPTY + BEFORE..EMPTY + BEFORE + BLIND).contains(&number);
        let frame = match number % 4 {
            _ if number < EMPTY => shot(&empty, number),
            1 if is_blind => flat(CAMERA.width / 2, 3000),
            2 if is_blind => flat(CAMERA.width, 0),
            3 if is_blind => flat(CAMERA.width, u16::MAX),
            _ => shot(&person, walked),
        };
        write_png(&file, &frame).unwrap();
        if is_blind && number % 4 == 0 {
            let whole = std::fs::read(&file).unwrap();
            std::fs::write(&file, &whole[..whole.len() / 3]).unwrap();
        }
    }
}

#[test]
fn frames_that_say_nothing_are_counted_and_told_and_leave_the_zone_unknown() {
    let folder = std::env::temp_dir().join(format!("kehai-blind-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    record(&folder);
    let told = Arc::new(Mutex::new(Vec::new()));
    let said = Arc::clone(&told);
    let source = FanSource::new(
        source::open(&folder, &LOW).unwrap(),
        LOW,
        entrance(1).background().unwrap(),
        Box::new(move |bad| said.lock().unwrap().push(bad.to_string())),
    );
    let (config, counts, sizes) = (source.config(), source.counts(), source.sizes());
    let name = "camera".to_owned();
    let mut unit = Unit::new(Plan { name, amend: Some(sizes), ..plan(Box::new(source), config) });
    let mut site_tracker = SiteTracker::new(&Arc::new(site(Source::Camera).unwrap()), Choice::default());
    let (mut before, mut last, mut blind_s, mut unknown) = (None, None, None, 0);
    for tenth in 1..600_u64 {
        let now_s = tenth as f64 * 0.1;
        for (at_us, bytes) in unit.advance(tenth * 100_000).unwrap() {
            site_tracker.receive(&bytes, at_us);
        }
        let zone = site_tracker.estimate(now_s).zones.remove("entrance").unwrap();
        let (good, bad) = (counts.good.load(Ordering::Relaxed), counts.bad.load(Ordering::Relaxed));
        if bad == 0 {
            before = zone.count();
            continue;
        }
        let since_s = now_s - *blind_s.get_or_insert(now_s);
        assert_ne!(zone.count(), Some(0), "{since_s:.1} s after the first bad frame: {zone:?}");
        if bad < BLIND as u64 && since_s > UNKNOWN_S {
            assert_eq!(zone.state(), ZoneKnown::Unknown, "{since_s:.1} s: {zone:?}");
            unknown += 1;
        }
        last = zone.count();
        if good + bad == (EMPTY + BEFORE + BLIND + AFTER) as u64 {
            break;
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
    assert_eq!(before, Some(1), "the person is counted before");
    assert!(unknown > 50, "{unknown} lines");
    assert_eq!(last, Some(1), "the person is found again");
    let good = counts.good.load(Ordering::Relaxed);
    assert_eq!(good, (EMPTY + BEFORE + AFTER) as u64);
    assert_eq!(counts.bad.load(Ordering::Relaxed), BLIND as u64);
    let told = told.lock().unwrap();
    assert_eq!(told.len(), BLIND, "one line each");
    for (line, number) in told.iter().zip(EMPTY + BEFORE..) {
        let why = ["is torn or no PNG", "is 160 × 240 pixels", "no pixel has a depth", "end of the scale"];
        let says = line.contains(&format!("{number:04}.png: ")) && line.contains(why[number % 4]);
        assert!(says && !line.contains('\n'), "{line}");
    }
}
