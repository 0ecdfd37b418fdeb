//! The wire as a whole: sizes, peers of other versions, damaged and foreign bytes, what survives.

mod damage;
mod peers;
mod samples;
mod sizes;
