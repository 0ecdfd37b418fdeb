//! What the tracker says and takes, as documents for programs: made from the types that are sent and read, never by hand.
//!
//! ```text
//!   serde types ─ schemars ─▶ JSON Schema ─┬─ web::operations ─▶ OpenAPI
//!                                          ├─ mqtt::channels ──▶ AsyncAPI
//!                                          ├─ alone ───────────▶ frame, site, tracks, …
//!                                          └─ shape ───────────▶ types for Python and TypeScript
//! ```
//!
//! `kehai-tracker schema NAME` prints each. They lie in docs/schemas/ and clients/; a test compares them with what is made,
//! and writes them anew with `KEHAI_WRITE_SCHEMAS=1`.

mod asyncapi;
pub mod collect;
mod openapi;
mod python;
mod shape;
mod typescript;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

use crate::store::event::Event;
use crate::store::figures::Figures;
use crate::store::timeline::Overview;
use crate::web::bodies::{AlarmTold, AlarmsListed, Kept, Paths, ToClient};
use kehai_tracking::door::doors::{DoorState, Passed};
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::Snapshot;

pub use asyncapi::asyncapi;
pub use openapi::openapi;

/// The version of all that is described: docs/api.md says what may change within one.
pub const VERSION: &str = "1.0.0";

/// Longest line of the types for other languages, where a list can be broken: as their formatters have it.
const WIDTH: usize = 110;

/// How a document is made.
#[derive(Clone, Copy, Debug)]
enum Make {
    Json(fn() -> Value),
    Text(fn() -> String),
}

/// A document.
#[derive(Clone, Copy, Debug)]
pub struct Document {
    /// Its name, for commands.
    pub name: &'static str,
    /// What it describes.
    pub about: &'static str,
    /// Where it lies in the repository; none: in docs/schemas.
    file: Option<&'static str>,
    make: Make,
}

impl Document {
    /// All of them.
    pub const ALL: [Self; 16] = [
        Self::json("openapi", "every request over HTTP: OpenAPI 3.1", openapi),
        Self::json("asyncapi", "the WebSocket and every topic of MQTT: AsyncAPI 3.0", asyncapi),
        Self::json("frame", "what is known at one time: GET /api/state", sent::<Snapshot>),
        Self::json("message", "what the WebSocket sends", sent::<ToClient<'_>>),
        Self::json("tracks", "a line of --tracks-out", sent::<TracksLine>),
        Self::json("site", "the site file, as TOML or JSON", taken::<Site>),
        Self::json("alarms", "the list of alarms: GET /api/alarms", sent::<AlarmsListed>),
        Self::json("webhook", "what --alarm-webhook is told", sent::<AlarmTold>),
        Self::json("door", "a guarded door: GET /api/door/NAME", sent::<DoorState>),
        Self::json("passage", "a passage through a guarded door", sent::<Passed>),
        Self::json("event", "what happened, as the database has it", sent::<Event>),
        Self::json("overview", "a time at a glance: GET /api/overview", sent::<Kept<Overview>>),
        Self::json("past", "paths of people: GET /api/past", sent::<Kept<Paths>>),
        Self::json("figures", "people by the hour: GET /api/figures", sent::<Kept<Figures>>),
        Self::text_of(
            "python",
            "the types of the Python client",
            "clients/python/kehai/types.py",
            python::python,
        ),
        Self::text_of(
            "typescript",
            "the types of the TypeScript client",
            "clients/typescript/types.ts",
            typescript::typescript,
        ),
    ];

    const fn json(name: &'static str, about: &'static str, make: fn() -> Value) -> Self {
        Self { name, about, file: None, make: Make::Json(make) }
    }

    const fn text_of(
        name: &'static str,
        about: &'static str,
        file: &'static str,
        make: fn() -> String,
    ) -> Self {
        Self { name, about, file: Some(file), make: Make::Text(make) }
    }

    /// That of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|document| document.name == name)
    }

    /// Where it lies in the repository.
    #[must_use]
    pub fn file(&self) -> String {
        self.file.map_or_else(|| format!("docs/schemas/{}.json", self.name), str::to_owned)
    }

    /// It, as its file has it.
    #[must_use]
    pub fn text(&self) -> String {
        match self.make {
            Make::Json(make) => format!("{:#}\n", make()),
            Make::Text(make) => make(),
        }
    }
}

/// The schema of what is sent.
fn sent<T: JsonSchema>() -> Value {
    alone::<T>(SchemaSettings::draft2020_12().for_serialize())
}

/// The schema of what is taken.
fn taken<T: JsonSchema>() -> Value {
    alone::<T>(SchemaSettings::draft2020_12().for_deserialize())
}

/// A document of one type.
fn alone<T: JsonSchema>(settings: SchemaSettings) -> Value {
    let plain = schemars::transform::RecursiveTransform(collect::plain);
    let mut schema = settings.with_transform(plain).into_generator().into_root_schema_for::<T>();
    schema.insert("$comment".to_owned(), json!(format!("kehai-tracker, version {VERSION}: docs/api.md")));
    schema.to_value()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_files_are_what_is_made_now() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let mut stale = Vec::new();
        for document in Document::ALL {
            let file = root.join(document.file());
            if std::env::var_os("KEHAI_WRITE_SCHEMAS").is_some() {
                std::fs::create_dir_all(file.parent().unwrap()).unwrap();
                std::fs::write(&file, document.text()).unwrap();
            }
            if std::fs::read_to_string(&file).unwrap_or_default() != document.text() {
                stale.push(document.file());
            }
        }
        let anew = "KEHAI_WRITE_SCHEMAS=1 cargo test -p host-tracker --lib schema";
        assert!(stale.is_empty(), "{anew} writes them anew: {stale:#?}");
    }
}
