//! The first file of an archive: what it is, who made it when, and what each other file must be.
//!
//! ```json
//! {"format": "kehai-backup", "layout": 1, "program": "0.1.0", "made_ms": 1764000000000, "site": "home.toml",
//!  "database_layout": 6, "parts": [{"name": "site.toml", "bytes": 812, "sha256": "9f86…"}, …]}
//! ```

use serde::{Deserialize, Serialize};

/// Its name.
pub const NAME: &str = "manifest.json";

/// What says that it is ours.
pub const FORMAT: &str = "kehai-backup";

/// The number of this form; archives of a higher one are refused.
pub const LAYOUT: u32 = 1;

/// Longest one that is read, bytes.
pub const LONGEST: u64 = 1 << 20;

/// By which a manifest is known, of whatever version.
#[derive(Deserialize)]
pub struct Known {
    pub format: String,
    pub layout: u32,
    #[serde(default)]
    pub program: String,
}

/// What is in an archive.
#[derive(Serialize, Deserialize)]
pub struct Manifest {
    pub format: String,
    pub layout: u32,
    pub program: String,
    pub made_ms: u64,
    pub site: String,
    pub database_layout: Option<i64>,
    pub parts: Vec<Packed>,
}

/// What a file of it must be.
#[derive(Serialize, Deserialize)]
pub struct Packed {
    pub name: String,
    pub bytes: u64,
    pub sha256: String,
}
