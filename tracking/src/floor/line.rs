//! What is written of a floor: its panels, as they are.
//!
//! ```text
//!   row 1 │ 6 │ 7 │ 8 │ 9 │…     number of a panel: row · columns + column
//!   row 0 │ 0 │ 1 │ 2 │ 3 │…     down · stuck · dead; from `unknown_from` on nothing is known
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a floor of pressure panels shows. Panels are numbered row by row: row · columns + column.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FloorLine {
    /// As the site calls it.
    pub name: String,
    /// Its columns.
    pub columns: u8,
    /// The panels that are down.
    pub down: Vec<u16>,
    /// Those that never come up.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stuck: Vec<u16>,
    /// Those that never go down.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dead: Vec<u16>,
    /// From this panel on nothing is known: more do not work than a reading names.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unknown_from: Option<u16>,
}
