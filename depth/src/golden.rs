//! A small hall for tests: a wall 4 m in front, a floor, and upright cylinders for people.

use crate::background::{Background, FRAMES, Learner};
use crate::camera::Camera;
use crate::cluster::Density;
use crate::foreground::{self, Limits};
use crate::frame::Frame;
use crate::segment::{Segment, segments};
use crate::source::{self, write_png};

/// An upright cylinder.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Body {
    pub(crate) x_m: f32,
    pub(crate) y_m: f32,
    pub(crate) radius_m: f32,
    pub(crate) top_m: f32,
}

/// Distance of the wall, m.
const WALL_M: f32 = 4.0;

/// The image of the hall with these people; pixel `7 · column + 13 · row + 31 · frame` of 16 is missing.
pub(crate) fn render(camera: &Camera, bodies: &[Body], number: usize) -> Frame {
    render_before(WALL_M, camera, bodies, number)
}

/// The same before a wall at another distance, m.
pub(crate) fn render_before(wall_m: f32, camera: &Camera, bodies: &[Body], number: usize) -> Frame {
    let mut depth_mm = Vec::new();
    for (column, row) in (0..camera.height).flat_map(|row| (0..camera.width).map(move |column| (column, row)))
    {
        let ray = camera.ray(column, row);
        let mut depth_m = wall_m / ray[0].max(1e-3);
        if ray[2] < 0.0 {
            depth_m = depth_m.min(-camera.height_m / ray[2]);
        }
        for body in bodies {
            depth_m = depth_m.min(side_m(camera, body, ray).unwrap_or(f32::MAX));
        }
        let missing = (7 * column + 13 * row + 31 * number).is_multiple_of(16);
        depth_mm.push(if missing { 0 } else { (depth_m * 1000.0).round().min(60_000.0) as u16 });
    }
    let stamp_us = number as u64 * camera.period_us();
    Frame::new(camera.width, camera.height, depth_mm, stamp_us).unwrap()
}

/// Depth at which a ray meets a cylinder's side.
fn side_m(camera: &Camera, body: &Body, [x, y, z]: [f32; 3]) -> Option<f32> {
    let (a, b) = (x * x + y * y, x * body.x_m + y * body.y_m);
    let c = body.x_m * body.x_m + body.y_m * body.y_m - body.radius_m * body.radius_m;
    let root = (b * b - a * c).max(-1.0).sqrt();
    let depth_m = (b - root) / a;
    let at_m = camera.height_m + depth_m * z;
    (depth_m > 0.0 && (0.0..=body.top_m).contains(&at_m)).then_some(depth_m)
}

/// The hall without people.
pub(crate) fn background(camera: &Camera) -> Background {
    let mut learner = Learner::default();
    (0..FRAMES).find_map(|number| learner.push(render(camera, &[], number))).unwrap()
}

fn found(camera: &Camera, background: &Background, frame: &Frame) -> Vec<Segment> {
    let points = foreground::of(frame, background, camera, &Limits::USUAL);
    segments(&points, camera, &Density { least: 5, ..Density::USUAL })
}

/// Two people at frame `number`: one walks across at 1.6 m, a taller one the other way at 3 m; 0.2 m a frame.
fn walkers(number: usize) -> [Body; 2] {
    let along = number as f32 * 0.2 - 1.0;
    [
        Body { x_m: 1.6, y_m: along, radius_m: 0.2, top_m: 1.5 },
        Body { x_m: 3.0, y_m: -along, radius_m: 0.22, top_m: 1.8 },
    ]
}

#[test]
fn the_golden_clip_shows_two_people_until_one_hides_the_other() {
    let camera = crate::camera::SMALL;
    let folder = tempfile::tempdir().unwrap();
    let count = 11;
    for number in 0..FRAMES + count {
        let bodies = number.checked_sub(FRAMES).map_or(vec![], |walked| walkers(walked).to_vec());
        let file = folder.path().join(format!("{number:06}.png"));
        write_png(&file, &render(&camera, &bodies, number)).unwrap();
    }
    let bytes: u64 =
        std::fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap().metadata().unwrap().len()).sum();
    assert!(bytes < 200_000, "{bytes}");

    let mut frames = source::open(folder.path(), &camera).unwrap();
    let mut learner = Learner::default();
    let background =
        std::iter::from_fn(|| frames.next_frame()).find_map(|frame| learner.push(frame.unwrap())).unwrap();
    let mut counts = Vec::new();
    for number in 0..count {
        let frame = frames.next_frame().unwrap().unwrap();
        let segments = found(&camera, &background, &frame);
        counts.push(segments.len());
        for segment in &segments {
            // The front of a cylinder is seen: its middle lies less than a radius nearer.
            let near = walkers(number).into_iter().any(|body| {
                let off = (segment.centre_m[0] - body.x_m).hypot(segment.centre_m[1] - body.y_m);
                off < body.radius_m && (segment.top_cm / 100.0 - body.top_m).abs() < 0.08
            });
            assert!(near, "frame {number}: {segment:?}");
        }
    }
    assert!(frames.next_frame().is_none());
    // In the sixth frame both are straight ahead.
    assert_eq!(counts, [2, 2, 2, 2, 2, 1, 2, 2, 2, 2, 2]);
}
