//! `kehai-tracker check`: whether a site file can be used, what is in it, and what is strange in it.

use std::path::PathBuf;

use clap::Args;
use host_tracker::site_file::SiteFile;
use kehai_tracking::remarks::remarks;

use super::failure::Failure;
use super::output::print;

/// Say whether site files can be used, what is in each, and what is strange in it; exit status 1 and one line for the first that cannot
#[derive(Debug, Args)]
#[command(after_help = "Example:
  kehai-tracker check /etc/kehai/site.toml")]
pub struct Arguments {
    /// Site files
    #[arg(value_name = "FILE.toml", required = true)]
    sites: Vec<PathBuf>,
}

/// Checks.
///
/// # Errors
/// One line: what is wrong in which file, and where.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    for path in &arguments.sites {
        let site = SiteFile::load(path)?.current().site;
        let of = |count: usize, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
        let parts = [
            of(site.modules.len(), "module"),
            of(site.floors.len(), "floor"),
            of(site.walls.len(), "wall"),
            of(site.zones.len(), "zone"),
            of(site.doors.len(), "door"),
        ];
        print(format_args!("{}: {}", path.display(), parts.join(", ")))?;
        for remark in remarks(&site) {
            print(format_args!("  {remark}"))?;
        }
    }
    Ok(())
}
