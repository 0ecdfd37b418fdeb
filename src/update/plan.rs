//! What is written to flash for an image: computed from what is there, before anything is written.
//!
//! ```text
//!   begin ────▶ notes page 1: erased, manifest
//!   piece ────▶ spare: a page is erased as its first piece comes
//!   complete ─▶ notes page 1: mark                       the module starts anew, the boot loader looks
//!   confirm ──▶ notes: least version, mark; state: booted   the new image works
//! ```
//!
//! The state is `embassy-boot`'s: its first word names it, the words behind it count the steps of a swap. An image is
//! confirmed from its mark on: the boot loader sets a state that power has kept from being set.
//!
//! Source: embassy-boot 0.7, `firmware_updater` (`set_magic`) and `boot_loader` (`read_state`).

use core::ops::Range;

use super::Version;
use super::manifest::MANIFEST_LEN;
use super::notes::{
    CANDIDATE_LEN, COMPLETE, CONFIRMED, Candidate, Stage, TOLD, WORD_LEN, least_of, least_word, mark,
};
use super::slots::Slots;
use super::standing::{Run, Standing};

/// Words by which the state is known.
const BOOTED: u8 = 0xd0;
const SWAPPED: u8 = 0xf0;

/// Most operations for one job: a state takes three, and two notes.
const OPERATIONS: usize = 5;

/// What is to be done to flash for images.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ImageJob<'a> {
    /// Only to look.
    Look,
    /// An image with this manifest is about to come. What had come of another is lost.
    Begin(&'a [u8; MANIFEST_LEN]),
    /// A piece of it, of at most 1024 bytes.
    Write {
        /// Where it begins in the image: a multiple of [`WORD_LEN`].
        offset: u32,
        /// The piece.
        bytes: &'a [u8],
    },
    /// All of it is there: the boot loader is to look at it at the next start.
    Complete,
    /// The image that runs works, and stays.
    Confirm,
    /// Hosts were told what has become of the image received last.
    Told,
}

/// An operation on flash.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Operation<'a> {
    /// Whole pages.
    Erase(Range<u32>),
    /// Whole words, where it is erased.
    Write(u32, &'a [u8]),
    /// A word, or the beginning of one, unless it is there already: words are never written twice.
    Mark(u32, [u8; WORD_LEN], usize),
}

/// Operations, in their order. No `Vec`: its iterator is one more thing that could panic.
pub type Plan<'a> = [Option<Operation<'a>>; OPERATIONS];

/// The flash can hold no such thing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NoRoom;

/// What flash says of images.
#[derive(Clone, Debug)]
pub struct Known {
    /// The greatest version in page 0, and the first word that is erased there.
    least: (Version, Option<u32>),
    candidate: Option<Candidate>,
    /// The first word of the state.
    state: u8,
}

/// The pages of the notes: least versions, and the image received last.
#[must_use]
pub const fn pages(slots: &Slots) -> (Range<u32>, Range<u32>) {
    let middle = slots.notes.start.saturating_add(slots.notes.end.saturating_sub(slots.notes.start) / 2);
    (slots.notes.start..middle, middle..slots.notes.end)
}

impl Known {
    /// Nothing, yet.
    pub const NOTHING: Self = Self { least: (Version([0; 3]), None), candidate: None, state: 0 };

    /// A word of page 0, read in its order; whether the next is to be read, too.
    pub fn least(&mut self, at: u32, word: &[u8; WORD_LEN]) -> bool {
        let (least, room) = &mut self.least;
        if *word == [0xff; WORD_LEN] {
            *room = Some(at);
            return false;
        }
        *least = least_of(word).map_or(*least, |version| version.max(*least));
        true
    }

    /// The beginning of page 1.
    pub fn candidate(&mut self, page: &[u8; CANDIDATE_LEN]) {
        self.candidate = Candidate::read(page);
    }

    /// The first word of the state, as long as the flash writes them.
    pub fn state(&mut self, word: &[u8]) {
        let first = word.first().copied().unwrap_or(0);
        self.state = if word.iter().all(|&byte| byte == first) { first } else { 0 };
    }

    /// How the module stands with its images.
    #[must_use]
    pub fn standing(&self, slots: &Slots) -> Standing {
        let stage = self.candidate.map(|candidate| candidate.stage);
        let run = match (self.state, stage) {
            (SWAPPED, Some(Stage::Confirmed)) => Run::Confirmed,
            (SWAPPED, _) => Run::OnTrial,
            _ => Run::Confirmed,
        };
        let outcome = self.candidate.filter(|candidate| !candidate.is_told).map(|candidate| candidate.stage);
        // What its confirmation will note counts from then on, without another look at flash.
        let least = match (run, self.candidate) {
            (Run::OnTrial, Some(candidate)) => self.least.0.max(candidate.manifest.least),
            _ => self.least.0,
        };
        Standing { room: slots.active.end.saturating_sub(slots.active.start), least, run, outcome }
    }

    /// What is to be done for a job, on flash with such pages and words.
    ///
    /// # Errors
    /// [`NoRoom`].
    pub fn plan<'a>(
        &self,
        job: ImageJob<'a>,
        slots: &Slots,
        (page_len, word_len): (usize, usize),
    ) -> Result<Plan<'a>, NoRoom> {
        let mut plan = [const { None }; OPERATIONS];
        let mut places = plan.iter_mut();
        let mut add = |operation| places.next().map(|place| *place = Some(operation)).ok_or(NoRoom);
        let (_, page) = pages(slots);
        let note = |at: u32| Operation::Mark(page.start.saturating_add(at), mark(), WORD_LEN);
        match job {
            ImageJob::Look => {}
            ImageJob::Begin(manifest) => {
                add(Operation::Erase(page.clone()))?;
                add(Operation::Write(page.start, manifest))?;
            }
            ImageJob::Write { offset, bytes } => {
                let from = slots.spare.start.checked_add(offset).ok_or(NoRoom)?;
                let to =
                    from.checked_add(bytes.len() as u32).filter(|to| *to <= slots.spare.end).ok_or(NoRoom)?;
                let page_len = page_len as u32;
                // At most one page begins in a piece: it is shorter.
                let first = from.checked_next_multiple_of(page_len).filter(|first| *first < to);
                if let Some(first) = first {
                    add(Operation::Erase(first..first.saturating_add(page_len)))?;
                }
                let (words, rest) = bytes.as_chunks::<WORD_LEN>();
                let words = words.as_flattened();
                if !words.is_empty() {
                    add(Operation::Write(from, words))?;
                }
                if !rest.is_empty() {
                    let mut last = [0xff; WORD_LEN];
                    last.iter_mut().zip(rest).for_each(|(place, &byte)| *place = byte);
                    add(Operation::Mark(from.saturating_add(words.len() as u32), last, WORD_LEN))?;
                }
            }
            ImageJob::Complete => add(note(COMPLETE))?,
            ImageJob::Confirm => {
                if let Some(candidate) = self.candidate {
                    let (least, room) = self.least;
                    if candidate.manifest.least > least {
                        add(Operation::Mark(
                            room.ok_or(NoRoom)?,
                            least_word(candidate.manifest.least),
                            WORD_LEN,
                        ))?;
                    }
                    add(note(CONFIRMED))?;
                }
                if self.state != BOOTED {
                    let at = slots.state.start;
                    // Its count of steps first: half erased, it must not look like a swap that has just begun.
                    let second = at.saturating_add(word_len as u32);
                    add(Operation::Mark(second, [0; WORD_LEN], word_len))?;
                    add(Operation::Erase(slots.state.clone()))?;
                    add(Operation::Mark(at, [BOOTED; WORD_LEN], word_len))?;
                }
            }
            ImageJob::Told => add(note(TOLD))?,
        }
        Ok(plan)
    }
}
