//! A route of the server with one method: the right it needs, which listeners serve it, and the handler.
//!
//! ```text
//!   get("/api/door", To(LookAtDoor), door::all).for_doors()
//!    │        │               │          │         └ a listener of doors alone serves it, too
//!    │        └ as axum has it │          └ handler
//!    └ HEAD as well            └ right
//! ```

use std::sync::Arc;

use axum::extract::DefaultBodyLimit;
use axum::handler::Handler;
use axum::http::Method;
use axum::routing::{self, MethodRouter};

use crate::web::rights::Right;
use crate::web::shared::Shared;

/// A route with one method.
#[derive(Clone)]
pub struct Route {
    pub method: Method,
    /// As the router has it.
    pub path: &'static str,
    pub right: Right,
    /// Whether a listener of doors alone serves it, too.
    pub is_for_doors: bool,
    /// Whether it is answered in clear where TLS is spoken.
    pub is_in_clear: bool,
    /// The handler, under this method.
    pub(in crate::web) served: MethodRouter<Arc<Shared>>,
}

impl Route {
    const fn new(
        method: Method,
        path: &'static str,
        right: Right,
        served: MethodRouter<Arc<Shared>>,
    ) -> Self {
        Self { method, path, right, is_for_doors: false, is_in_clear: false, served }
    }

    /// Served by a listener of doors alone, too.
    pub fn for_doors(self) -> Self {
        Self { is_for_doors: true, ..self }
    }

    /// Answered in clear where TLS is spoken.
    pub fn in_clear(self) -> Self {
        Self { is_in_clear: true, ..self }
    }

    /// Takes bodies of up to so many bytes.
    pub fn body_max(self, bytes: usize) -> Self {
        Self { served: self.served.layer(DefaultBodyLimit::max(bytes)), ..self }
    }

    /// Whether a request with this method is served: HEAD as GET, without the body.
    pub fn serves(&self, method: &Method) -> bool {
        self.method == *method || (self.method == Method::GET && *method == Method::HEAD)
    }
}

pub(super) fn get<T: 'static>(
    path: &'static str,
    right: Right,
    handler: impl Handler<T, Arc<Shared>>,
) -> Route {
    Route::new(Method::GET, path, right, routing::get(handler))
}

pub(super) fn put<T: 'static>(
    path: &'static str,
    right: Right,
    handler: impl Handler<T, Arc<Shared>>,
) -> Route {
    Route::new(Method::PUT, path, right, routing::put(handler))
}

pub(super) fn post<T: 'static>(
    path: &'static str,
    right: Right,
    handler: impl Handler<T, Arc<Shared>>,
) -> Route {
    Route::new(Method::POST, path, right, routing::post(handler))
}

pub(super) fn delete<T: 'static>(
    path: &'static str,
    right: Right,
    handler: impl Handler<T, Arc<Shared>>,
) -> Route {
    Route::new(Method::DELETE, path, right, routing::delete(handler))
}
