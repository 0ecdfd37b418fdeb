//! The pipeline, by behaviour.

use super::*;
use crate::scan::ScanTime;
use crate::scan::{MAX_BEAMS, URG_04LX};
use std::boxed::Box;
use std::println;
use std::vec;
use std::vec::Vec;

fn urg() -> Geometry {
    Geometry::new(URG_04LX).unwrap()
}

fn configured() -> Box<Pipeline<MAX_BEAMS>> {
    let mut pipeline = Box::new(Pipeline::new());
    pipeline.configure(&urg(), Settings::URG_04LX, Fingerprint(1)).unwrap();
    pipeline
}

fn process<'p>(pipeline: &'p mut Pipeline<MAX_BEAMS>, ranges_mm: &[u16], sensor_ms: u64) -> &'p Judgement {
    let time = ScanTime { sensor_ms, ..ScanTime::default() };
    pipeline.process(&Scan { geometry: &urg(), ranges_mm, time })
}

fn learned() -> Box<Pipeline<MAX_BEAMS>> {
    let mut pipeline = configured();
    for scan in 0..60 {
        process(&mut pipeline, &[4000; 682], scan * 100);
    }
    pipeline
}

#[test]
fn everything_fits_in_48_kib() {
    let bytes = size_of::<Pipeline<MAX_BEAMS>>();
    println!("pipeline for {MAX_BEAMS} beams: {bytes} bytes; a candidate {}", size_of::<Candidate>());
    assert!(bytes <= 48 * 1024);
}

#[test]
fn learning_starts_by_itself_and_ends_with_version_one() {
    let mut pipeline = configured();
    for scan in 0..60 {
        let judgement = process(&mut pipeline, &[4000; 682], scan * 100);
        assert_eq!(judgement.background_version, 0);
        assert_eq!(judgement.sequence, scan as u32 + 1);
    }
    let judgement = process(&mut pipeline, &[4000; 682], 6000);
    assert_eq!((judgement.background_version, judgement.learning), (1, Learning::Idle));
}

#[test]
fn a_scan_of_another_geometry_is_counted_and_says_nothing_is_known() {
    let mut pipeline = learned();
    let other = Geometry::new(crate::scan::GeometryParts { last_step: 700, ..URG_04LX }).unwrap();
    let scan = Scan { geometry: &other, ranges_mm: &[4000; 657], time: ScanTime::default() };
    let judgement = pipeline.process(&scan);
    assert_eq!((judgement.background_version, judgement.candidates().len()), (0, 0));
    assert_eq!(judgement.unseen().first().map(|span| span.beams), Some(657));
    assert_eq!(pipeline.counters().foreign_scans, 1);
}

#[test]
fn the_missing_end_of_a_short_scan_is_unseen() {
    let mut pipeline = learned();
    let judgement = process(&mut pipeline, &[4000; 600], 6000);
    let [span] = judgement.unseen() else { panic!("one span") };
    assert_eq!((span.first_step, span.beams, span.near_mm), (644, 82, None));
    assert_eq!(pipeline.counters().short_scans, 1);
}

#[test]
fn a_sensor_larger_than_the_pipeline_is_refused() {
    let mut small = Pipeline::<100>::new();
    let refused = small.configure(&urg(), Settings::URG_04LX, Fingerprint(1)).unwrap_err();
    assert_eq!(refused, ConfigureError::TooManyBeams { beams: 682, room: 100 });
}

#[test]
fn beyond_twenty_four_the_narrow_and_the_far_become_unseen_spans() {
    let mut pipeline = learned();
    let mut ranges_mm = vec![4000; 682];
    // 30 things: every third one wide, ever farther.
    for thing in 0..30 {
        let beams = if thing % 3 == 0 { 15 } else { 5 };
        ranges_mm[thing * 22..thing * 22 + beams].fill(2500 + 30 * thing as u16);
    }
    let judgement = process(&mut pipeline, &ranges_mm, 6000);
    assert_eq!(judgement.candidates().len(), CANDIDATES);
    let steps: Vec<u16> = judgement.candidates().iter().map(|candidate| candidate.first_step).collect();
    assert!(steps.is_sorted());
    assert_eq!(judgement.candidates().iter().filter(|candidate| !candidate.narrow).count(), 10);
    let overflow: Vec<_> =
        judgement.unseen().iter().filter(|span| span.reason == UnseenReason::Overflow).collect();
    assert_eq!(overflow.len(), 6);
    let farthest_kept = judgement.candidates().iter().filter(|c| c.narrow).map(|c| c.near_mm).max();
    assert!(overflow.iter().all(|span| span.near_mm > farthest_kept && span.beams == 5));
    assert_eq!(pipeline.counters().candidates_over, 6);
}

#[test]
fn standing_is_timed_by_the_sensor_over_its_wrap_and_restart() {
    let mut pipeline = learned();
    let mut ranges_mm = vec![4000; 682];
    ranges_mm[300..340].fill(1500);
    for scan in 0..30 {
        process(&mut pipeline, &ranges_mm, 6000 + scan * 100);
    }
    assert_eq!(process(&mut pipeline, &ranges_mm, 9000).candidates()[0].static_ds, 30);
    // A restarted sensor and a long pause count as one period each.
    assert_eq!(process(&mut pipeline, &ranges_mm, 5).candidates()[0].static_ds, 31);
    assert_eq!(process(&mut pipeline, &ranges_mm, 900_000).candidates()[0].static_ds, 32);
}

#[test]
fn only_a_recent_report_can_be_absorbed_from() {
    let mut pipeline = learned();
    let mut ranges_mm = vec![4000; 682];
    ranges_mm[300..340].fill(1500);
    let sequence = process(&mut pipeline, &ranges_mm, 6000).sequence;
    let wish = Absorb { sequence, first_step: 344, last_step: 383, nearest_mm: 1400, farthest_mm: 1600 };
    let old = Absorb { sequence: sequence.wrapping_sub(ABSORB_AGE_SCANS + 1), ..wish };
    assert_eq!(pipeline.absorb(old), Err(AbsorbRefusal::Report));
    assert_eq!(pipeline.absorb(Absorb { sequence: sequence + 1, ..wish }), Err(AbsorbRefusal::Report));
    assert_eq!(pipeline.counters().absorbs_refused, 2);
    assert_eq!(pipeline.absorb(wish), Ok(40));
    let judgement = process(&mut pipeline, &ranges_mm, 6100);
    assert_eq!((judgement.candidates().len(), judgement.background_version), (0, 2));
}
