//! `kehai-tracker schema`: the documents for programs.

use clap::Args;
use host_tracker::web::schema::Document;

use super::failure::Failure;
use super::output::print;

/// Print a document for programs: what is sent and taken over HTTP, WebSocket and MQTT, and the site file
#[derive(Debug, Args)]
#[command(after_help = "Example:
  kehai-tracker schema site > site.schema.json")]
pub struct Arguments {
    /// Which; without one, all are listed
    #[arg(value_name = "NAME")]
    name: Option<String>,
}

/// Prints it.
///
/// # Errors
/// There is none of that name, or the reader of the output has gone.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Some(name) = &arguments.name else {
        return Document::ALL
            .iter()
            .try_for_each(|known| print(format_args!("{:10} {}", known.name, known.about)));
    };
    let names = || Document::ALL.map(|known| known.name).join(", ");
    let document =
        Document::named(name).ok_or_else(|| format!("there is no document {name}: one of {}", names()))?;
    print(document.text().trim_end())
}
