//! What a request is for, what it takes and what it answers, for programs.

use std::borrow::Cow;
use std::marker::PhantomData;

use kehai_tracking::door::inbox::Input;
use schemars::{JsonSchema, Schema, SchemaGenerator};

use super::route::Route;
use crate::type_schema::{Make, of};

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

impl Query {
    pub(super) const fn number(name: &'static str, about: &'static str, is_needed: bool) -> Self {
        Self { name, about, is_number: true, is_needed }
    }

    pub(super) const fn word(name: &'static str, about: &'static str, is_needed: bool) -> Self {
        Self { name, about, is_number: false, is_needed }
    }
}

/// A request.
#[derive(Clone)]
pub struct Operation {
    pub route: Route,
    /// The route's path, with one name of several where it takes several.
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

impl Route {
    /// An operation that is answered with JSON.
    pub(super) fn answers<T: JsonSchema>(self, id: &str, about: &'static str) -> Operation {
        self.answers_with(Body::Json(of::<T>), id, about)
    }

    /// An operation that is answered with text of this media type.
    pub(super) fn answers_text(self, kind: &'static str, id: &str, about: &'static str) -> Operation {
        self.answers_with(Body::Text(kind), id, about)
    }

    pub(super) fn answers_with(self, answers: Body, id: &str, about: &'static str) -> Operation {
        let (path, id) = (self.path.to_owned(), id.to_owned());
        let (query, refusals) = (&[][..], &[][..]);
        Operation {
            route: self,
            path,
            id,
            about,
            query,
            takes: Vec::new(),
            answers,
            refusals,
            conflict: None,
        }
    }
}

impl Operation {
    /// What an input of a door it is, if it is one.
    pub fn input(&self) -> Option<Input> {
        self.takes.iter().find_map(|body| if let Body::Input(input) = body { Some(*input) } else { None })
    }

    pub(super) fn asks(self, query: &'static [Query]) -> Self {
        Self { query, ..self }
    }

    pub(super) fn takes<T: JsonSchema>(self) -> Self {
        self.takes_any(&[Body::Json(of::<T>)])
    }

    pub(super) fn takes_any(self, bodies: &[Body]) -> Self {
        Self { takes: [self.takes, bodies.to_vec()].concat(), ..self }
    }

    pub(super) fn refuses(self, refusals: &'static [u16]) -> Self {
        Self { refusals, ..self }
    }

    pub(super) fn conflicts<T: JsonSchema>(self) -> Self {
        Self { conflict: Some(of::<T>), ..self }
    }

    /// The operation of one name where the route's path takes several as `variable`.
    pub(super) fn named(self, variable: &str, name: &str) -> Self {
        Self { path: self.route.path.replace(variable, name), ..self }
    }
}

/// One of two answers.
pub(super) struct Either<A, B>(PhantomData<(A, B)>);

impl<A: JsonSchema, B: JsonSchema> JsonSchema for Either<A, B> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        format!("{}Or{}", A::schema_name(), B::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let either = [generator.subschema_for::<A>(), generator.subschema_for::<B>()];
        schemars::json_schema!({ "anyOf": either })
    }
}
