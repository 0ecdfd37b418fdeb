//! The wire as a whole: its bytes, sizes, peers of other versions and in Python, damaged and foreign bytes.

mod damage;
mod golden;
mod peers;
mod python;
mod samples;
mod sizes;
