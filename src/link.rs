//! What the library asks of a board beside `embedded_io_async::{Read, Write}`: time and line speed.
//!
//! Nothing here reads a clock or touches a register; a board's folder, and `host-sim`, implement it.

/// Time as the module sees it: microseconds since boot, monotonic.
#[allow(async_fn_in_trait, reason = "single-threaded executors: no Send bound is wanted")]
pub trait Clock {
    /// Microseconds since boot.
    fn now_us(&self) -> u64;

    /// Returns once [`now_us`](Self::now_us) is at least `at_us`; at once when it already is.
    ///
    /// # Cancellation
    /// Nothing is lost.
    async fn wait_until(&self, at_us: u64);
}

/// A serial line whose speed can be changed.
#[allow(async_fn_in_trait, reason = "single-threaded executors: no Send bound is wanted")]
pub trait Baud {
    /// Sends what is still in the transmitter, then runs at `rate_baud`. Bytes that arrive during the
    /// change may be lost. Links without a speed (TCP, USB) return at once.
    ///
    /// # Cancellation
    /// The line may be at either speed; call again.
    async fn set_baud(&mut self, rate_baud: u32);
}
