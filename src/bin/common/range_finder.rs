//! A module beside a range finder, on whatever board: for [`module::run`](super::module::run).

use embedded_io_async::{Read, Write};
use embedded_storage_async::nor_flash::NorFlash;
use kehai::device::{About, Module};
use kehai::link::Baud;
use kehai::scan::MAX_BEAMS;
use kehai::sensor::{Driver, LineSettings};
use kehai::tasks::{self, Hardware};
use static_cell::StaticCell;

use super::module::Start;
use super::module::clock::BoardClock;

/// Fastest speed of the sensors and of the transceivers in front of them.
const FASTEST_BAUD: u32 = 750_000;

/// The module, in its place. On its way there it is on the stack once, and off it when this returns: inlined into
/// a task, that room would stay taken for ever.
#[inline(never)]
pub fn make(about: About) -> &'static mut Module<MAX_BEAMS> {
    static MODULE: StaticCell<Module<MAX_BEAMS>> = StaticCell::new();
    MODULE.init_with(|| Module::new(about))
}

/// Its tasks, until it is to start anew.
pub fn operate<'a, Line, Flash, Feed>(
    start: Start<'a, Line, Flash, Feed, Driver<Line, BoardClock, MAX_BEAMS>, MAX_BEAMS>,
    last_baud: Option<u32>,
) -> impl Future<Output = ()> + use<'a, Line, Flash, Feed>
where
    Line: Read + Write + Baud,
    Flash: NorFlash,
    Feed: FnMut(),
{
    let Start { module, uart, driver, datagrams, store, watchdog, notices } = start;
    let line = LineSettings::Serial { last_baud, wanted_baud: None, fastest_baud: FASTEST_BAUD };
    let driver = driver.insert(Driver::new(uart, BoardClock, module.settings().sensor(line)));
    tasks::run(module, Hardware { driver, line, datagrams, store, watchdog, clock: BoardClock, notices })
}
