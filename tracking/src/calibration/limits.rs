//! How much of a walk is enough, and how good a pose must be.

/// Length of a slot of the walk, s: a scan.
pub const SLOT_S: f64 = 0.1;

/// Time two modules should have seen the walker together, s: at walking speed some 15 m of way, the errors of a
/// body's shape being new every second.
pub const ENOUGH_S: f64 = 20.0;

/// Less than this links no two modules, s.
pub const LEAST_S: f64 = 8.0;

/// The walk two modules share must spread so far about its middle, m (root mean square): centres are wrong by 5 cm,
/// and 5 cm at 0.6 m are as much as 5°, ten times that with the number of scans.
pub const LEAST_SPREAD_M: f64 = 0.4;

/// Greatest uncertainty (95 %) of a pose that is still worth having: half a body, and what moves a centre by
/// as much at 4 m.
pub const WORST_M: f64 = 0.25;
/// The same for its direction, rad.
pub const WORST_RAD: f64 = 4.0 * std::f64::consts::PI / 180.0;

/// From one σ of a normal error to the bound that 95 % of them keep.
pub const SIGMAS_95: f64 = 1.96;
