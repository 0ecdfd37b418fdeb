//! A doorway: how near to its line people are lost and found, and how far beside its ends they still pass. Of guarded doors, and of
//! counting lines.
//!
//! ```text
//!            ┌╌╌╌╌╌╌╌┐
//!   frame ───┤       ├─── line, BESIDE_M longer on both sides
//!            └╌╌╌╌╌╌╌┘    DOORWAY_M before and behind
//! ```

/// Beside the ends of the line this far a person still passes, m: half a body.
pub const BESIDE_M: f64 = 0.25;

/// How far from the line a track may be lost, or found, while it passes, m: in the frame of the door no module sees a
/// person, and in the time a birth takes the person walks so far.
pub const DOORWAY_M: f64 = 0.8;
