//! Flash as the boards have it: pages to erase, words to write once. In memory, or kept in a file; its power can
//! be cut in the middle of any operation. The word that was being written then is half written, or, in flash with
//! error correction, cannot be read until its page is erased.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::rc::Rc;

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Bytes of a page.
pub const PAGE_LEN: usize = 4096;
/// Pages of a module's settings and background: as many as on a board.
pub const PAGES: usize = 32;
/// Bytes of a word: the largest of the boards'.
pub const WORD_LEN: usize = 16;

/// Flash. Clones are the same flash.
#[derive(Clone, Debug)]
pub struct Flash(Rc<RefCell<State>>);

#[derive(Debug)]
struct State {
    bytes: Vec<u8>,
    file: Option<File>,
    /// Writes and erasures until the power goes; the last one is done by half.
    operations_left: Option<u32>,
    operations: u32,
    /// Words that a cut leaves half written cannot be read.
    corrects_errors: bool,
    /// Numbers of the words that cannot be read.
    damaged: BTreeSet<usize>,
    /// Words written a second time: real flash does not allow it.
    rewritten: u32,
}

/// Why an access failed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum FlashError {
    /// Outside the flash, or not at the bounds of its words and pages.
    #[error("no such place in the flash")]
    BadAddress,
    /// The power is off.
    #[error("the power is off")]
    NoPower,
    /// A word whose check bits do not fit.
    #[error("a word cannot be read")]
    Damaged,
    /// The file behind it cannot be written.
    #[error("the file cannot be written")]
    File,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Flash {
    /// Erased flash of so many pages.
    #[must_use]
    pub fn new(pages: usize) -> Self {
        Self::with(vec![0xff; pages * PAGE_LEN], None)
    }

    /// Erased flash with error correction, as the STM32H5 has it.
    #[must_use]
    pub fn with_error_correction(pages: usize) -> Self {
        let flash = Self::new(pages);
        flash.0.borrow_mut().corrects_errors = true;
        flash
    }

    fn with(bytes: Vec<u8>, file: Option<File>) -> Self {
        let state = State {
            bytes,
            file,
            operations_left: None,
            operations: 0,
            corrects_errors: false,
            damaged: BTreeSet::new(),
            rewritten: 0,
        };
        Self(Rc::new(RefCell::new(state)))
    }

    /// Flash of so many pages, kept in a file, which is made if there is none. A file of fewer pages gets more, erased.
    ///
    /// # Errors
    /// The file cannot be opened, or is not of this size.
    pub fn open(path: &Path, pages: usize) -> io::Result<Self> {
        let file = File::options().read(true).write(true).create(true).truncate(false).open(path)?;
        let length = pages * PAGE_LEN;
        let mut bytes = vec![0xff; length];
        match file.metadata()?.len() {
            0 => file.write_all_at(&bytes, 0)?,
            held if held <= length as u64 && held.is_multiple_of(PAGE_LEN as u64) => {
                let held = usize::try_from(held).unwrap_or(length);
                file.read_exact_at(bytes.get_mut(..held).unwrap_or(&mut []), 0)?;
                file.write_all_at(bytes.get(held..).unwrap_or(&[]), held as u64)?;
            }
            held => {
                let wrong = format!("{held} bytes; the settings of a module are {length}");
                return Err(io::Error::new(io::ErrorKind::InvalidData, wrong));
            }
        }
        Ok(Self::with(bytes, Some(file)))
    }

    /// Bytes of the whole.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.borrow().bytes.len()
    }

    /// Whether it has no bytes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Cuts the power in the middle of the `operations`-th write or erasure from now on, 0 for the next.
    pub fn cut_after(&self, operations: u32) {
        self.0.borrow_mut().operations_left = Some(operations);
    }

    /// The power is back. Whether it was off.
    pub fn power_on(&self) -> bool {
        self.0.borrow_mut().operations_left.take() == Some(u32::MAX)
    }

    /// Writes and erasures so far.
    #[must_use]
    pub fn operations(&self) -> u32 {
        self.0.borrow().operations
    }

    /// Words written a second time without an erasure, to other values.
    #[must_use]
    pub fn rewritten(&self) -> u32 {
        self.0.borrow().rewritten
    }

    /// Words that cannot be read.
    #[must_use]
    pub fn damaged(&self) -> usize {
        self.0.borrow().damaged.len()
    }

    /// What it holds.
    #[must_use]
    pub fn contents(&self) -> Vec<u8> {
        self.0.borrow().bytes.clone()
    }

    /// Another flash that holds the same.
    #[must_use]
    pub fn copy(&self) -> Self {
        let copy = Self::with(self.contents(), None);
        {
            let (from, mut to) = (self.0.borrow(), copy.0.borrow_mut());
            (to.corrects_errors, to.damaged) = (from.corrects_errors, from.damaged.clone());
        }
        copy
    }
}

impl State {
    /// Does an operation on `length` bytes from `offset` on, by half if the power goes.
    fn operate(
        &mut self,
        offset: u32,
        length: usize,
        unit: usize,
        value: impl Fn(usize, u8) -> u8,
    ) -> Result<(), FlashError> {
        let offset = offset as usize;
        let aligned = offset.is_multiple_of(unit) && length.is_multiple_of(unit);
        if !aligned || offset + length > self.bytes.len() {
            return Err(FlashError::BadAddress);
        }
        let (done, result) = match self.operations_left {
            Some(u32::MAX) => return Err(FlashError::NoPower),
            Some(0) => {
                self.operations_left = Some(u32::MAX);
                (length / 2, Err(FlashError::NoPower))
            }
            left => {
                self.operations_left = left.map(|left| left - 1);
                (length, Ok(()))
            }
        };
        self.operations += 1;
        for (at, byte) in self.bytes[offset..offset + done].iter_mut().enumerate() {
            *byte = value(at, *byte);
        }
        if unit == PAGE_LEN {
            self.damaged.retain(|word| !(offset..offset + done).contains(&(word * WORD_LEN)));
        }
        if self.corrects_errors && result.is_err() {
            self.damaged.insert((offset + done) / WORD_LEN);
        }
        if let Some(file) = &self.file {
            file.write_all_at(&self.bytes[offset..offset + done], offset as u64)
                .map_err(|_| FlashError::File)?;
        }
        result
    }
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let state = self.0.borrow();
        if state.operations_left == Some(u32::MAX) {
            return Err(FlashError::NoPower);
        }
        let from = offset as usize;
        let part = state.bytes.get(from..from + bytes.len()).ok_or(FlashError::BadAddress)?;
        let words = from / WORD_LEN..(from + bytes.len()).div_ceil(WORD_LEN);
        if state.damaged.range(words).next().is_some() {
            return Err(FlashError::Damaged);
        }
        bytes.copy_from_slice(part);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD_LEN;
    const ERASE_SIZE: usize = PAGE_LEN;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let length = to.checked_sub(from).ok_or(FlashError::BadAddress)?;
        self.0.borrow_mut().operate(from, length as usize, PAGE_LEN, |_, _| 0xff)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let mut state = self.0.borrow_mut();
        let from = offset as usize;
        let written = state.bytes.get(from..from + bytes.len()).unwrap_or(&[]);
        let rewritten = written.iter().zip(bytes).any(|(&was, &is)| was != 0xff && was != is);
        state.rewritten += u32::from(rewritten);
        state.operate(offset, bytes.len(), WORD_LEN, |at, was| was & bytes[at])
    }
}
