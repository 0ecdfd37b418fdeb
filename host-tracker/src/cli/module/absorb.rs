//! `kehai-tracker module absorb`: makes a thing that a module sees, and that stays, a part of its background.

use clap::Args;
use host_tracker::module::absorb::absorb;

use super::target::Target;
use crate::cli::failure::Failure;
use crate::cli::output::{print, print_json};

/// Make a thing that stays a part of the background: a chair, a door leaf
///
/// The thing must stand out from the background and must not have moved for five seconds. No person is looked for
/// behind it or in its place any more until the background is learned anew, so never absorb a person.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module absorb hall
  kehai-tracker module absorb hall --bearing -25")]
pub struct Arguments {
    #[command(flatten)]
    target: Target,

    /// The thing in this direction, degrees from the module's front, counter-clockwise; needed if there are several
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = bearing)]
    bearing: Option<f64>,
}

fn bearing(text: &str) -> Result<f64, String> {
    let bearing = text.parse().ok().filter(|bearing| (-180.0..=180.0).contains(bearing));
    bearing.ok_or_else(|| "a bearing is a number of degrees from -180 to 180".to_owned())
}

/// Asks what stands out, chooses, and asks for it.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let absorbed = absorb(&mut arguments.target.control()?, arguments.bearing)?;
    if arguments.target.json {
        return print_json(&absorbed);
    }
    print(format_args!(
        "absorbed: {} beams at {:.0}° and {:.2} m; background version {}",
        absorbed.beams, absorbed.bearing_deg, absorbed.range_m, absorbed.background_version
    ))
}
