//! Packets: eight samples at once, as a scan's beams meet them, each a torso and perhaps an arm that it stretches out.
//!
//! ```text
//!   samples   · · · · · · · · │ · · · · · · · · │ ▬ ▬ ▬ ▬ ▬ ▬ ▬ ▬       those with an arm last
//!                 packet            packet            packet
//!                                            ╭───╮
//!                                       ●╌╌╌╌│╌╌╌│╌╌╌     a torso alone
//!                                        ╲╌╌╌╌▬▬▬│╌╌╌     an arm, and the torso behind it
//! ```
//!
//! Neighbours among the samples mostly come of one, and cover the same beams.

use super::ellipse::{Edge, Ellipses, LANES, Lanes, Layer, Ray};
use super::sample::Sample;
use crate::geometry::Point;

/// What one beam meets of each of eight samples, nearest first.
#[derive(Clone, Copy, Debug)]
pub struct Met {
    pub near: Layer,
    pub far: Option<Layer>,
}

/// See the module.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    torsos: Ellipses,
    arms: Option<Ellipses>,
    /// Places of its samples among all, of which the first `len` count.
    places: [u16; LANES],
    len: usize,
}

impl Packet {
    /// All of these samples, as rays from `origin` meet them a time after their own.
    pub fn all(samples: &[Sample], origin: Point, delay_s: f64) -> Vec<Self> {
        let places: Vec<u16> = (0..).zip(samples).map(|(place, _)| place).collect();
        Self::some(samples, &places, (origin, delay_s), true)
    }

    /// Those at some places. Unless `with_arms` without the arms that they stretch out.
    pub fn some(samples: &[Sample], places: &[u16], seen: (Point, f64), with_arms: bool) -> Vec<Self> {
        let has_arm = |place: &&u16| with_arms && samples[usize::from(**place)].arm.is_some();
        let mut packets = Vec::with_capacity(places.len() / LANES + 2);
        let mut lanes: Vec<u16> = Vec::with_capacity(places.len());
        for is_armed in [false, true] {
            lanes.clear();
            lanes.extend(places.iter().filter(|place| has_arm(place) == is_armed));
            packets.extend(lanes.chunks(LANES).map(|chunk| Self::of(samples, chunk, seen, is_armed)));
        }
        packets
    }

    /// Up to eight, all of them with an arm or none.
    fn of(samples: &[Sample], chunk: &[u16], (origin, delay_s): (Point, f64), is_armed: bool) -> Self {
        let last = chunk.last().copied().unwrap_or(0);
        let mut places = [last; LANES];
        places.iter_mut().zip(chunk).for_each(|(place, own)| *place = *own);
        let (mut torsos, mut arms) = (Lanes::default(), Lanes::default());
        for (lane, place) in places.into_iter().enumerate() {
            let sample = &samples[usize::from(place)];
            let from = origin - sample.velocity * delay_s;
            torsos.put(lane, &sample.torso(), from);
            if let Some(arm) = sample.outline_of_arm() {
                arms.put(lane, &arm, from);
            }
        }
        let arms = is_armed.then(|| Ellipses::of(&arms));
        Self { torsos: Ellipses::of(&torsos), arms, places, len: chunk.len().min(LANES) }
    }

    /// Places of its samples among all, lane by lane; where there are fewer, the last lanes count for nothing.
    pub fn places(&self) -> impl Iterator<Item = usize> {
        self.places.into_iter().take(self.len).map(usize::from)
    }

    /// What some beams meet of each, beam by beam.
    // In one loop with their likelihood there are not registers enough, and every third instruction moves a number.
    #[inline(never)]
    pub fn meet(&self, rays: &[Ray], edge: Edge, met: &mut Vec<Met>) {
        met.clear();
        let torsos = &self.torsos;
        let Some(arms) = &self.arms else {
            met.extend(rays.iter().map(|ray| Met { near: torsos.meet(ray, edge), far: None }));
            return;
        };
        met.extend(rays.iter().map(|ray| {
            let (torso, arm) = (torsos.meet(ray, edge), arms.meet(ray, edge));
            let is_before = arm.range_m.simd_lt(torso.range_m);
            let of = |yes: Layer, no: Layer| Layer {
                opacity: is_before.bitselect(yes.opacity, no.opacity),
                range_m: is_before.bitselect(yes.range_m, no.range_m),
            };
            Met { near: of(arm, torso), far: Some(of(torso, arm)) }
        }));
    }

    /// No part of them is nearer to the origin, m.
    pub fn nearest_m(&self) -> f32 {
        let arm_m = self.arms.as_ref().map_or(f32::INFINITY, Ellipses::nearest_m);
        self.torsos.nearest_m().min(arm_m)
    }

    /// The angles from a direction between which all that they cover lies.
    pub fn shadow_rad(&self, towards: Point) -> (f64, f64) {
        let torso = self.torsos.shadow_rad(towards);
        let arm = self.arms.as_ref().map_or(torso, |arms| arms.shadow_rad(towards));
        (torso.0.min(arm.0), torso.1.max(arm.1))
    }
}

#[cfg(test)]
mod tests {
    use super::super::sample::Arm;
    use super::*;

    fn sample(at: Point, arm: Option<Arm>) -> Sample {
        let heading = Point::new(-1.0, 0.0);
        Sample { arm, ..Sample::new(at, Point::default(), heading) }
    }

    #[test]
    fn an_arm_before_the_torso_is_met_first_and_one_beside_it_alone() {
        // Two metres ahead, it looks at the module and reaches towards it and to one side.
        let arm = Some(Arm { hand: Point::new(0.4, 0.4), is_level: true });
        let samples = [sample(Point::new(2.0, 0.0), arm)];
        let packet = Packet::all(&samples, Point::default(), 0.0)[0];
        let (mut both, mut alone) = (0, 0);
        for step in -50..50 {
            let ray = Ray::along(Point::towards(0.01 * f64::from(step)));
            let mut met = Vec::new();
            packet.meet(&[ray], Edge::of(true), &mut met);
            let met = met[0];
            let far = met.far.unwrap();
            let first = |lanes: wide::f32x8| lanes.to_array()[0];
            assert!(first(met.near.range_m) <= first(far.range_m), "{met:?}");
            both += i32::from(first(met.near.opacity) > 0.0 && first(far.opacity) > 0.0);
            alone += i32::from(first(met.near.opacity) > 0.0 && first(far.opacity) == 0.0);
        }
        assert!(both > 0 && alone > 0, "{both} before the torso, {alone} beside it");
    }

    #[test]
    fn every_sample_is_in_one_packet_and_none_with_an_arm_beside_one_without() {
        let arm = Arm { hand: Point::new(0.4, 0.0), is_level: true };
        let one = |number: usize| {
            let at = Point::towards(0.7 * number as f64) * 2.0;
            sample(at, number.is_multiple_of(3).then_some(arm))
        };
        let samples: Vec<Sample> = (0..29).map(one).collect();
        let mut found: Vec<usize> = Vec::new();
        for packet in Packet::all(&samples, Point::default(), 0.0) {
            let places: Vec<usize> = packet.places().collect();
            assert!(places.iter().all(|place| samples[*place].arm.is_some() == packet.arms.is_some()));
            found.extend(places);
        }
        found.sort_unstable();
        assert_eq!(found, (0..29).collect::<Vec<_>>());
    }
}
