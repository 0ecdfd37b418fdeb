//! Flash whose reads let other tasks run.
//!
//! ```text
//!   read · read · … 32 … · read ─▶ others ─▶ read · …
//! ```
//!
//! A store that power cuts have left with words that cannot be read takes thousands of reads to search: seconds on a
//! slow board. Flash that is never waited for would keep the watchdog from being fed for that long.

use core::pin::Pin;
use core::task::{Context, Poll};

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use pin_project_lite::pin_project;

/// Reads until others run: some milliseconds on a slow board.
const TURN: u8 = 32;

/// `flash`, with turns for others.
#[derive(Clone, Copy, Debug)]
pub struct Cooperative<F> {
    flash: F,
    reads: u8,
}

impl<F> Cooperative<F> {
    /// Takes turns at `flash`.
    pub const fn new(flash: F) -> Self {
        Self { flash, reads: 0 }
    }

    /// The flash itself, without turns.
    pub const fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Gives the flash back.
    pub fn into_flash(self) -> F {
        self.flash
    }
}

pin_project! {
    /// A read, after a turn of others if one is due. Not an `async fn`: each of those can panic once it is over.
    struct Turned<R> {
        is_due: bool,
        #[pin]
        read: R,
    }
}

impl<R: Future> Future for Turned<R> {
    type Output = R::Output;

    fn poll(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<R::Output> {
        let this = self.project();
        if core::mem::take(this.is_due) {
            context.waker().wake_by_ref();
            return Poll::Pending;
        }
        this.read.poll(context)
    }
}

impl<F: NorFlash> ErrorType for Cooperative<F> {
    type Error = F::Error;
}

impl<F: NorFlash> ReadNorFlash for Cooperative<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> impl Future<Output = Result<(), F::Error>> {
        self.reads = self.reads.wrapping_add(1) % TURN;
        Turned { is_due: self.reads == 0, read: self.flash.read(offset, bytes) }
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<F: NorFlash> NorFlash for Cooperative<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> impl Future<Output = Result<(), F::Error>> {
        self.flash.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> impl Future<Output = Result<(), F::Error>> {
        self.flash.write(offset, bytes)
    }
}
