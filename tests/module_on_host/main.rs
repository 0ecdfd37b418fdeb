//! The module's tasks as a whole, on simulated time: what hosts see of them.

mod controlling;
mod on_host;
mod replacing;
mod storing;
mod subscribing;
mod ways_back;
