//! Other modules in the place of the site's, as a scene's file says them.
//!
//! ```toml
//! [[arrangement]]                 # other modules in the place of the site's
//! name = "3"
//! module = [
//!   { name = "left", x = -0.96, y = 0.0 },
//!   { name = "right", x = 0.96, y = 0.0, yaw_deg = 180.0 },
//!   { name = "door", x = -0.72, y = 0.96, yaw_deg = -90.0 },
//! ]
//! ```

use super::site::Module;
use serde::Deserialize;

/// Modules that can take the place of the site's.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Arrangement {
    /// Name by which it is selected.
    pub name: String,
    /// The modules.
    #[serde(rename = "module")]
    pub modules: Vec<Module>,
}
