//! Made people in a room with one zone, as a database is fed with them.
#![allow(dead_code, reason = "each test uses its own part of it")]

use std::sync::Arc;

use host_tracker::store::Keep;
use kehai_tracking::jsonl::{TrackLine, TracksLine, ZoneKnown, ZoneLine};
use kehai_tracking::occupancy::Found;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;
use kehai_tracking::tracker::{LifeCycle, Origin};

/// One zone, the half of a room of 18 m by 18 m.
pub fn site() -> Arc<Site> {
    Arc::new(
        toml::from_str("[[zone]]\nname = \"hall\"\npolygon = [[-9, -9], [0, -9], [0, 9], [-9, 9]]").unwrap(),
    )
}

/// What is kept for so many days.
pub fn keep(days: u32) -> Keep {
    Keep { days, ..Keep::USUAL }
}

/// A confirmed track at a place.
pub fn track(id: u64, x: f64, y: f64) -> TrackLine {
    TrackLine {
        id,
        x,
        y,
        vx: 0.0,
        vy: 0.0,
        cov: Some([0.01, 0.0, 0.01]),
        state: LifeCycle::Confirmed,
        existence: 1.0,
        reason: "seen".into(),
        origin: Origin::Entered,
    }
}

/// A snapshot of these tracks; those with a negative x are in the hall.
pub fn frame(unix_ms: u64, tracks: Vec<TrackLine>) -> Arc<Snapshot> {
    let count = tracks.iter().filter(|track| track.x < 0.0).count() as u32;
    let hall = ZoneLine::new(Found::inside(count, vec![]), 1.0, ZoneKnown::Known);
    let zones = [("hall".to_string(), hall)].into();
    Arc::new(Snapshot::of(unix_ms, TracksLine { t: unix_ms as f64 * 1e-3, tracks, zones }))
}

/// A person who walks at 0.1 to 1.3 m/s through a room of 8 m by 8 m, with a tracker's noise: 1 cm.
pub fn walker(id: u64, at_ms: u64) -> TrackLine {
    let t = (at_ms % 86_400_000) as f64 * 1e-3 + id as f64 * 17.0;
    let phase = t + 18.0 * (t * 0.05).sin();
    let noise = |k: f64| 0.01 * ((t * 977.0 + k).sin() * 43_758.5).fract();
    track(id, 4.0 * (0.15 * phase).sin() + noise(1.0), 4.0 * (0.11 * phase).cos() + noise(2.0))
}
