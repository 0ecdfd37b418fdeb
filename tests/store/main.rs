//! The store through damage and losses of power, in flash that writes whole words and in flash that does not.

mod beyond_repair;
mod power_cuts;
mod resets;
mod rough;
mod rough_flash;
