//! Flash of single bytes, as the RP2350 has it, whose power can be cut in the midst of an operation.

use std::cell::RefCell;
use std::rc::Rc;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

use super::{PAGE, Power};

#[derive(Debug)]
struct State {
    bytes: Vec<u8>,
    left: Option<u32>,
    operations: u32,
    is_off: bool,
}

/// Flash. Clones are the same flash.
#[derive(Clone, Debug)]
pub struct Bytewise(Rc<RefCell<State>>);

impl Bytewise {
    pub fn new(pages: u32) -> Self {
        let bytes = vec![0xff; (pages * PAGE) as usize];
        Self(Rc::new(RefCell::new(State { bytes, left: None, operations: 0, is_off: false })))
    }

    fn operate(
        &self,
        at: u32,
        len: usize,
        change: impl Fn(usize, u8) -> u8,
    ) -> Result<(), NorFlashErrorKind> {
        let mut state = self.0.borrow_mut();
        if state.is_off {
            return Err(NorFlashErrorKind::Other);
        }
        let done = if state.left == Some(0) { len / 2 } else { len };
        state.is_off = state.left == Some(0);
        state.left = state.left.map(|left| left.saturating_sub(1));
        state.operations += 1;
        let slice = state.bytes.get_mut(at as usize..at as usize + done);
        for (index, byte) in slice.ok_or(NorFlashErrorKind::OutOfBounds)?.iter_mut().enumerate() {
            *byte = change(index, *byte);
        }
        if state.is_off { Err(NorFlashErrorKind::Other) } else { Ok(()) }
    }
}

impl Power for Bytewise {
    fn copy(&self) -> Self {
        let copy = Self::new(0);
        copy.0.borrow_mut().bytes = self.contents();
        copy
    }

    fn cut_after(&self, operations: u32) {
        self.0.borrow_mut().left = Some(operations);
    }

    fn power_on(&self) -> bool {
        let mut state = self.0.borrow_mut();
        state.left = None;
        std::mem::take(&mut state.is_off)
    }

    fn operations(&self) -> u32 {
        self.0.borrow().operations
    }

    fn contents(&self) -> Vec<u8> {
        self.0.borrow().bytes.clone()
    }
}

impl ErrorType for Bytewise {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Bytewise {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, at: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let state = self.0.borrow();
        let found = state.bytes.get(at as usize..at as usize + bytes.len());
        match found {
            _ if state.is_off => Err(NorFlashErrorKind::Other),
            Some(found) => {
                bytes.copy_from_slice(found);
                Ok(())
            }
            None => Err(NorFlashErrorKind::OutOfBounds),
        }
    }

    fn capacity(&self) -> usize {
        self.0.borrow().bytes.len()
    }
}

impl NorFlash for Bytewise {
    const WRITE_SIZE: usize = 1;
    const ERASE_SIZE: usize = PAGE as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.operate(from, (to - from) as usize, |_, _| 0xff)
    }

    async fn write(&mut self, at: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        self.operate(at, bytes.len(), |index, was| was & bytes[index])
    }
}
