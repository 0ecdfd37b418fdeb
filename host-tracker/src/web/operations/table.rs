//! Every request, a line each.

use std::collections::BTreeMap;

use axum::http::Method;
use kehai_tracking::calibration::session::Status;
use kehai_tracking::door::LockOrder;
use kehai_tracking::door::doors::DoorState;
use kehai_tracking::door::inbox::Input;
use kehai_tracking::names::Whereabouts;
use kehai_tracking::names::message::Message as Sign;
use kehai_tracking::snapshot::Snapshot;
use kehai_tracking::survey::Proposal;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde_json::Value;

use super::{Body, Operation, Query, number, word};
use crate::firmware::folder::FirmwareFiles;
use crate::module::absorb::{Absorbed, Seen as Thing};
use crate::picture::Place;
use crate::schema::collect::of;
use crate::store::figures::Figures;
use crate::store::timeline::Overview;
use crate::web::alarms::Seen;
use crate::web::bodies::{
    AlarmsAcknowledged, AlarmsListed, Done, Kept, ModuleSettings, Paths, Refusal, Renamed, Revised, Session,
    SiteShown, SiteTogether,
};
use crate::web::calibration::Wish;
use crate::web::coverage::Covered;
use crate::web::explain::Explained;
use crate::web::heat::Heat;
use crate::web::module::{Absorb, Act, Identify, Learn, Nothing, Rename};
use crate::web::picture::PictureLaid;
use crate::web::recent::Past;
use crate::web::session::LogIn;
use crate::web::site::Change;

const FROM: Query = number("from", "The beginning, ms since 1970.", true);
const TO: Query = number("to", "The end, ms since 1970.", true);
const BINS: Query =
    number("bins", "Into how many parts the time is cut, 1 to 1000; 240 if nothing is said.", false);
const BIN: Query = number("bin", "Length of a part, s; 3600 if nothing is said.", false);
const ID: Query = word("id", "What a reader has read.", true);
const EDGES: Query =
    word("edges", "In place of the others: where parts begin and end, ms since 1970, between commas.", false);
const ZONE: Query = word("zone", "A zone.", false);
const LINE: Query = word("line", "A counting line.", false);
const PERSON: Query = number("person", "A track.", false);
const ALARM: Query = word("alarm", "The name of an alarm, as `clock-off`.", false);

/// All of them, but for the page's files.
pub fn operations() -> Vec<Operation> {
    let text = |route, id, about, kind| Operation::new(Method::GET, route, id, about, Body::Text(kind));
    let put_site = Operation {
        takes: vec![Body::Json(of::<Change>), Body::Text("application/toml")],
        conflict: Some(of::<Either<Refusal, SiteTogether<'_>>>),
        ..Operation::new(
            Method::PUT,
            "/api/site",
            "changeSite",
            "Check, save and use another site. As TOML it is \
            the text of a site file; the revision is then in the header If-Match.",
            Body::Json(of::<Revised>),
        )
    };
    let end = Operation::new(Method::DELETE, "/api/session", "logOut", "Log out.", Body::Json(of::<Done>));
    let mut all = vec![
        Operation::new(
            Method::GET,
            "/ws",
            "openSocket",
            "Open the WebSocket: docs/schemas/asyncapi.json.",
            Body::Socket,
        )
        .refuses(&[400, 503]),
        Operation::get::<Snapshot>("/api/state", "state", "All that is known now: the newest frame."),
        Operation::get::<SiteShown<'_>>("/api/site", "site", "The site in use."),
        put_site.refuses(&[400, 409, 413, 415, 500]),
        Operation::get::<AlarmsListed>(
            "/api/alarms",
            "alarms",
            "The alarms that stand, and those of the last day.",
        ),
        Operation::post::<AlarmsAcknowledged>(
            "/api/alarms/acknowledge",
            "acknowledge",
            "Acknowledge alarms: \
            all that are named, or none.",
        )
        .takes::<Seen>()
        .refuses(&[400, 404, 409, 413]),
        Operation::get::<Vec<Past<'_>>>(
            "/api/history",
            "history",
            "The last ten minutes, two lines a second.",
        ),
        Operation::get::<Kept<Overview>>("/api/overview", "overview", "A time of up to a month at a glance.")
            .asks(&[FROM, TO, BINS])
            .refuses(&[400, 503]),
        Operation::get::<Kept<Paths>>("/api/past", "past", "Paths, counts and events of up to an hour.")
            .asks(&[FROM, TO])
            .refuses(&[400, 503]),
        Operation::get::<Kept<Figures>>(
            "/api/figures",
            "figures",
            "Crossings of lines, people and stays in zones, part by part \
            of up to a month.",
        )
        .asks(&[FROM, TO, BIN, EDGES])
        .refuses(&[400, 503]),
        Operation::get::<Kept<Heat>>("/api/heat", "heat", "How long people were where, of up to a month.")
            .asks(&[FROM, TO])
            .refuses(&[400, 503]),
        Operation::get::<Covered>(
            "/api/coverage",
            "coverage",
            "What the modules see, and what is expected of them.",
        )
        .refuses(&[404, 503]),
        Operation::get::<Explained>("/api/explain", "explain", "Why a figure is what it is: one of these.")
            .asks(&[ZONE, LINE, PERSON, ALARM])
            .refuses(&[400, 404, 503]),
        Operation::get::<FirmwareFiles>(
            "/api/firmware",
            "firmware",
            "Which firmware there is for new boards.",
        )
        .refuses(&[500]),
        text("/api/firmware/{name}", "firmwareFile", "A file of it.", "application/octet-stream")
            .refuses(&[404, 500]),
        Operation::get::<Proposal>(
            "/api/survey",
            "survey",
            "Walls, rooms and entries that the modules have measured.",
        ),
        Operation::get::<PictureLaid>(
            "/api/picture/place",
            "picturePlace",
            "Where the picture under the map lies.",
        ),
        Operation::new(
            Method::PUT,
            "/api/picture/place",
            "layPicture",
            "Lay it elsewhere.",
            Body::Json(of::<Done>),
        )
        .takes::<Place>()
        .refuses(&[400, 404, 500]),
        text("/api/picture", "picture", "The picture under the map.", "image/png").refuses(&[404, 500]),
        Operation {
            takes: vec![Body::Text("image/png"), Body::Text("image/svg+xml")],
            ..Operation::new(
                Method::PUT,
                "/api/picture",
                "changePicture",
                "Another picture, of 8 MiB at most.",
                Body::Json(of::<Done>),
            )
        }
        .refuses(&[400, 413, 415, 500]),
        Operation::new(
            Method::DELETE,
            "/api/picture",
            "removePicture",
            "No picture any more.",
            Body::Json(of::<Done>),
        )
        .refuses(&[500]),
        Operation::post::<SiteTogether<'_>>(
            "/api/site/try",
            "trySite",
            "What would become of a change. Nothing is saved.",
        )
        .takes::<Change>()
        .refuses(&[400, 413]),
        Operation::get::<Whereabouts>("/api/where", "whereIs", "Where an ID is that a reader has read.")
            .asks(&[ID])
            .refuses(&[400, 404]),
        Operation::post::<Done>("/api/sign", "sign", "Say what a reader of cards or tags has read.")
            .takes::<Sign>()
            .refuses(&[400, 404, 409, 413, 503]),
        Operation::get::<Status>("/api/calibration", "calibration", "How far the calibration by walking is."),
        Operation::post::<Either<Revised, Status>>(
            "/api/calibration",
            "calibrate",
            "A step of the calibration; `accept` is \
            answered with the site's new revision, the others as the question how far it is.",
        )
        .takes::<Wish>()
        .refuses(&[400, 409, 413, 500]),
        Operation::get::<ModuleSettings>("/api/module/{name}", "module", "The settings of a module.")
            .refuses(&[404, 409, 504]),
        Operation::get::<Vec<Thing>>(
            "/api/module/{name}/things",
            "moduleThings",
            "What stands out from a module's background.",
        )
        .refuses(&[404, 409, 504]),
        Operation::get::<Session>("/api/session", "session", "Who asks, and what they may do."),
        Operation::post::<Session>("/api/session", "logIn", "Log in: the answer has a cookie.")
            .takes::<LogIn>()
            .refuses(&[400, 401, 409, 413, 429]),
        end,
        text("/metrics", "metrics", "The newest frame for Prometheus.", crate::metrics::CONTENT_TYPE),
        text("/healthz", "healthz", "Whether the tracker goes on.", "text/plain; charset=utf-8")
            .refuses(&[503]),
        Operation::get::<Vec<DoorState>>("/api/door", "doors", "Every guarded door."),
        Operation::get::<DoorState>("/api/door/{name}", "door", "A guarded door.").refuses(&[404]),
        text("/door/{name}", "doorScreen", "The screen for the entrant.", "text/html; charset=utf-8"),
        Operation::get::<BTreeMap<String, Value>>("/api/openapi.json", "openapi", "This document."),
        Operation::get::<BTreeMap<String, Value>>(
            "/api/asyncapi.json",
            "asyncapi",
            "The same for the WebSocket and MQTT.",
        ),
    ];
    all.extend(Act::NAMED.map(of_module));
    all.extend(Input::NAMED.map(of_door));
    all
}

fn of_module((act, name): (Act, &'static str)) -> Operation {
    const ROUTE: &str = "/api/module/{name}/{action}";
    let operation = match act {
        Act::Identify => Operation::post::<Done>(ROUTE, "", "Let its LED blink, so that a person finds it.")
            .takes::<Identify>(),
        Act::Learn => Operation::post::<Done>(ROUTE, "", "Learn the background anew: leave its view before.")
            .takes::<Learn>(),
        Act::Absorb => {
            Operation::post::<Absorbed>(ROUTE, "", "Make a thing that stands still a part of the background.")
                .takes::<Absorb>()
        }
        Act::Restart => Operation::post::<Done>(ROUTE, "", "Start it anew.").takes::<Nothing>(),
        Act::Rename => Operation::post::<Renamed>(ROUTE, "", "Give it another name, in the site as well.")
            .takes::<Rename>(),
        Act::Settings => {
            let about = "Change settings, by their keys: all of them or none.";
            Operation::post::<Done>(ROUTE, "", about).takes::<BTreeMap<String, String>>()
        }
    };
    let (path, id) = (ROUTE.replace("{action}", name), format!("{name}Module"));
    Operation { path, id, refusals: &[400, 404, 409, 413, 504], ..operation }
}

fn of_door((input, name): (Input, &'static str)) -> Operation {
    const ROUTE: &str = "/api/door/{name}/{*input}";
    let about = match input {
        Input::Card => "A card was shown.",
        Input::Number => "A number of people was entered.",
        Input::Contact => "The leaf has opened or shut.",
        Input::Exit => "A person wants out. Taken from every client, whatever the body.",
        Input::Reset => "A person has looked after the alarm.",
        Input::LockReady => "The lock is there; the answer is its order.",
        Input::LockTaken => "The lock has taken an output.",
        Input::AlarmTaken => "The alarm has taken an output.",
    };
    let operation = if input == Input::LockReady {
        Operation::post::<Either<LockOrder, Done>>(ROUTE, "", about)
    } else {
        Operation::post::<Done>(ROUTE, "", about)
    };
    let (path, id) = (ROUTE.replace("{*input}", name), format!("tellDoor-{}", name.replace('/', "-")));
    Operation { path, id, takes: vec![Body::Input(input)], refusals: &[400, 404, 409, 421], ..operation }
}

/// One of two answers.
struct Either<A, B>(std::marker::PhantomData<(A, B)>);

impl<A: JsonSchema, B: JsonSchema> JsonSchema for Either<A, B> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("{}Or{}", A::schema_name(), B::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let either = [generator.subschema_for::<A>(), generator.subschema_for::<B>()];
        schemars::json_schema!({ "anyOf": either })
    }
}
