//! What answers and WebSocket messages are made of, where it is nothing that the tracker knows by another name.
//!
//! ```text
//!   type ─ serde ──────▶ what is sent
//!        └ schemars ───▶ its schema, in the documents of `schema`
//! ```
//!
//! Names and units are those of docs/tracker.md; times are ms since 1970.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::editors::OtherEditor;
use crate::alarm_handle::Told;
use crate::reports::ReportLine;
use crate::store::answers::Count;
use crate::store::event::Event;
use kehai_tracking::alarm_list::{Became, ListedAlarm};
use kehai_tracking::site::Site;
use kehai_tracking::site::merge::Conflict;
use kehai_tracking::site::wrong::Wrong;
use kehai_tracking::snapshot::Snapshot;

/// Why something was not done.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Refusal {
    /// In words: what is wrong, where, and what to do.
    pub error: String,
}

/// It is done, and there is nothing to say of it.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Done {}

/// The alarms that stand, and those that ended within the last day.
#[derive(Debug, Serialize, JsonSchema)]
pub struct AlarmsListed {
    /// This machine's time.
    pub unix_ms: u64,
    /// Those that stand, the oldest first.
    pub standing: Vec<ListedAlarm>,
    /// Those that ended within the last day, the newest first.
    pub ended: Vec<ListedAlarm>,
    /// Changes that a listener missed, as it was too slow.
    pub missed: u64,
    /// What has been told to the webhook.
    pub webhook: Told,
}

/// What was acknowledged.
#[derive(Debug, Serialize, JsonSchema)]
pub struct AlarmsAcknowledged {
    /// Those that were not acknowledged before.
    pub acknowledged: Vec<ListedAlarm>,
}

/// What is told to the webhook.
#[derive(Debug, Serialize, JsonSchema)]
pub struct AlarmTold {
    /// What became of it.
    pub event: Became,
    /// The site's name.
    pub site: String,
    /// The alarm after that.
    pub alarm: ListedAlarm,
}

/// The site in use.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SiteShown<'a> {
    /// Counts its changes; to be sent back with an edit, so that none is lost.
    pub revision: u64,
    /// Name of its file.
    pub file: &'a str,
    /// The site.
    pub site: &'a Site,
    /// The text of its file.
    pub toml: &'a str,
}

/// The site has changed.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Revised {
    /// Its new revision.
    pub revision: u64,
    /// What was changed meanwhile, and is kept.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    pub merged: Vec<String>,
}

/// A change beside what was changed meanwhile.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SiteTogether<'a> {
    /// Why it was not saved.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The revision of the site in use.
    pub revision: u64,
    /// The site in use.
    pub site: &'a Site,
    /// Both in one.
    pub merged: &'a Site,
    /// What both changed, to be decided.
    pub conflicts: &'a [Conflict],
    /// What was changed meanwhile, in words.
    pub changes: &'a [String],
    /// What is wrong with it.
    pub wrong: Vec<Wrong>,
}

/// Settings of a module.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ModuleSettings {
    /// Each by its key, as docs/wire.md has them.
    pub settings: BTreeMap<String, String>,
}

/// A module has another name.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Renamed {
    /// Its new name.
    pub name: String,
    /// The site's new revision, if the site called it by the old one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub revision: Option<u64>,
}

/// Who asks, and what the page shows them.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Session {
    /// Whether anybody has to log in here.
    pub needed: bool,
    /// The user's name, or that of the token; null for a client that is not known.
    pub name: Option<String>,
    /// Their role; null for programs, which may have several.
    pub role: Option<&'static str>,
    /// What they may do.
    pub may: Vec<&'static str>,
    /// The tracker's version; absent for a client that may not look.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<&'static str>,
}

/// What the database has of a time, if there is one.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(rename = "{T}Answer")]
pub enum Kept<T> {
    /// There is.
    Kept(KeptPart<T>),
    /// Nothing is kept.
    Nothing(NotKept),
}

/// Something that is kept.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "{T}Kept")]
pub struct KeptPart<T> {
    /// There is a database.
    #[schemars(extend("const" = true))]
    pub kept: bool,
    /// What it has.
    #[serde(flatten)]
    pub found: T,
}

/// The tracker runs without a database.
#[derive(Debug, Serialize, JsonSchema)]
pub struct NotKept {
    /// There is none.
    #[schemars(extend("const" = false))]
    pub kept: bool,
}

/// People's paths, counts and events of a short time.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Paths {
    /// The path of each track.
    pub paths: Vec<PathWalked>,
    /// When the tracker ran: from, to.
    pub lives: Vec<(u64, u64)>,
    /// Counts of zones when they changed, and the one before for each.
    pub counts: Vec<Count>,
    /// What happened.
    pub events: Vec<Event>,
}

/// A track's path.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PathWalked {
    /// The start of the tracker it belongs to; numbers of tracks start again with each.
    pub run: i64,
    /// The track's number.
    pub track: u64,
    /// Where it was: ms since 1970, x mm, y mm, and 1 where it was occluded, else 0.
    pub places: Vec<(u64, i32, i32, u8)>,
}

/// What the WebSocket sends. Each message has one key.
#[derive(Debug, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ToClient<'a> {
    /// What is known, every 0.1 s; without what modules see, which `fields` has.
    Frame(&'a Snapshot),
    /// What each module's newest scan saw empty, by its name, as corners in m; twice a second.
    Fields(BTreeMap<&'a str, Vec<[f64; 2]>>),
    /// All tracks right after a report, for who asked for reports.
    Report(&'a ReportLine),
    /// The site's revision: once, and when it has changed.
    Site(u64),
    /// The alarms that stand: once, and when others stand or one was acknowledged.
    Alarms(&'a [ListedAlarm]),
    /// Who else has the editor open, for who has it open: once, and when others have.
    Editors(Vec<OtherEditor>),
    /// A message that came is not understood, and why.
    Error(String),
}

/// What a browser may ask for.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wish {
    /// Whether frames are wanted.
    pub frames: bool,
    /// Whether tracks are wanted after each report.
    #[serde(default)]
    pub reports: bool,
    /// Whether the editor is open here: a user who may change the site is told which others have it open.
    #[serde(default)]
    pub editing: bool,
}
