//! What the modules of the site see, for the handover page.
//!
//! ```text
//!   GET /api/coverage ─▶ {"unix_ms": …, "cell_m": 0.25, "cells": [[1.12, 3.4, 2], …], "all": {…}, "zones": […], "blind": […], "next": {…},
//!                         "expected": {…}, "estimated": [{"people": 4, "exact": 0.97, …}], "poses": […]}
//!
//!   home.expected.json ─▶ expected     beside home.toml: what `kehai-sim plan home.toml --keep --modules 0 --json` has printed
//! ```

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::answers::refuse;
use super::shared::Shared;
use crate::store::answers::Posed;
use crate::store::reader::Reader;
use kehai_tracking::expectation::{Expectation, expectations};
use kehai_tracking::explain::Question;
use kehai_tracking::ground::{Ground, ground};
use kehai_tracking::site::{Module, Site};
use kehai_tracking::snapshot::unix_ms;

/// Changes of places that are told at most, the newest.
const POSES_MAX: usize = 20;

/// Of the simulator's result, what is told here.
#[derive(Deserialize)]
struct Plan {
    people: u32,
    layouts: Vec<Layout>,
}

#[derive(Deserialize)]
struct Layout {
    modules: Vec<Module>,
    exact: f64,
    exact_95: [f64; 2],
    runs: u32,
}

/// What the simulator expects of this site.
#[derive(Debug, PartialEq, Serialize, JsonSchema)]
struct Expected {
    people: u32,
    /// Share of the time in which the count is right, and its interval at 95 %.
    exact: f64,
    exact_95: [f64; 2],
    runs: u32,
    /// Whether the modules stood where they are now.
    is_of_now: bool,
}

/// What the modules see, and what is expected of them.
#[derive(Debug, Serialize, JsonSchema)]
pub(in crate::web) struct Covered {
    /// What they see.
    #[serde(flatten)]
    ground: Ground,
    /// When this was found.
    unix_ms: u64,
    /// What the simulator expects; null: it was not asked.
    expected: Option<Expected>,
    /// What is expected by how much is seen alone, of rooms that were simulated before; empty: none of them is like this site.
    estimated: Vec<Expectation>,
    /// Where modules were moved to when, the newest first; null without a database.
    poses: Option<Vec<Posed>>,
}

/// Coverage of the site.
pub async fn show(State(shared): State<Arc<Shared>>) -> Response {
    let Some(questions) = &shared.context.questions else {
        return refuse(StatusCode::NOT_FOUND, "this tracker answers no questions");
    };
    let facts = match questions.ask(Question::Views).await {
        Ok(facts) => facts,
        Err(why) => return refuse(StatusCode::SERVICE_UNAVAILABLE, &why.to_string()),
    };
    let shared = Arc::clone(&shared);
    let found = tokio::task::spawn_blocking(move || {
        let file = shared.context.site.path().with_extension("expected.json");
        let text = std::fs::read_to_string(file).ok();
        let ground = ground(&facts.site, &facts.glances);
        Covered {
            estimated: expectations(&ground.all),
            ground,
            unix_ms: unix_ms(),
            expected: text.and_then(|text| expected(&text, &facts.site)),
            poses: poses(&shared),
        }
    });
    match found.await {
        Ok(covered) => Json(covered).into_response(),
        Err(_) => refuse(StatusCode::INTERNAL_SERVER_ERROR, "the coverage could not be found"),
    }
}

/// What the simulator has said of the first layout; none of what is no such file.
fn expected(text: &str, site: &Site) -> Option<Expected> {
    let Plan { people, layouts } = serde_json::from_str(text).ok()?;
    let Layout { modules, exact, exact_95, runs } = layouts.into_iter().next()?;
    Some(Expected { people, exact, exact_95, runs, is_of_now: modules == site.modules })
}

/// Where modules were moved to when, the newest first; null without a database.
fn poses(shared: &Shared) -> Option<Vec<Posed>> {
    let poses = Reader::open(shared.context.database.as_ref()?).ok()?.poses().ok()?;
    Some(poses.into_iter().rev().take(POSES_MAX).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_simulated_with_the_modules_elsewhere_is_not_of_now() {
        let module = |x: f64| format!("[[module]]\nname = \"left\"\nx = {x:?}\ny = 0.0\nheight_m = 0.9\n");
        let site: Site = toml::from_str(&module(1.0)).unwrap();
        let plan = r#"{"people": 4, "sensor": "urg-04lx", "layouts": [{"modules": [{"name": "left", "x": 1.0, "y": 0.0, "yaw_deg": 0.0, "height_m": 0.9}], "exact": 0.98, "exact_95": [0.97, 0.99], "runs": 40}]}"#;
        let found = expected(plan, &site).unwrap();
        assert_eq!((found.people, found.exact, found.runs, found.is_of_now), (4, 0.98, 40, true));
        let moved: Site = toml::from_str(&module(1.1)).unwrap();
        assert!(!expected(plan, &moved).unwrap().is_of_now);
        assert_eq!(expected("{}", &site), None);
    }
}
