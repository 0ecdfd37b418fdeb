//! `kehai-tracker module info`: a module's identity and properties.

use clap::Args;
use host_tracker::net::client::{Client, ClientError};
use kehai::wire::{Info, Message, Request};
use kehai_tracking::text::printable;
use serde::Serialize;

use super::target::Target;
use crate::cli::failure::Failure;
use crate::cli::output::{print, print_json};

/// Say who and what a module is
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-tracker module info hall
  kehai-tracker module info 192.168.1.20 --json")]
pub struct Arguments {
    #[command(flatten)]
    target: Target,
}

/// What a module says of itself.
#[derive(Clone, Debug, Serialize)]
pub struct InfoLine {
    pub name: String,
    pub id: String,
    pub address: String,
    /// How often it has started.
    pub start: u32,
    pub uptime_s: u64,
    pub firmware: String,
    pub build: String,
    pub board: String,
    /// 0: none.
    pub background_version: u16,
    /// None until it has found one.
    pub sensor: Option<SensorLine>,
}

/// What it says of its sensor.
#[derive(Clone, Debug, Serialize)]
pub struct SensorLine {
    pub model: String,
    pub serial: String,
    pub firmware: String,
    pub first_step: u16,
    pub last_step: u16,
    pub cluster: u16,
    pub scans_hz: f64,
    pub range_min_mm: u16,
    pub range_max_mm: u16,
    pub open_range_mm: u16,
}

/// Asks a module for its identity and properties.
pub fn ask(client: &mut Client) -> Result<InfoLine, ClientError> {
    let (address, start) = (client.address().to_string(), client.identity().boot);
    client.ask(Request::Info, |identity, message| match message {
        Message::Info(info) => Some(line(info, identity.module.to_string(), &address, start)),
        _ => None,
    })
}

fn line(info: &Info<'_>, id: String, address: &str, start: u32) -> InfoLine {
    InfoLine {
        name: printable(info.name),
        id,
        address: address.to_owned(),
        start,
        uptime_s: info.uptime_us / 1_000_000,
        firmware: printable(info.firmware),
        build: printable(info.build),
        board: printable(info.board),
        background_version: info.background_version,
        sensor: info.sensor.map(|sensor| SensorLine {
            model: printable(sensor.model),
            serial: printable(sensor.serial),
            firmware: printable(sensor.firmware),
            first_step: sensor.first_step,
            last_step: sensor.last_step,
            cluster: sensor.cluster,
            scans_hz: 1e6 / (f64::from(sensor.period_us.max(1)) * (1.0 + f64::from(sensor.skip))),
            range_min_mm: sensor.range_min_mm,
            range_max_mm: sensor.range_max_mm,
            open_range_mm: sensor.open_range_mm,
        }),
    }
}

/// Asks and prints.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let info = ask(&mut arguments.target.connect()?)?;
    if arguments.target.json {
        return print_json(&info);
    }
    let row = |key: &str, value: String| print(format_args!("{key:<12}{value}"));
    row("name", info.name)?;
    row("identity", info.id)?;
    row("address", info.address)?;
    row("board", format!("{}, firmware {} ({})", info.board, info.firmware, info.build))?;
    row("running", format!("for {} s, start {}", info.uptime_s, info.start))?;
    row(
        "background",
        match info.background_version {
            0 => "none: kehai-tracker module learn".to_owned(),
            version => format!("version {version}"),
        },
    )?;
    let Some(sensor) = info.sensor else {
        return row("sensor", "not found".to_owned());
    };
    row("sensor", format!("{}, serial number {}, {}", sensor.model, sensor.serial, sensor.firmware))?;
    row(
        "measures",
        format!(
            "steps {} to {} by {}, {:.1} scans/s, {} to {} mm, open to {} mm",
            sensor.first_step,
            sensor.last_step,
            sensor.cluster,
            sensor.scans_hz,
            sensor.range_min_mm,
            sensor.range_max_mm,
            sensor.open_range_mm
        ),
    )
}
