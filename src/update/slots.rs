//! Where on a board's flash the images are.
//!
//! ```text
//!   ┌──────┬───────┬───────┬──────────────┬──────────────┬─────────────────────────┐
//!   │ boot │ notes │ state │ active       │ spare        │ settings and background │
//!   │ load-│ 2     │ of a  │ runs         │ comes, or is │                         │
//!   │ er   │ pages │ swap  │              │ the one be-  │                         │
//!   │      │       │       │              │ fore; a page │                         │
//!   │      │       │       │              │ more         │                         │
//!   └──────┴───────┴───────┴──────────────┴──────────────┴─────────────────────────┘
//! ```
//!
//! Two images are exchanged page by page, from the last one on: the spare one moves up by a page, which is why its part is
//! a page longer. The state says how far that has come, a word a step.

use core::ops::Range;

/// Parts of a flash, as offsets from its beginning. Each is whole pages.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Slots {
    /// Two pages: see [`notes`](super::notes).
    pub notes: Range<u32>,
    /// How far a swap has come.
    pub state: Range<u32>,
    /// The image that runs.
    pub active: Range<u32>,
    /// The image that comes, or the one before: a page longer than `active`.
    pub spare: Range<u32>,
}
