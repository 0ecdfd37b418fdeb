//! The requests over HTTP as an OpenAPI document.
//!
//! ```text
//!   web::operations ─▶ paths      what each takes and answers; who may, from the route's right and `roles::may`
//!   types ──────────▶ components.schemas
//! ```
//!
//! Source: OpenAPI 3.1.1, whose schemas are JSON Schema 2020-12.

use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use super::VERSION;
use super::collect::Collected;
use crate::access::roles::{Role, may};
use crate::type_schema::of;
use crate::web::bodies::{AlarmTold, Refusal, ToClient, Wish};
use crate::web::operations::{Body, Operation, Query, operations};

/// The document.
#[must_use]
pub fn openapi() -> Value {
    let mut collected = Collected::new(SchemaSettings::draft2020_12());
    let refused = collected.sends(of::<Refusal>);
    let told = collected.sends(of::<AlarmTold>);
    // For who reads the WebSocket with the types of this document.
    collected.sends(of::<ToClient<'_>>);
    collected.takes(of::<Wish>);
    let mut paths = Map::new();
    for operation in operations() {
        let described = described(operation, &mut collected);
        let path = paths.entry(operation.path.clone()).or_insert_with(|| json!({}));
        path[operation.route.method.as_str().to_lowercase()] = described;
    }
    let mut document = json!({
        "openapi": "3.1.1",
        "info": {
            "title": "kehai-tracker",
            "version": VERSION,
            "description": "What kehai-tracker answers over HTTP. What may change within a version: docs/api.md. \
                x-kehai-roles are the roles that may ask, once there are users; a site with doors asks for more, as \
                docs/security.md says.",
            "license": { "name": "MIT OR Apache-2.0", "identifier": "MIT OR Apache-2.0" },
        },
        "servers": [{ "url": "http://127.0.0.1:8420", "description": "The tracker on this machine." }],
        "paths": paths,
        "webhooks": {
            "alarm": {
                "post": {
                    "operationId": "alarmTold",
                    "summary": "What --alarm-webhook is told: an alarm has begun, was acknowledged, has ended.",
                    "requestBody": { "content": { "application/json": { "schema": told } } },
                    "responses": { "2XX": { "description": "Taken. Any other answer: it is told twice more." } },
                },
            },
        },
        "components": {
            "responses": {
                "Refused": {
                    "description": "Not done, and why.",
                    "content": { "application/json": { "schema": refused } },
                },
            },
            "securitySchemes": {
                "token": { "type": "http", "scheme": "bearer", "description": "Of a program or device: kehai-tracker token add." },
                "session": { "type": "apiKey", "in": "cookie", "name": "kehai-session", "description": "Of a person: POST /api/session. \
                    Over TLS its name is __Host-kehai-session." },
            },
        },
    });
    let schemas = collected.finish(&mut document);
    document["components"]["schemas"] = Value::Object(schemas);
    document
}

fn described(operation: &Operation, collected: &mut Collected) -> Value {
    let mut responses = Map::new();
    let (status, done) = match operation.answers {
        Body::Socket => ("101", json!({ "description": "The connection is a WebSocket." })),
        body => {
            let mut content = Map::new();
            content.extend([sent(body, collected)]);
            ("200", json!({ "description": "Done.", "content": content }))
        }
    };
    responses.insert(status.to_owned(), done);
    // What every request may meet: it is from elsewhere, its sender may not, there is no room.
    let refusals = operation.refusals.iter().map(u16::to_string).chain(["default".to_owned()]);
    responses.extend(refusals.map(|status| (status, json!({ "$ref": "#/components/responses/Refused" }))));
    if let Some(conflict) = operation.conflict {
        let (kind, content) = sent(Body::Json(conflict), collected);
        let answer =
            json!({ "description": "Changed meanwhile, and what by.", "content": { kind: content } });
        responses.insert("409".to_owned(), answer);
    }
    let mut described = json!({
        "operationId": operation.id,
        "summary": operation.about,
        "responses": responses,
    });
    let parameters = parameters(operation);
    if !parameters.is_empty() {
        described["parameters"] = Value::Array(parameters);
    }
    if !operation.takes.is_empty() {
        let content: Map<String, Value> =
            operation.takes.iter().map(|body| taken(*body, collected)).collect();
        described["requestBody"] = json!({ "content": content });
    }
    match operation.route.right.action(operation.input()) {
        Some(action) => {
            let roles = Role::NAMED.into_iter().filter(|(role, _)| may(*role, action)).map(|(_, name)| name);
            described["security"] = json!([{ "token": [] }, { "session": [] }]);
            described["x-kehai-roles"] = roles.collect();
        }
        None => described["security"] = json!([]),
    }
    described
}

fn parameters(operation: &Operation) -> Vec<Value> {
    let in_path = operation.path.contains("{name}").then(|| {
        json!({
            "name": "name", "in": "path", "required": true, "schema": { "type": "string" },
            "description": "As the site calls it, percent-encoded.",
        })
    });
    let in_query = operation.query.iter().map(|Query { name, about, is_number, is_needed }| {
        let kind =
            if *is_number { json!({ "type": "integer", "minimum": 0 }) } else { json!({ "type": "string" }) };
        json!({ "name": name, "in": "query", "required": is_needed, "schema": kind, "description": about })
    });
    in_path.into_iter().chain(in_query).collect()
}

const JSON: &str = "application/json";

fn sent(body: Body, collected: &mut Collected) -> (String, Value) {
    match body {
        Body::Json(make) => (JSON.to_owned(), json!({ "schema": collected.sends(make) })),
        Body::Input(_) | Body::Socket => (JSON.to_owned(), json!({})),
        Body::Text(kind) => (kind.to_owned(), json!({ "schema": { "type": "string" } })),
    }
}

fn taken(body: Body, collected: &mut Collected) -> (String, Value) {
    match body {
        Body::Json(make) => (JSON.to_owned(), json!({ "schema": collected.takes(make) })),
        Body::Input(input) => {
            (JSON.to_owned(), json!({ "schema": collected.takes(|generator| input.schema(generator)) }))
        }
        Body::Text(_) | Body::Socket => sent(body, collected),
    }
}
