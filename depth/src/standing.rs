//! A person stands at one place after another before a camera: the host is told of the person, or not that the place is empty.
//!
//! ```text
//!   ◩ ─ ─ 1 m ─ 2 m ─ 3 m ─ 4 m ─ 5 m ┆ 6 m ─ … ─ 10 m   ┃ wall
//!         reported, up to the reach   ┆ not called empty
//! ```

use kehai::pipeline::Settings;
use kehai::sensor_model::SensorModel;
use kehai::visibility::seen_empty;
use kehai_emulator::chain::Chain;

use crate::background::{Background, FRAMES, Learner};
use crate::camera::{Camera, SMALL};
use crate::device::FanSource;
use crate::frame::{Frame, is_measured};
use crate::golden::{Body, render_before};
use crate::source::{BadFrame, Frames};

/// Frames that the firmware learns from, and a few more.
const EMPTY: usize = 70;

/// A camera as in paper D, with half of its pixels.
const PAPER: Camera = Camera { width: 160, height: 120, fov_deg: 59.0, ..SMALL };

struct Clip(std::vec::IntoIter<Frame>);

impl Frames for Clip {
    fn next_frame(&mut self) -> Option<Result<Frame, BadFrame>> {
        self.0.next().map(Ok)
    }
}

/// Noise of 0.29 % at 5 m that grows with the square of the distance.
fn noisy(frame: &Frame, seed: usize) -> Frame {
    let mut state = seed as u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let mut add = |value_mm: u16| {
        // The sum of three has a deviation of a half.
        let normal = 2.0 * (uniform() + uniform() + uniform() - 1.5);
        let depth_m = f32::from(value_mm) * 1e-3;
        let noise_mm = 14.5 * (depth_m / 5.0).powi(2) * normal;
        if is_measured(value_mm) {
            (f32::from(value_mm) + noise_mm).round().clamp(1.0, 60_000.0) as u16
        } else {
            0
        }
    };
    let values = frame.depth_mm().iter().map(|value_mm| add(*value_mm)).collect();
    Frame::new(frame.width(), frame.height(), values, frame.stamp_us).unwrap()
}

fn shot(wall_m: f32, camera: &Camera, bodies: &[Body], number: usize) -> Frame {
    noisy(&render_before(wall_m, camera, bodies, number), number)
}

fn background(wall_m: f32, camera: &Camera) -> Background {
    let mut learner = Learner::default();
    (0..FRAMES).find_map(|number| learner.push(shot(wall_m, camera, &[], 1000 + number))).unwrap()
}

/// What a host is told of a place.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Told {
    /// That something stands there.
    reported: bool,
    /// How far the bearing to it is empty, m; 0: not known.
    empty_m: f32,
}

/// What a host is told of each place, with a person there; of an empty hall for None.
fn told(wall_m: f32, camera: &Camera, places: &[Option<Body>]) -> Vec<Told> {
    let mut frames: Vec<Frame> = (0..EMPTY).map(|number| shot(wall_m, camera, &[], number)).collect();
    for (number, body) in (EMPTY..).zip(places) {
        frames.push(shot(wall_m, camera, body.as_slice(), number));
    }
    let clip = Box::new(Clip(frames.into_iter()));
    let source = FanSource::new(clip, *camera, background(wall_m, camera), Box::new(|_| {}));
    let config = source.config();
    let range_max_mm = u16::try_from(config.model.geometry.range_max_mm).unwrap();
    let settings = Settings::of(&SensorModel::of(config.model.model_text), range_max_mm);
    let mut chain = Chain::new(Box::new(source), config, settings);
    for _ in 0..EMPTY {
        assert!(chain.next_scan().unwrap().is_some());
    }
    let mut all = Vec::new();
    for body in places {
        let judged = chain.next_scan().unwrap().unwrap();
        let geometry = *judged.scan.geometry;
        let candidates = judged.judgement.candidates().to_vec();
        let unseen = judged.judgement.unseen().to_vec();
        let profile: Vec<_> = chain.pipeline().background().profile().collect();
        let mut empty_mm = vec![0; profile.len()];
        seen_empty(&geometry, &profile, &candidates, &unseen, settings.open_range_mm, &mut empty_mm);
        let (x_m, y_m) = body.map_or((1.0, 0.0), |body| (body.x_m, body.y_m));
        let towards = (y_m.atan2(x_m) - geometry.bearing_rad(0)) / geometry.beam_rad();
        let beam = towards.round() as u16;
        let reported = candidates.iter().any(|candidate| {
            let beams = geometry.beam(candidate.first_step)..=geometry.beam(candidate.last_step);
            beams.contains(&beam) && (f32::from(candidate.near_mm) * 1e-3 - x_m.hypot(y_m)).abs() < 0.4
        });
        all.push(Told { reported, empty_m: f32::from(empty_mm[usize::from(beam)]) * 1e-3 });
    }
    all
}

/// People at 1 to 10 m, straight ahead and aside, seen from their side.
fn standing(camera: &Camera, wall_m: f32) -> Vec<Option<Body>> {
    let aside_rad = [0.0, 0.3 * camera.fov_deg.to_radians(), -0.45 * camera.fov_deg.to_radians()];
    let places = (1..=10).flat_map(|range| aside_rad.map(|aside_rad| (range as f32, aside_rad)));
    let body = |(range_m, aside_rad): (f32, f32)| Body {
        x_m: range_m * aside_rad.cos(),
        y_m: range_m * aside_rad.sin(),
        radius_m: 0.12,
        top_m: 1.7,
    };
    places.map(body).filter(|body| body.x_m + body.radius_m < wall_m).map(Some).collect()
}

/// Cameras, and the reach of each, m.
fn cameras() -> [(&'static str, Camera, f32); 9] {
    [
        ("small", SMALL, 5.0),
        ("paper", PAPER, 5.0),
        ("low plane", Camera { above_m: Some(0.7), ..PAPER }, 5.0),
        ("up", Camera { height_m: 0.8, pitch_deg: -10.0, ..PAPER }, 5.0),
        ("steep up", Camera { pitch_deg: -35.0, ..PAPER }, 2.1),
        ("high", Camera { height_m: 2.2, pitch_deg: 15.0, ..PAPER }, 5.0),
        ("down", Camera { height_m: 2.6, pitch_deg: 45.0, ..PAPER }, 3.9),
        ("wide", Camera { fov_deg: 110.0, ..PAPER }, 5.0),
        ("coarse", Camera { width: 32, height: 24, ..PAPER }, 2.7),
    ]
}

#[test]
fn a_person_is_reported_up_to_the_reach_and_at_no_distance_is_the_place_called_empty() {
    let mut wrong = Vec::new();
    for (name, camera, reach_m) in cameras() {
        for wall_m in [5.8, 9.5] {
            let mut places = standing(&camera, wall_m);
            places.extend([None, None]);
            let told = told(wall_m, &camera, &places);
            for (body, told) in places.iter().zip(&told) {
                let Some(body) = body else { continue };
                let range_m = body.x_m.hypot(body.y_m);
                let is_missed = range_m < reach_m && !told.reported;
                if is_missed || !told.reported && told.empty_m > range_m {
                    wrong
                        .push(format!("{name}, wall {wall_m}, at {:.1} {:.1}: {told:?}", body.x_m, body.y_m));
                }
            }
            let empty = told.last().unwrap();
            if (empty.empty_m - reach_m).abs() > 0.11 {
                wrong.push(format!("{name}, wall {wall_m}, empty: {empty:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
