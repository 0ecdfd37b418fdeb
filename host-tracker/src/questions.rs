//! Questions to the tracking loop: why a figure is what it is.
//!
//! ```text
//!   HTTP ─ ask ─▶ (queue of 16) ─▶ tracking loop, after a snapshot: copies what it knows ─▶ explained by the thread that asked
//! ```
//!
//! The loop answers a few after each snapshot and waits for none; what has no room is refused.

use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use tokio::sync::oneshot;

use kehai_tracking::explain::{Facts, Question};

/// Questions that wait at most.
const WAITING: usize = 16;

/// Questions that are answered after a snapshot at most: a copy of a large zone takes about a millisecond.
pub const ANSWERED: usize = 4;

/// A question on its way.
#[derive(Debug)]
pub struct Asked {
    /// What is asked.
    pub question: Question,
    answer: oneshot::Sender<Facts>,
}

impl Asked {
    /// Answers it; the thread that asked may have gone.
    pub fn answer(self, facts: Facts) {
        let _ = self.answer.send(facts);
    }
}

/// Where questions are asked. Clones are the same place.
#[derive(Clone, Debug)]
pub struct Questions(SyncSender<Asked>);

/// Why there is no answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Unanswered {
    /// Too many questions wait.
    #[error("too many questions at once: ask again in a second")]
    Full,
    /// The tracker has ended.
    #[error("the tracker has ended")]
    Ended,
}

impl Questions {
    /// A place to ask, and the queue of questions.
    #[must_use]
    pub fn new() -> (Self, Receiver<Asked>) {
        let (sender, receiver) = sync_channel(WAITING);
        (Self(sender), receiver)
    }

    /// What is known when the next snapshot is made.
    ///
    /// # Errors
    /// [`Unanswered`].
    ///
    /// # Cancellation
    /// The answer is dropped.
    pub async fn ask(&self, question: Question) -> Result<Facts, Unanswered> {
        let (answer, answered) = oneshot::channel();
        self.0.try_send(Asked { question, answer }).map_err(|error| match error {
            TrySendError::Full(_) => Unanswered::Full,
            TrySendError::Disconnected(_) => Unanswered::Ended,
        })?;
        answered.await.map_err(|_| Unanswered::Ended)
    }
}
