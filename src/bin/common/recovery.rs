//! The ways back that need the board: its button, the count of short starts, a network that has died.

use core::future::poll_fn;
use core::pin::pin;

use defmt::{info, warn};
use embassy_net::Stack;
use embassy_time::{Duration, Instant, Timer};
use embedded_storage_async::nor_flash::NorFlash;
use kehai::device::button::Button;
use kehai::device::reception::SilentNetwork;
use kehai::device::starts::{LASTED_US, ShortStarts};
use kehai::link::{Clock, ResetMemory};
use kehai::store;
use kehai::store::flash::FlashStore;
use kehai::tasks::Notices;

use super::clock::BoardClock;
use super::watched;

/// Between two looks at the button; the watchdog is fed and the LED changes as often.
const LOOK: Duration = Duration::from_millis(100);
/// Between two looks at the frames received.
const FRAMES_LOOK: Duration = Duration::from_secs(10);

/// Longest that a start reads the store: longer is endless.
const READ: Duration = Duration::from_secs(30);

/// Feeds the watchdog while `work` goes on, for half a minute at most: a store with many words that cannot be read takes
/// longer to search than the watchdog waits, and would at every start anew.
///
/// # Cancellation
/// As of `work`.
pub async fn fed<T>(mut feed: impl FnMut(), work: impl Future<Output = T>) -> T {
    let (mut work, begin) = (pin!(work), Instant::now());
    poll_fn(|context| {
        if Instant::now().saturating_duration_since(begin) < READ {
            feed();
        }
        work.as_mut().poll(context)
    })
    .await
}

/// Begins a factory reset if the button is held from power-up.
///
/// # Cancellation
/// It may have begun.
pub async fn factory_reset<F: NorFlash>(
    store: &mut FlashStore<F>,
    mut pressed: impl FnMut() -> bool,
    mut feed: impl FnMut(),
    mut light: impl FnMut(bool),
) {
    let mut lit = false;
    loop {
        match Button::at(BoardClock.now_us(), pressed()) {
            Button::LetGo => return,
            Button::Held => {
                lit = !lit;
                light(lit);
                feed();
                Timer::after(LOOK).await;
            }
            Button::FactoryReset => {
                warn!("button held: settings and background are erased");
                // It searches the store, too. Not by `fed`: each use of an `async fn` links a panic more.
                let (mut begun, since) = (pin!(store::begin_reset(store)), Instant::now());
                // A store that does not take it takes no count of this start either, which is said.
                let _ = poll_fn(|context| {
                    if Instant::now().saturating_duration_since(since) < READ {
                        feed();
                    }
                    begun.as_mut().poll(context)
                })
                .await;
                return;
            }
        }
    }
}

/// Notes that this start has lasted, once it has; then waits for ever.
///
/// # Cancellation
/// The start counts as one that did not last, unless noted already.
pub async fn note_lasting(memory: &mut impl ResetMemory) {
    Timer::at(Instant::from_micros(LASTED_US)).await;
    ShortStarts::lasted(memory);
    core::future::pending().await
}

/// Returns when the network has died: the module must restart.
///
/// # Cancellation
/// It is no longer noticed.
pub async fn network_dies(stack: Stack<'static>, notices: &Notices) {
    let mut network = SilentNetwork::new(BoardClock.now_us());
    loop {
        Timer::after(FRAMES_LOOK).await;
        let had_subscriber = notices.status().had_subscriber;
        if network.is_dead(watched::frames(), stack.is_link_up(), had_subscriber, BoardClock.now_us()) {
            info!("no frame for 10 min");
            return;
        }
    }
}
