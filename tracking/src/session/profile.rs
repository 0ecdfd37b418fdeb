//! A module's background, put together from its parts.
//!
//! ```text
//!   parts of version v ─▶ all there? ─▶ up to which range each beam is empty when nothing stands before it
//! ```

use std::sync::Arc;

use kehai::background::{BeamProfile, BeamState};
use kehai::visibility;
use kehai::wire::ProfilePart;

/// The newest whole background, and the one being received.
#[derive(Clone, Debug, Default)]
pub struct Profile {
    version: u16,
    /// The background itself: what follows from it follows anew when the range of open beams is set.
    beams: Vec<BeamProfile>,
    /// Up to which range an open beam is empty, mm.
    open_range_mm: u16,
    empty_mm: Arc<[u16]>,
    walls_mm: Arc<[u16]>,
    /// Whether the module hangs head down: both lists are turned round.
    upside_down: bool,
    arriving: Option<Arriving>,
}

#[derive(Clone, Debug)]
struct Arriving {
    version: u16,
    /// Beams by part, as they come.
    parts: Vec<Option<Vec<BeamProfile>>>,
}

impl Profile {
    /// How the module hangs.
    pub fn hang(&mut self, upside_down: bool) {
        if self.upside_down != upside_down {
            self.upside_down = upside_down;
            self.turn_round();
        }
    }

    fn turn_round(&mut self) {
        for list in [&mut self.empty_mm, &mut self.walls_mm] {
            *list = list.iter().rev().copied().collect();
        }
    }

    /// Up to which range an open beam is empty, mm: it counts at once.
    pub fn set_open_range(&mut self, open_range_mm: u16) {
        if self.open_range_mm != open_range_mm {
            self.open_range_mm = open_range_mm;
            self.work_out();
        }
    }

    /// Up to which range an open beam is empty, mm; 0 before it is set.
    pub const fn open_range_mm(&self) -> u16 {
        self.open_range_mm
    }

    /// Works out from the background what is empty and where walls are.
    fn work_out(&mut self) {
        let mut empty_mm = vec![0; self.beams.len()];
        visibility::empty_before(&self.beams, self.open_range_mm, &mut empty_mm);
        self.empty_mm = empty_mm.into();
        let wall = |beam: &BeamProfile| if beam.state == BeamState::Wall { beam.far_mm } else { 0 };
        self.walls_mm = self.beams.iter().map(wall).collect();
        if self.upside_down {
            self.turn_round();
        }
    }

    /// Stores a part of a background of `beams` beams.
    pub fn store(&mut self, part: &ProfilePart<'_>, beams: u16) {
        let Ok(version) = u16::try_from(part.head.object) else { return };
        if self.has(version) {
            return;
        }
        let parts = usize::from(part.head.parts);
        let arriving = match &mut self.arriving {
            Some(arriving) if arriving.version == version && arriving.parts.len() == parts => arriving,
            other => other.insert(Arriving { version, parts: vec![None; parts] }),
        };
        let Some(place) = arriving.parts.get_mut(usize::from(part.head.part)) else { return };
        *place = Some(part.beams.iter().collect());
        if arriving.parts.iter().any(Option::is_none) {
            return;
        }
        let whole: Vec<BeamProfile> = arriving.parts.drain(..).flatten().flatten().collect();
        self.arriving = None;
        if whole.len() == usize::from(beams) {
            (self.version, self.beams) = (version, whole);
            self.work_out();
        }
    }

    /// The parts that this version still lacks, bit i for part i, 0 for all of them; none once it is whole.
    pub fn missing(&self, version: u16) -> Option<u32> {
        if self.has(version) {
            return None;
        }
        let arriving = self.arriving.as_ref().filter(|arriving| arriving.version == version);
        let Some(arriving) = arriving else { return Some(0) };
        let missing = (0..u32::BITS).zip(&arriving.parts).filter(|(_, part)| part.is_none());
        Some(missing.fold(0, |parts, (part, _)| parts | 1 << part))
    }

    /// Whether this version is whole.
    fn has(&self, version: u16) -> bool {
        self.version == version && version != 0
    }

    /// Range of the wall behind each beam, mm; 0 where there is none. Empty before a background is whole.
    pub const fn walls_mm(&self) -> &Arc<[u16]> {
        &self.walls_mm
    }

    /// The same as [`empty_mm`](Self::empty_mm), of the newest background that is whole.
    pub fn newest_empty_mm(&self) -> Option<&Arc<[u16]>> {
        (self.version != 0).then_some(&self.empty_mm)
    }

    /// Up to which range each beam is empty when nothing stands before it; nothing is known of another version.
    pub fn empty_mm(&self, version: u16, beams: u16) -> Arc<[u16]> {
        if self.has(version) { Arc::clone(&self.empty_mm) } else { vec![0; usize::from(beams)].into() }
    }
}

#[cfg(test)]
mod tests {
    use kehai::wire::{List, PartHead};

    use super::*;

    #[test]
    fn another_range_of_open_beams_counts_for_the_background_that_is_known() {
        let open = BeamProfile { state: BeamState::Open, ..BeamProfile::default() };
        let wall = BeamProfile { far_mm: 3000, spread_mm: 10, state: BeamState::Wall, ..open };
        let beams: Vec<BeamProfile> = (0..8).map(|beam| if beam < 7 { open } else { wall }).collect();
        let head = PartHead { object: 1, part: 0, parts: 1, first_step: 0, setup: 1 };
        let mut profile = Profile::default();
        profile.set_open_range(4000);
        profile.store(&ProfilePart { head, beams: List::new(&beams) }, 8);
        let known = profile.empty_mm(1, 8);
        assert_eq!(known[0], 4000);
        profile.set_open_range(1500);
        let (empty_mm, walls_mm) = (profile.empty_mm(1, 8), Arc::clone(profile.walls_mm()));
        assert_eq!((empty_mm[0], empty_mm[7], walls_mm[7]), (1500, known[7], 3000));
        profile.hang(true);
        profile.set_open_range(1600);
        assert_eq!((profile.empty_mm(1, 8)[7], profile.walls_mm()[0]), (1600, 3000), "turned round once");
        assert_eq!(profile.missing(1), None, "nothing has to be asked for again");
    }
}
