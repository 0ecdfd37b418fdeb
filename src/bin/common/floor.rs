//! A module beside a SensFloor, on whatever board: for [`module::run`](super::module::run).

use embedded_io_async::{Read, Write};
use embedded_storage_async::nor_flash::NorFlash;
use kehai::device::tiles::Tiles;
use kehai::device::{About, Module};
use kehai::link::Baud;
use kehai::tasks::{self, FloorHardware};
use static_cell::StaticCell;

use super::module::Start;
use super::module::clock::BoardClock;

/// The module, in its place; it has no beams. Not inlined, as in `range_finder`.
#[inline(never)]
pub fn make(about: About) -> &'static mut Module<1> {
    static MODULE: StaticCell<Module<1>> = StaticCell::new();
    MODULE.init_with(|| Module::new(about))
}

/// Its tasks, until it is to start anew. The floor's line has one speed.
pub fn operate<'a, Line, Flash, Feed>(
    start: Start<'a, Line, Flash, Feed, Tiles, 1>,
    _: Option<u32>,
) -> impl Future<Output = ()> + use<'a, Line, Flash, Feed>
where
    Line: Read + Write + Baud,
    Flash: NorFlash,
    Feed: FnMut(),
{
    let Start { module, uart: line, driver, datagrams, store, watchdog, notices } = start;
    let (tiles, clock) = (driver.insert(Tiles::new()), BoardClock);
    tasks::run_floor(module, FloorHardware { tiles, line, datagrams, store, watchdog, clock, notices })
}
