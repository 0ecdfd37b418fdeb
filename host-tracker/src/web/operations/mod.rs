//! Every request over HTTP that is answered with data: what it is for, what it takes, what it answers.
//!
//! ```text
//!   Operation { method, route, path, … } ─▶ `schema::openapi` ─▶ GET /api/openapi.json, docs/schemas/openapi.json
//!               └ compared with the router's routes and `rights::needed` by the test below
//! ```
//!
//! A path of the router that takes several names, as `/api/module/{name}/{action}`, is an operation for each of them here.

mod table;

use axum::http::Method;
use kehai_tracking::door::inbox::Input;
use schemars::JsonSchema;

use crate::schema::collect::{Make, of};
pub use table::operations;

/// What a body is.
#[derive(Clone, Copy)]
pub enum Body {
    /// JSON of this schema.
    Json(Make),
    /// The same, but that it says what an input of a door says.
    Input(Input),
    /// Text of this media type.
    Text(&'static str),
    /// None: the connection becomes a WebSocket.
    Socket,
}

/// A field of a request's query.
#[derive(Clone, Copy)]
pub struct Query {
    pub name: &'static str,
    pub about: &'static str,
    pub is_number: bool,
    pub is_needed: bool,
}

/// A request.
#[derive(Clone)]
pub struct Operation {
    pub method: Method,
    /// As the router has it.
    pub route: &'static str,
    /// The same for one name of several.
    pub path: String,
    pub id: String,
    pub about: &'static str,
    pub query: &'static [Query],
    /// Any of these.
    pub takes: Vec<Body>,
    pub answers: Body,
    /// Statuses that say why not, beside those that every request may meet.
    pub refusals: &'static [u16],
    /// What the status 409 is answered with, if it is more than why not.
    pub conflict: Option<Make>,
}

impl Operation {
    /// What an input of a door it is, if it is one.
    pub fn input(&self) -> Option<Input> {
        self.takes.iter().find_map(|body| if let Body::Input(input) = body { Some(*input) } else { None })
    }

    fn new(method: Method, route: &'static str, id: &str, about: &'static str, answers: Body) -> Self {
        let (path, id, query, refusals) = (route.to_owned(), id.to_owned(), &[][..], &[][..]);
        Self { method, route, path, id, about, query, takes: Vec::new(), answers, refusals, conflict: None }
    }

    fn get<T: JsonSchema>(route: &'static str, id: &str, about: &'static str) -> Self {
        Self::new(Method::GET, route, id, about, Body::Json(of::<T>))
    }

    fn post<T: JsonSchema>(route: &'static str, id: &str, about: &'static str) -> Self {
        Self::new(Method::POST, route, id, about, Body::Json(of::<T>))
    }

    fn asks(self, query: &'static [Query]) -> Self {
        Self { query, ..self }
    }

    fn takes<T: JsonSchema>(self) -> Self {
        let takes = [self.takes, vec![Body::Json(of::<T>)]].concat();
        Self { takes, ..self }
    }

    fn refuses(self, refusals: &'static [u16]) -> Self {
        Self { refusals, ..self }
    }
}

const fn number(name: &'static str, about: &'static str, is_needed: bool) -> Query {
    Query { name, about, is_number: true, is_needed }
}

const fn word(name: &'static str, about: &'static str, is_needed: bool) -> Query {
    Query { name, about, is_number: false, is_needed }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::web::rights::needed;

    /// The routes in the text of the router.
    fn routes() -> BTreeSet<&'static str> {
        let router = include_str!("../router.rs");
        router.split(".route(\"").skip(1).filter_map(|rest| rest.split('"').next()).collect()
    }

    #[test]
    fn every_route_is_described_and_nothing_else() {
        let described: BTreeSet<&str> = operations().iter().map(|operation| operation.route).collect();
        assert_eq!(described, routes());
        let ids: BTreeSet<String> = operations().into_iter().map(|operation| operation.id).collect();
        assert_eq!(ids.len(), operations().len());
    }

    #[test]
    fn every_method_that_a_route_has_is_described_and_no_other() {
        for route in routes() {
            for method in [Method::GET, Method::PUT, Method::POST, Method::DELETE, Method::PATCH] {
                let is_described =
                    operations().iter().any(|known| known.route == route && known.method == method);
                let is_allowed = needed(&method, Some(route), None).is_some();
                // The router refuses the methods that the session does not have.
                let is_there =
                    is_allowed && !(route == "/api/session" && matches!(method, Method::PUT | Method::PATCH));
                assert_eq!(is_described, is_there, "{method} {route}");
            }
        }
    }
}
