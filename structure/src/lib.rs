//! The structure of the workspace, checked from its sources and its manifests.
//!
//! ```text
//!   crates   kehai  <  kehai-emulator, kehai-tracking  <  host-tracker  <  host-sim      never upward
//!   files    a.rs -> b.rs -> c.rs                                                         never back to a.rs
//!   folders  door/ -> tracker/                                                            never back to door/
//! ```
//!
//! `./ci.sh structure` runs it; it ends with a failure and one line for each fault.
#![cfg(not(target_os = "none"))]

mod attributes;
pub mod circles;
pub mod layers;
pub mod modules;
mod names;
mod paths;

use std::path::PathBuf;

/// Why the structure could not be checked.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A source file is missing or cannot be read.
    #[error("{path}: {cause}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A source file is not valid Rust.
    #[error("{path}:{line}: {cause}")]
    Parse {
        /// The file.
        path: PathBuf,
        /// Its line, from 1.
        line: usize,
        /// What the parser says.
        cause: syn::Error,
    },
    /// `cargo metadata` failed.
    #[error("cargo metadata: {0}")]
    Metadata(#[from] cargo_metadata::Error),
    /// `cargo tree` failed.
    #[error("cargo tree: {0}")]
    Tree(String),
}
