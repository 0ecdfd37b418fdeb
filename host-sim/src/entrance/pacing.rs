//! A number of people who stay at the entrance, as one source tells of them: what its host receives, and when.
//!
//! ```text
//!   0 s ─ the source starts, and learns ─ 20 s ─ they come in ─ 28 s ─ all walk up and down in view ─ 40 s
//! ```
//!
//! The site is that of `gate.toml` with this one source; so what each source costs the host can be set beside the others.

use std::sync::Arc;

use kehai::floor::READING_US;
use kehai::wire::{
    DATAGRAM_MAX, Identity, Info, List, Message, ModuleId, Pressed, ReportHead, Subscribed, TooLong,
};
use kehai_emulator::simulated_time::Stuck;
use kehai_tracking::floor::Plan as Panels;
use kehai_tracking::site::Site;

use super::lasers::Laser;
use super::live::DepthCamera;
use super::{CAMERA, Entrance, gate};
use crate::floor::panels::{Broken, reading};
use crate::run::unit::{Plan, Sights, Unit, empty_flash};
use crate::run::{Arrival, Conditions};
use crate::world::geometry::{Point, Pose};

/// They come after so long, s: the source has learned what is there without them.
pub const COME_S: f64 = 20.0;

/// From this time on all are in view, s, until the end.
pub const IN_S: f64 = 28.0;

/// When it ends, s.
pub const END_S: f64 = 40.0;

/// Where the laser is: x and y, m, yaw, degrees. It looks along their lanes, and no person hides another.
const LASER: (f64, f64, f64) = (2.9, 2.8, -90.0);

/// What looks at them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Source {
    /// A UHG-08LX.
    Laser,
    /// A depth camera, whose reports have sizes.
    Camera,
    /// A floor of panels.
    Floor,
}

impl Source {
    /// Its name in the site.
    const fn name(self) -> &'static str {
        match self {
            Self::Laser => "left",
            Self::Camera => "camera",
            Self::Floor => "mat",
        }
    }
}

/// Why nothing can be told.
#[derive(Debug, thiserror::Error)]
pub enum PacingError {
    /// A fault of the simulation.
    #[error(transparent)]
    Stuck(#[from] Stuck),
    /// The site of the entrance has no such source.
    #[error("the entrance's site is not as expected: {0}")]
    Site(String),
    /// A reading does not fit a datagram.
    #[error("a reading of the floor does not fit a datagram")]
    Wire(TooLong),
}

/// The people.
#[must_use]
pub fn entrance(people: u16) -> Arc<Entrance> {
    let frames = (END_S - COME_S) * f64::from(CAMERA.frames_per_s);
    Arc::new(Entrance::pacing(people, frames as usize + 1))
}

/// The range finder before them.
#[must_use]
pub fn laser(entrance: &Arc<Entrance>) -> Laser {
    let (x, y, yaw_deg) = LASER;
    let pose = Pose { at: Point::new(x, y), yaw_rad: yaw_deg.to_radians() };
    Laser::new(Arc::clone(entrance), COME_S, pose, (1, 1))
}

/// The entrance with this source and none else.
///
/// # Errors
/// [`PacingError::Site`].
pub fn site(source: Source) -> Result<Site, PacingError> {
    let mut site = gate::site().map_err(|error| PacingError::Site(error.to_string()))?;
    site.modules.retain(|module| module.name == source.name());
    if source == Source::Laser {
        site.modules.iter_mut().for_each(|module| (module.x, module.y, module.yaw_deg) = LASER);
    }
    site.floors.retain(|floor| floor.name == source.name());
    match (site.modules.len(), site.floors.len()) {
        (1, 0) | (0, 1) => Ok(site),
        _ => Err(PacingError::Site(format!("no {}", source.name()))),
    }
}

/// All that this source sends to its host.
///
/// # Errors
/// [`PacingError`].
pub fn arrivals(source: Source, entrance: &Arc<Entrance>) -> Result<Vec<Arrival>, PacingError> {
    let site = site(source)?;
    if source == Source::Floor {
        return pressed(&site, entrance);
    }
    let [module] = site.modules.as_slice() else { return Err(PacingError::Site("no module".into())) };
    let mut plan = match source {
        Source::Camera => {
            let camera = DepthCamera::new(entrance, COME_S);
            let camera = camera.ok_or_else(|| PacingError::Site("the camera learns no background".into()))?;
            let (config, sizes) = (camera.config(), camera.sizes());
            Plan { amend: Some(sizes), ..plan(Box::new(camera), config) }
        }
        Source::Laser | Source::Floor => {
            let laser = laser(entrance);
            let (config, phase_us) = laser.config();
            Plan { phase_us, ..plan(Box::new(laser), config) }
        }
    };
    plan.name.clone_from(&module.name);
    let mut unit = Unit::new(plan);
    let arrived = unit.advance((END_S * 1e6) as u64)?;
    Ok(arrived.into_iter().map(|(at_us, bytes)| Arrival { at_us, module: 0, bytes }).collect())
}

pub(super) fn plan(
    source: Box<dyn kehai_emulator::source::RangeSource>,
    config: kehai_emulator::urg::Config,
) -> Plan {
    Plan {
        index: 0,
        name: String::new(),
        source,
        config,
        phase_us: 0,
        sights: Sights::default(),
        flash: empty_flash(),
        conditions: Conditions::LAN,
        seed: 1,
        amend: None,
        outages_us: Vec::new(),
    }
}

/// What a device beside the floor sends, whose clock is its host's.
fn pressed(site: &Site, entrance: &Arc<Entrance>) -> Result<Vec<Arrival>, PacingError> {
    let [mat] = site.floors.as_slice() else { return Err(PacingError::Site("no floor".into())) };
    let (panels, soles) = (Panels::from(mat), entrance.soles(1));
    let say = |message: &Message<'_>, at_us: u64| {
        let identity = Identity { module: ModuleId([2, 0, 0, 0, 0xf1, 0]), boot: 1 };
        let mut bytes = [0; DATAGRAM_MAX];
        let length = message.encode(identity, &mut bytes).map_err(PacingError::Wire)?;
        let bytes = bytes.get(..length).unwrap_or_default().to_vec();
        Ok::<_, PacingError>(Arrival { at_us, module: 0, bytes })
    };
    let info = Info {
        request_id: 1,
        version_min: 1,
        version_max: 1,
        firmware: "",
        build: "",
        board: "",
        name: &mat.name,
        uptime_us: 0,
        setup: 1,
        background_version: 0,
        sensor: None,
    };
    let mut arrivals = vec![say(&Message::Info(info), 0)?];
    for sequence in 1..=(END_S * 1e6) as u64 / READING_US {
        let at_us = sequence * READING_US;
        // Times are exchanged once a second.
        if sequence % 9 == 1 {
            let (request_id, t1) = (sequence as u32, at_us.to_le_bytes());
            let subscribed = Subscribed {
                request_id,
                t1,
                t2_us: at_us,
                t3_us: at_us,
                lease_ms: 5000,
                may_control: false,
                subscribers: 1,
            };
            arrivals.push(say(&Message::Subscribed(subscribed), at_us)?);
        }
        let people = entrance.people_at(at_us as f64 * 1e-6 - COME_S);
        let soles: Vec<_> = people.iter().flat_map(|walker| soles.of(walker)).collect();
        let bits = reading(&panels, &soles, &Broken::default());
        let head =
            ReportHead { sequence: sequence as u32, setup: 1, stamp_us: at_us, ..ReportHead::default() };
        let down = List::new(bits.bytes(panels.panels()));
        let (columns, rows) = (mat.columns, mat.rows);
        let pressed = Pressed { head, columns, rows, down, faulty: List::new(&[]) };
        arrivals.push(say(&Message::Pressed(pressed), at_us)?);
    }
    Ok(arrivals)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baselines::Choice;
    use kehai_tracking::site_tracker::SiteTracker;
    use kehai_tracking::tracker::LifeCycle;

    #[test]
    fn each_source_shows_its_host_the_person_who_stays() {
        for source in [Source::Laser, Source::Camera, Source::Floor] {
            let entrance = entrance(1);
            let mut site_tracker = SiteTracker::new(&Arc::new(site(source).unwrap()), Choice::default());
            let mut right = (0, 0);
            let arrivals = arrivals(source, &entrance).unwrap();
            let mut arrivals = arrivals.iter().peekable();
            for tenth in 0..(END_S * 10.0) as u64 {
                let now_us = tenth * 100_000;
                while let Some(arrival) = arrivals.next_if(|arrival| arrival.at_us <= now_us) {
                    site_tracker.receive(&arrival.bytes, arrival.at_us);
                }
                let now_s = now_us as f64 * 1e-6;
                let known = site_tracker.estimate(now_s);
                if now_s > IN_S {
                    let truth = entrance.people_at(now_s - COME_S)[0].at;
                    let mut sure = known.tracks.iter().filter(|track| track.state != LifeCycle::Tentative);
                    // One who turns round on the spot may be taken for two, one of them hidden.
                    let is_right = sure.any(|track| (track.at - truth).length() < 0.5);
                    right = (right.0 + u64::from(is_right), right.1 + 1);
                }
            }
            assert!(right.0 * 10 >= right.1 * 9, "{source:?}: {right:?}");
        }
    }
}
