//! `kehai-tracker`: the tracker's commands.

use std::error::Error;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::{Args, Parser, Subcommand};
use host_tracker::http::{Desk, Server};
use host_tracker::jsonl::write_line;
use host_tracker::service::{Options, Service};
use host_tracker::site_file::SiteFile;
use host_tracker::trackers::Choice;

/// Follows people from the reports of kehai modules.
#[derive(Debug, Parser)]
#[command(name = "kehai-tracker", version, propagate_version = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Run(Run),
}

/// Follow people with live modules, and write where they are every 0.1 s
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker run --site door.toml --module 192.168.1.20 --module 192.168.1.21 --tracks-out -
  kehai-tracker run --site door.toml --module 127.0.0.1:4040 --tracks-out tracks.jsonl --seconds 60")]
struct Run {
    /// The site: where the modules, walls, zones and entries are
    #[arg(long, value_name = "FILE.toml")]
    site: PathBuf,

    /// A module's address; port 4040 if none is given
    #[arg(long, value_name = "HOST[:PORT]", required = true)]
    module: Vec<String>,

    /// Where the lines go; - is the terminal
    #[arg(long, value_name = "FILE", default_value = "-")]
    tracks_out: PathBuf,

    /// Serve the live map at this address; 127.0.0.1 is this machine alone, 0.0.0.0 everybody on the network
    #[arg(long, value_name = "IP:PORT")]
    http: Option<SocketAddr>,

    /// A name under which browsers may open the map, beside addresses and local names
    #[arg(long, value_name = "NAME", requires = "http")]
    http_name: Vec<String>,

    /// The tracker
    #[arg(long, value_name = "NAME", default_value_t = Choice::default())]
    tracker: Choice,

    /// Stop after so long
    #[arg(long, value_name = "N")]
    seconds: Option<u64>,
}

/// The port modules listen on.
const PORT: u16 = 4040;

fn main() -> ExitCode {
    let Command::Run(arguments) = Arguments::parse().command;
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("kehai-tracker: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Run) -> Result<(), Box<dyn Error>> {
    let site = SiteFile::load(&arguments.site)?;
    let modules = arguments.module.iter().map(|text| address(text)).collect::<Result<Vec<_>, _>>()?;
    let mut out: Box<dyn Write> = if arguments.tracks_out.as_os_str() == "-" {
        Box::new(io::stdout().lock())
    } else {
        let name = arguments.tracks_out.display();
        Box::new(BufWriter::new(
            File::create(&arguments.tracks_out).map_err(|error| format!("{name}: {error}"))?,
        ))
    };
    let options = Options {
        site: (*site.current().site).clone(),
        modules,
        tracker: arguments.tracker,
        ..Options::default()
    };
    let service = Arc::new(Service::start(options)?);
    let frames = service.queue();
    let _map = arguments.http.map(|listen| map(listen, site, &service, &arguments.http_name)).transpose()?;
    let end_s = arguments.seconds.map_or(f64::INFINITY, |seconds| seconds as f64);
    for frame in frames {
        match write_line(&mut out, &frame.line).and_then(|()| out.flush()) {
            // Whoever read the lines has had enough.
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => break,
            other => other?,
        }
        if frame.line.t >= end_s {
            break;
        }
    }
    Ok(())
}

/// Serves the live map.
fn map(
    listen: SocketAddr,
    site: SiteFile,
    service: &Arc<Service>,
    names: &[String],
) -> Result<Server, Box<dyn Error>> {
    let changing = Arc::clone(service);
    let desk = Desk {
        frames: service.frames(),
        site,
        changed: Box::new(move |site| changing.change_site(site)),
        metrics: None,
        names: names.to_vec(),
    };
    let server =
        Server::start(listen, desk).map_err(|error| format!("the live map cannot be at {listen}: {error}"))?;
    eprintln!("live map at http://{}/", server.address());
    Ok(server)
}

fn address(text: &str) -> Result<SocketAddr, String> {
    let found = if text.contains(':') { text.to_socket_addrs() } else { (text, PORT).to_socket_addrs() };
    found
        .map_err(|error| format!("--module {text}: {error}"))?
        .find(SocketAddr::is_ipv4)
        .ok_or_else(|| format!("--module {text}: no IPv4 address"))
}
