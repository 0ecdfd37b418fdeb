//! The WebSocket and the topics of MQTT as an AsyncAPI document.
//!
//! ```text
//!   ToClient, Wish ───────▶ channel /ws           the tracker sends, and receives
//!   mqtt::channels ───────▶ a channel each        published retained or not, or taken
//!   types ────────────────▶ components.schemas
//! ```
//!
//! Source: AsyncAPI 3.0.0, whose schemas are those of JSON Schema draft 07; its MQTT bindings 0.2.0.

use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use super::VERSION;
use super::collect::Collected;
use crate::mqtt::channels::{Channel, Payload, channels};
use crate::type_schema::of;
use crate::web::bodies::{ToClient, Wish};

/// The document.
#[must_use]
pub fn asyncapi() -> Value {
    let mut collected = Collected::new(SchemaSettings::draft07());
    let (mut all, mut operations) = (Map::new(), Map::new());
    all.insert("socket".to_owned(), socket(&mut collected));
    let said = |message: &str| json!({ "$ref": format!("#/channels/socket/messages/{message}") });
    let messages = all["socket"]["messages"].as_object().into_iter().flat_map(Map::keys);
    let sent: Vec<Value> = messages.filter(|name| *name != WISH).map(|name| said(name)).collect();
    let operation = |action: &str, messages: &[Value]| json!({ "action": action, "channel": { "$ref": "#/channels/socket" }, "messages": messages });
    operations.insert("socketSends".to_owned(), operation("send", &sent));
    operations.insert("socketReceives".to_owned(), operation("receive", &[said(WISH)]));
    for channel in channels() {
        operations.insert(channel.id.clone(), operation_of(&channel));
        all.insert(channel.id.clone(), channel_of(&channel, &mut collected));
    }
    let mut document = json!({
        "asyncapi": "3.0.0",
        "info": {
            "title": "kehai-tracker",
            "version": VERSION,
            "description": "What kehai-tracker sends over its WebSocket and publishes over MQTT, and what it takes. What may \
                change within a version: docs/api.md. Home Assistant's own part is as its discovery asks for.",
            "license": { "name": "MIT OR Apache-2.0" },
        },
        "servers": {
            "tracker": { "host": "127.0.0.1:8420", "protocol": "ws", "description": "--http; wss over TLS." },
            "broker": { "host": "localhost:1883", "protocol": "mqtt", "description": "--mqtt; mqtts over TLS." },
        },
        "channels": all,
        "operations": operations,
    });
    let schemas = collected.finish(&mut document);
    document["components"] = json!({ "schemas": schemas });
    document
}

const WISH: &str = "wish";

fn socket(collected: &mut Collected) -> Value {
    let mut messages = Map::new();
    let sent = collected.sends(<ToClient<'_> as schemars::JsonSchema>::json_schema);
    for variant in sent["oneOf"].as_array().into_iter().flatten() {
        // Each message has one key.
        let Some(name) = variant["required"][0].as_str() else { continue };
        let mut payload = variant.clone();
        let about = payload.as_object_mut().and_then(|payload| payload.remove("description"));
        messages
            .insert(name.to_owned(), json!({ "summary": about, "contentType": JSON, "payload": payload }));
    }
    let wish = collected.takes(of::<Wish>);
    messages.insert(
        WISH.to_owned(),
        json!({ "summary": "What a client wants.", "contentType": JSON, "payload": wish }),
    );
    json!({
        "address": "/ws",
        "description": "Frames come until others are asked for. It ends with the session or the token by which it was opened.",
        "servers": [{ "$ref": "#/servers/tracker" }],
        "messages": messages,
    })
}

const JSON: &str = "application/json";

fn channel_of(channel: &Channel, collected: &mut Collected) -> Value {
    let (kind, payload) = match channel.payload {
        Payload::Json(make) => (JSON, collected.sends(make)),
        Payload::Taken(make) => (JSON, collected.takes(make)),
        Payload::Input(input) => (JSON, collected.takes(|generator| input.schema(generator))),
        Payload::Word(make) => ("text/plain", collected.sends(make)),
        Payload::TakenWord(make) => ("text/plain", collected.takes(make)),
    };
    let names = channel.address.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'));
    let parameters: Map<String, Value> = names.map(|name| (name.to_owned(), parameter(name))).collect();
    json!({
        "address": channel.address,
        "description": channel.about,
        "servers": [{ "$ref": "#/servers/broker" }],
        "parameters": parameters,
        "messages": { "payload": { "contentType": kind, "payload": payload } },
    })
}

/// In topics, names are in lower case, and what is neither letter nor digit is `-`.
fn parameter(name: &str) -> Value {
    match name {
        "prefix" => json!({ "description": "--mqtt-prefix", "default": "kehai" }),
        "discovery" => json!({ "description": "--home-assistant-prefix", "default": "homeassistant" }),
        "site" => json!({ "description": "The site's name, as topics have it: its file's, or --mqtt-site." }),
        "alarm" => json!({ "description": "The alarm's name." }),
        "label" => json!({ "description": "Eight digits of the ID's hash." }),
        "device" => json!({ "description": "kehai_SITE, or kehai_SITE_MODULE." }),
        _ => json!({ "description": "Its name, as topics have it." }),
    }
}

fn operation_of(channel: &Channel) -> Value {
    let is_taken = matches!(channel.payload, Payload::Taken(_) | Payload::TakenWord(_) | Payload::Input(_));
    let passes = !is_taken && !channel.is_retained;
    json!({
        "action": if is_taken { "receive" } else { "send" },
        "channel": { "$ref": format!("#/channels/{}", channel.id) },
        "messages": [{ "$ref": format!("#/channels/{}/messages/payload", channel.id) }],
        "bindings": { "mqtt": { "qos": u8::from(!passes), "retain": channel.is_retained, "bindingVersion": "0.2.0" } },
    })
}
