//! The sensor's protocol, SCIP 2, as far as bytes go: requests out, replies in.
//!
//! Nothing here waits, reads a clock or talks to a line. [`Command::encode`] gives the bytes of
//! a request; [`Reader::expect`] and [`Reader::feed`] take the replies apart.
//!
//! ```text
//!   MD0044072501000 \n        echo of the request; in a scan with the scans that remain
//!   99 b \n                   status, checksum            00: accepted, 99: a scan follows
//!   JUGn D \n                 stamp: 24 bits of ms, checksum
//!   06806806706105m… _ \n     64 characters of data, checksum
//!   05P05P… S \n              the last line may be shorter
//!   \n                        the end: an empty line
//!
//!   PP \n  00 P \n  DMIN:20;4 \n  …  \n        information: KEY:VALUE;checksum
//!   QT \n  00 P \n  \n                         anything else
//!   SCIP2.0 \n  0 \n  \n                       SCIP 1.1: one character of status, no checksum
//! ```
//!
//! What keeps a wrong range out: every character must be of the code, every line has its checksum,
//! every data line but the last has exactly 64 characters, and the count of values is known from
//! the request. Together they let no single flipped bit of a data block through.
//!
//! | module | |
//! |---|---|
//! | [`command`] | requests |
//! | [`reader`], [`event`] | replies as they arrive; what was lost, and why |
//! | [`parameters`], [`info`], [`status`] | what the sensor says, typed |
//! | [`encoding`], [`checksum`], [`text`] | characters |
//!
//! Source: SCIP 2.0 (C-42-03320B); recorded replies of three models (`tests/scip/spec.rs`).

pub mod checksum;
pub mod command;
mod data_block;
pub mod encoding;
pub mod event;
pub mod info;
pub mod parameters;
pub mod reader;
pub mod status;
pub mod text;
mod text_line;

pub use command::{Command, CommandError, Measurement, Request, Width};
pub use event::{Dropped, Event, Loss, LossCause, Losses, Reply, ScanHeader, Scip11Reply, TimeReply};
pub use info::{SensorState, StateCode, Version};
pub use parameters::Parameters;
pub use reader::{Fed, Reader};
pub use status::{MeasurementStatus, Status};
pub use text::Text;
