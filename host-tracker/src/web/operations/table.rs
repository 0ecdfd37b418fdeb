//! Every request, by its subject: people, the site and its modules, doors, the server itself.

use std::collections::BTreeMap;

use kehai_tracking::calibration::status::Status;
use kehai_tracking::door::LockOrder;
use kehai_tracking::door::doors::DoorState;
use kehai_tracking::door::inbox::{self, Input};
use kehai_tracking::names::Whereabouts;
use kehai_tracking::names::message::{self, Message as Sign};
use kehai_tracking::snapshot::Snapshot;
use kehai_tracking::survey::Proposal;
use serde_json::Value;

use super::operation::{Body, Either, Operation, Query};
use super::route::{delete, get, post, put};
use crate::access::roles::Action;
use crate::firmware::folder::FirmwareFiles;
use crate::metrics;
use crate::module::absorb::{Absorbed, Seen as Thing};
use crate::picture::{LONGEST, Place};
use crate::store::figures::Figures;
use crate::store::timeline::Overview;
use crate::web::alarms::{self, Seen};
use crate::web::bodies::{
    AlarmsAcknowledged, AlarmsListed, Done, Kept, ModuleSettings, Paths, Refusal, Renamed, Revised, Session,
    SiteShown, SiteTogether,
};
use crate::web::calibration::{self, Wish};
use crate::web::coverage::{self, Covered};
use crate::web::explain::{self, Explained};
use crate::web::heat::{self, Heat};
use crate::web::module::{self, Absorb, Act, Identify, Learn, Nothing, Rename};
use crate::web::picture::{self, PictureLaid};
use crate::web::recent::Past;
use crate::web::rights::Right::{self, Free, To, ToTell};
use crate::web::session::{self, LogIn};
use crate::web::site::{self, Change};
use crate::web::{documents, door, firmware, newest, past, sign, socket, survey};

const FROM: Query = Query::number("from", "The beginning, ms since 1970.", true);
const TO: Query = Query::number("to", "The end, ms since 1970.", true);
const BINS: Query =
    Query::number("bins", "Into how many parts the time is cut, 1 to 1000; 240 if nothing is said.", false);
const BIN: Query = Query::number("bin", "Length of a part, s; 3600 if nothing is said.", false);
const ID: Query = Query::word("id", "What a reader has read.", true);
const EDGES: Query = Query::word(
    "edges",
    "In place of the others: where parts begin and end, ms since 1970, between commas.",
    false,
);
const ZONE: Query = Query::word("zone", "A zone.", false);
const LINE: Query = Query::word("line", "A counting line.", false);
const PERSON: Query = Query::number("person", "A track.", false);
const ALARM: Query = Query::word("alarm", "The name of an alarm, as `clock-off`.", false);

const LOOK: Right = To(Action::Look);
const LOOK_AT_DOOR: Right = To(Action::LookAtDoor);
const CHANGE: Right = To(Action::ChangeSite);
const ASK: Right = To(Action::AskModule);

/// All of them, but for the page's files.
pub(super) fn operations() -> Vec<Operation> {
    let (modules, inputs) = (Act::NAMED.map(of_module), Input::NAMED.map(of_input));
    [&of_people()[..], &of_site(), &modules, &of_server(), &of_doors(), &inputs].concat()
}

fn of_people() -> Vec<Operation> {
    vec![
        get("/ws", LOOK, socket::open)
            .answers_with(Body::Socket, "openSocket", "Open the WebSocket: docs/schemas/asyncapi.json.")
            .refuses(&[400, 503]),
        get("/api/state", LOOK, newest::state)
            .answers::<Snapshot>("state", "All that is known now: the newest frame."),
        get("/api/alarms", LOOK, alarms::list)
            .answers::<AlarmsListed>("alarms", "The alarms that stand, and those of the last day."),
        post("/api/alarms/acknowledge", To(Action::Acknowledge), alarms::acknowledge)
            .answers::<AlarmsAcknowledged>("acknowledge", "Acknowledge alarms: all that are named, or none.")
            .takes::<Seen>()
            .refuses(&[400, 404, 409, 413]),
        get("/api/history", LOOK, newest::history)
            .answers::<Vec<Past<'_>>>("history", "The last ten minutes, two lines a second."),
        get("/api/overview", LOOK, past::glance)
            .answers::<Kept<Overview>>("overview", "A time of up to a month at a glance.")
            .asks(&[FROM, TO, BINS])
            .refuses(&[400, 503]),
        get("/api/past", LOOK, past::paths)
            .answers::<Kept<Paths>>("past", "Paths, counts and events of up to an hour.")
            .asks(&[FROM, TO])
            .refuses(&[400, 503]),
        get("/api/figures", LOOK, past::binned)
            .answers::<Kept<Figures>>(
                "figures",
                "Crossings of lines, people and stays in zones, part by part of up to a month.",
            )
            .asks(&[FROM, TO, BIN, EDGES])
            .refuses(&[400, 503]),
        get("/api/heat", LOOK, heat::map)
            .answers::<Kept<Heat>>("heat", "How long people were where, of up to a month.")
            .asks(&[FROM, TO])
            .refuses(&[400, 503]),
        get("/api/coverage", LOOK, coverage::show)
            .answers::<Covered>("coverage", "What the modules see, and what is expected of them.")
            .refuses(&[404, 503]),
        get("/api/explain", LOOK, explain::why)
            .answers::<Explained>("explain", "Why a figure is what it is: one of these.")
            .asks(&[ZONE, LINE, PERSON, ALARM])
            .refuses(&[400, 404, 503]),
        get("/api/where", LOOK, sign::ask)
            .answers::<Whereabouts>("whereIs", "Where an ID is that a reader has read.")
            .asks(&[ID])
            .refuses(&[400, 404]),
        // Readers of cards and tags say what they have read at each listener.
        post("/api/sign", To(Action::Sign), sign::tell)
            .for_doors()
            .body_max(message::LONGEST)
            .answers::<Done>("sign", "Say what a reader of cards or tags has read.")
            .takes::<Sign>()
            .refuses(&[400, 404, 409, 413, 503]),
    ]
}

fn of_site() -> Vec<Operation> {
    vec![
        get("/api/site", LOOK, site::show).answers::<SiteShown<'_>>("site", "The site in use."),
        put("/api/site", CHANGE, site::change)
            .answers::<Revised>(
                "changeSite",
                "Check, save and use another site. As TOML it is \
                 the text of a site file; the revision is then in the header If-Match.",
            )
            .takes::<Change>()
            .takes_any(&[Body::Text("application/toml")])
            .conflicts::<Either<Refusal, SiteTogether<'_>>>()
            .refuses(&[400, 409, 413, 415, 500]),
        post("/api/site/try", CHANGE, site::attempt)
            .answers::<SiteTogether<'_>>("trySite", "What would become of a change. Nothing is saved.")
            .takes::<Change>()
            .refuses(&[400, 413]),
        get("/api/firmware", LOOK, firmware::list)
            .answers::<FirmwareFiles>("firmware", "Which firmware there is for new boards.")
            .refuses(&[500]),
        get("/api/firmware/{name}", LOOK, firmware::file)
            .answers_text("application/octet-stream", "firmwareFile", "A file of it.")
            .refuses(&[404, 500]),
        get("/api/survey", CHANGE, survey::show)
            .answers::<Proposal>("survey", "Walls, rooms and entries that the modules have measured."),
        get("/api/picture/place", LOOK, picture::place)
            .answers::<PictureLaid>("picturePlace", "Where the picture under the map lies."),
        put("/api/picture/place", CHANGE, picture::lay)
            .answers::<Done>("layPicture", "Lay it elsewhere.")
            .takes::<Place>()
            .refuses(&[400, 404, 500]),
        get("/api/picture", LOOK, picture::show)
            .answers_text("image/png", "picture", "The picture under the map.")
            .refuses(&[404, 500]),
        put("/api/picture", CHANGE, picture::change)
            .body_max(LONGEST)
            .answers::<Done>("changePicture", "Another picture, of 8 MiB at most.")
            .takes_any(&[Body::Text("image/png"), Body::Text("image/svg+xml")])
            .refuses(&[400, 413, 415, 500]),
        delete("/api/picture", CHANGE, picture::remove)
            .answers::<Done>("removePicture", "No picture any more.")
            .refuses(&[500]),
        get("/api/calibration", LOOK, calibration::show)
            .answers::<Status>("calibration", "How far the calibration by walking is."),
        post("/api/calibration", CHANGE, calibration::change)
            .answers::<Either<Revised, Status>>(
                "calibrate",
                "A step of the calibration; `accept` is \
                 answered with the site's new revision, the others as the question how far it is.",
            )
            .takes::<Wish>()
            .refuses(&[400, 409, 413, 500]),
        get("/api/module/{name}", ASK, module::show)
            .answers::<ModuleSettings>("module", "The settings of a module.")
            .refuses(&[404, 409, 504]),
        get("/api/module/{name}/things", ASK, module::seen)
            .answers::<Vec<Thing>>("moduleThings", "What stands out from a module's background.")
            .refuses(&[404, 409, 504]),
    ]
}

fn of_module((act, name): (Act, &'static str)) -> Operation {
    let route = post("/api/module/{name}/{action}", ASK, module::act);
    let id = format!("{name}Module");
    let operation = match act {
        Act::Identify => {
            route.answers::<Done>(&id, "Let its LED blink, so that a person finds it.").takes::<Identify>()
        }
        Act::Learn => {
            route.answers::<Done>(&id, "Learn the background anew: leave its view before.").takes::<Learn>()
        }
        Act::Absorb => route
            .answers::<Absorbed>(&id, "Make a thing that stands still a part of the background.")
            .takes::<Absorb>(),
        Act::Restart => route.answers::<Done>(&id, "Start it anew.").takes::<Nothing>(),
        Act::Rename => {
            route.answers::<Renamed>(&id, "Give it another name, in the site as well.").takes::<Rename>()
        }
        Act::Settings => route
            .answers::<Done>(&id, "Change settings, by their keys: all of them or none.")
            .takes::<BTreeMap<String, String>>(),
    };
    operation.named("{action}", name).refuses(&[400, 404, 409, 413, 504])
}

fn of_doors() -> Vec<Operation> {
    vec![
        get("/api/door", LOOK_AT_DOOR, door::all)
            .for_doors()
            .answers::<Vec<DoorState>>("doors", "Every guarded door."),
        get("/api/door/{name}", LOOK_AT_DOOR, door::one)
            .for_doors()
            .answers::<DoorState>("door", "A guarded door.")
            .refuses(&[404]),
        get("/door/{name}", Free, door::screen).for_doors().answers_text(
            "text/html; charset=utf-8",
            "doorScreen",
            "The screen for the entrant.",
        ),
    ]
}

fn of_input((input, name): (Input, &'static str)) -> Operation {
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
    let route = post("/api/door/{name}/{*input}", ToTell, door::tell).for_doors().body_max(inbox::LONGEST);
    let id = format!("tellDoor-{}", name.replace('/', "-"));
    let operation = if input == Input::LockReady {
        route.answers::<Either<LockOrder, Done>>(&id, about)
    } else {
        route.answers::<Done>(&id, about)
    };
    operation.named("{*input}", name).takes_any(&[Body::Input(input)]).refuses(&[400, 404, 409, 421])
}

fn of_server() -> Vec<Operation> {
    vec![
        get("/api/session", Free, session::show)
            .answers::<Session>("session", "Who asks, and what they may do."),
        post("/api/session", Free, session::begin)
            .answers::<Session>("logIn", "Log in: the answer has a cookie.")
            .takes::<LogIn>()
            .refuses(&[400, 401, 409, 413, 429]),
        delete("/api/session", Free, session::end).answers::<Done>("logOut", "Log out."),
        get("/metrics", LOOK, newest::metrics).answers_text(
            metrics::CONTENT_TYPE,
            "metrics",
            "The newest frame for Prometheus.",
        ),
        // It says nothing but that, and a supervisor may not agree on TLS.
        get("/healthz", Free, newest::healthz)
            .in_clear()
            .answers_text("text/plain; charset=utf-8", "healthz", "Whether the tracker goes on.")
            .refuses(&[503]),
        // As little as the page's files: they are the same for all.
        get("/api/openapi.json", Free, documents::openapi)
            .answers::<BTreeMap<String, Value>>("openapi", "This document."),
        get("/api/asyncapi.json", Free, documents::asyncapi)
            .answers::<BTreeMap<String, Value>>("asyncapi", "The same for the WebSocket and MQTT."),
    ]
}
