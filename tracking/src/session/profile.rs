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

    /// Stores a part of a background of `beams` beams.
    pub fn store(&mut self, part: &ProfilePart<'_>, beams: u16, open_range_mm: u16) {
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
            self.version = version;
            let mut empty_mm = vec![0; whole.len()];
            visibility::empty_before(&whole, open_range_mm, &mut empty_mm);
            self.empty_mm = empty_mm.into();
            let wall = |beam: &BeamProfile| if beam.state == BeamState::Wall { beam.far_mm } else { 0 };
            self.walls_mm = whole.iter().map(wall).collect();
            if self.upside_down {
                self.turn_round();
            }
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
