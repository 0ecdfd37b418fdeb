//! The sensor noise model: from the ranges of a perfect sensor to those of a real one.
//!
//! ```text
//!   seen ─▶ missing? ─▶ + spread(r) · correlated noise ─▶ whole mm ─▶ ties ─▶ edges ─▶ codes ─▶ mm
//!           reach,        heavy tails far away,                        with the     what is left
//!           drop-outs     scale and clothing bias                      step before  without a range
//! ```
//!
//! The figures come from recordings of real URG-04LX and UHG-08LX: spread by range, correlation of
//! neighbours 0.5 / 0.3 / 0.18 / 0.11 at lags 1 to 4, 42–47 % of the readings equal to a neighbour,
//! drop-outs of 0.5–1.6 % lasting 1.5–2.7 scans on few steps, and behind an edge 5–18 % of the first
//! readings missing, 1–6 % in between. `tests/world_noise.rs` measures all of them on this model.

use super::optics::{self, Optics};
use super::random::{Purpose, Stream};

/// Measurement of a perfect sensor in one step.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Seen {
    /// Distance to the surface.
    pub range_m: f64,
    /// Cosine of the angle to the surface's normal.
    pub incidence: f64,
    /// Reflectance of the surface.
    pub reflectance: f64,
    /// What the surface adds to the range.
    pub bias_mm: f64,
    /// Number of the object hit.
    pub thing: u16,
}

/// Share of the noise that is each step's own; the rest wanders along the scan.
const OWN_SHARE: f64 = 0.3;
/// How much of the wandering part the next step keeps.
const KEPT: f64 = 0.63;
/// Share of the steps that repeat the step before exactly.
const TIE_SHARE: f64 = 0.19;
/// Ties are between readings of one surface: no farther apart than this.
const TIE_LIMIT_MM: f64 = 40.0;
/// Share of wild readings far away, and how much wilder they are: kurtosis 6.
const WILD_SHARE: f64 = 0.05;
const WILD_FACTOR: f64 = 2.6;
/// A range step larger than this is an edge.
const EDGE_M: f64 = 0.1;
/// The first reading behind an edge: share that is missing, share in between.
const EDGE_LOST_SHARE: f64 = 0.11;
const EDGE_MIXED_SHARE: f64 = 0.035;
/// Width over which returns fade out, as a share of the reach, and how much the steps of one wall differ.
const FADE_SHARE: f64 = 0.02;
const ROUGHNESS: f64 = 0.04;
/// Share of the steps that drop out at all, how often such a step begins to (per scan), and the chance
/// that a drop-out goes on for one more scan.
const WEAK_SHARE: f64 = 0.08;
const WEAK_BEGINS: (f64, f64) = (0.02, 0.10);
const WEAK_GOES_ON: f64 = 0.5;
/// A drop-out is over after so many scans: the chance of a longer one is 1 in 4096.
const LONGEST_DROP_OUT: u64 = 12;

/// Whether a sensor in a scene is a real one or a perfect one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseLevel {
    /// As recorded from real sensors.
    #[default]
    Real,
    /// Exact ranges; only the reach ends.
    None,
}

/// One sensor's own noise: the same seed and number give the same sensor.
#[derive(Clone, Debug)]
pub struct Noise {
    level: NoiseLevel,
    optics: Optics,
    seed: u64,
    sensor: u64,
    scale: f64,
    /// Per step: factor on the reach.
    roughness: Vec<f64>,
    /// Per step: the reading without a return.
    nothing: Vec<u32>,
    /// Steps that drop out, and how often they begin to.
    weak: Vec<(usize, f64)>,
}

impl Noise {
    /// Sensor number `sensor` of a scene.
    #[must_use]
    pub fn new(level: NoiseLevel, optics: Optics, seed: u64, sensor: u64) -> Self {
        let mut stream = Stream::new(seed, Purpose::Sensor, [sensor, 0]);
        let steps = optics.geometry.steps();
        let scale = 1.0 + stream.between(-0.005, 0.005);
        let roughness = (0..steps).map(|_| 1.0 + ROUGHNESS * stream.normal().clamp(-2.5, 2.5)).collect();
        // Codes come in runs of about twenty steps.
        let mut code = optics::choose(optics.nothing, stream.uniform());
        let mut next_code = || {
            if stream.chance(0.05) {
                code = optics::choose(optics.nothing, stream.uniform());
            }
            code
        };
        let nothing = (0..steps).map(|_| next_code()).collect();
        let mut weak = Vec::new();
        for step in 0..steps {
            if stream.chance(WEAK_SHARE) {
                weak.push((step, stream.between(WEAK_BEGINS.0, WEAK_BEGINS.1)));
            }
        }
        Self { level, optics, seed, sensor, scale, roughness, nothing, weak }
    }

    /// The readings of the scan that began at `start_us`, one for each entry of `seen`.
    #[must_use]
    pub fn readings(&self, start_us: u64, seen: &[Option<Seen>]) -> Vec<u32> {
        match self.level {
            NoiseLevel::None => self.exact(seen),
            NoiseLevel::Real => self.real(start_us, seen),
        }
    }

    fn exact(&self, seen: &[Option<Seen>]) -> Vec<u32> {
        let within = |seen: &&Seen| seen.range_m < self.optics.reach_m(seen.reflectance, seen.incidence);
        let ranges: Vec<Option<f64>> =
            seen.iter().map(|seen| seen.as_ref().filter(within).map(|seen| seen.range_m * 1000.0)).collect();
        self.encoded(&ranges, &mut Stream::new(self.seed, Purpose::Edges, [self.sensor, 0]))
    }

    fn real(&self, start_us: u64, seen: &[Option<Seen>]) -> Vec<u32> {
        let mut stream = Stream::new(self.seed, Purpose::Noise, [self.sensor, start_us]);
        let mut wander = stream.normal();
        let fresh = (1.0 - KEPT * KEPT).sqrt();
        let mut before: Option<f64> = None;
        let mut ranges: Vec<Option<f64>> = Vec::with_capacity(seen.len());
        for (seen, roughness) in seen.iter().zip(&self.roughness) {
            wander = KEPT * wander + fresh * stream.normal();
            let own = stream.normal();
            let (fate, tie, wild) = (stream.uniform(), stream.uniform(), stream.uniform());
            let range_mm = seen.as_ref().and_then(|seen| {
                let reach_m = roughness * self.optics.reach_m(seen.reflectance, seen.incidence);
                if !comes_back((seen.range_m / reach_m - 1.0) / FADE_SHARE, fate) {
                    return None;
                }
                let mut error = OWN_SHARE.sqrt() * own + (1.0 - OWN_SHARE).sqrt() * wander;
                if seen.range_m > self.optics.heavy_tails_m {
                    let spread = (1.0 - WILD_SHARE + WILD_SHARE * WILD_FACTOR * WILD_FACTOR).sqrt();
                    error *= if wild < WILD_SHARE { WILD_FACTOR / spread } else { 1.0 / spread };
                }
                let slant = (1.0 / seen.incidence.max(0.25)).sqrt();
                let error_mm = error * self.optics.spread_mm(seen.range_m) * slant + seen.bias_mm;
                let range_mm = (seen.range_m * 1000.0 * self.scale + error_mm).round();
                let tied =
                    before.filter(|before| tie < TIE_SHARE && (before - range_mm).abs() < TIE_LIMIT_MM);
                Some(tied.unwrap_or(range_mm))
            });
            ranges.push(range_mm);
            before = range_mm;
        }
        let mut stream = Stream::new(self.seed, Purpose::Edges, [self.sensor, start_us]);
        mix_edges(seen, &mut ranges, &mut stream);
        self.drop_out(start_us, &mut ranges);
        self.encoded(&ranges, &mut stream)
    }

    /// Steps that drop out now because a drop-out began in this scan or in one shortly before.
    fn drop_out(&self, start_us: u64, ranges: &mut [Option<f64>]) {
        let now = start_us / u64::from(self.optics.geometry.period_us.max(1));
        for age in 0..LONGEST_DROP_OUT.min(now + 1) {
            let mut stream = Stream::new(self.seed, Purpose::DropOut, [self.sensor, now - age]);
            let lasts_longer = libm::pow(WEAK_GOES_ON, age as f64);
            for (step, begins) in &self.weak {
                if stream.chance(begins * lasts_longer)
                    && let Some(range) = ranges.get_mut(*step)
                {
                    *range = None;
                }
            }
        }
    }

    /// Whole millimetres, and codes for what has no range.
    fn encoded(&self, ranges: &[Option<f64>], stream: &mut Stream) -> Vec<u32> {
        let geometry = self.optics.geometry;
        let limits = f64::from(geometry.range_min_mm)..=f64::from(geometry.range_max_mm);
        let sees =
            |index: Option<usize>| index.and_then(|index| ranges.get(index)).is_some_and(Option::is_some);
        let reading = |(step, (range, nothing)): (usize, (&Option<f64>, &u32))| {
            let share = stream.uniform();
            match range.map(f64::round) {
                Some(range_mm) if limits.contains(&range_mm) => range_mm as u32,
                None if sees(step.checked_sub(1)) && sees(Some(step + 1)) => {
                    optics::choose(self.optics.lost, share)
                }
                None if sees(step.checked_sub(1)) || sees(Some(step + 1)) => {
                    self.optics.border.filter(|_| share < 0.5).unwrap_or(*nothing)
                }
                // Also ranges nearer or farther than the sensor can report.
                _ => *nothing,
            }
        };
        ranges.iter().zip(&self.nothing).enumerate().map(reading).collect()
    }
}

/// Whether light comes back that does so with probability 1 / (1 + eᵡ), where `fate` in [0, 1) decides.
fn comes_back(exponent: f64, fate: f64) -> bool {
    // e⁻⁸ is 0.000 34: beyond, nearly every fate is decided without it.
    const FAR: f64 = 8.0;
    const RARE: f64 = 0.0004;
    if exponent < -FAR && fate < 1.0 - RARE {
        return true;
    }
    if exponent > FAR && fate > RARE {
        return false;
    }
    fate < 1.0 / (1.0 + libm::exp(exponent))
}

/// Behind an edge the first reading is sometimes missing and sometimes lies in between: half of the
/// light fell on the nearer thing.
fn mix_edges(seen: &[Option<Seen>], ranges: &mut [Option<f64>], stream: &mut Stream) {
    for step in 1..seen.len().min(ranges.len()) {
        let (Some(left), Some(right)) = (seen[step - 1], seen[step]) else { continue };
        if (left.range_m - right.range_m).abs() < EDGE_M {
            continue;
        }
        let far = if left.range_m > right.range_m { step - 1 } else { step };
        let near_mm = left.range_m.min(right.range_m) * 1000.0;
        let (fate, share) = (stream.uniform(), stream.uniform());
        ranges[far] = match ranges[far] {
            Some(_) if fate < EDGE_LOST_SHARE => None,
            Some(far_mm) if fate < EDGE_LOST_SHARE + EDGE_MIXED_SHARE => {
                Some((near_mm + (far_mm - near_mm) * (0.1 + 0.8 * share)).round())
            }
            range => range,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::optics::SensorModel;

    fn wall(range_m: f64) -> Vec<Option<Seen>> {
        vec![Some(Seen { range_m, incidence: 1.0, reflectance: 0.53, bias_mm: 0.0, thing: 0 }); 682]
    }

    #[test]
    fn a_sensor_without_noise_says_what_is_there() {
        let noise = Noise::new(NoiseLevel::None, SensorModel::Urg04lx.optics(), 1, 0);
        assert_eq!(noise.readings(0, &wall(1.2344)), vec![1234; 682]);
        assert!(noise.readings(0, &wall(7.0)).iter().all(|reading| [0, 6].contains(reading)));
        assert!(noise.readings(0, &vec![None; 682]).iter().all(|reading| [0, 6].contains(reading)));
    }

    #[test]
    fn the_same_scan_of_the_same_sensor_has_the_same_noise_in_whatever_order() {
        let noise = || Noise::new(NoiseLevel::Real, SensorModel::Urg04lx.optics(), 1, 0);
        let (first, second) = (noise(), noise());
        let early = first.readings(100_000, &wall(2.0));
        let late = first.readings(9_000_000, &wall(2.0));
        assert_ne!(early, late);
        assert_eq!(second.readings(9_000_000, &wall(2.0)), late);
        assert_eq!(second.readings(100_000, &wall(2.0)), early);
        let other = Noise::new(NoiseLevel::Real, SensorModel::Urg04lx.optics(), 1, 1);
        assert_ne!(other.readings(100_000, &wall(2.0)), early);
    }

    #[test]
    fn black_clothes_return_nothing_beyond_their_range() {
        let noise = Noise::new(NoiseLevel::Real, SensorModel::Urg04lx.optics(), 1, 0);
        let coat = |range_m| {
            let mut wall = wall(range_m);
            wall.iter_mut().flatten().for_each(|seen| seen.reflectance = 0.04);
            noise.readings(0, &wall).iter().filter(|reading| **reading > 20).count()
        };
        assert!(coat(0.8) > 650);
        assert_eq!(coat(2.0), 0);
    }
}
