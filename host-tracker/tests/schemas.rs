//! The documents for programs, held against what they describe: site files, messages to doors, and themselves.

mod described;
mod http_client;

use std::path::{Path, PathBuf};

use host_tracker::web::schema::Document;
use jsonschema::Validator;
use kehai_tracking::door::Card;
use kehai_tracking::door::inbox::{Inbox, Input};
use kehai_tracking::now::Now;
use kehai_tracking::site::Site;
use serde_json::{Value, json};

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn document(name: &str) -> Value {
    serde_json::from_str(&Document::named(name).unwrap().text()).unwrap()
}

fn validator(schema: &Value) -> Validator {
    jsonschema::options().build(schema).unwrap()
}

#[test]
fn every_json_schema_is_one() {
    for known in Document::ALL.iter().filter(|known| known.file().ends_with(".json")) {
        let value = document(known.name);
        if value["$schema"].is_string() {
            let wrong = jsonschema::meta::validate(&value).err().map(|error| error.to_string());
            assert_eq!(wrong, None, "{}", known.name);
        }
    }
    for (name, draft) in [
        ("openapi", "https://json-schema.org/draft/2020-12/schema"),
        ("asyncapi", "http://json-schema.org/draft-07/schema#"),
    ] {
        for (of, schema) in document(name)["components"]["schemas"].as_object().unwrap() {
            let mut schema = schema.clone();
            schema["$schema"] = json!(draft);
            let wrong = jsonschema::meta::validate(&schema).err().map(|error| error.to_string());
            assert_eq!(wrong, None, "{name}: {of}");
        }
    }
}

/// All tables of TOML in the pages and in this crate's tests that are site files.
fn sites() -> Vec<(String, String)> {
    let pages = ["docs/site.md", "docs/tracker.md", "docs/door.md", "docs/floor.md"];
    let mut sites = Vec::new();
    for page in pages {
        let text = std::fs::read_to_string(project().join(page)).unwrap();
        let blocks = text.split("```toml\n").skip(1).filter_map(|rest| rest.split("```").next());
        sites.extend(blocks.map(|block| (page.to_owned(), block.to_owned())));
    }
    sites
}

#[test]
fn a_site_file_that_is_read_is_one_by_its_schema() {
    let schema = document("site");
    let validator = validator(&schema);
    let mut read = 0;
    for (page, text) in sites() {
        if Site::parse(&page, &text).is_err() {
            continue;
        }
        read += 1;
        let value: Value = toml::from_str(&text).unwrap();
        let wrong: Vec<String> = validator.iter_errors(&value).map(|error| error.to_string()).collect();
        assert!(wrong.is_empty(), "{page}: {wrong:#?} in\n{text}");
        let value = serde_json::to_value(Site::parse(&page, &text).unwrap()).unwrap();
        assert!(validator.is_valid(&value), "{page}, as JSON: {value}");
    }
    assert!(read >= 3, "{read} site files in the pages");
    for wrong in [
        "[[zone]]\nname = 1\npolygon = []\n",
        "[[zone]]\nname = \"a\"\n",
        "colour = 1\n",
        "[[wall]]\npoint = []\n",
    ] {
        assert!(Site::parse("wrong", wrong).is_err(), "{wrong}");
        let value: Value = toml::from_str(wrong).unwrap();
        assert!(!validator.is_valid(&value), "{wrong}");
    }
}

/// The schema of an input's message.
fn of_input(name: &str) -> Value {
    let document = document("openapi");
    let path = format!("/api/door/{{name}}/{name}");
    let mut schema =
        document["paths"][&path]["post"]["requestBody"]["content"]["application/json"]["schema"].clone();
    schema["components"] = document["components"].clone();
    schema
}

#[test]
fn a_message_to_a_door_is_taken_if_its_schema_says_so() {
    const NOW_MS: u64 = 1_700_000_000_000;
    for (input, name) in Input::NAMED {
        let schema = of_input(name);
        let validator = validator(&schema);
        let all = json!({
            "id": 1, "boot": 9041, "at_ms": NOW_MS, "card": "04A2", "number": 2, "contact": "shut", "nonce": 4, "taken": 1,
        });
        let now = Now { steady_s: 0.0, unix_ms: NOW_MS };
        let agrees = |message: &Value| {
            let taken =
                Inbox::default().read(input, message.to_string().as_bytes(), now, |_| Card(0)).is_ok();
            assert_eq!(taken, validator.is_valid(message), "{name}: {message}");
            taken
        };
        let part = |fields: &[&str]| -> Value {
            fields
                .iter()
                .map(|field| ((*field).to_owned(), all[field].clone()))
                .collect::<serde_json::Map<_, _>>()
                .into()
        };
        let fields = input.fields();
        assert!(agrees(&part(fields)), "{name}");
        if input == Input::Exit {
            assert!(agrees(&all) && agrees(&json!(null)));
            continue;
        }
        for missing in fields {
            let rest: Vec<&str> = fields.iter().copied().filter(|field| field != missing).collect();
            assert!(!agrees(&part(&rest)), "{name} without {missing}");
        }
        let mut more = part(fields);
        more["more"] = json!(1);
        assert!(!agrees(&more), "{name} with more");
        assert!(agrees(&part(&[fields, &["id", "boot", "at_ms"]].concat())), "{name} with a stamp");
        for (key, wrong) in [
            ("id", json!(0)),
            ("card", json!("")),
            ("card", json!(4)),
            ("number", json!(-1)),
            ("contact", json!("ajar")),
        ] {
            if fields.contains(&key) {
                let mut message = part(fields);
                message[key] = wrong;
                assert!(!agrees(&message), "{name}: {message}");
            }
        }
    }
}

#[test]
#[should_panic(expected = "is not as it is described")]
fn a_frame_without_its_time_is_noticed() {
    described::answer("GET /api/state", 200, r#"{"t": 1.0, "tracks": []}"#);
}

#[test]
#[should_panic(expected = "not described")]
fn an_answer_of_an_unknown_request_is_noticed() {
    described::answer("GET /api/unknown", 200, "{}");
}

#[test]
#[should_panic(expected = "is of 0 channels")]
fn a_topic_that_is_not_described_is_noticed() {
    described::published("kehai/door/zone/hall/colour", "{}");
}

#[test]
#[should_panic(expected = "Additional properties are not allowed")]
fn a_field_that_is_not_described_is_noticed() {
    described::published(
        "kehai/door/zone/hall",
        r#"{"count":1,"occupied":true,"state":"known","colour":"red"}"#,
    );
}
