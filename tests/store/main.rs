//! The store through losses of power, in flash that writes whole words and in flash that does not.

mod power_cuts;
mod rough;
mod rough_flash;
