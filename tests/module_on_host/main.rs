//! The module's tasks as a whole, on simulated time: what hosts see of them.

#[path = "../on_host/mod.rs"]
mod on_host;

mod controlling;
mod storing;
mod subscribing;
mod ways_back;
