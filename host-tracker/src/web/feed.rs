//! Snapshots to text, once for all clients.
//!
//! ```text
//!   Arc<Snapshot> ─▶ {"frame": …}    every 0.1 s, without what modules see
//!            └──▶ {"fields": …}   what they see, twice a second: most of the bytes, and slow to change
//! ```
//!
//! The texts lie in a watch channel: a client that comes late gets the newest, and those between are gone.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::extract::ws::Utf8Bytes;
use tokio::sync::watch;

use super::bodies::ToClient;
use super::shared::{Packets, Shared};
use super::socket::text;
use kehai_tracking::snapshot::Snapshot;

/// Frames from one text of fields, and one line of history, to the next.
const FIELDS_EVERY: u64 = 5;

/// Makes the texts until the tracker has ended.
pub async fn run(shared: Arc<Shared>, packets: watch::Sender<Packets>, alarms: watch::Sender<Utf8Bytes>) {
    let mut told = None;
    let mut frames = shared.context.frames.clone();
    let mut number = 0_u64;
    loop {
        let frame = Arc::clone(&frames.borrow_and_update());
        // The one from before the first line says nothing.
        if frame.unix_ms != 0 {
            if number.is_multiple_of(FIELDS_EVERY) {
                let fields = fields(&frame);
                packets.send_modify(|packets| {
                    packets.fields = fields;
                    packets.fields_number += 1;
                });
                shared.history.lock().push(&frame);
            }
            number += 1;
            // In other words an alarm is the same: only frames have the newest.
            let standing = standing(&frame);
            if told.as_ref() != Some(&standing) {
                told = Some(standing);
                alarms.send_replace(text(&ToClient::Alarms(&frame.alarms)));
            }
            let text = envelope(&frame);
            packets.send_modify(|packets| packets.frame = text);
        }
        if frames.changed().await.is_err() {
            return;
        }
    }
}

/// Which alarms stand, and whether they are acknowledged.
fn standing(frame: &Snapshot) -> Vec<(u64, bool)> {
    frame.alarms.iter().map(|alarm| (alarm.id, alarm.acknowledged.is_some())).collect()
}

fn envelope(frame: &Snapshot) -> Utf8Bytes {
    text(&ToClient::Frame(&frame.without_free()))
}

fn fields(frame: &Snapshot) -> Utf8Bytes {
    let fields: BTreeMap<&str, Vec<[f64; 2]>> =
        frame.modules.iter().map(|module| (module.name.as_str(), module.free.to_vec())).collect();
    text(&ToClient::Fields(fields))
}
