//! Whatever a test reads from the tracker, held against the documents that describe it.
//!
//! ```text
//!   answer over HTTP ────────▶ openapi    by its method and path
//!   WebSocket, MQTT ─────────▶ asyncapi   by its key, by its topic
//!   a line of --tracks-out ──▶ tracks
//! ```
//!
//! Stricter than the documents are for clients: a field that no schema knows is an error here.
#![allow(dead_code, reason = "each test uses its own part of it")]

mod home_assistant;

use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex};

use host_tracker::web::schema::{Document, asyncapi, openapi};
use jsonschema::{Draft, Validator};
use serde_json::{Value, json};

static OPENAPI: LazyLock<Value> = LazyLock::new(|| strict(openapi()));
static ASYNCAPI: LazyLock<Value> = LazyLock::new(|| strict(asyncapi()));

/// What every request may meet: it is malformed, of an unknown client, of one that may not, at the listener of doors, too
/// slow, at that of the map, in clear, one too many.
const MET: [u16; 8] = [400, 401, 403, 404, 408, 421, 426, 503];

/// An answer over HTTP to a request as `GET /api/state?…`.
#[track_caller]
pub fn answer(line: &str, status: u16, body: &str) {
    let (method, asked) = line.split_once(' ').unwrap();
    let asked = asked.split('?').next().unwrap();
    let paths = OPENAPI["paths"].as_object().unwrap();
    let method = method.to_lowercase();
    // A literal name comes before one that may be any.
    let mut of =
        paths.iter().filter(|(path, operations)| is_of(asked, path) && !operations[&method].is_null());
    let Some((path, operations)) = of.next() else {
        let is_file = method == "get" && !asked.starts_with("/api");
        assert!(status >= 400 || is_file, "{line} is answered with {status} and not described");
        return;
    };
    if (300..400).contains(&status) {
        return;
    }
    let responses = &operations[&method]["responses"];
    let described = &responses[status.to_string()];
    assert!(!described.is_null() || MET.contains(&status), "{line} is answered with {status}: {body}");
    if let Some(json) = described["content"].get("application/json")
        && status >= 400
    {
        hold(&format!("{method} {path} {status}"), &OPENAPI, &json["schema"], body, line);
    } else if status >= 400 {
        let schema = &OPENAPI["components"]["responses"]["Refused"]["content"]["application/json"]["schema"];
        hold("refused", &OPENAPI, schema, body, line);
    } else if let Some(json) = described["content"].get("application/json") {
        hold(&format!("{method} {path}"), &OPENAPI, &json["schema"], body, line);
    }
}

/// The JSON that a request which was done had for its body. A request to let a person out may say anything.
#[track_caller]
pub fn asked(line: &str, body: &[u8]) {
    let (method, asked) = line.split_once(' ').unwrap();
    let paths = OPENAPI["paths"].as_object().unwrap();
    let mut of = paths.iter().filter(|(path, _)| is_of(asked, path));
    let Some((path, operations)) = of.next() else { return };
    let taken = &operations[method.to_lowercase()]["requestBody"]["content"]["application/json"]["schema"];
    let Ok(body) = std::str::from_utf8(body) else { return };
    if taken.as_object().is_some_and(|taken| !taken.is_empty()) && !body.is_empty() {
        hold(&format!("{method} {path} takes"), &OPENAPI, taken, body, line);
    }
}

/// A message of the WebSocket.
#[track_caller]
pub fn message(text: &str) {
    let value: Value = serde_json::from_str(text).unwrap();
    let key = value.as_object().and_then(|fields| fields.keys().next()).expect("a key").clone();
    let known = &ASYNCAPI["channels"]["socket"]["messages"][&key];
    assert!(!known.is_null(), "no such message: {text}");
    hold(&format!("socket {key}"), &ASYNCAPI, &known["payload"], text, &key);
}

/// A payload of MQTT, from whomever. An empty one takes a retained one away.
#[track_caller]
pub fn published(topic: &str, payload: &str) {
    let channels = ASYNCAPI["channels"].as_object().unwrap();
    let of: Vec<_> =
        channels.iter().filter(|(_, channel)| is_of(topic, channel["address"].as_str().unwrap())).collect();
    let [(name, channel)] = of[..] else { panic!("{topic} is of {} channels", of.len()) };
    let is_input = ASYNCAPI["operations"][name]["action"] == "receive";
    if payload.is_empty() || is_input {
        return;
    }
    let said = &channel["messages"]["payload"];
    let payload =
        if said["contentType"] == "text/plain" { json!(payload).to_string() } else { payload.to_owned() };
    hold(&format!("topic {name}"), &ASYNCAPI, &said["payload"], &payload, topic);
    if name == "discovery" {
        home_assistant::discovers(&payload);
    }
}

/// Text that a document of its own describes, as `tracks`.
#[track_caller]
pub fn as_document(name: &str, text: &str) {
    let make = || {
        (Draft::Draft202012, strict(serde_json::from_str(&Document::named(name).unwrap().text()).unwrap()))
    };
    hold_to(&validator(&format!("document {name}"), make), text, name);
}

/// Whether a path is of a template with names in braces.
pub fn is_of(path: &str, template: &str) -> bool {
    let (mut parts, mut wanted) = (path.split('/'), template.split('/'));
    loop {
        match (parts.next(), wanted.next()) {
            (None, None) => return true,
            (Some(part), Some(wanted)) if wanted.starts_with('{') || part == wanted => {}
            _ => return false,
        }
    }
}

#[track_caller]
fn hold(name: &str, document: &Value, schema: &Value, text: &str, of: &str) {
    let make = || {
        let mut schema = schema.clone();
        schema["components"] = document["components"].clone();
        let draft = if document["asyncapi"].is_null() { Draft::Draft202012 } else { Draft::Draft7 };
        (draft, schema)
    };
    hold_to(&validator(name, make), text, of);
}

#[track_caller]
fn hold_to(validator: &Validator, text: &str, of: &str) {
    let value: Value =
        serde_json::from_str(text).unwrap_or_else(|error| panic!("{of} is no JSON: {error}: {text}"));
    let wrong: Vec<String> =
        validator.iter_errors(&value).map(|error| format!("{}: {error}", error.instance_path())).collect();
    assert!(wrong.is_empty(), "{of} is not as it is described: {wrong:#?} in {text}");
}

/// Made once for each name.
fn validator(name: &str, make: impl FnOnce() -> (Draft, Value)) -> Arc<Validator> {
    static KNOWN: LazyLock<Mutex<HashMap<String, Arc<Validator>>>> = LazyLock::new(Mutex::default);
    let mut known = KNOWN.lock().unwrap();
    let made = known.entry(name.to_owned()).or_insert_with(|| {
        let (draft, schema) = make();
        Arc::new(jsonschema::options().with_draft(draft).build(&schema).unwrap())
    });
    Arc::clone(made)
}

/// With no field that is not described.
pub fn strict(mut value: Value) -> Value {
    match &mut value {
        Value::Object(fields) => {
            for field in fields.values_mut() {
                *field = strict(field.take());
            }
            if fields.get("type") == Some(&json!("object"))
                && fields.get("properties").is_some_and(Value::is_object)
            {
                fields.entry("additionalProperties").or_insert(json!(false));
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| *item = strict(item.take())),
        _ => {}
    }
    value
}
