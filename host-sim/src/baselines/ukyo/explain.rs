//! What the assignment left over, and what follows from it: figures 6 and 7 of the paper, and its filter updates.

use super::axis::Axis;
use super::{BETA, Derived, Extent, FRAMES, REMEMBERED, Track, Ukyo, WHOLE_LITRES};

/// Box and volume of a segment, litres.
type Seen = (Extent, f64);

impl Ukyo {
    /// Why a track has no segment.
    pub(super) fn explain_tracks(&mut self, seen: &[Seen], free: &mut [bool]) {
        for index in 0..self.tracks.len() {
            let (id, at) = (self.tracks[index].id, self.tracks[index].at());
            if self.tracks[index].segment.is_some() || self.has_derived(id) {
                continue;
            }
            let within =
                (0..seen.len()).find(|segment| seen[*segment].0.holds(seen[*segment].0.middle(), at));
            let Some(segment) = within else {
                self.tracks[index].missed += 1;
                continue;
            };
            if self.tracks[index].derived.is_some() {
                // What it came from has its segments again.
                self.tracks[index].missed = FRAMES;
                continue;
            }
            let with = self.tracks.iter().position(|other| other.id != id && other.segment == Some(segment));
            if let Some(with) = with {
                self.tracks[with].segment = None;
                let origins = [self.tracks[with].id, id];
                self.derive(Derived::Merged(origins), segment, seen);
                free[segment] = false;
            } else {
                self.tracks[index].missed += 1;
            }
        }
    }

    /// Why a segment has no track.
    pub(super) fn explain_segments(&mut self, seen: &[Seen], free: &mut [bool]) {
        for segment in 0..seen.len() {
            if !free[segment] {
                continue;
            }
            free[segment] = false;
            let (extent, volume_l) = seen[segment];
            let middle = extent.middle();
            let whole = self.tracks.iter().position(|track| {
                track.segment.is_some() && track.derived.is_none() && track.extent.holds(track.at(), middle)
            });
            if let Some(index) = whole
                && !self.has_derived(self.tracks[index].id)
            {
                let of = self.tracks[index].id;
                let Some(other) = self.tracks[index].segment.take() else { continue };
                self.derive(Derived::Split { of }, segment, seen);
                self.derive(Derived::Split { of }, other, seen);
                continue;
            }
            let within =
                |track: &&Track| track.segment.is_none() && !track.is_new && extent.holds(middle, track.at());
            let lost: Vec<u64> = self.tracks.iter().filter(within).map(|track| track.id).collect();
            let lost: Vec<u64> = lost.into_iter().filter(|id| !self.has_derived(*id)).collect();
            if let [one, other, ..] = lost[..] {
                self.derive(Derived::Merged([one, other]), segment, seen);
            } else {
                self.begin(extent, volume_l, segment, None);
            }
        }
    }

    fn has_derived(&self, id: u64) -> bool {
        self.tracks.iter().any(|track| track.is_from(id))
    }

    fn derive(&mut self, derived: Derived, segment: usize, seen: &[Seen]) {
        if let Some((extent, volume_l)) = seen.get(segment) {
            self.begin(*extent, *volume_l, segment, Some(derived));
        }
    }

    /// A new track: where the segment is, with unknown speed.
    fn begin(&mut self, extent: Extent, volume_l: f64, segment: usize, derived: Option<Derived>) {
        self.newest += 1;
        let middle = extent.middle();
        self.tracks.push(Track {
            id: self.newest,
            axes: middle.map(Axis::new),
            extent,
            volumes: vec![volume_l],
            missed: 0,
            matched: 1,
            segment: Some(segment),
            derived,
            before: middle,
            is_new: true,
        });
    }

    /// The filters: of what has a segment, and of what is carried along with what it became.
    pub(super) fn update(&mut self, seen: &[Seen]) {
        let has_gain = self.settings.has_gain;
        for track in self.tracks.iter_mut().filter(|track| !track.is_new) {
            let Some((extent, volume_l)) = track.segment.and_then(|segment| seen.get(segment)) else {
                track.matched = 0;
                continue;
            };
            let largest_l = track.volumes.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            let absolute = (volume_l / WHOLE_LITRES).min(1.0);
            let relative = (volume_l / largest_l).min(1.0);
            let trust = if has_gain { BETA * absolute + (1.0 - BETA) * relative } else { 1.0 };
            let middle = extent.middle();
            track.axes.iter_mut().zip(middle).for_each(|(axis, measured)| axis.update(measured, trust));
            track.extent = *extent;
            track.volumes.push(*volume_l);
            let spare = track.volumes.len().saturating_sub(REMEMBERED);
            track.volumes.drain(..spare);
            (track.matched, track.missed) = (track.matched + 1, 0);
        }
        for index in 0..self.tracks.len() {
            if self.tracks[index].segment.is_some() {
                continue;
            }
            let (id, before) = (self.tracks[index].id, self.tracks[index].before);
            let derived: Vec<&Track> = self.tracks.iter().filter(|track| track.is_from(id)).collect();
            let measured = match derived[..] {
                [one] if !one.is_new && one.segment.is_some() && !self.has_derived(one.id) => {
                    let now = one.at();
                    Some([0, 1, 2].map(|axis: usize| before[axis] + now[axis] - one.before[axis]))
                }
                [one, other] if one.segment.is_some() && other.segment.is_some() => {
                    Some(one.extent.with(&other.extent).middle())
                }
                _ => None,
            };
            if let Some(measured) = measured {
                let axes = &mut self.tracks[index].axes;
                axes.iter_mut().zip(measured).for_each(|(axis, measured)| axis.update(measured, 1.0));
                self.tracks[index].missed = 0;
            }
        }
    }

    /// Ends what has left, and what was derived once its origins are seen by themselves.
    pub(super) fn end(&mut self) {
        let again: Vec<u64> =
            self.tracks.iter().filter(|track| track.matched >= FRAMES).map(|track| track.id).collect();
        let is_over = |track: &Track| match track.derived {
            None => false,
            Some(Derived::Merged(origins)) => origins.iter().all(|origin| again.contains(origin)),
            Some(Derived::Split { of }) => again.contains(&of),
        };
        self.tracks.retain(|track| !is_over(track) && track.missed < FRAMES);
        let ids: Vec<u64> = self.tracks.iter().map(|track| track.id).collect();
        for track in &mut self.tracks {
            let has_origin = match track.derived {
                None => true,
                Some(Derived::Merged(origins)) => origins.iter().any(|origin| ids.contains(origin)),
                Some(Derived::Split { of }) => ids.contains(&of),
            };
            if !has_origin {
                track.derived = None;
            }
        }
    }
}
