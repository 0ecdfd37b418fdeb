//! Devices on the network: found, asked, subscribed to and received.
//!
//! ```text
//!   discovery ─▶ registry ─▶ subscribe, info, profile ─▶ tracking loop ─▶ a snapshot every 0.1 s
//!   socket ─▶ receiver, a thread of its own ───────────────┘
//!   client: one question to one device, for the commands
//! ```

pub mod client;
pub mod discovery;
pub mod networks;
pub mod poses;
pub mod receiver;
pub mod tracking;
