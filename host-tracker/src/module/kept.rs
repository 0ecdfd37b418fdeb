//! Clients that are kept from one request to the next.
//!
//! ```text
//!   request ─▶ a client of this module and these keys? ─ yes ─▶ ask ─ not answered ─╮
//!                     ╰─ no ──▶ a new client, and a session ─▶ ask ◀────────────────╯
//! ```
//!
//! A device with keys has room for six sessions and keeps one for a minute after its host was heard last: a client for each
//! request would fill them with six requests in a minute.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use kehai_tracking::keys::Keys;

use super::ModuleError;
use crate::net::client::Client;

/// A client that asks nothing for so long is not kept: the device has given up its session by then.
const KEPT: Duration = Duration::from_secs(60);

/// Clients by the address of their module.
#[derive(Debug, Default)]
pub struct KeptClients(Vec<Kept>);

#[derive(Debug)]
struct Kept {
    client: Client,
    keys: Arc<Keys>,
    asked: Instant,
}

impl KeptClients {
    /// Asks the module at `address`, by the client that has asked it before. What is refused or not answered then is asked by a new
    /// one: the module may have started anew.
    ///
    /// # Errors
    /// [`ModuleError`].
    pub fn ask<T>(
        &mut self,
        address: SocketAddr,
        keys: &Arc<Keys>,
        ask: impl Fn(&mut Client) -> Result<T, ModuleError>,
    ) -> Result<T, ModuleError> {
        self.0.retain(|kept| kept.asked.elapsed() < KEPT);
        let own = self.0.iter().position(|kept| kept.client.address() == address && kept.keys == *keys);
        if let Some(Kept { mut client, .. }) = own.map(|own| self.0.swap_remove(own)) {
            client.skip_what_has_come()?;
            match ask(&mut client) {
                Err(ModuleError::Client(_)) => {}
                answer => return self.keep(client, keys, answer),
            }
        }
        let mut client = Client::with_keys(address, Arc::clone(keys))?;
        let answer = ask(&mut client);
        self.keep(client, keys, answer)
    }

    fn keep<T>(
        &mut self,
        client: Client,
        keys: &Arc<Keys>,
        answer: Result<T, ModuleError>,
    ) -> Result<T, ModuleError> {
        if !matches!(answer, Err(ModuleError::Client(_))) {
            self.0.push(Kept { client, keys: Arc::clone(keys), asked: Instant::now() });
        }
        answer
    }
}
