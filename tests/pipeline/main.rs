//! From scans to candidates: what holds for any scans, for simulated bodies, and on real recordings.

mod centre_accuracy;
mod properties;
mod recordings;
