//! What must hold for any scans at all: no panic, the same twice, and never "empty" where nothing was seen.

use kehai::background::{Absorb, BeamProfile, BeamState, Class, Fingerprint, LearnRequest};
use kehai::candidate::CANDIDATES;
use kehai::pipeline::{Judgement, Pipeline, Settings};
use kehai::scan::{Geometry, GeometryParts, Scan, ScanTime};
use kehai::unseen::UNSEEN_SPANS;
use kehai::visibility::seen_empty;
use proptest::collection::vec;
use proptest::prelude::*;

const BEAMS: usize = 200;
/// Range at which the model detects black clothing in these tests.
const OPEN_MM: u16 = 2500;

fn geometry(cluster: u16) -> Geometry {
    Geometry::new(GeometryParts {
        first_step: 10,
        last_step: 9 + cluster * BEAMS as u16,
        cluster,
        front_step: 512,
        steps_per_turn: 1024,
        period_us: 100_000,
        range_min_mm: 20,
        range_max_mm: 5600,
    })
    .unwrap()
}

/// Every kind of value, the interesting ones often.
fn value() -> impl Strategy<Value = u16> {
    prop_oneof![
        4 => 20u16..5600,
        2 => 0u16..20,
        1 => Just(0u16),
        1 => Just(19u16),
        1 => Just(u16::MAX),
        1 => any::<u16>(),
    ]
}

/// A room: runs of walls and openings, some of which flicker between two ranges.
#[derive(Clone, Debug)]
struct Room {
    runs: Vec<(usize, u16, u16, u8)>,
}

fn room() -> impl Strategy<Value = Room> {
    vec((1usize..40, value(), value(), 0u8..4), 1..20).prop_map(|runs| Room { runs })
}

impl Room {
    /// Ranges of the room alone in scan `scan`, with reproducible noise.
    fn scan(&self, scan: usize) -> Vec<u16> {
        let beams = self
            .runs
            .iter()
            .cycle()
            .flat_map(|&(beams, one, two, often)| (0..beams).map(move |_| (one, two, often)));
        let noisy = beams.take(BEAMS).enumerate().map(|(beam, (one, two, often))| {
            let flickers = often > 0 && (scan * 7 + beam * 13) % 4 < usize::from(often);
            let value = if flickers { two } else { one };
            if (20..5600).contains(&value) { value + ((scan * 31 + beam * 17) % 9) as u16 } else { value }
        });
        noisy.collect()
    }
}

/// Something put into a scan: where, how wide, at which range.
type Thing = (usize, usize, u16);

fn with_things(mut ranges_mm: Vec<u16>, things: &[Thing]) -> Vec<u16> {
    for &(first, beams, value_mm) in things {
        ranges_mm.iter_mut().skip(first).take(beams).for_each(|range_mm| *range_mm = value_mm);
    }
    ranges_mm
}

fn things() -> impl Strategy<Value = Vec<Thing>> {
    vec((0..BEAMS, 1usize..30, value()), 0..30)
}

fn process<'p>(
    pipeline: &'p mut Pipeline<BEAMS>,
    geometry: &Geometry,
    ranges_mm: &[u16],
    scan: u64,
) -> &'p Judgement {
    let time = ScanTime { sensor_ms: scan * 100, stamp_us: scan * 99_700, uncertainty_us: 0 };
    pipeline.process(&Scan { geometry, ranges_mm, time })
}

fn learned(room: &Room, geometry: &Geometry) -> Box<Pipeline<BEAMS>> {
    let mut pipeline = Box::new(Pipeline::new());
    let settings = Settings { open_range_mm: OPEN_MM, ..Settings::URG_04LX };
    pipeline.configure(geometry, settings, Fingerprint(1)).unwrap();
    pipeline.learn(LearnRequest { scans: 60, even_if_moving: true }).unwrap();
    for scan in 0..60 {
        process(&mut pipeline, geometry, &room.scan(scan), scan as u64);
    }
    assert!(pipeline.background().is_known());
    pipeline
}

/// Free range of every beam in this scan.
fn seen_mm(geometry: &Geometry, ranges_mm: &[u16], profile: &[BeamProfile]) -> Vec<u16> {
    let beams = profile.iter().enumerate().map(|(beam, profile)| {
        let reading = ranges_mm.get(beam).map(|&value_mm| geometry.reading(value_mm).range_mm());
        match (reading, profile.state) {
            (Some(Some(range_mm)), _) => range_mm,
            // A wall that does not answer may have anything before it, and so may a beam not asked.
            (Some(None), BeamState::Open) => OPEN_MM,
            _ => 0,
        }
    });
    beams.collect()
}

/// The host's picture of a judgement, by the profile it received last.
fn rebuilt(geometry: &Geometry, profile: &[BeamProfile], judgement: &Judgement) -> Vec<u16> {
    let mut empty_mm = vec![0; BEAMS];
    seen_empty(geometry, profile, judgement.candidates(), judgement.unseen(), OPEN_MM, &mut empty_mm);
    empty_mm
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, rng_seed: proptest::test_runner::RngSeed::Fixed(4), ..ProptestConfig::default() })]

    #[test]
    fn any_scans_at_all_do_no_harm(
        scans in vec(vec(value(), 0..BEAMS + 20), 1..80),
        wishes in vec((any::<u8>(), any::<u32>(), any::<[u16; 4]>()), 0..20),
    ) {
        let geometry = geometry(1);
        let mut pipeline = Box::new(Pipeline::<BEAMS>::new());
        pipeline.configure(&geometry, Settings::URG_04LX, Fingerprint(1)).unwrap();
        for (index, ranges_mm) in scans.iter().cycle().take(120).enumerate() {
            let judgement = process(&mut pipeline, &geometry, ranges_mm, index as u64 % 50);
            prop_assert!(judgement.candidates().len() <= CANDIDATES && judgement.unseen().len() <= UNSEEN_SPANS);
            if let Some(&(kind, sequence, [first_step, last_step, nearest_mm, farthest_mm])) = wishes.get(index % 40) {
                if kind % 2 == 0 {
                    let _ = pipeline.learn(LearnRequest { scans: first_step % 90, even_if_moving: kind % 4 == 0 });
                }
                let sequence = if kind < 128 { index as u32 + 1 } else { sequence };
                let _ = pipeline.absorb(Absorb { sequence, first_step, last_step, nearest_mm, farthest_mm });
            }
        }
    }

    #[test]
    fn the_same_scans_give_the_same_judgements(room in room(), things in vec(things(), 1..10)) {
        let geometry = geometry(1);
        let run = || {
            let mut pipeline = learned(&room, &geometry);
            let judgements = things.iter().enumerate().map(|(index, things)| {
                let ranges_mm = with_things(room.scan(index), things);
                format!("{:?}", process(&mut pipeline, &geometry, &ranges_mm, 60 + index as u64))
            });
            judgements.collect::<Vec<_>>()
        };
        prop_assert_eq!(run(), run());
    }

    #[test]
    fn what_the_host_rebuilds_is_never_empty_where_the_scan_saw_nothing(
        room in room(),
        things in vec((things(), 1usize..25), 1..8),
        absorb in any::<bool>(),
        length in prop_oneof![4 => Just(BEAMS), 1 => 0..BEAMS],
        cluster in 1u16..3,
    ) {
        let geometry = geometry(cluster);
        let mut pipeline = learned(&room, &geometry);
        let mut version = 0;
        let mut profile: Vec<BeamProfile> = vec![];
        for (index, (things, times)) in things.iter().enumerate() {
            for again in 0..*times {
                let scan = 60 + index * 25 + again;
                let mut ranges_mm = with_things(room.scan(scan), things);
                ranges_mm.truncate(length);
                // The host has the profile that was published before the scan.
                if version != pipeline.background().version() {
                    version = pipeline.background().version();
                    profile = pipeline.background().profile().collect();
                }
                let judgement = process(&mut pipeline, &geometry, &ranges_mm, scan as u64 * 3);
                prop_assert_eq!(judgement.background_version, version);
                let empty_mm = rebuilt(&geometry, &profile, judgement);
                let seen_mm = seen_mm(&geometry, &ranges_mm, &profile);
                for beam in 0..BEAMS {
                    prop_assert!(
                        empty_mm[beam] <= seen_mm[beam],
                        "beam {} of scan {}: empty up to {}, seen up to {}, {:?}",
                        beam, scan, empty_mm[beam], seen_mm[beam], profile[beam]
                    );
                }
                if let (true, Some(candidate)) = (absorb, judgement.candidates().first().cloned()) {
                    let wish = Absorb {
                        sequence: judgement.sequence,
                        first_step: candidate.first_step,
                        last_step: candidate.last_step,
                        nearest_mm: candidate.near_mm,
                        farthest_mm: candidate.near_mm.saturating_add(300),
                    };
                    let _ = pipeline.absorb(wish);
                }
            }
        }
    }

    #[test]
    fn every_foreground_beam_is_told_and_no_background_beam_is(room in room(), things in things()) {
        let geometry = geometry(1);
        let mut pipeline = learned(&room, &geometry);
        let ranges_mm = with_things(room.scan(61), &things);
        let judgement = process(&mut pipeline, &geometry, &ranges_mm, 61).clone();
        let mut told = vec![0; BEAMS];
        for candidate in judgement.candidates() {
            let (first, last) = (geometry.beam(candidate.first_step), geometry.beam(candidate.last_step));
            prop_assert!(candidate.beams >= 3 && last >= first + 2);
            (usize::from(first)..=usize::from(last)).for_each(|beam| told[beam] += 1);
        }
        for span in judgement.unseen() {
            span.beams_of(&geometry).for_each(|beam| told[beam] += 1);
        }
        for beam in 0..BEAMS {
            let valid = geometry.reading(ranges_mm[beam]).range_mm().is_some();
            match pipeline.background().class(beam) {
                Class::Background => prop_assert!(told[beam] == 0 || !valid || judgement.unseen().len() == UNSEEN_SPANS, "beam {beam}"),
                // Beyond the capacity spans grow together, and may cover more than once.
                Class::Foreground | Class::NoReturn => prop_assert!(
                    told[beam] == 1 || (told[beam] > 1 && judgement.unseen().len() == UNSEEN_SPANS),
                    "beam {beam} told {} times", told[beam]
                ),
            }
        }
    }
}
