//! Updates: which image is received, piece by piece, and whether the one that runs works.
//!
//! ```text
//!   update ──▶ fits? ─▶ work: begin ──┐                      on trial:  scans, a host, a store that works ─▶ wish: confirm
//!   chunk ───▶ next? ─▶ work: write ──┼─▶ flash ─▶ answer               not within 5 min ─▶ start anew: the old one is back
//!   install ─▶ whole? ─▶ work: complete┘
//! ```
//!
//! The image itself is never in memory: its pieces go from the datagram to flash. A start of the module forgets what had
//! come; the boot loader alone decides what starts.

use core::ops::Range;

use super::answers::{Answer, RequestKey};
use super::{Module, Wish};
use crate::link::{Outbox, StoreError};
use crate::update::Version;
use crate::update::manifest::{MANIFEST_LEN, Manifest, program};
use crate::update::notes::{Fault, Stage, WORD_LEN};
use crate::update::plan::ImageJob;
use crate::update::standing::{Run, Standing};
use crate::wire::{EventKind, ImageFault, Message, Refusal};

/// Longest that an image may take to show that it works, µs: a sensor needs 20 s to be found at its slowest, a host a
/// second to subscribe, a network minutes to give an address.
const TRIAL_US: u64 = 300_000_000;

/// Bytes of a signature by which an image that had begun to come is known again.
const ID_LEN: usize = 4;

/// An image that comes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Receiving {
    id: [u8; ID_LEN],
    size: u32,
    /// All bytes before are stored.
    next: u32,
}

/// Whether hosts know what has become of the image received last.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Outcome {
    /// Flash says that they were told, or there is nothing to tell.
    Noted,
    /// Health says it, and no host has listened yet.
    Said,
    /// It was sent to a host: flash is to say so.
    Told,
}

/// What is known of images.
#[derive(Clone, Copy, Debug)]
pub(super) struct Update {
    room: u32,
    least: Version,
    run: Run,
    /// On trial, it has shown that it works.
    works: bool,
    outcome: Outcome,
    receiving: Option<Receiving>,
}

impl Update {
    /// Without a boot loader.
    pub(super) const NONE: Self = Self {
        room: 0,
        least: Version([0; 3]),
        run: Run::Confirmed,
        works: false,
        outcome: Outcome::Noted,
        receiving: None,
    };

    /// Health was sent to a host.
    pub(super) fn health_sent(&mut self) {
        if self.outcome == Outcome::Said {
            self.outcome = Outcome::Told;
        }
    }

    /// Whether flash is to say that a host was told of the outcome.
    pub(super) const fn is_told(&self) -> bool {
        matches!(self.outcome, Outcome::Told)
    }
}

/// What is to be done to flash with the datagram just received.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ImageWork {
    /// What.
    pub step: ImageStep,
    key: RequestKey,
}

/// See [`ImageWork`]. Ranges are of the datagram's bytes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ImageStep {
    /// An image with this manifest is about to come.
    Begin {
        /// Its manifest, in the datagram.
        manifest: Range<usize>,
        /// Bytes of the image.
        size: u32,
        /// Of its signature.
        id: [u8; ID_LEN],
    },
    /// A piece of it.
    Write {
        /// Where it begins in the image.
        offset: u32,
        /// The piece, in the datagram.
        bytes: Range<usize>,
    },
    /// All of it has come.
    Complete,
}

impl ImageWork {
    /// The job, with the datagram it came in.
    #[must_use]
    pub fn job<'a>(&self, datagram: &'a [u8]) -> ImageJob<'a> {
        let bytes = |place: &Range<usize>| datagram.get(place.clone()).unwrap_or(&[]);
        match &self.step {
            ImageStep::Begin { manifest, .. } => match bytes(manifest).first_chunk() {
                Some(manifest) => ImageJob::Begin(manifest),
                None => ImageJob::Look,
            },
            ImageStep::Write { offset, bytes: place } => {
                ImageJob::Write { offset: *offset, bytes: bytes(place) }
            }
            ImageStep::Complete => ImageJob::Complete,
        }
    }
}

impl<const BEAMS: usize> Module<BEAMS> {
    /// How the module stands with its images at this start.
    pub fn begin_images(&mut self, standing: Result<Standing, StoreError>) {
        let standing = standing.unwrap_or_else(|StoreError| {
            self.store_failed();
            Standing::NO_BOOT_LOADER
        });
        let Standing { room, least, run, outcome } = standing;
        let kind = match (run, outcome) {
            (Run::OnTrial, _) => Some(EventKind::ImageOnTrial),
            (_, Some(Stage::Reverted)) => Some(EventKind::ImageReverted),
            (_, Some(Stage::Refused(Fault::Forged))) => Some(EventKind::ImageForged),
            (_, Some(Stage::Refused(Fault::Damaged))) => Some(EventKind::ImageDamaged),
            (_, Some(Stage::Refused(Fault::OtherProgram))) => Some(EventKind::ImageOther),
            (_, Some(Stage::Refused(Fault::TooOld))) => Some(EventKind::ImageTooOld),
            (_, Some(Stage::Receiving | Stage::Complete | Stage::Tried | Stage::Confirmed) | None) => None,
        };
        let is_outcome = kind.is_some() && run != Run::OnTrial;
        let outcome = if is_outcome { Outcome::Said } else { Outcome::Noted };
        self.update = Update { room, least, run, outcome, ..Update::NONE };
        if let Some(kind) = kind {
            self.say(kind, 0);
        }
    }

    /// An image is about to come, whose manifest is there in the datagram. None: it goes on.
    pub(super) fn update(
        &self,
        manifest: &[u8; MANIFEST_LEN],
        place: Range<usize>,
    ) -> Result<Option<ImageStep>, Refusal> {
        let Update { room, least, run, receiving, .. } = self.update;
        if room == 0 {
            return Err(Refusal::Unsupported);
        }
        let image = Manifest::read(manifest).map_err(|_| Refusal::Image(ImageFault::Manifest))?;
        let fault = if image.program != program(self.about.board) {
            Some(ImageFault::Program)
        } else if image.version < least {
            Some(ImageFault::TooOld)
        } else if image.size == 0 || image.size > room {
            Some(ImageFault::TooLarge)
        } else {
            // Its spare slot holds the image to go back to.
            (run == Run::OnTrial).then_some(ImageFault::OnTrial)
        };
        if let Some(fault) = fault {
            return Err(Refusal::Image(fault));
        }
        let id = id(manifest);
        let goes_on = receiving.is_some_and(|receiving| receiving.id == id);
        Ok((!goes_on).then_some(ImageStep::Begin { manifest: place, size: image.size, id }))
    }

    /// A piece has come, there in the datagram. None: it is stored already.
    pub(super) fn update_chunk(
        &self,
        offset: u32,
        place: Range<usize>,
    ) -> Result<Option<ImageStep>, Refusal> {
        let len = place.len();
        let sequence = Refusal::Image(ImageFault::Sequence);
        let Receiving { size, next, .. } = self.update.receiving.ok_or(sequence)?;
        let end = offset.checked_add(len as u32).filter(|end| *end <= size).ok_or(sequence)?;
        if end <= next {
            return Ok(None);
        }
        let is_whole = len.is_multiple_of(WORD_LEN) || end == size;
        let write = ImageStep::Write { offset, bytes: place };
        if offset == next && is_whole { Ok(Some(write)) } else { Err(sequence) }
    }

    /// Whether all of an image has come.
    pub(super) fn update_install(&self) -> Result<Option<ImageStep>, Refusal> {
        match self.update.receiving {
            Some(Receiving { size, next, .. }) if size == next => Ok(Some(ImageStep::Complete)),
            _ => Err(Refusal::Image(ImageFault::Sequence)),
        }
    }

    /// Answers a request for an image, or says what is to be done to flash before it is answered.
    pub(super) fn image_wish(
        &mut self,
        key: RequestKey,
        wish: Result<Option<ImageStep>, Refusal>,
        out: &mut impl Outbox,
    ) -> Option<ImageWork> {
        // A restart that is under way answers its request again.
        if self.answers.of(key) == Some(Answer::Done) {
            self.send_answer(key, &Message::Done { request_id: key.request_id }, out);
            return None;
        }
        if self.storing || self.pending.is_some() {
            self.refuse(key, Refusal::Busy, out);
            return None;
        }
        match wish {
            Err(refusal) => self.refuse(key, refusal, out),
            Ok(None) => self.send_receiving(key, out),
            Ok(Some(step)) => return Some(ImageWork { step, key }),
        }
        None
    }

    /// The work is done, or has failed: answers the host.
    pub fn image_done(
        &mut self,
        work: &ImageWork,
        done: Result<(), StoreError>,
        now_us: u64,
        out: &mut impl Outbox,
    ) {
        let ImageWork { step, key } = work;
        self.lanes.choose(*key.from.ip(), now_us, &mut self.counters, out);
        if matches!(step, ImageStep::Begin { .. }) {
            // The notes are those of another image now.
            self.update.outcome = Outcome::Noted;
        }
        if done.is_err() {
            self.update.receiving = None;
            self.store_failed();
            return self.refuse(*key, Refusal::NotStored, out);
        }
        match step {
            ImageStep::Begin { size, id, .. } => {
                self.update.receiving = Some(Receiving { id: *id, size: *size, next: 0 });
                self.send_receiving(*key, out);
            }
            ImageStep::Write { offset, bytes } => {
                if let Some(receiving) = &mut self.update.receiving {
                    receiving.next = offset.saturating_add(bytes.len() as u32);
                }
                self.send_receiving(*key, out);
            }
            ImageStep::Complete => {
                self.restarting = true;
                self.answers.keep(*key, Answer::Done);
                self.event(EventKind::Restarting, *key, now_us);
                self.send_answer(*key, &Message::Done { request_id: key.request_id }, out);
            }
        }
    }

    /// Says how far an image has come.
    fn send_receiving(&mut self, key: RequestKey, out: &mut impl Outbox) {
        let next = self.update.receiving.map_or(0, |receiving| receiving.next);
        self.send_answer(key, &Message::Receiving { request_id: key.request_id, next }, out);
    }

    /// Whether the image that runs has shown that it works: scans come, a host listens, flash takes what it is given.
    pub(super) const fn wants_confirmation(&self) -> bool {
        match self.update.run {
            Run::Confirmed => false,
            Run::OnTrial => self.update.works,
        }
    }

    /// Looks at an image on trial.
    pub(super) fn poll_trial(&mut self, now_us: u64) {
        if self.update.run != Run::OnTrial {
            return;
        }
        let sees = now_us < self.no_scan_us();
        self.update.works = sees && !self.subscribers.is_empty() && !self.store_failed;
        if now_us >= TRIAL_US && !self.update.works {
            self.restarting = true;
        }
    }

    /// When the trial ends, µs.
    pub(super) const fn trial_ends_us(&self) -> Option<u64> {
        match self.update.run {
            Run::OnTrial => Some(TRIAL_US),
            Run::Confirmed => None,
        }
    }

    /// The image that runs is confirmed, or could not be.
    pub fn confirmed(&mut self, done: Result<(), StoreError>, now_us: u64, out: &mut impl Outbox) {
        match done {
            Ok(()) => {
                self.update.run = Run::Confirmed;
                self.say(EventKind::ImageConfirmed, now_us);
            }
            // It goes with the next start, as flash does not work.
            Err(StoreError) => self.store_failed(),
        }
        self.update.works = false;
        self.publish_health(now_us, out);
    }

    /// What a wish has come to that flash is to note something of images.
    pub(crate) fn image_noted(
        &mut self,
        wish: Wish,
        done: Result<(), StoreError>,
        now_us: u64,
        out: &mut impl Outbox,
    ) {
        match wish {
            Wish::Confirm => self.confirmed(done, now_us, out),
            Wish::Told => self.told(done),
            Wish::Store | Wish::Restart => {}
        }
    }

    /// Flash says that a host was told of the outcome, or cannot.
    pub fn told(&mut self, done: Result<(), StoreError>) {
        self.update.outcome = Outcome::Noted;
        if done.is_err() {
            self.store_failed();
        }
    }
}

/// By which an image is known again.
fn id(manifest: &[u8; MANIFEST_LEN]) -> [u8; ID_LEN] {
    let (_, signature) = Manifest::signature(manifest);
    signature.first_chunk().copied().unwrap_or_default()
}
