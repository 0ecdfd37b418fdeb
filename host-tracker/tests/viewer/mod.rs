//! A viewer as Foxglove is one: connects, sees which topics there are, subscribes, and keeps what it is shown in an MCAP file.
//!
//! ```text
//!   ws://127.0.0.1:PORT, foxglove.sdk.v1
//!     ◀ {"op":"serverInfo"}   ◀ {"op":"advertise","channels":[…]}   ▶ {"op":"subscribe","subscriptions":[{"id","channelId"}]}
//!     ◀ 01 │ subscription u32 │ log time, ns u64 │ message           little-endian
//! ```

use std::collections::BTreeMap;
use std::fs::File;
use std::net::TcpStream;
use std::path::Path;
use std::time::Duration;

use data_encoding::BASE64;
use serde_json::{Value, json};
use tungstenite::{ClientRequestBuilder, Message, WebSocket};

const PROTOCOL: &str = "foxglove.sdk.v1";
const MESSAGE_DATA: u8 = 1;

/// What one message says.
pub struct Shown {
    pub topic: String,
    pub log_ns: u64,
    pub bytes: Vec<u8>,
}

/// A viewer.
pub struct Viewer {
    socket: WebSocket<TcpStream>,
    /// As they are advertised, by their topics.
    pub channels: BTreeMap<String, Value>,
    topics: BTreeMap<u32, String>,
}

impl Viewer {
    /// Opens a connection to `address`, and waits until these topics are there.
    pub fn open(address: &str, topics: &[&str]) -> Self {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let request =
            ClientRequestBuilder::new(format!("ws://{address}").parse().unwrap()).with_sub_protocol(PROTOCOL);
        let (socket, _) = tungstenite::client(request, stream).unwrap();
        let mut viewer = Self { socket, channels: BTreeMap::new(), topics: BTreeMap::new() };
        while !topics.iter().all(|topic| viewer.channels.contains_key(*topic)) {
            viewer.read();
        }
        viewer
    }

    pub fn subscribe(&mut self, topic: &str) {
        let id = u32::try_from(self.topics.len()).unwrap() + 1;
        let subscription = json!({ "id": id, "channelId": self.channels[topic]["id"] });
        self.topics.insert(id, topic.to_owned());
        let wish = json!({ "op": "subscribe", "subscriptions": [subscription] });
        self.socket.send(Message::text(wish.to_string())).unwrap();
    }

    /// The next message of a topic.
    pub fn shown(&mut self) -> Shown {
        loop {
            if let Some(shown) = self.read() {
                return shown;
            }
        }
    }

    fn read(&mut self) -> Option<Shown> {
        match self.socket.read().unwrap() {
            Message::Text(text) => {
                let said: Value = serde_json::from_str(&text).unwrap();
                for channel in said["channels"].as_array().into_iter().flatten() {
                    self.channels.insert(channel["topic"].as_str().unwrap().to_owned(), channel.clone());
                }
                None
            }
            Message::Binary(bytes) if bytes[0] == MESSAGE_DATA => Some(Shown {
                topic: self.topics[&u32::from_le_bytes(bytes[1..5].try_into().unwrap())].clone(),
                log_ns: u64::from_le_bytes(bytes[5..13].try_into().unwrap()),
                bytes: bytes[13..].to_vec(),
            }),
            _ => None,
        }
    }

    /// Writes what was shown to a recording, with the schemas that were advertised, marked as derived.
    pub fn keep(&self, all: &[Shown], file: &Path) {
        let text = |channel: &Value, key: &str| channel[key].as_str().unwrap().to_owned();
        let mut mcap = mcap::Writer::new(File::create(file).unwrap()).unwrap();
        let derived = BTreeMap::from([("derived".to_owned(), "true".to_owned())]);
        let mut channels = BTreeMap::new();
        for (topic, channel) in &self.channels {
            let encoding = text(channel, "schemaEncoding");
            let schema = match encoding.as_str() {
                "protobuf" => BASE64.decode(text(channel, "schema").as_bytes()).unwrap(),
                _ => text(channel, "schema").into_bytes(),
            };
            let schema = mcap.add_schema(&text(channel, "schemaName"), &encoding, &schema).unwrap();
            let id = mcap.add_channel(schema, topic, &text(channel, "encoding"), &derived).unwrap();
            channels.insert(topic.clone(), id);
        }
        for (sequence, Shown { topic, log_ns, bytes }) in (0..).zip(all) {
            let header = mcap::records::MessageHeader {
                channel_id: channels[topic],
                sequence,
                log_time: *log_ns,
                publish_time: *log_ns,
            };
            mcap.write_to_known_channel(&header, bytes).unwrap();
        }
        mcap.finish().unwrap();
    }
}
