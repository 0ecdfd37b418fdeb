//! Weighing: the samples of one body are weighed by the likelihood of the scan, given all other bodies.
//!
//! ```text
//!   others' fields ─▶ mixture of each beam ─▶ log likelihood ratio of each sample ─▶ weights, existence
//! ```

use super::apart::{Keeper, apart, keepers};
use super::beams::Beams;
use super::cloud::{effective, relatives};
use super::field::Field;
use super::packet::Packet;
use super::ray::Mixture;
use super::sample::{COARSE, FINE, HIDDEN};
use super::scan::{Measured, Scan};
use super::window::Window;
use super::{Part, Rendering};
use crate::geometry::Point;

/// Power of the likelihood in the first look (annealing).
const TEMPER: f64 = 0.3;

/// Effective share of the samples from which on a cloud is where the data is, and a first look need not be tempered.
const THERE: f64 = 0.2;

/// Effective share below which a cloud is resampled.
const WORN: f64 = 0.5;

/// Log likelihood ratios that differ by less say nothing about where a body is.
const FLAT: f64 = 0.01;

/// Hits farther from the middle of a body are not its arm's, m.
const ARM_M: f64 = 0.75;

/// A look at a scan.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Look {
    /// With a tempered likelihood, so that the cloud walks to the data, unless it is there already.
    Coarse,
    /// With the whole likelihood.
    Fine,
}

/// What came of a look.
#[derive(Clone, Copy, Debug, Default)]
pub struct Looked {
    /// What the scan says of the body's existence, as log odds.
    pub evidence: f64,
    /// Whether the scan needs no further look.
    pub done: bool,
    /// Whether the cloud is another than before.
    pub changed: bool,
}

impl Rendering {
    /// One look of one body at a scan: weighs its samples.
    pub(super) fn look(&mut self, index: usize, scan: &Scan, window: &Window, look: Look) -> Looked {
        let mut beams = self.beams(index, scan, window);
        if look == Look::Coarse && self.model.has(Part::Arms) {
            let middle = self.bodies[index].cloud.moments().at;
            let mut unexplained = unexplained((scan, window), &beams);
            unexplained.retain(|place| (*place - middle).length() < ARM_M);
            self.bodies[index].cloud.reach(&unexplained, &mut self.random);
        }
        let body = &self.bodies[index];
        // No scan has looked for it since it was seen. A hidden body is not tried: it would take every arm that its neighbours stretch out.
        let is_lost = body.is_unseen(body.cloud.at_s()) && !body.hidden;
        if self.model.has(Part::Reappearance) && look == Look::Coarse && is_lost {
            self.reappear(index, (scan, window), &beams);
        }
        // After an arm was stretched out: it meets beams that hit something far before the body.
        let packets = Packet::all(self.bodies[index].cloud.samples(), scan.origin(), window.delay_s);
        beams.silence(nearest_m(&packets));
        let is_unknown = || window.beams().all(|beam| scan.measured(beam) == Measured::Unknown);
        let keepers = if self.model.has(Part::Apart) { keepers(&self.bodies, index) } else { Vec::new() };
        if beams.telling().is_empty() && (keepers.is_empty() || is_unknown()) {
            return Looked { evidence: 0.0, done: true, changed: false };
        }
        let aparts = self.aparts(index, &keepers);
        let log_ratios = self.log_ratios(&packets, window, &beams, &aparts);
        let (least, most) =
            log_ratios.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &ratio| {
                (least.min(ratio), most.max(ratio))
            });
        let at_s = self.bodies[index].cloud.at_s();
        let body = &mut self.bodies[index];
        let way = body.way(self.terrain.ground(self.model, scan), at_s);
        let whole = body.cloud.weighed(&log_ratios, 1.0);
        let tempered = look == Look::Coarse && effective(&whole) < THERE;
        if most - least > FLAT {
            if tempered {
                body.cloud.take(body.cloud.weighed(&log_ratios, TEMPER));
                body.cloud.resample(COARSE, way, &mut self.random);
            } else {
                let worn = effective(&whole) < WORN;
                body.cloud.take(whole);
                if worn {
                    body.cloud.resample(if body.hidden { HIDDEN } else { FINE }, way, &mut self.random);
                }
            }
        }
        let of = if self.model.has(Part::BestQuarter) { 4 } else { 1 };
        // How little room a body has beside others is no news of this scan. Counted again by each, it would delete every person who
        // waits hidden.
        let is_known = !keepers.is_empty() && self.bodies[index].confirmed && self.model.has(Part::Room);
        let room = if is_known { best(aparts, of) } else { 0.0 };
        let evidence = self.beyond_a_limb(index, best(log_ratios, of) - room);
        Looked { evidence, done: !tempered, changed: true }
    }

    /// Log likelihood of each sample of a body that it does not overlap the others.
    fn aparts(&self, index: usize, keepers: &[Keeper]) -> Vec<f64> {
        let samples = self.bodies[index].cloud.samples().iter();
        samples.map(|sample| apart(sample.at, sample.heading, keepers)).collect()
    }

    /// Log likelihood of the scan with each sample of a body over that without it.
    fn log_ratios(&self, packets: &[Packet], window: &Window, beams: &Beams, aparts: &[f64]) -> Vec<f64> {
        let (mut log_ratios, mut met) = (aparts.to_vec(), Vec::with_capacity(window.len()));
        for packet in packets {
            let ratios = beams.ratios(packet, window, self.edge, &mut met);
            for (place, ratio) in packet.places().zip(ratios) {
                log_ratios[place] += window.weight * libm::log(ratio.max(1e-300));
            }
        }
        log_ratios
    }

    /// Lets a body that no scan has looked for since it was seen come into view where something is that no body explains.
    fn reappear(&mut self, index: usize, (scan, window): (&Scan, &Window), beams: &Beams) {
        let contours = unexplained((scan, window), beams);
        let body = &mut self.bodies[index];
        let kernel_m = body.kernel_m(body.cloud.at_s());
        let walls = &self.terrain.plan.walls;
        let may_go = |from: Point, to: Point| !walls.between(from, to);
        body.cloud.reappear(&contours, (scan.origin(), kernel_m), may_go, &mut self.random);
    }

    /// The beams of a window without this body.
    fn beams(&self, index: usize, scan: &Scan, window: &Window) -> Beams {
        let unarmed = self.unarmed(index, scan);
        let others = self.fields.iter().filter(|(other, _)| *other != index);
        let shown = others.map(|(number, field)| {
            unarmed.iter().find(|(other, _)| other == number).map_or(field, |(_, torso)| torso)
        });
        let others: Vec<&Field> = shown.filter(|field| field.meets(window)).collect();
        Beams::of(scan, window, &others)
    }
}

/// No part of these samples is nearer to the module, m.
fn nearest_m(packets: &[Packet]) -> f64 {
    f64::from(packets.iter().map(Packet::nearest_m).fold(f32::INFINITY, f32::min))
}

/// Where something is that no other body explains.
fn unexplained((scan, window): (&Scan, &Window), beams: &Beams) -> Vec<Point> {
    let hit = |(beam, mixture): (usize, &Mixture)| {
        let Measured::Hit(range_m) = scan.measured(beam) else { return None };
        mixture.is_clutter().then(|| scan.origin() + scan.towards(beam) * range_m)
    };
    window.beams().zip(beams.mixtures()).filter_map(hit).collect()
}

/// Log mean of the exponentials of the best part, one in `of`: is there any place that the scan does not contradict?
pub fn best(mut ratios: Vec<f64>, of: usize) -> f64 {
    let count = (ratios.len() / of).max(1);
    if ratios.is_empty() {
        return 0.0;
    }
    ratios.select_nth_unstable_by(count - 1, |one, other| other.total_cmp(one));
    ratios.truncate(count);
    let most = ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = relatives(&ratios, 1.0).into_iter().sum();
    most + libm::log(sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::super::body::{Body, SURE};
    use super::super::cloud::Cloud;
    use super::super::field::render;
    use super::super::model::RenderingModel;
    use super::super::sample::Sample;
    use super::super::window::window;
    use super::*;
    use crate::site::Site;

    /// A body far behind others that stand anywhere before it, and one beside it.
    fn behind_others(places_m: &[f64], beside_m: f64) -> (Rendering, Scan, Vec<Window>) {
        let site: Site = toml::from_str("[[module]]\nname = 'm'\nx = 0\ny = 0\nyaw_deg = 0").unwrap();
        let mut tracker = Rendering::new(&site, RenderingModel::default());
        let mut scan = Scan::at_origin();
        let body = |id, x_m: f64, places_m: &[f64]| {
            let sample =
                |&y_m: &f64| Sample::new(Point::new(x_m, y_m), Point::default(), Point::new(0.0, 1.0));
            Body::begin(id, SURE, Cloud::new(places_m.iter().map(sample).collect(), 0.0))
        };
        // Two bodies far behind one that may stand anywhere before them: one of these stands where the other may be.
        scan.set(vec![Measured::Hit(0.75); scan.beams()]);
        let before: Vec<f64> = (-5..11).map(|place| 0.1 * f64::from(place)).collect();
        tracker.bodies = vec![body(1, 3.0, places_m), body(2, 3.0, &[beside_m]), body(3, 1.0, &before)];
        let windows: Vec<Window> =
            tracker.bodies.iter().map(|body| window(body, &scan, 1).unwrap()).collect();
        let rendered = tracker.bodies.iter().zip(&windows);
        let fields = rendered.map(|(body, window)| render(body, &scan, window, tracker.edge));
        tracker.fields = fields.enumerate().collect();
        (tracker, scan, windows)
    }

    #[test]
    fn a_body_that_no_beam_tells_of_is_kept_out_of_another() {
        let (mut tracker, scan, windows) = behind_others(&[0.0, 0.8], 0.0);
        let mut beams = tracker.beams(0, &scan, &windows[0]);
        let samples = tracker.bodies[0].cloud.samples();
        let packets = Packet::all(samples, scan.origin(), windows[0].delay_s);
        beams.silence(nearest_m(&packets));
        assert!(beams.telling().is_empty());
        tracker.look(0, &scan, &windows[0], Look::Fine);
        let at = tracker.bodies[0].cloud.moments().at;
        assert!(at.y > 0.75, "{at:?}");
    }

    #[test]
    fn how_little_room_a_body_has_is_no_evidence() {
        let evidence = |confirmed, without| {
            // The other is 5 cm nearer than two bodies leave each other room.
            let (mut tracker, scan, windows) = behind_others(&[0.0, 0.01], 0.35);
            tracker.model.without = without;
            tracker.bodies[0].confirmed = confirmed;
            tracker.look(0, &scan, &windows[0], Look::Fine).evidence
        };
        assert!(evidence(true, None).abs() < 0.01);
        assert!(evidence(true, Some(Part::Room)) < -0.3);
        assert!(evidence(false, None) < -0.3, "a tentative one may be the arm of the other");
    }
}
