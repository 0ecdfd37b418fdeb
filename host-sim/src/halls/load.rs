//! What the service of a site has to do each tenth of a second: frames of many areas, read and put together.
//!
//! ```text
//!   a row of halls, people in each and to and fro over each border ─▶ frames, as JSON ─▶ read ─▶ Campus ─▶ picture
//!                                                                     │ bytes           │ ms              │ ms, hand-overs
//! ```

use std::error::Error;
use std::time::{Duration, Instant};

use kehai_tracking::areas::{AreaFrame, AreaName, Campus, packed};
use kehai_tracking::geometry::Point;
use kehai_tracking::jsonl::{TrackLine, TracksLine};
use kehai_tracking::site::{Module, Site, Zone};
use kehai_tracking::snapshot::{DeviceState, ModuleLine, Snapshot};
use kehai_tracking::tracker::TrackId;

use super::strollers::{Place, Stroller};
use super::world::HALL_M;
use crate::world::random::{Purpose, Stream};

/// Between two pictures, µs.
const EVERY_US: u64 = 100_000;

/// Pictures that are measured, and those before, in which all is new. In five seconds each stroller crosses its border once or twice.
const PICTURES: u64 = 50;
const BEFORE: u64 = 15;

/// Of so many people one walks over the border to the next area.
const STROLLS: usize = 4;

/// Corners of what a module's newest scan saw empty: the six modules of the demo have 155 to 172.
const FREE_CORNERS: usize = 160;

/// How large a site is.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    /// Areas.
    pub areas: usize,
    /// People in each.
    pub people: usize,
    /// Modules of each.
    pub modules: usize,
}

/// What it costs.
#[derive(Clone, Copy, Debug)]
pub struct Load {
    /// Of a frame of one area, in the mean, bytes.
    pub frame_bytes: usize,
    /// To read a frame, in the mean.
    pub read: Duration,
    /// To make a picture, in the mean.
    pub picture: Duration,
    /// People in the last picture.
    pub people: usize,
    /// Crossings of borders a second.
    pub handed_over_hz: f64,
    /// How often a person who walks over borders had another number than a tenth of a second before, or was not shown.
    pub renumbered: usize,
}

impl Load {
    /// Share of one core that ten pictures a second of so many areas take.
    #[must_use]
    pub fn core_share(&self, areas: usize) -> f64 {
        (self.read.as_secs_f64() * areas as f64 + self.picture.as_secs_f64()) * 1e6 / EVERY_US as f64
    }
}

/// The strollers at the eastern border of an area; none if it is the last.
fn strollers(size: &Size, west: usize) -> impl Iterator<Item = Stroller> {
    let number = if west + 1 < size.areas { size.people.div_ceil(STROLLS) } else { 0 };
    (0..number).map(move |number| Stroller { west, number })
}

/// The tracks of an area: people who stand about in it, and those who walk over its borders while it sees them.
fn tracks(
    size: &Size,
    area: usize,
    t_s: f64,
    stream: &mut Stream,
) -> Result<Vec<TrackLine>, serde_json::Error> {
    let mut track = |id: u64, x: f64, y: f64, vx: f64| {
        let mut off = || 0.05 * stream.normal();
        serde_json::from_value(serde_json::json!({
            "id": id, "x": x + off(), "y": y + off(), "vx": vx, "vy": 0.0,
            "state": "confirmed", "cov": [0.002, 0.0, 0.002],
        }))
    };
    let standing = size.people - strollers(size, area).count();
    let mut lines: Vec<TrackLine> = (0..standing)
        .map(|id| {
            let mut place = Stream::new(area as u64, Purpose::Plan, [id as u64, 0]);
            let (x, y) =
                (place.between(2.6, HALL_M - 2.6), place.between(0.0, HALL_M * size.people as f64 / 4.0));
            track(id as u64, area as f64 * HALL_M + x, y, 0.0)
        })
        .collect::<Result<_, _>>()?;
    let before = area.checked_sub(1).into_iter().flat_map(|west| strollers(size, west));
    for stroller in strollers(size, area).chain(before) {
        let is_west = stroller.west == area;
        let Some(visit) = stroller.visit(is_west, t_s) else { continue };
        let Place { at, vx } = stroller.place(t_s);
        // Each time it comes it is a track that was not there before.
        let id = (visit * 2 + u64::from(is_west) + 1) * 1_000_000 + stroller.number as u64;
        lines.push(track(id, at.x, at.y, vx)?);
    }
    Ok(lines)
}

fn frame(size: &Size, area: usize, t_s: f64, stream: &mut Stream) -> Result<Snapshot, serde_json::Error> {
    let module = |number: usize| ModuleLine {
        name: format!("module {number}"),
        id: "02:4b:00:00:00:01".into(),
        address: "192.168.100.100:4040".into(),
        firmware: "0.1.0".into(),
        state: DeviceState::Watching,
        scans_hz: 10.0,
        clock_offset_ms: Some(123.4),
        background_age_s: Some(1234.5),
        silent_s: Some(0.05),
        free: vec![[12.34, 5.67]; FREE_CORNERS].into(),
        ..ModuleLine::default()
    };
    let line = TracksLine { tracks: tracks(size, area, t_s, stream)?, ..TracksLine::default() };
    Ok(Snapshot { modules: (0..size.modules).map(module).collect(), ..Snapshot::of(0, line) })
}

/// Measures a site of this size on this machine, on one thread.
///
/// # Errors
/// A name or a frame that cannot be: none.
pub fn measure(size: &Size) -> Result<Load, Box<dyn Error>> {
    let names: Vec<AreaName> =
        (0..size.areas).map(|area| format!("area-{area:03}").parse()).collect::<Result<_, _>>()?;
    let mut campus = Campus::new(&names, size.areas);
    for (area, name) in names.iter().enumerate() {
        let (from, to, far) = (area as f64 * HALL_M, (area + 1) as f64 * HALL_M, HALL_M * size.people as f64);
        let polygon = vec![[from, -1.0], [to, -1.0], [to, far], [from, far]];
        let zone = Zone::counted("hall".into(), polygon);
        let module = |number: usize| Module::unplaced(format!("module {number}"));
        let modules = (0..size.modules).map(module).collect();
        campus.set_site(name, Site { zones: vec![zone], modules, ..Site::default() });
    }
    let site = campus.site();
    let mut stream = Stream::new(1, Purpose::Plan, [u64::MAX, 0]);
    let mut load = Load {
        frame_bytes: 0,
        read: Duration::ZERO,
        picture: Duration::ZERO,
        people: 0,
        handed_over_hz: 0.0,
        renumbered: 0,
    };
    let walking: Vec<Stroller> = (0..size.areas).flat_map(|west| strollers(size, west)).collect();
    let mut numbers: Vec<Option<TrackId>> = vec![None; walking.len()];
    for picture_number in 1..=BEFORE + PICTURES {
        let now_us = picture_number * EVERY_US;
        let t_s = at_s(picture_number);
        let is_measured = picture_number > BEFORE;
        for (area, name) in names.iter().enumerate() {
            let text = serde_json::to_vec(&packed(&frame(size, area, t_s, &mut stream)?, picture_number))?;
            let begun = Instant::now();
            let frame: Snapshot = serde_json::from_slice(&text)?;
            campus.hear(name, AreaFrame { epoch: 1, number: picture_number, frame }, now_us);
            if is_measured {
                load.read += begun.elapsed();
                load.frame_bytes += text.len();
            }
        }
        let begun = Instant::now();
        let picture = campus.picture(&site, now_us, 0);
        if is_measured {
            load.picture += begun.elapsed();
        }
        load.people = picture.line.tracks.len();
        for (stroller, number) in walking.iter().zip(&mut numbers) {
            let now = number_at(&picture.line.tracks, stroller.place(t_s).at);
            load.renumbered += usize::from(is_measured && now != *number);
            *number = now;
        }
    }
    let (from_s, to_s) = (at_s(BEFORE), at_s(BEFORE + PICTURES));
    let crossings: u64 =
        walking.iter().map(|stroller| stroller.crossings(to_s) - stroller.crossings(from_s)).sum();
    load.handed_over_hz = crossings as f64 / (to_s - from_s);
    load.frame_bytes /= PICTURES as usize * size.areas;
    load.read /= u32::try_from(PICTURES as usize * size.areas)?;
    load.picture /= u32::try_from(PICTURES)?;
    Ok(load)
}

/// Time of a picture, s.
const fn at_s(picture_number: u64) -> f64 {
    (picture_number * EVERY_US) as f64 * 1e-6
}

/// Number of the person who is shown at a place; no other person is within half a metre of a stroller.
fn number_at(tracks: &[TrackLine], at: Point) -> Option<TrackId> {
    let is_there = |track: &&TrackLine| (Point::new(track.x, track.y) - at).length() < 0.5;
    tracks.iter().find(is_there).map(|track| track.id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_person_in_a_strip_of_two_areas_is_one_and_keeps_the_number_over_the_border() {
        let load = measure(&Size { areas: 3, people: 8, modules: 2 }).unwrap();
        assert_eq!(load.people, 3 * 8);
        assert!(load.frame_bytes > 2000, "{load:?}");
        // Four people, each every 4 m / 1.3 m/s.
        assert!((load.handed_over_hz - 4.0 * 1.3 / 4.0).abs() <= 0.4, "{load:?}");
        assert_eq!(load.renumbered, 0);
    }
}
