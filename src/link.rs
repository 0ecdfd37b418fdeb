//! What the library asks of a board beside `embedded_io_async::{Read, Write}`: time, line speed,
//! datagrams, a store and a watchdog.
//!
//! Nothing here reads a clock or touches a register; a board's folder, and `host-sim`, implement it.

use core::net::SocketAddrV4;

use crate::update::plan::ImageJob;
use crate::update::standing::Standing;

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

/// Lanes for answers: a host that cannot be reached leaves one to the others.
pub const ANSWER_LANES: usize = 2;

/// Which way out a datagram takes. Each has a queue of its own, so that a host that cannot be reached
/// delays no other: in some network stacks a datagram whose receiver answers no ARP blocks all behind it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Lane {
    /// Answers to the requests of any host; lanes count from 0 to [`ANSWER_LANES`] − 1.
    Answers(u8),
    /// What the subscriber in this place is sent unasked; places count from 0.
    Place(u8),
}

/// The datagram could not be queued at once: dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Dropped;

/// Sending datagrams, from the module's one port. No send ever waits.
pub trait Outbox {
    /// Queues a datagram if that is possible at once.
    ///
    /// # Errors
    /// [`Dropped`].
    fn try_send_to(&mut self, lane: Lane, to: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped>;

    /// Whether everything queued in `lane` has left.
    fn is_empty(&mut self, lane: Lane) -> bool;

    /// Throws away what is queued in `lane` and opens its socket anew. The port stays the same.
    fn reopen(&mut self, lane: Lane);
}

/// What a network has lost since the start, before the module could see it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NetworkLosses {
    /// Times the link went down.
    pub links: u32,
    /// Datagrams for the port that there was no room for, or that were damaged.
    pub datagrams: u32,
}

/// A UDP port.
#[allow(async_fn_in_trait, reason = "single-threaded executors: no Send bound is wanted")]
pub trait Datagrams: Outbox {
    /// Waits for a datagram: its length, and its sender. One that does not fit `buffer` is cut to it; so a
    /// buffer one byte longer than any legal datagram shows what is too long.
    ///
    /// # Cancellation
    /// Nothing is lost.
    async fn receive_from(&mut self, buffer: &mut [u8]) -> (usize, SocketAddrV4);

    /// What was lost so far, as far as this network can tell.
    fn losses(&mut self) -> NetworkLosses {
        NetworkLosses::default()
    }
}

/// The record could not be read or written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StoreError;

impl core::fmt::Display for StoreError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the record cannot be read or written")
    }
}

impl core::error::Error for StoreError {}

/// Images of the firmware in flash: where one is put that comes, and what the boot loader is told of it.
#[allow(async_fn_in_trait, reason = "single-threaded executors: no Send bound is wanted")]
pub trait Images {
    /// Does a job; returns how the module stood with its images before it. May stop everything else for as long as a
    /// page takes to erase.
    ///
    /// # Errors
    /// [`StoreError`]: flash does not work, or there is no boot loader. An image that was coming cannot be completed.
    ///
    /// # Cancellation
    /// As a loss of power: the job may be done, or begun.
    async fn images(&mut self, job: ImageJob<'_>) -> Result<Standing, StoreError>;
}

/// Numbered records that survive a loss of power: at any moment a record has its old or its new value.
#[allow(async_fn_in_trait, reason = "single-threaded executors: no Send bound is wanted")]
pub trait Store {
    /// Reads record `key` to the start of `buffer`: its length, or nothing when there is none.
    ///
    /// # Errors
    /// [`StoreError`]: unreadable, or longer than `buffer`.
    ///
    /// # Cancellation
    /// Nothing is lost.
    async fn load(&mut self, key: u8, buffer: &mut [u8]) -> Result<Option<usize>, StoreError>;

    /// Writes record `key`, of at most [`RECORD_MAX`] bytes. May take seconds, and stop everything else
    /// meanwhile.
    ///
    /// # Errors
    /// [`StoreError`]; the record has its old or its new value.
    ///
    /// # Cancellation
    /// As a loss of power: the record has its old or its new value.
    async fn save(&mut self, key: u8, record: &[u8]) -> Result<(), StoreError>;
}

/// Longest record, bytes.
pub const RECORD_MAX: usize = 1024;

/// Something that starts the module anew unless it is fed.
pub trait Watchdog {
    /// Feeds it: to be done once a second at least.
    fn feed(&mut self);
}

/// A word of memory that a reset spares and a loss of power does not.
pub trait ResetMemory {
    /// What was written last; anything after a loss of power.
    fn read(&mut self) -> u32;
    /// Writes it.
    fn write(&mut self, word: u32);
}

impl<T: Clock> Clock for &T {
    fn now_us(&self) -> u64 {
        (*self).now_us()
    }

    async fn wait_until(&self, at_us: u64) {
        (*self).wait_until(at_us).await;
    }
}
