//! The tracker that these tests are about: the one that `KEHAI_TRACKER` names, or the default one. Every tracker has to pass
//! them: `./ci.sh test` runs them by both.

use kehai_tracking::tracker::Selected;

pub fn tracker() -> Selected {
    match std::env::var("KEHAI_TRACKER") {
        Ok(name) => name.parse().unwrap_or_else(|error| panic!("KEHAI_TRACKER: {error}")),
        Err(_) => Selected::default(),
    }
}
