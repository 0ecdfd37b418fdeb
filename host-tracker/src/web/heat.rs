//! How long people were where, for the map and the report.
//!
//! ```text
//!   GET /api/heat?from=MS&to=MS ─▶ {"kept": true, "x": …, "y": …, "cell_m": 0.25, "columns": 40, "rows": 30, "cells": [12.3, 0, null, …],
//!                                   "hidden_s": 4.2, "outside_s": 0, "watched": {"left": 86400}}     s, row by row from the lowest
//!                                   null: no person was seen there, and no module that sees it was watching
//! ```
//!
//! What a module sees is taken from what it sees today, and whether it was watching from its health of each minute.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::extract::{RawQuery, State};
use axum::response::Response;
use schemars::JsonSchema;
use serde::Serialize;

use super::past::{Asked, OVERVIEW_MS, answer};
use super::shared::Shared;
use crate::store::heat::{Frame, heat};
use kehai_tracking::explain::Question;
use kehai_tracking::explain::glance::Glance;
use kehai_tracking::geometry::Point;
use kehai_tracking::site::Site;

/// How long people were where.
#[derive(Debug, Serialize, JsonSchema)]
pub(in crate::web) struct Heat {
    /// The cells.
    #[serde(flatten)]
    frame: Frame,
    /// Time of each, s, row by row from the lowest; null: no person was seen there, and no module that sees it was watching.
    cells: Vec<Option<f64>>,
    /// Time of people who were hidden, and of those outside the cells, s.
    hidden_s: f64,
    outside_s: f64,
    /// How long each module was watching, s.
    watched: BTreeMap<String, u64>,
}

/// How long people were where, at most of a month.
pub async fn map(State(shared): State<Arc<Shared>>, RawQuery(query): RawQuery) -> Response {
    let glances = match &shared.context.questions {
        Some(questions) => {
            questions.ask(Question::Views).await.map(|facts| facts.glances).unwrap_or_default()
        }
        None => Vec::new(),
    };
    let site = shared.context.site.current().site;
    answer(&shared, query, OVERVIEW_MS, move |reader, Asked { from_ms, to_ms, .. }| {
        let frame = Frame::around(&site);
        let found = heat(reader, (from_ms, to_ms), &frame)?;
        let watched = reader.watched(from_ms, to_ms)?;
        let cells = found.cells.iter().zip(frame.middles());
        let cells = cells.map(|(time_s, at)| known(*time_s, at, &glances, &site, &watched));
        let cells: Vec<Option<f64>> = cells.collect();
        let (hidden_s, outside_s) = (tenth(found.hidden_s), tenth(found.outside_s));
        Ok(Heat { frame, cells, hidden_s, outside_s, watched })
    })
    .await
}

/// The time of a cell; none if no person was seen there and no module looked.
fn known(
    time_s: f64,
    at: Point,
    glances: &[Glance],
    site: &Site,
    watched: &BTreeMap<String, u64>,
) -> Option<f64> {
    let looks = |glance: &&Glance| {
        let module = site.modules.get(glance.module());
        let watches = module.and_then(|module| watched.get(&module.name)).is_some_and(|time_s| *time_s > 0);
        watches && glance.sees_empty(at)
    };
    (time_s > 0.0 || glances.iter().any(|glance| looks(&glance))).then(|| tenth(time_s))
}

fn tenth(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}
