//! Every request over HTTP that is answered with data: its route, the right it needs and its handler; what it is for, takes and
//! answers. What is not in this table is not served, but for the page's files.
//!
//! ```text
//!   Operation { route, path, … } ─┬▶ `router`            which request goes where, and who may ask
//!                                 └▶ `schema::openapi`   GET /api/openapi.json, docs/schemas/openapi.json
//! ```
//!
//! | file | what |
//! |---|---|
//! | `table` | the table |
//! | `route` | a route with one method |
//! | `operation` | what it is for programs |
//!
//! A route that takes several names, as `/api/module/{name}/{action}`, is an operation for each of them here; the first one's
//! handler serves them all.

mod operation;
mod route;
mod table;

use std::sync::LazyLock;

use axum::http::Method;
use kehai_tracking::door::inbox::Input;

use super::rights::Right;
pub use operation::{Body, Operation, Query};
pub use route::Route;

static OPERATIONS: LazyLock<Vec<Operation>> = LazyLock::new(table::operations);

/// All of them, but for the page's files.
pub fn operations() -> &'static [Operation] {
    &OPERATIONS
}

/// All routes, each method of a path once.
pub fn routes() -> impl Iterator<Item = &'static Route> {
    let is_first = |(number, operation): &(usize, &'static Operation)| {
        let Route { method, path, .. } = &operation.route;
        !operations()
            .iter()
            .take(*number)
            .any(|before| before.route.path == *path && before.route.method == *method)
    };
    operations().iter().enumerate().filter(is_first).map(|(_, operation)| &operation.route)
}

/// The right that a request needs, by its method and the path of its route; none, if there is no such request.
pub fn right(method: &Method, path: Option<&str>) -> Option<Right> {
    // The page's own files hold no data.
    let Some(path) = path else { return Some(Right::Free) };
    let route = operations().iter().map(|operation| &operation.route);
    route.filter(|route| route.path == path).find(|route| route.serves(method)).map(|route| route.right)
}

/// Whether a request is answered in clear where TLS is spoken: if its route says so, and the way out, as a button that cannot
/// agree on TLS, or knows another certificate, must still open.
pub fn is_taken_in_clear(path: Option<&str>, input: Option<Input>) -> bool {
    let is_in_clear =
        |operation: &Operation| Some(operation.route.path) == path && operation.route.is_in_clear;
    input == Some(Input::Exit) || operations().iter().any(is_in_clear)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::access::roles::Action;

    #[test]
    fn every_operation_has_an_id_and_a_path_of_its_own() {
        let ids: BTreeSet<&str> = operations().iter().map(|operation| operation.id.as_str()).collect();
        assert_eq!(ids.len(), operations().len());
        let of = |operation: &'static Operation| (operation.path.as_str(), operation.route.method.as_str());
        let paths: BTreeSet<(&str, &str)> = operations().iter().map(of).collect();
        assert_eq!(paths.len(), operations().len());
    }

    #[test]
    fn the_operations_of_one_route_need_one_right_and_are_served_by_the_same_listeners() {
        for route in routes() {
            let is_same =
                |other: &&Operation| other.route.path == route.path && other.route.method == route.method;
            for other in operations().iter().filter(is_same) {
                let of = |route: &Route| (route.right, route.is_for_doors, route.is_in_clear);
                assert_eq!(of(&other.route), of(route), "{} {}", route.method, other.path);
            }
        }
    }

    #[test]
    fn what_changes_something_needs_a_right_but_for_the_session() {
        for route in routes().filter(|route| route.method != Method::GET) {
            let is_session = route.path == "/api/session";
            assert_eq!(route.right == Right::Free, is_session, "{} {}", route.method, route.path);
            let looks = Right::To(Action::Look);
            assert_ne!(route.right, looks, "{} {}", route.method, route.path);
        }
    }

    #[test]
    fn a_request_that_is_not_in_the_table_has_no_right_and_head_has_that_of_get() {
        let look = Some(Right::To(Action::Look));
        assert_eq!([Method::GET, Method::HEAD].map(|method| right(&method, Some("/api/state"))), [look; 2]);
        for method in [Method::PUT, Method::POST, Method::DELETE, Method::PATCH, Method::OPTIONS] {
            assert_eq!(right(&method, Some("/api/state")), None, "{method}");
        }
        assert_eq!(right(&Method::HEAD, Some("/api/sign")), None);
        assert_eq!(right(&Method::GET, Some("/api/unknown")), None);
        assert_eq!(right(&Method::GET, None), Some(Right::Free), "a file of the page");
    }

    #[test]
    fn the_way_out_and_the_sign_of_life_alone_are_taken_in_clear() {
        for operation in operations() {
            let is_clear = is_taken_in_clear(Some(operation.route.path), operation.input());
            let is_known = operation.path == "/healthz" || operation.input() == Some(Input::Exit);
            assert_eq!(is_clear, is_known, "{}", operation.path);
        }
        assert!(!is_taken_in_clear(None, None));
    }
}
