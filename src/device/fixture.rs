//! A module, and an outbox for it, in tests of single parts of a device.

use core::net::SocketAddrV4;

use super::About;
use crate::link::{Dropped, Lane, Outbox};
use crate::wire::ModuleId;

/// About a module of which a test asks nothing.
pub fn about() -> About {
    About {
        module: ModuleId([2, 0, 0, 0, 0, 1]),
        secret: [7; 16],
        firmware: "",
        build: "",
        board: "",
        watchdog_reset: false,
    }
}

/// Counts the datagrams that it is given.
#[derive(Default)]
pub struct Sent(pub usize);

impl Outbox for Sent {
    fn try_send_to(&mut self, _: Lane, _: SocketAddrV4, _: &[u8]) -> Result<(), Dropped> {
        self.0 += 1;
        Ok(())
    }

    fn is_empty(&mut self, _: Lane) -> bool {
        true
    }

    fn reopen(&mut self, _: Lane) {}
}
