//! Which right a request needs. What is not in this list is not served.
//!
//! ```text
//!   method, route ─▶ Free: everybody │ Needs(action) │ none: such a request does not exist
//! ```

use axum::http::Method;

use crate::access::roles::Action;
use kehai_tracking::door::inbox::Input;

/// What a request needs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Needed {
    /// Nothing.
    Free,
    /// The right to do this.
    Needs(Action),
}

/// Whether a request is answered in clear where TLS is spoken: the way out, as a button that cannot agree on TLS, or knows another
/// certificate, must still open; and the sign of life, which says nothing.
pub fn is_taken_in_clear(route: Option<&str>, input: Option<Input>) -> bool {
    input == Some(Input::Exit) || route == Some("/healthz")
}

/// What a request needs, by its method and route; none, if there is no such request. `input` is that of a message to a door, if
/// it is one that doors have.
pub fn needed(method: &Method, route: Option<&str>, input: Option<Input>) -> Option<Needed> {
    use Needed::{Free, Needs};
    // The page's own files hold no data.
    let Some(route) = route else { return Some(Free) };
    let reads = matches!(*method, Method::GET | Method::HEAD);
    Some(match (route, reads) {
        ("/api/session", _) | ("/healthz" | "/door/{name}", true) => Free,
        // As little as the page's files: they are the same for all.
        ("/api/openapi.json" | "/api/asyncapi.json", true) => Free,
        (
            "/ws"
            | "/api/site"
            | "/api/state"
            | "/api/history"
            | "/api/overview"
            | "/api/past"
            | "/api/figures"
            | "/api/where"
            | "/api/explain"
            | "/api/heat"
            | "/api/coverage"
            | "/api/calibration"
            | "/api/alarms"
            | "/metrics"
            | "/api/picture"
            | "/api/picture/place"
            | "/api/firmware"
            | "/api/firmware/{name}",
            true,
        ) => Needs(Action::Look),
        ("/api/door" | "/api/door/{name}", true) => Needs(Action::LookAtDoor),
        ("/api/picture", false) if matches!(*method, Method::PUT | Method::DELETE) => {
            Needs(Action::ChangeSite)
        }
        ("/api/picture/place", false) if *method == Method::PUT => Needs(Action::ChangeSite),
        ("/api/survey", true) => Needs(Action::ChangeSite),
        ("/api/site", false) if *method == Method::PUT => Needs(Action::ChangeSite),
        ("/api/site/try", false) if *method == Method::POST => Needs(Action::ChangeSite),
        ("/api/calibration", false) if *method == Method::POST => Needs(Action::ChangeSite),
        ("/api/alarms/acknowledge", false) if *method == Method::POST => Needs(Action::Acknowledge),
        ("/api/module/{name}" | "/api/module/{name}/things", true) => Needs(Action::AskModule),
        ("/api/module/{name}/{action}", false) if *method == Method::POST => Needs(Action::AskModule),
        ("/api/sign", false) if *method == Method::POST => Needs(Action::Sign),
        ("/api/door/{name}/{*input}", false) if *method == Method::POST => {
            // A client that may see the door is told that there is no such input.
            Needs(input.map_or(Action::LookAtDoor, Action::Tell))
        }
        _ => return None,
    })
}
