//! The sizes of the bodies in a frame, put into the report that the firmware makes of its fan.
//!
//! ```text
//!   frame ─┬─▶ fan ─▶ SCIP ─▶ firmware ─▶ report: candidates ──┐
//!          │    ranges ◀──────────── are they the same? ───────┤
//!          └─▶ clusters ─▶ size, and whose each bearing is ────┴─▶ report with the size of each candidate
//! ```
//!
//! A scan is known again by its ranges, which arrive as they were measured: no clock takes part. Of a candidate over several
//! bodies the volumes add up, and the highest top counts. A report whose scan is not known any more leaves as it is.

use std::collections::VecDeque;

use kehai::candidate::Candidate;
use kehai::wire::{DATAGRAM_MAX, List, Message, SIZED_MAX, Size};
use kehai_emulator::pc::amended::Amend;
use std::sync::{Mutex, PoisonError};

use crate::camera::Camera;
use crate::cluster::{Density, clusters};
use crate::foreground::Point;
use crate::segment::Segment;

/// Scans that are remembered: a report leaves before the next scan but one, also when the PC is busy.
const REMEMBERED: usize = 4;

/// A body that has fewer than this share of the bearings of a candidate's largest one is its neighbour's edge.
const SHARE: f64 = 0.25;

/// The bodies in a frame, by bearing.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Bodies {
    /// Range of each bearing, mm.
    ranges_mm: Vec<u32>,
    /// Whose each bearing is: a number in `sizes`.
    whose: Vec<Option<usize>>,
    sizes: Vec<Size>,
}

impl Bodies {
    /// Of the ring of a frame; `nearest` is, by bearing, the number of the nearest point in `points`.
    #[must_use]
    pub fn of(
        ranges_mm: Vec<u32>,
        nearest: &[Option<usize>],
        points: &[Point],
        camera: &Camera,
        density: &Density,
    ) -> Self {
        let plane_m = camera.plane_m();
        let (numbers, upper): (Vec<usize>, Vec<Point>) =
            points.iter().copied().enumerate().filter(|(_, point)| point.place[2] >= plane_m).unzip();
        let mut body_of = vec![None; points.len()];
        let mut sizes = Vec::new();
        for (body, cluster) in clusters(&upper, density).iter().enumerate() {
            let own: Vec<Point> = cluster.iter().filter_map(|&index| upper.get(index).copied()).collect();
            sizes.push(size(&Segment::of(&own)));
            for point in cluster.iter().filter_map(|&index| numbers.get(index)) {
                if let Some(of) = body_of.get_mut(*point) {
                    *of = Some(body);
                }
            }
        }
        let whose = nearest.iter().map(|nearest| body_of.get((*nearest)?).copied()?).collect();
        Self { ranges_mm, whose, sizes }
    }

    /// Whether a candidate was found in this ring.
    fn holds(&self, candidate: &Candidate) -> bool {
        let range_mm = |step: u16| self.ranges_mm.get(usize::from(step)).copied();
        let is_same = |(step, own_mm): (u16, u16)| range_mm(step) == Some(own_mm.into());
        [
            (candidate.first_step, candidate.first_mm),
            (candidate.near_step, candidate.near_mm),
            (candidate.last_step, candidate.last_mm),
        ]
        .into_iter()
        .all(is_same)
    }

    fn size_of(&self, candidate: &Candidate) -> Size {
        let span = usize::from(candidate.first_step)..=usize::from(candidate.last_step);
        let mut bearings = vec![0.0_f64; self.sizes.len()];
        for body in self.whose.get(span).into_iter().flatten().flatten() {
            if let Some(count) = bearings.get_mut(*body) {
                *count += 1.0;
            }
        }
        let most = bearings.iter().copied().fold(0.0, f64::max);
        let counts = self.sizes.iter().zip(bearings).filter(|(_, own)| *own > 0.0 && *own >= SHARE * most);
        counts.fold(Size::UNKNOWN, |sum, (size, _)| Size {
            volume_l: sum.volume_l.saturating_add(size.volume_l),
            top_cm: sum.top_cm.max(size.top_cm),
        })
    }
}

/// As it goes on the wire; a body has a volume of at least a litre and a top of at least a centimetre.
fn size(segment: &Segment) -> Size {
    let volume_l = segment.volume_l.round().clamp(1.0, f32::from(u16::MAX)) as u16;
    Size { volume_l, top_cm: segment.top_cm.round().clamp(1.0, f32::from(u8::MAX)) as u8 }
}

/// The bodies of the latest scans, shared between the source of the ranges and the device's port.
#[derive(Debug, Default)]
pub struct Sizes(Mutex<VecDeque<Bodies>>);

impl Sizes {
    /// Remembers the bodies of the newest scan.
    pub fn remember(&self, bodies: Bodies) {
        let mut scans = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        scans.push_front(bodies);
        scans.truncate(REMEMBERED);
    }
}

impl Amend for Sizes {
    fn amend(&self, datagram: &[u8], room: &mut [u8; DATAGRAM_MAX]) -> Option<usize> {
        let Ok((header, Message::Report(report))) = Message::decode(datagram) else { return None };
        let candidates: Vec<Candidate> = report.candidates.iter().collect();
        if candidates.is_empty() || candidates.len() > SIZED_MAX {
            return None;
        }
        let scans = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let scan = scans.iter().find(|scan| candidates.iter().all(|candidate| scan.holds(candidate)))?;
        let sizes: Vec<Size> = candidates.iter().map(|candidate| scan.size_of(candidate)).collect();
        let sized = kehai::wire::Report { sizes: List::new(&sizes), ..report };
        Message::Report(sized).encode(header.identity, room).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai::wire::{Identity, Report, ReportHead};

    /// Two bodies side by side, and a few bearings that belong to no body.
    fn bodies(near_mm: u32) -> Bodies {
        let (one, two) = (Size { volume_l: 50, top_cm: 171 }, Size { volume_l: 30, top_cm: 120 });
        let whose = [None, Some(0), Some(0), Some(0), Some(0), Some(1), Some(1), None];
        let ranges_mm = vec![4000, near_mm, near_mm - 9, near_mm, near_mm + 5, 2500, 2510, 4000];
        Bodies { ranges_mm, whose: whose.to_vec(), sizes: vec![one, two] }
    }

    fn candidate(bodies: &Bodies, first: u16, last: u16, near: u16) -> Candidate {
        let range_mm = |step: u16| bodies.ranges_mm[usize::from(step)] as u16;
        Candidate {
            first_step: first,
            last_step: last,
            near_step: near,
            first_mm: range_mm(first),
            last_mm: range_mm(last),
            near_mm: range_mm(near),
            ..Candidate::default()
        }
    }

    /// The sizes that a report with these candidates leaves with; None: it leaves as it came.
    fn sent(sizes: &Sizes, candidates: &[Candidate]) -> Option<Vec<Size>> {
        let (candidates, unseen) = (List::new(candidates), List::default());
        let report = Report { head: ReportHead::default(), candidates, unseen, sizes: List::default() };
        let mut bytes = [0; DATAGRAM_MAX];
        let length = Message::Report(report).encode(Identity::default(), &mut bytes).unwrap();
        let mut room = [0; DATAGRAM_MAX];
        let amended = sizes.amend(&bytes[..length], &mut room)?;
        let (_, Message::Report(report)) = Message::decode(&room[..amended]).unwrap() else { panic!() };
        Some(report.sizes.iter().collect())
    }

    #[test]
    fn each_candidate_gets_the_size_of_the_bodies_it_is_of() {
        let (sizes, scan) = (Sizes::default(), bodies(2000));
        sizes.remember(scan.clone());
        let of = |first, last, near| sent(&sizes, &[candidate(&scan, first, last, near)]).unwrap()[0];
        assert_eq!(of(1, 4, 2), Size { volume_l: 50, top_cm: 171 });
        assert_eq!(of(5, 6, 5), Size { volume_l: 30, top_cm: 120 });
        assert_eq!(of(1, 6, 2), Size { volume_l: 80, top_cm: 171 }, "two as one");
        assert_eq!(of(1, 5, 2), Size { volume_l: 80, top_cm: 171 }, "a quarter of the bearings");
        assert_eq!(of(0, 0, 0), Size::UNKNOWN);
    }

    #[test]
    fn a_report_of_another_scan_leaves_as_it_is() {
        let (sizes, scan) = (Sizes::default(), bodies(2000));
        sizes.remember(scan.clone());
        sizes.remember(bodies(2100));
        let own = [candidate(&scan, 1, 4, 2)];
        assert!(sent(&sizes, &own).is_some(), "the scan before");
        (0..REMEMBERED).for_each(|_| sizes.remember(bodies(2100)));
        assert_eq!(sent(&sizes, &own), None);
        assert_eq!(sent(&sizes, &[]), None);
        let many = vec![candidate(&bodies(2100), 1, 4, 2); SIZED_MAX + 1];
        assert_eq!((sent(&sizes, &many), sent(&sizes, &many[1..]).map(|all| all.len())), (None, Some(16)));
        assert_eq!(sizes.amend(b"no datagram", &mut [0; DATAGRAM_MAX]), None);
    }
}
