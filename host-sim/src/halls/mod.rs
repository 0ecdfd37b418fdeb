//! Four halls as one site: followed by one tracker, and by a tracker of each hall with all of them put together.
//!
//! ```text
//!                      ╭─▶ tracker of all ──────────────────────────▶ tracks ─╮
//!   world ─▶ datagrams ┤                                                      ├─▶ judged by the truth, and by each other
//!                      ╰─▶ tracker of each hall ─ frames ─▶ Campus ─▶ picture ╯
//!                              │ a share is lost
//! ```
//!
//! What is asked: whether people keep their numbers and names over the borders, and whether the totals agree.
//!
//! | file | what |
//! |---|---|
//! | `world` | the halls, their modules, the people, the site of each area |
//! | `cards` | when and where the card of each person is read |
//! | `judge` | one stream of pictures against the truth: IDF1, numbers and names over borders |
//! | `totals` | two totals side by side |
//! | `simulated` | in memory, on simulated time |
//! | `live` | in real time, by processes |
//! | `network` | a router of Zenoh between them, and one that loses frames |
//! | `relay` | a second way to a module, by another address |
//! | `load` | what a service of many areas costs |
//! | `strollers` | those who walk to and fro over its borders |
//! | `table` | the figures, for people |

pub mod cards;
pub mod judge;
#[cfg(feature = "daemon")]
pub mod live;
pub mod load;
pub mod named;
#[cfg(feature = "daemon")]
mod network;
#[cfg(feature = "daemon")]
mod relay;
pub mod simulated;
mod strollers;
pub mod table;
pub mod totals;
pub mod world;
