//! One topic: its key, its token, and what is sent under it.
//!
//! ```text
//!   put ─▶ payload + attachment ─▶ Zenoh, congestion: drop
//!            ╰─ the newest is kept, if those who come later are told ─▶ KEY/@adv/pub/ZID/NUMBER/_    answered
//! ```
//!
//! What rmw_zenoh does for those who come later is Zenoh's advanced publisher. The question that its subscribers ask is answered here: the crate
//! that has it (`zenoh-ext`) needs Zenoh's unstable features.
//!
//! Source: zenoh-ext 1.10, `advanced_publisher.rs`, `advanced_cache.rs`.

use std::marker::PhantomData;
use std::sync::Arc;

use parking_lot::Mutex;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::query::Queryable;
use zenoh::{Session, Wait};

use super::describe::Message;
use super::encode::{ATTACHMENT, Gid, attachment, payload};
use super::names::{Node, gid};
use super::qos::{Durability, Qos};
use kehai_tracking::snapshot::unix_ms;

/// A publisher of messages of one type. The topic is gone when it is dropped.
#[derive(Debug)]
pub struct Topic<M> {
    publisher: Publisher<'static>,
    kept: Option<Kept>,
    gid: Gid,
    sequence: u64,
    _token: LivelinessToken,
    messages: PhantomData<M>,
}

/// What was said last, and that it is to be had.
#[derive(Debug)]
struct Kept {
    newest: Arc<Mutex<Option<Said>>>,
    _answers: Queryable<()>,
    _token: LivelinessToken,
}

type Said = (Vec<u8>, [u8; ATTACHMENT]);

impl<M: Message> Topic<M> {
    /// Makes the topic known, as the publisher of that number of this session, from 1.
    ///
    /// # Errors
    /// What Zenoh says.
    pub fn declare(
        session: &Session,
        node: &Node,
        number: u32,
        topic: &str,
        qos: Qos,
    ) -> Result<Self, zenoh::Error> {
        let key = node.topic(topic, &M::TYPE);
        let publisher =
            session.declare_publisher(key.clone()).congestion_control(CongestionControl::Drop).wait()?;
        let kept = match qos.durability {
            Durability::Volatile => None,
            Durability::TransientLocal => Some(Kept::declare(session, &key, node.history(&key, number))?),
        };
        let token = node.publisher_token(number, topic, &M::TYPE, qos);
        let gid = gid(&token);
        let token = session.liveliness().declare_token(token).wait()?;
        Ok(Self { publisher, kept, gid, sequence: 0, _token: token, messages: PhantomData })
    }

    /// Whether a node subscribes.
    ///
    /// # Errors
    /// What Zenoh says.
    pub fn is_heard(&self) -> Result<bool, zenoh::Error> {
        Ok(self.publisher.matching_status().wait()?.matching())
    }

    /// Sends a message; it is dropped where it cannot be sent at once.
    ///
    /// # Errors
    /// What Zenoh says.
    pub fn put(&mut self, message: &M) -> Result<(), zenoh::Error> {
        self.sequence += 1;
        let payload = payload(message)?;
        let attachment = attachment(self.sequence, unix_ms().saturating_mul(1_000_000), &self.gid);
        if let Some(kept) = &self.kept {
            *kept.newest.lock() = Some((payload.clone(), attachment));
        }
        self.publisher.put(payload).attachment(attachment).wait()
    }
}

impl Kept {
    fn declare(session: &Session, key: &str, history: String) -> Result<Self, zenoh::Error> {
        let newest = Arc::new(Mutex::new(None::<Said>));
        let (asked, key) = (Arc::clone(&newest), key.to_owned());
        let answers = session.declare_queryable(history.clone()).callback(move |query| {
            let said = asked.lock().clone();
            if let Some((payload, attachment)) = said {
                // A client that does not get it asks again.
                let _ = query.reply(key.clone(), payload).attachment(attachment).wait();
            }
        });
        let answers = answers.wait()?;
        // Subscribers that were there before learn by this that there is something to ask for.
        let token = session.liveliness().declare_token(history).wait()?;
        Ok(Self { newest, _answers: answers, _token: token })
    }
}
