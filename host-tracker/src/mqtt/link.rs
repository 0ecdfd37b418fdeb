//! The link: a thread that keeps one connection to the broker going, and reports what comes over it.
//!
//! ```text
//!   broker ══▶ connected │ a retained topic │ a message │ the end ──▶ queue ──▶ `session`
//!                                              full: counted
//! ```

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use rumqttc::{Connection, Event, Packet, Publish};

use crate::shared_count::SharedCount;

/// News that wait for the session: as many as it may have on the way itself, of which the broker sends it a copy each.
const QUEUE: usize = 8192;

/// So much of a message is passed on, bytes: what is longer is none that is taken, and its beginning shows that as well.
const PAYLOAD_MAX: usize = 4096;

/// Of a longer message that the broker keeps the topic alone is passed on, bytes: Home Assistant's devices are shorter.
const KEPT_MAX: usize = 1 << 20;

/// Longest topic that is passed on, bytes: no device has such a one.
const TOPIC_MAX: usize = 4096;

/// What the link says.
pub(super) enum News {
    /// The broker has taken the connection.
    Connected,
    /// The broker keeps this message under this topic.
    Retained(String, Vec<u8>),
    /// A message, with its topic: it was sent just now, and is kept by no broker.
    Message(String, Vec<u8>),
    /// The connection has ended, for this reason.
    Ended(String),
}

/// The link's end of the queue of news.
pub(super) struct Tell {
    news: SyncSender<News>,
    dropped: SharedCount,
}

/// The session has ended.
struct Unheard;

/// The queue of news. Messages that find no room in it are added to `dropped`.
pub(super) fn queue(dropped: &SharedCount) -> (Tell, Receiver<News>) {
    let (news, receiver) = sync_channel(QUEUE);
    (Tell { news, dropped: dropped.clone() }, receiver)
}

impl Tell {
    /// Passes a message on, if there is room: a flood of them must not keep the link from the broker.
    fn message(&self, topic: String, payload: &[u8]) -> Result<(), Unheard> {
        let payload = payload.get(..PAYLOAD_MAX).unwrap_or(payload).to_vec();
        let full = if topic.len() > TOPIC_MAX {
            true
        } else {
            match self.news.try_send(News::Message(topic, payload)) {
                Ok(()) => false,
                Err(TrySendError::Full(_)) => true,
                Err(TrySendError::Disconnected(_)) => return Err(Unheard),
            }
        };
        self.dropped.add(u64::from(full));
        Ok(())
    }

    /// Passes on what must not be lost, and waits until there is room for it.
    fn surely(&self, news: News) -> Result<(), Unheard> {
        self.news.send(news).map_err(|_| Unheard)
    }

    fn published(&self, publish: Publish) -> Result<(), Unheard> {
        match publish.retain {
            true if publish.payload.is_empty() => Ok(()),
            true => {
                let fits = publish.payload.len() <= KEPT_MAX;
                let payload = if fits { publish.payload.to_vec() } else { Vec::new() };
                self.surely(News::Retained(publish.topic, payload))
            }
            false => self.message(publish.topic, &publish.payload),
        }
    }
}

/// Keeps the connection going until it ends, and reports its news.
pub(super) fn run(mut connection: Connection, tell: &Tell) {
    for event in connection.iter() {
        let heard = match event {
            Ok(Event::Incoming(Packet::ConnAck(_))) => tell.surely(News::Connected),
            Ok(Event::Incoming(Packet::Publish(publish))) => tell.published(publish),
            Ok(_) => Ok(()),
            Err(error) => {
                let _ = tell.surely(News::Ended(error.to_string()));
                return;
            }
        };
        if heard.is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use rumqttc::QoS;

    use super::*;

    #[test]
    fn what_the_broker_keeps_comes_with_its_payload_and_what_is_too_long_without() {
        let (tell, news) = queue(&SharedCount::default());
        for (payload, passed) in [("kept".to_owned(), 4), ("x".repeat(KEPT_MAX + 1), 0)] {
            let mut publish = Publish::new("kehai/home/total", QoS::AtLeastOnce, payload);
            publish.retain = true;
            assert!(tell.published(publish).is_ok());
            let Ok(News::Retained(topic, payload)) = news.recv() else { unreachable!() };
            assert_eq!((&*topic, payload.len()), ("kehai/home/total", passed));
        }
    }

    #[test]
    fn a_flood_of_messages_fills_the_queue_alone_and_is_counted() {
        let dropped = SharedCount::default();
        let (tell, news) = queue(&dropped);
        for _ in 0..QUEUE + 10 {
            assert!(tell.message("kehai/home/sign".into(), &[b'x'; 1 << 20]).is_ok());
        }
        assert!(tell.message("x".repeat(TOPIC_MAX + 1), b"").is_ok());
        assert_eq!(dropped.get(), 11);
        let Ok(News::Message(topic, payload)) = news.recv() else { unreachable!() };
        assert_eq!((&*topic, payload.len()), ("kehai/home/sign", PAYLOAD_MAX));
        drop(news);
        assert!(tell.message("a".into(), b"").is_err() && tell.surely(News::Connected).is_err());
    }
}
