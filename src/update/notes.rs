//! Two pages of flash that image and boot loader share: what may start, and what has become of the last image received.
//!
//! ```text
//!   page 0   least versions, a word each: version 6, its complement 6, 4 × a5       never erased: a version only rises
//!   page 1    0  manifest of the image received last             192                erased by the next one
//!           192  complete     all of the image is there            16               by the image that runs
//!           208  outcome      tried, or why not                    16               by the boot loader
//!           224  reverted     it has not confirmed itself          16               by the boot loader
//!           240  confirmed    it works                             16               by that image
//!           256  told         a host was told of the outcome       16               by the image that runs
//! ```
//!
//! Each word is written once and is the largest of all boards. A word that a loss of power left half written is not
//! written, but of the last three: what they say was true before they were begun, and they cannot be written again.

use super::Version;
use super::manifest::{MANIFEST_LEN, Manifest};

/// Bytes of a word: the largest of the boards'.
pub const WORD_LEN: usize = 16;
/// Bytes of page 1 that are used.
pub const CANDIDATE_LEN: usize = MANIFEST_LEN + 5 * WORD_LEN;

/// Where its marks are in page 1.
pub const COMPLETE: u32 = MANIFEST_LEN as u32;
/// See [`COMPLETE`].
pub const OUTCOME: u32 = COMPLETE + WORD_LEN as u32;
/// See [`COMPLETE`].
pub const REVERTED: u32 = OUTCOME + WORD_LEN as u32;
/// See [`COMPLETE`].
pub const CONFIRMED: u32 = REVERTED + WORD_LEN as u32;
/// See [`COMPLETE`].
pub const TOLD: u32 = CONFIRMED + WORD_LEN as u32;

/// What a mark is made of.
const MARK: u8 = 0x5a;
const FRAME: [u8; 4] = [0xa5; 4];

/// Why an image is not tried.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Fault {
    /// Its signature is not that of a maker the boot loader knows.
    Forged,
    /// It is not what its manifest says: other bytes, or more than there is room for.
    Damaged,
    /// It is for another board or is another program.
    OtherProgram,
    /// Its version is below the least that may start.
    TooOld,
}

impl Fault {
    const ALL: [(Self, u8); 4] =
        [(Self::Forged, 0x11), (Self::Damaged, 0x22), (Self::OtherProgram, 0x33), (Self::TooOld, 0x44)];

    /// The word that says so, for [`OUTCOME`].
    #[must_use]
    pub fn word(self) -> [u8; WORD_LEN] {
        let code = Self::ALL.iter().find(|(fault, _)| *fault == self).map_or(MARK, |(_, code)| *code);
        [code; WORD_LEN]
    }
}

/// The word of a mark that says yes: complete, tried, reverted, confirmed.
#[must_use]
pub const fn mark() -> [u8; WORD_LEN] {
    [MARK; WORD_LEN]
}

/// What has become of the image that was received last.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stage {
    /// Not all of it has come.
    Receiving,
    /// All of it is there: the boot loader is to look at it.
    Complete,
    /// The boot loader will not try it.
    Refused(Fault),
    /// It is being tried.
    Tried,
    /// It has not confirmed itself: the one before runs again.
    Reverted,
    /// It runs, and works.
    Confirmed,
}

/// The image that was received last.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Candidate {
    /// What it says of itself, as it came: its signature may be anything.
    pub manifest: Manifest,
    /// How far it has come.
    pub stage: Stage,
    /// Hosts were told of it.
    pub is_told: bool,
}

impl Candidate {
    /// Reads the first bytes of page 1; none if no image was ever received, or the page does not show which.
    #[must_use]
    pub fn read(page: &[u8; CANDIDATE_LEN]) -> Option<Self> {
        let (manifest, marks) = page.split_first_chunk::<MANIFEST_LEN>()?;
        let manifest = Manifest::read(manifest).ok()?;
        let words = marks.as_chunks::<WORD_LEN>().0;
        let word = |index: usize| words.get(index).and_then(same);
        let is_begun = |index: usize| words.get(index).is_some_and(|word| *word != [0xff; WORD_LEN]);
        let stage = match [word(0), word(1)] {
            _ if is_begun(3) => Stage::Confirmed,
            _ if is_begun(2) => Stage::Reverted,
            [_, Some(MARK)] => Stage::Tried,
            [Some(MARK), Some(code)] => match Fault::ALL.iter().find(|(_, known)| *known == code) {
                Some((fault, _)) => Stage::Refused(*fault),
                None => Stage::Complete,
            },
            [Some(MARK), None] => Stage::Complete,
            _ => Stage::Receiving,
        };
        Some(Self { manifest, stage, is_told: is_begun(4) })
    }
}

/// The byte of a word whose bytes are all the same.
fn same(word: &[u8; WORD_LEN]) -> Option<u8> {
    let [first, rest @ ..] = word;
    rest.iter().all(|byte| byte == first).then_some(*first)
}

/// The word in page 0 that says that no image below `version` may start.
#[must_use]
pub fn least_word(version: Version) -> [u8; WORD_LEN] {
    let mut word = [0; WORD_LEN];
    let bytes = version.bytes();
    let all = bytes.into_iter().chain(bytes.map(|byte| !byte)).chain(FRAME);
    word.iter_mut().zip(all).for_each(|(place, byte)| *place = byte);
    word
}

/// What such a word says; none if it is not whole.
#[must_use]
pub fn least_of(word: &[u8; WORD_LEN]) -> Option<Version> {
    let (version, _) = word.split_first_chunk::<6>()?;
    let version = Version::from_bytes(*version);
    (least_word(version) == *word).then_some(version)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::update::manifest::{SIGNED_LEN, program};

    const MANIFEST: Manifest = Manifest {
        program: [0; 16],
        version: Version([0, 1, 0]),
        least: Version([0, 0, 0]),
        size: 5,
        digest: [9; 64],
    };

    fn page(marks: &[(u32, [u8; WORD_LEN])]) -> [u8; CANDIDATE_LEN] {
        let mut page = [0xff; CANDIDATE_LEN];
        let manifest = Manifest { program: program("x"), ..MANIFEST };
        page[..SIGNED_LEN].copy_from_slice(&manifest.signed_bytes());
        for (at, word) in marks {
            page[*at as usize..][..WORD_LEN].copy_from_slice(word);
        }
        page
    }

    #[test]
    fn the_marks_say_how_far_an_image_has_come() {
        let half = {
            let mut half = mark();
            half[8..].fill(0xff);
            half
        };
        let (complete, tried) = ((COMPLETE, mark()), (OUTCOME, mark()));
        let too_old = (OUTCOME, Fault::TooOld.word());
        type Marks<'a> = &'a [(u32, [u8; WORD_LEN])];
        let all: [(Marks<'_>, Stage); 9] = [
            (&[], Stage::Receiving),
            (&[(COMPLETE, half)], Stage::Receiving),
            (&[complete], Stage::Complete),
            (&[complete, (OUTCOME, half)], Stage::Complete),
            (&[complete, too_old], Stage::Refused(Fault::TooOld)),
            (&[complete, tried], Stage::Tried),
            (&[complete, tried, (REVERTED, mark())], Stage::Reverted),
            (&[complete, tried, (REVERTED, half)], Stage::Reverted),
            (&[complete, tried, (CONFIRMED, half)], Stage::Confirmed),
        ];
        for (marks, stage) in all {
            assert_eq!(Candidate::read(&page(marks)).map(|candidate| candidate.stage), Some(stage));
        }
        assert_eq!(Candidate::read(&[0xff; CANDIDATE_LEN]), None);
    }

    #[test]
    fn a_least_version_counts_only_whole() {
        let version = Version([3, 0, 65_535]);
        let word = least_word(version);
        assert_eq!(least_of(&word), Some(version));
        for length in 0..WORD_LEN {
            let mut cut = word;
            cut[length..].fill(0xff);
            assert_eq!(least_of(&cut), None, "{length}");
        }
    }
}
