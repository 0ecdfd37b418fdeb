//! Work that takes long: on threads of its own, as all clients of a listener share one.
//!
//! ```text
//!   handler ─▶ turn, if only one may work at a time ─▶ work on a thread ─▶ answer
//!      └─ dropped, as its client has left:                  └─ goes on, and keeps its turn until it ends
//! ```

use std::sync::Arc;

use axum::http::StatusCode;
use axum::response::Response;
use tokio::sync::Mutex;
use tokio::task::{JoinError, spawn_blocking};

use super::answers::refuse;

/// The answer that `work` comes to on a thread that may block, for a disk, a lock or equations.
///
/// # Cancellation
/// The work goes on to its end.
pub(super) async fn answer(work: impl FnOnce() -> Response + Send + 'static) -> Response {
    spawn_blocking(work).await.unwrap_or_else(|error| broken(&error))
}

/// The answer if the work has panicked.
pub(super) fn broken(_: &JoinError) -> Response {
    refuse(StatusCode::INTERNAL_SERVER_ERROR, "this could not be done: the log says why")
}

/// Waits for the turn, then does `work` on a thread that may block.
///
/// # Errors
/// The work has panicked.
///
/// # Cancellation
/// Before its turn nothing is done. Afterwards the work goes on to its end, and the turn lasts as long.
pub(super) async fn in_turn<Turn: Send + 'static, T: Send + 'static>(
    turn: &Arc<Mutex<Turn>>,
    work: impl FnOnce(&mut Turn) -> T + Send + 'static,
) -> Result<T, JoinError> {
    let mut turn = Arc::clone(turn).lock_owned().await;
    spawn_blocking(move || work(&mut turn)).await
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn work_without_a_client_keeps_its_turn() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
        let turn = Arc::new(Mutex::new(()));
        let (begun_in, begun) = mpsc::channel();
        let (go_on, may_end) = mpsc::channel();
        runtime.block_on(async {
            let work = move |(): &mut ()| {
                begun_in.send(()).unwrap();
                may_end.recv()
            };
            let client = tokio::spawn({
                let turn = Arc::clone(&turn);
                async move { in_turn(&turn, work).await }
            });
            while begun.try_recv().is_err() {
                tokio::task::yield_now().await;
            }
            client.abort();
            assert!(client.await.unwrap_err().is_cancelled());
            assert!(turn.try_lock().is_err(), "the work goes on");
            go_on.send(()).unwrap();
            in_turn(&turn, |()| ()).await.unwrap();
        });
    }
}
