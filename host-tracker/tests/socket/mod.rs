//! What the tracker's WebSocket sends.

use std::net::TcpStream;

use serde_json::Value;
use tungstenite::{Message, WebSocket};

/// What the next message with this key has there.
#[track_caller]
pub fn next(socket: &mut WebSocket<TcpStream>, key: &str) -> Value {
    loop {
        let Message::Text(text) = socket.read().unwrap() else { continue };
        crate::described::message(&text);
        let value: Value = serde_json::from_str(&text).unwrap();
        if !value[key].is_null() {
            return value[key].clone();
        }
    }
}
