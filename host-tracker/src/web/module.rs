//! Modules, looked after from the map: as `kehai-tracker module` does, and by the same requests.
//!
//! ```text
//!   GET  /api/module/NAME          ─▶ {"settings": {"name": "left", "learn_scans": "100", …}}
//!   GET  /api/module/NAME/things   ─▶ [{"bearing_deg": -25.1, "range_m": 1.83, "still_s": 12.0, "is_still": true}]
//!   POST /api/module/NAME/identify ◀─ {} or {"seconds": 10}    ─▶ {}: it blinks
//!   POST /api/module/NAME/learn    ◀─ {} or {"scans": 300}        ─▶ {}: it has begun
//!   POST /api/module/NAME/absorb   ◀─ {} or {"bearing": -25}      ─▶ {"bearing_deg": …, "range_m": …, "beams": …, …}
//!   POST /api/module/NAME/restart  ◀─ {}                          ─▶ {}
//!   POST /api/module/NAME/rename   ◀─ {"name": "hall"}            ─▶ {"name": "hall", "revision": 4}, with the site's new revision if it has changed
//!   POST /api/module/NAME/settings ◀─ {"learn_scans": "300"}      ─▶ {}: all of them are stored
//!        ─▶ 400 (malformed), 403 (not by this role), 404 (no such module or action), 409 (refused, and why; not found; a door is in use),
//!           504 (it does not answer)
//! ```
//!
//! NAME is that of the frames. One request at a time is under way.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::rejection::BytesRejection;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use tokio::task::spawn_blocking;

use super::answers::refuse;
use super::blocking::in_turn;
use super::bodies::{Done, ModuleSettings, Renamed};
use super::shared::Shared;
use super::site::save_status;
use crate::access::Who;
use crate::key_file;
use crate::module::absorb::{absorb, things};
use crate::module::{self, ModuleError};
use crate::named::named;
use crate::net::client::{Client, ClientError};
use kehai::wire::IDENTIFY_MAX_S;
use kehai_tracking::keys::Keys;

named! {
    /// What can be done with a module, by its name in paths.
    #[derive(Clone, Copy, PartialEq, Eq, Debug)]
    pub(crate) enum Act {
        Identify = "identify",
        Learn = "learn",
        Absorb = "absorb",
        Restart = "restart",
        Rename = "rename",
        Settings = "settings",
    }
}

/// Nothing more is to be said.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Nothing {}

/// How long to blink.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Identify {
    /// For so many seconds, 60 at most; 0: no more; without it, half a minute.
    #[serde(default = "identify_s")]
    #[schemars(range(max = 60))]
    seconds: u16,
}

const fn identify_s() -> u16 {
    module::IDENTIFY_S
}

/// How to learn.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Learn {
    /// Scans to learn from; 0: as many as its setting says.
    #[serde(default)]
    scans: u16,
}

/// What is to be absorbed.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Absorb {
    /// Its direction, degrees from the module's front, counter-clockwise; without it, the only thing there is.
    bearing: Option<f64>,
}

/// Another name.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct Rename {
    /// It.
    name: String,
}

/// Why not.
type Refused = (StatusCode, String);

/// Its settings.
pub async fn show(State(shared): State<Arc<Shared>>, Path(name): Path<String>) -> Response {
    let settings = asked(&shared, &name, |client| {
        let settings = module::settings(client)?.into_iter().collect();
        Ok(json!(ModuleSettings { settings }))
    });
    response(settings.await)
}

/// What stands out from its background.
pub async fn seen(State(shared): State<Arc<Shared>>, Path(name): Path<String>) -> Response {
    let things = asked(&shared, &name, |client| {
        module::control(client)?;
        Ok(json!(things(client)?))
    });
    response(things.await)
}

/// Does something with it.
pub async fn act(
    State(shared): State<Arc<Shared>>,
    Extension(who): Extension<Who>,
    Path((name, action)): Path<(String, String)>,
    body: Result<Bytes, BytesRejection>,
) -> Response {
    let Some(act) = Act::named(&action) else {
        let names = Act::NAMED.map(|(_, name)| name).join(", ");
        return refuse(StatusCode::NOT_FOUND, &format!("a module takes {names}"));
    };
    let Ok(body) = body else {
        return refuse(StatusCode::BAD_REQUEST, "the request was cut off or is too long");
    };
    // What a module sees and how decides what a door counts; its LED does not.
    if act != Act::Identify
        && let Some(refusal) = shared.refuse_change(&who, None)
    {
        return refusal;
    }
    let answer = done(&shared, &who, &name, act, &body).await;
    if answer.is_ok() {
        tracing::info!("module {name}: {}, asked for by {who}", act.name());
    }
    response(answer)
}

fn response(answer: Result<Value, Refused>) -> Response {
    match answer {
        Ok(answer) => Json(answer).into_response(),
        Err((status, why)) => refuse(status, &why),
    }
}

async fn done(shared: &Arc<Shared>, who: &Who, name: &str, act: Act, body: &[u8]) -> Result<Value, Refused> {
    match act {
        Act::Identify => {
            let Identify { seconds } = read(body)?;
            if seconds > IDENTIFY_MAX_S {
                let why = format!("seconds: a module blinks for {IDENTIFY_MAX_S} s at most");
                return Err((StatusCode::BAD_REQUEST, why));
            }
            asked(shared, name, move |client| {
                module::identify(client, seconds)?;
                Ok(json!(Done {}))
            })
            .await
        }
        Act::Learn => {
            let Learn { scans } = read(body)?;
            asked(shared, name, move |client| {
                module::control(client)?;
                module::learn(client, scans)?;
                Ok(json!(Done {}))
            })
            .await
        }
        Act::Absorb => {
            let Absorb { bearing } = read(body)?;
            asked(shared, name, move |client| {
                module::control(client)?;
                Ok(json!(absorb(client, bearing)?))
            })
            .await
        }
        Act::Restart => {
            let Nothing {} = read(body)?;
            asked(shared, name, |client| {
                module::control(client)?;
                module::restart(client)?;
                Ok(json!(Done {}))
            })
            .await
        }
        Act::Rename => {
            let Rename { name: to } = read(body)?;
            rename(shared, who, name, to).await
        }
        Act::Settings => {
            let settings: BTreeMap<String, String> = read(body)?;
            if settings.contains_key("name") {
                let why = "name: rename changes it, here and in the site";
                return Err((StatusCode::BAD_REQUEST, why.to_owned()));
            }
            let settings = settings.into_iter().map(|(key, value)| format!("{key}={value}")).collect();
            set(shared, name, settings).await
        }
    }
}

async fn set(shared: &Shared, name: &str, settings: Vec<String>) -> Result<Value, Refused> {
    asked(shared, name, move |client| {
        module::control(client)?;
        module::set(client, &settings)?;
        Ok(json!(Done {}))
    })
    .await
}

/// Gives it another name, and the site, if it calls it so.
///
/// # Cancellation
/// Once begun it is done in both: a module with a name that the site does not have would be missing there.
async fn rename(shared: &Arc<Shared>, who: &Who, name: &str, to: String) -> Result<Value, Refused> {
    let (shared, who, name) = (Arc::clone(shared), who.clone(), name.to_owned());
    let renaming = tokio::spawn(async move { rename_in_both(&shared, &who, &name, to).await });
    renaming.await.unwrap_or_else(|_| Err(broken("the module could not be renamed".to_owned())))
}

/// The site as its file has it now, if this client may change that: by hand it may have got doors.
fn look(shared: &Shared, who: &Who) -> Result<(), Refused> {
    let context = &shared.context;
    context.site.look(&*context.changed).map_err(|error| (save_status(&error), error.to_string()))?;
    shared.may_change(who, None)
}

async fn rename_in_both(shared: &Arc<Shared>, who: &Who, name: &str, to: String) -> Result<Value, Refused> {
    // Before the module has its name: of what is refused nothing is done.
    let (looking, by) = (Arc::clone(shared), who.clone());
    let looked = spawn_blocking(move || look(&looking, &by)).await;
    looked.unwrap_or_else(|_| Err(broken("the site's file could not be read".to_owned())))?;
    let site = shared.context.site.current().site;
    if site.places().any(|(_, known)| known == to) {
        return Err((StatusCode::CONFLICT, format!("the site has a \"{to}\" already")));
    }
    set(shared, name, vec![format!("name={to}")]).await?;
    let (shared, who, name) = (Arc::clone(shared), who.clone(), name.to_owned());
    let saving = move || {
        let (file, changed) = (&shared.context.site, &*shared.context.changed);
        // Of the file, now: another rename may just have been written, and not be in use yet.
        let renamed = look(&shared, &who).and_then(|()| {
            let is_there = file.current().site.places().any(|(_, known)| known == name);
            let renamed = is_there.then(|| file.rename_module(&name, &to, changed)).transpose();
            renamed.map_err(|error| (save_status(&error), error.to_string()))
        });
        match renamed {
            Ok(revision) => Ok(json!(Renamed { name: to, revision })),
            Err((status, why)) => Err((status, format!("it is called {to} now, but not in the site: {why}"))),
        }
    };
    let not_saved = |_| Err(broken("it has its name, but the site could not be saved".to_owned()));
    spawn_blocking(saving).await.unwrap_or_else(not_saved)
}

const fn broken(why: String) -> Refused {
    (StatusCode::INTERNAL_SERVER_ERROR, why)
}

/// The body of a request; an empty one is an empty object.
fn read<T: DeserializeOwned>(body: &[u8]) -> Result<T, Refused> {
    let body = if body.is_empty() { b"{}" } else { body };
    serde_json::from_slice(body).map_err(|error| (StatusCode::BAD_REQUEST, error.to_string()))
}

/// The answer of a module to what `ask` asks of it, in a thread that may wait for it; or why there is none.
async fn asked(
    shared: &Shared,
    name: &str,
    ask: impl Fn(&mut Client) -> Result<Value, ModuleError> + Send + 'static,
) -> Result<Value, Refused> {
    let address = address(shared, name)?;
    let file = shared.context.keys.clone();
    let answer = in_turn(&shared.asking, move |clients| {
        let keys = file.as_deref().map(key_file::load).transpose();
        let keys = keys.map_err(|error| broken(error.to_string()))?.flatten();
        let keys = Arc::new(keys.unwrap_or_else(Keys::none));
        clients.ask(address, &keys, ask).map_err(|error| {
            let status = match &error {
                ModuleError::Client(ClientError::Silent(_)) => StatusCode::GATEWAY_TIMEOUT,
                _ => StatusCode::CONFLICT,
            };
            (status, error.to_string())
        })
    });
    answer.await.unwrap_or_else(|_| Err(broken("the module could not be asked".to_owned())))
}

/// Where a module answers, by its name in the frames.
fn address(shared: &Shared, name: &str) -> Result<SocketAddr, Refused> {
    let frame = Arc::clone(&shared.context.frames.borrow());
    let mut lines = frame.modules.iter().filter(|line| line.name == name);
    let Some(line) = lines.next() else {
        return Err((StatusCode::NOT_FOUND, format!("there is no module \"{name}\"")));
    };
    if lines.next().is_some() {
        return Err((
            StatusCode::CONFLICT,
            format!(
                "two modules are called \"{name}\": kehai-tracker module set ADDRESS name=… gives one another name"
            ),
        ));
    }
    line.address.parse().map_err(|_| (StatusCode::CONFLICT, format!("module {name} has not been found")))
}
