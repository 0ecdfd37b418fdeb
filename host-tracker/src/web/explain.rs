//! Why a figure is what it is.
//!
//! ```text
//!   GET /api/explain?zone=hall     ─▶ {"words": ["2 people", …], "zone": {"name": "hall", "verdict": {"is": "seen"}, "unseen": […], "inside": […], …}}
//!   GET /api/explain?line=front    ─▶ the same of a counting line
//!   GET /api/explain?person=7      ─▶ {"words": […], "person": {"track": 7, "life": {"is": "hidden"}, "modules": […], …}}
//!   GET /api/explain?alarm=dirty   ─▶ {"words": […], "alarm": [{"device": "left", "condition": {…}}], "listed": […]}
//!                                     or 404: there is no such thing
//! ```
//!
//! The tracking loop copies what it knows; the reasons are found here.

use std::sync::Arc;

use axum::Json;
use axum::extract::{RawQuery, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use percent_encoding::percent_decode_str;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::json;

use super::answers::refuse;
use super::shared::Shared;
use kehai_tracking::alarm::{AlarmKind, Cause};
use kehai_tracking::alarm_list::ListedAlarm;
use kehai_tracking::explain::words::words;
use kehai_tracking::explain::{Question, Reasons, explain};

const USAGE: &str = "ask for /api/explain?zone=NAME, line=NAME, person=NUMBER or alarm=NAME, one of them";

/// What is asked for.
#[derive(PartialEq, Debug)]
enum Asked {
    /// Something that the tracking loop knows.
    Of(Question),
    /// An alarm that no device measures anything for.
    Listed(Cause),
}

impl Asked {
    fn read(query: &str) -> Result<Self, String> {
        let (key, value) = query.split_once('=').ok_or(USAGE)?;
        if value.contains('&') {
            return Err(USAGE.to_owned());
        }
        let value = percent_decode_str(value).decode_utf8().map_err(|_| USAGE)?.into_owned();
        match key {
            "zone" => Ok(Self::Of(Question::Zone(value))),
            "line" => Ok(Self::Of(Question::Line(value))),
            "person" => match value.parse() {
                Ok(number) => Ok(Self::Of(Question::Person(number))),
                Err(_) => Err(format!("person: \"{value}\" is no number of a track")),
            },
            "alarm" => match serde_json::from_value(json!(value)) {
                Ok(Cause::Fault(AlarmKind::Unknown)) | Err(_) => {
                    Err(format!("alarm: there is no alarm \"{value}\""))
                }
                Ok(Cause::Fault(kind)) => Ok(Self::Of(Question::Alarm(kind))),
                Ok(cause) => Ok(Self::Listed(cause)),
            },
            _ => Err(USAGE.to_owned()),
        }
    }

    fn cause(&self) -> Option<Cause> {
        match self {
            Self::Of(Question::Alarm(kind)) => Some(Cause::Fault(*kind)),
            Self::Of(_) => None,
            Self::Listed(cause) => Some(*cause),
        }
    }
}

/// Explains.
pub async fn why(State(shared): State<Arc<Shared>>, RawQuery(query): RawQuery) -> Response {
    let asked = match Asked::read(&query.unwrap_or_default()) {
        Ok(asked) => asked,
        Err(why) => return refuse(StatusCode::BAD_REQUEST, &why),
    };
    let cause = asked.cause();
    let mut explained = match asked {
        Asked::Listed(_) => Explained::default(),
        Asked::Of(question) => {
            let Some(questions) = &shared.context.questions else {
                return refuse(StatusCode::NOT_FOUND, "this tracker answers no questions");
            };
            let missing = missing(&question);
            let facts = match questions.ask(question).await {
                Ok(facts) => facts,
                Err(why) => return refuse(StatusCode::SERVICE_UNAVAILABLE, &why.to_string()),
            };
            let told = tokio::task::spawn_blocking(|| {
                let reasons = explain(facts)?;
                Some(Explained { words: words(&reasons), reasons: Some(reasons), listed: None })
            });
            match told.await {
                Ok(Some(explained)) => explained,
                Ok(None) => return refuse(StatusCode::NOT_FOUND, &missing),
                Err(_) => return refuse(StatusCode::INTERNAL_SERVER_ERROR, "it could not be explained"),
            }
        }
    };
    if let Some(cause) = cause {
        let listed = &shared.context.listed;
        let known = listed.standing().into_iter().chain(listed.ended());
        explained.list(cause, known.filter(|alarm| alarm.cause == cause).collect());
    }
    Json(explained).into_response()
}

/// What is said where there is nothing to explain.
fn missing(question: &Question) -> String {
    match question {
        Question::Zone(name) => format!("there is no zone \"{name}\" now"),
        Question::Line(name) => format!("there is no line \"{name}\" now"),
        Question::Person(number) => format!("there is no person {number} now"),
        Question::Alarm(kind) => format!("nothing is known of the alarm \"{kind}\" now"),
        Question::Views => "nothing is known of what modules see now".to_owned(),
    }
}

/// The reasons.
#[derive(Debug, Default, Serialize, JsonSchema)]
pub(in crate::web) struct Explained {
    /// In words, a sentence each.
    words: Vec<String>,
    /// Under the key of what was asked for.
    #[serde(flatten)]
    reasons: Option<Reasons>,
    /// Alarms of that name: those that stand, and those of the last day.
    #[serde(skip_serializing_if = "Option::is_none")]
    listed: Option<Vec<ListedAlarm>>,
}

impl Explained {
    /// Adds which alarms of a cause stand, and which ended within a day.
    fn list(&mut self, cause: Cause, own: Vec<ListedAlarm>) {
        let said = own.iter().map(|alarm| match alarm.until_ms {
            None => format!("{alarm} stands: {}", alarm.text),
            Some(_) => format!("{alarm} rang within the last day, and is over: {}", alarm.text),
        });
        let mut said: Vec<String> = said.collect();
        if own.is_empty() {
            said.push(format!("no alarm {} stands, and none has within the last day", cause.name()));
        }
        self.words.splice(0..0, said);
        self.listed = Some(own);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kehai_tracking::door;

    #[test]
    fn a_question_names_one_thing_that_can_be() {
        let zone = Asked::Of(Question::Zone("living room".into()));
        assert_eq!(Asked::read("zone=living%20room"), Ok(zone));
        assert_eq!(Asked::read("person=7"), Ok(Asked::Of(Question::Person(7))));
        assert_eq!(Asked::read("alarm=clock-off"), Ok(Asked::Of(Question::Alarm(AlarmKind::ClockOff))));
        assert_eq!(Asked::read("alarm=held-open"), Ok(Asked::Listed(Cause::Door(door::Alarm::HeldOpen))));
        for wrong in
            ["", "zone", "person=me", "person=-1", "alarm=rain", "alarm=unknown", "zone=a&line=b", "room=a"]
        {
            assert!(Asked::read(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_is_not_there_is_named() {
        assert_eq!(missing(&Question::Zone("nope".into())), "there is no zone \"nope\" now");
        assert_eq!(missing(&Question::Person(7)), "there is no person 7 now");
    }
}
