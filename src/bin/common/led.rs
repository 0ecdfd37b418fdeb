//! Switches the LED as [`kehai::device::led`] says.

use embassy_net::Stack;
use embassy_time::{Instant, Timer};
use kehai::device::led::{LedState, SLOT_US};
use kehai::tasks::Notices;

/// Shows how the module is, for ever.
///
/// # Cancellation
/// The LED stays as it is.
pub async fn show(stack: Stack<'static>, notices: &Notices, mut light: impl FnMut(bool)) {
    loop {
        let now_us = Instant::now().as_micros();
        let has_network = stack.is_link_up() && stack.is_config_up();
        light(LedState::of(&notices.status(), has_network, now_us).is_lit(now_us));
        Timer::at(Instant::from_micros((now_us / SLOT_US + 1) * SLOT_US)).await;
    }
}
