//! The entrance before a depth camera, before two range finders, and before both: reports over a network, the tracker, a zone.
//!
//! ```text
//!   entrance ─┬─ camera ─▶ fan, sizes ─▶ device ─┐            ┌─▶ camera alone
//!             ├─ URG ────▶ SCIP ───────▶ device ─┼─▶ reports ─┼─▶ two range finders alone     tracks ─▶ identities
//!             └─ URG ────▶ SCIP ───────▶ device ─┘            └─▶ both               zone ───▶ exact count
//! ```
//!
//! People are judged within the zone, also while others hide them: a trapezoid in the camera's view.

use std::ops::RangeInclusive;
use std::sync::Arc;

use kehai_tracking::geometry::inside;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::{LifeCycle, TrackState};
use serde::{Deserialize, Serialize};

use super::entrance::{FIGURES, shares};
use super::figure::Figure;
use super::findings::{Figures, Pooled};
use super::jobs::Runs;
use crate::baselines::Choice;
use crate::entrance::judge::{Judge, Reported, Verdict};
use crate::entrance::lasers::{Laser, PLANE_M};
use crate::entrance::live::DepthCamera;
use crate::entrance::{CAMERA, Entrance, FRAMES, Present, Shot};
use crate::run::Conditions;
use crate::run::unit::{Plan, Sights, Unit, empty_flash};
use crate::world::geometry::{Point, Pose};
use kehai_depth::frame::Frame;

/// The entrance is empty for so long: the devices start, and learn.
const LEAD_S: f64 = 25.0;

/// The zone, m: within the camera's view.
const ZONE_M: [[f64; 2]; 4] = [[1.0, -0.45], [4.7, -2.5], [4.7, 2.5], [1.0, 0.45]];

/// A person nearer to its edge than this, m, is neither in nor out: as far as places are off.
const EDGE_M: f64 = 0.25;

/// Where the modules are: x and y, m, yaw, degrees.
const PLACES: [(&str, f64, f64, f64); 3] =
    [("camera", 0.0, 0.0, 0.0), ("left", 0.1, 2.8, -50.0), ("right", 5.7, -2.8, 130.0)];

/// What is installed, of [`PLACES`]; and with which trackers.
const SOURCES: [(&str, &[usize], &[&str]); 3] = [
    ("camera alone", &[0], &["kehai", "kehai-rules", "kehai-rules-without-size"]),
    ("two range finders alone", &[1, 2], &["kehai", "kehai-rules"]),
    ("camera and two range finders", &[0, 1, 2], &["kehai", "kehai-rules", "kehai-rules-without-size"]),
];

/// The figure that segments alone have not.
pub const COUNTED: &str = "counted right, % of the time";

/// What one run came to with one set of sources.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Came {
    verdict: Verdict,
    /// Moments with the right count, and all of them.
    right: (u64, u64),
}

/// Runs every set of sources with these seeds.
///
/// # Errors
/// A fault of the simulation, or of the file in which results are kept.
pub fn run(seeds: &RangeInclusive<u64>, runs: &Runs) -> Result<Vec<Pooled>, String> {
    let jobs: Vec<(u8, u64)> = seeds.clone().map(|seed| (0, seed)).collect();
    let results = runs.results("entrance-sources", &jobs, |(_, seed)| one(seed))?;
    let rows = SOURCES.iter().flat_map(|(name, _, trackers)| trackers.iter().map(move |one| (*name, *one)));
    let pooled = |(index, (name, tracker)): (usize, (&str, &str))| {
        let own = results.iter().filter_map(|((_, seed), all)| Some((*seed, figures(all.get(index)?))));
        Pooled { trial: name.into(), tracker: tracker.into(), runs: own.collect() }
    };
    Ok(rows.enumerate().map(pooled).collect())
}

fn site(installed: &[usize]) -> Site {
    let mut text = format!("[[zone]]\nname = 'entrance'\npolygon = {ZONE_M:?}\ncount = true\n");
    for (number, (name, x, y, yaw_deg)) in PLACES.into_iter().enumerate() {
        if installed.contains(&number) {
            let height_m = if number == 0 { f64::from(CAMERA.height_m) } else { PLANE_M };
            text += &format!(
                "[[module]]\nname = '{name}'\nx = {x:?}\ny = {y:?}\nyaw_deg = {yaw_deg:?}\nheight_m = {height_m:?}\n"
            );
        }
    }
    Site::parse("entrance.toml", &text).unwrap_or_default()
}

/// The devices.
fn units(entrance: &Arc<Entrance>, seed: u64) -> Option<Vec<Unit>> {
    let plan = |index: usize, name: &str| Plan {
        index,
        name: name.to_owned(),
        source: Box::new(kehai_emulator::source::StillRoom::new(
            kehai_emulator::urg::model::URG_04LX.geometry,
        )),
        config: kehai_emulator::urg::Config::new(kehai_emulator::urg::model::URG_04LX),
        phase_us: 0,
        sights: Sights::default(),
        flash: empty_flash(),
        conditions: Conditions::LAN,
        seed,
        amend: None,
        outages_us: Vec::new(),
    };
    let unit = |(index, (name, x, y, yaw_deg)): (usize, (&str, f64, f64, f64))| {
        if index == 0 {
            let camera = DepthCamera::new(entrance, LEAD_S)?;
            let (config, sizes) = (camera.config(), camera.sizes());
            let source = Box::new(camera);
            return Some(Unit::new(Plan { source, config, amend: Some(sizes), ..plan(index, name) }));
        }
        let pose = Pose { at: Point::new(x, y), yaw_rad: yaw_deg.to_radians() };
        let laser = Laser::new(Arc::clone(entrance), LEAD_S, pose, (seed, index as u64));
        let (config, phase_us) = laser.config();
        Some(Unit::new(Plan { source: Box::new(laser), config, phase_us, ..plan(index, name) }))
    };
    PLACES.into_iter().enumerate().map(unit).collect()
}

/// One run with all of [`SOURCES`].
fn one(seed: u64) -> Result<Vec<Came>, String> {
    let entrance = Arc::new(Entrance::new(seed));
    let mut units = units(&entrance, seed).ok_or("no background")?;
    let mut watched = Vec::new();
    for (_, installed, trackers) in SOURCES {
        for tracker in trackers {
            let tracker: Choice = tracker.parse().map_err(|error| format!("{error}"))?;
            let site_tracker = SiteTracker::new(&Arc::new(site(installed)), tracker);
            watched.push((installed, site_tracker, Judge::default(), (0, 0)));
        }
    }
    let zone: Vec<Point> = ZONE_M.iter().map(|[x, y]| Point::new(*x, *y)).collect();
    let period_s = CAMERA.period_us() as f64 * 1e-6;
    let first = (LEAD_S / period_s).round() as usize;
    for number in 1..first + FRAMES {
        let now_us = number as u64 * CAMERA.period_us();
        let mut arrivals = Vec::new();
        for (module, unit) in units.iter_mut().enumerate() {
            let arrived = unit.advance(now_us).map_err(|error| error.to_string())?;
            arrivals.extend(arrived.into_iter().map(|(at_us, bytes)| (at_us, module, bytes)));
        }
        arrivals.sort_by_key(|(at_us, ..)| *at_us);
        let people = entrance.people_at(now_us as f64 * 1e-6 - LEAD_S);
        let present = people.iter().map(|one| Present {
            person: one.person,
            at: one.at,
            share: 1.0,
            is_judged: inside(one.at, &zone),
        });
        let shot = Shot { frame: Frame::unseen(1, 1, now_us), whose: Vec::new(), people: present.collect() };
        let is_clear = shot.people.iter().all(|one| edge_m(one.at, &zone) > EDGE_M);
        let there = shot.people.iter().filter(|one| one.is_judged).count();
        for (installed, site_tracker, judge, right) in &mut watched {
            for (at_us, module, bytes) in &arrivals {
                if installed.contains(module) {
                    site_tracker.receive(bytes, *at_us);
                }
            }
            let known = site_tracker.estimate(now_us as f64 * 1e-6);
            if number < first {
                continue;
            }
            let is_counted =
                |track: &&TrackState| track.state != LifeCycle::Tentative && inside(track.at, &zone);
            let counted = known.tracks.iter().filter(is_counted);
            let reported: Vec<Reported> =
                counted.map(|track| Reported { id: track.id, at: track.at, segment: None }).collect();
            judge.frame(&shot, &[], &reported);
            if is_clear {
                let count = known.zones.get("entrance").and_then(|zone| zone.count());
                right.0 += u64::from(count.is_some_and(|count| count as usize == there));
                right.1 += 1;
            }
        }
    }
    Ok(watched.into_iter().map(|(.., judge, right)| Came { verdict: judge.finish(), right }).collect())
}

/// Distance of a place from the edge of an area, m.
fn edge_m(at: Point, area: &[Point]) -> f64 {
    let sides = area.iter().zip(area.iter().cycle().skip(1));
    let off = sides.map(|(from, to)| kehai_tracking::geometry::distance_to_segment(at, *from, *to));
    off.fold(f64::INFINITY, f64::min)
}

fn figures(came: &Came) -> Figures {
    let (right, of) = came.right;
    let nothing = || Figure::Mean { values: Vec::new(), digits: 1, shares: true };
    let found = std::iter::repeat_with(nothing).take(3);
    let values = found.chain(shares(&came.verdict));
    let all = FIGURES.iter().map(|name| (*name).to_owned()).zip(values);
    let counted = Figure::time(100.0 * right as f64 / of.max(1) as f64, 1);
    all.chain([(COUNTED.to_owned(), counted)]).collect()
}
