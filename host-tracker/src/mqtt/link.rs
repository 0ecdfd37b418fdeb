//! The link: a thread that keeps one connection to the broker going, and reports what comes over it.
//!
//! ```text
//!   broker ══▶ connected │ a retained topic │ a message │ the end ──▶ `session`
//! ```

use std::sync::mpsc::Sender;

use rumqttc::{Connection, Event, Packet};

/// What the link says.
pub(super) enum News {
    /// The broker has taken the connection.
    Connected,
    /// The broker keeps a message under this topic.
    Retained(String),
    /// A message, with its topic: it was sent just now, and is kept by no broker.
    Message(String, Vec<u8>),
    /// The connection has ended, for this reason.
    Ended(String),
}

/// Keeps the connection going until it ends, and reports its news.
pub(super) fn run(mut connection: Connection, tell: &Sender<News>) {
    for event in connection.iter() {
        let news = match event {
            Ok(Event::Incoming(Packet::ConnAck(_))) => News::Connected,
            Ok(Event::Incoming(Packet::Publish(publish)))
                if publish.retain && !publish.payload.is_empty() =>
            {
                News::Retained(publish.topic)
            }
            Ok(Event::Incoming(Packet::Publish(publish))) if !publish.retain => {
                News::Message(publish.topic, publish.payload.to_vec())
            }
            Ok(_) => continue,
            Err(error) => {
                let _ = tell.send(News::Ended(error.to_string()));
                return;
            }
        };
        if tell.send(news).is_err() {
            return;
        }
    }
}
