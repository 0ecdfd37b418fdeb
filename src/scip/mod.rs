//! The sensor's protocol, SCIP 2, as far as bytes go: requests out, replies in.

pub mod checksum;
pub mod command;
mod data_block;
pub mod encoding;
pub mod event;
pub mod info;
mod line;
pub mod parameters;
pub mod range_code;
pub mod reader;
pub mod status;
pub mod text;

pub use command::{Command, CommandError, Measurement, Request, Width};
pub use event::{Dropped, Event, Loss, LossCause, Losses, Reply, ScanHeader, Scip11Reply, TimeReply};
pub use info::{SensorState, StateCode, Version};
pub use parameters::Parameters;
pub use range_code::{Family, RangeCode};
pub use reader::{Fed, Reader};
pub use status::{MeasurementStatus, Status};
