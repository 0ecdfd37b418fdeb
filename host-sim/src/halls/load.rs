//! What the service of a site has to do each tenth of a second: frames of many areas, read and put together.
//!
//! ```text
//!   a row of halls, people in each and in each strip ─▶ frames, as JSON ─▶ read ─▶ Campus ─▶ picture
//!                                                       │ bytes           │ ms              │ ms
//! ```

use std::error::Error;
use std::time::{Duration, Instant};

use kehai_tracking::areas::{AreaFrame, AreaName, Campus, packed};
use kehai_tracking::jsonl::{TrackLine, TracksLine};
use kehai_tracking::site::{Site, Zone};
use kehai_tracking::snapshot::{DeviceState, ModuleLine, Snapshot};

use super::world::HALL_M;
use crate::world::random::{Purpose, Stream};

/// Between two pictures, µs.
const EVERY_US: u64 = 100_000;

/// Pictures that are measured; those before are the first in which all is new.
const PICTURES: u64 = 20;

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
}

impl Load {
    /// Share of one core that ten pictures a second of so many areas take.
    #[must_use]
    pub fn core_share(&self, areas: usize) -> f64 {
        (self.read.as_secs_f64() * areas as f64 + self.picture.as_secs_f64()) * 1e6 / EVERY_US as f64
    }
}

/// The tracks of an area: people who stand about in it, and every fourth at the border to the next, where both see them.
fn tracks(size: &Size, area: usize, stream: &mut Stream) -> Result<Vec<TrackLine>, serde_json::Error> {
    let track = |id: usize, of: usize| {
        // The same person is at the same place in both areas.
        let mut place = Stream::new(of as u64, Purpose::Plan, [id as u64, 0]);
        let at_border = id.is_multiple_of(4);
        let x = of as f64 * HALL_M + if at_border { HALL_M } else { place.between(1.0, HALL_M - 1.0) };
        let y = place.between(0.0, HALL_M * size.people as f64 / 4.0);
        let off = || 0.05;
        serde_json::from_value(serde_json::json!({
            "id": of * size.people + id, "x": x + off() * stream.normal(), "y": y + off() * stream.normal(),
            "state": "confirmed", "cov": [0.002, 0.0, 0.002],
        }))
    };
    let own = (0..size.people).map(|id| (id, area));
    let before = area
        .checked_sub(1)
        .into_iter()
        .flat_map(|before| (0..size.people).step_by(4).map(move |id| (id, before)));
    let mut track = track;
    own.chain(before).map(|(id, of)| track(id, of)).collect()
}

fn frame(size: &Size, area: usize, stream: &mut Stream) -> Result<Snapshot, serde_json::Error> {
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
    let line = TracksLine { tracks: tracks(size, area, stream)?, ..TracksLine::default() };
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
        campus.set_site(name, Site { zones: vec![zone], ..Site::default() });
    }
    let site = campus.site();
    let mut stream = Stream::new(1, Purpose::Plan, [u64::MAX, 0]);
    let mut load = Load { frame_bytes: 0, read: Duration::ZERO, picture: Duration::ZERO, people: 0 };
    let before = 5;
    for number in 1..=before + PICTURES {
        let now_us = number * EVERY_US;
        let is_measured = number > before;
        for (area, name) in names.iter().enumerate() {
            let text = serde_json::to_vec(&packed(&frame(size, area, &mut stream)?, number))?;
            let begun = Instant::now();
            let frame: Snapshot = serde_json::from_slice(&text)?;
            campus.hear(name, AreaFrame { epoch: 1, number, frame }, now_us);
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
    }
    load.frame_bytes /= PICTURES as usize * size.areas;
    load.read /= u32::try_from(PICTURES as usize * size.areas)?;
    load.picture /= u32::try_from(PICTURES)?;
    Ok(load)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_stands_in_a_strip_of_two_areas_is_one() {
        let load = measure(&Size { areas: 3, people: 8, modules: 2 }).unwrap();
        assert_eq!(load.people, 3 * 8);
        assert!(load.frame_bytes > 2000, "{load:?}");
    }
}
