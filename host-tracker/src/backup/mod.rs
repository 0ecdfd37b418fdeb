//! Everything that a tracker needs to go on elsewhere, as one archive, and back.
//!
//! ```text
//!   site.toml, pictures, users, keys ─┐
//!   site.db ─ copied while it is used ─┴─▶ FILE.tar.gz: manifest.json with the SHA-256 of each, then each
//!
//!   FILE.tar.gz ─▶ checked, beside its places ─▶ plan, on disk ─▶ renamed ─▶ plan removed
//!                    killed: nothing has changed │ killed: the next start goes on with it
//! ```
//!
//! What may be in an archive is a closed list ([`Part`]). Where each goes is said by this machine, never by the archive: a path
//! in it is compared with that list and used for nothing else.

mod archive;
mod error;
mod keys;
mod make;
mod manifest;
mod part;
mod plan;
mod restore;

pub use error::BackupError;
pub use make::{Made, make};
pub use part::{Part, Places};
pub use plan::finish;
pub use restore::{Restored, restore};

#[cfg(test)]
mod tests;
