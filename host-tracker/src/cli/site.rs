//! `kehai-tracker site`: puts the areas of a large site together.

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Duration;

use clap::Args;
use host_tracker::areas::{CampusSettings, Together, TogetherError, TogetherSettings};
use kehai_tracking::areas::AreaName;

use super::area::NetworkArguments;
use super::broker::MqttArguments;
use super::failure::Failure;
use super::http::{HttpArguments, advised};
use super::signals;
use super::supervisor::Supervisor;

/// Put the areas of a large site together
///
/// Each area has its own tracker, kehai-tracker run --area SITE/AREA; all of them are drawn in one frame. This shows the map, the
/// totals and the alarms of all, and is the one publisher to MQTT. People keep their number from area to area. An area that is not
/// heard is unknown. Ends with Ctrl-C.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The site, as in --area SITE/AREA
    #[arg(value_name = "SITE")]
    site: AreaName,

    /// An area that is missed from the start if it is not heard; others are shown as soon as they are
    #[arg(long, value_name = "NAME")]
    area: Vec<AreaName>,

    #[command(flatten)]
    network: NetworkArguments,

    /// Where users, the certificate and the picture of the whole site lie, beside its name
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    folder: PathBuf,

    #[command(flatten)]
    http: HttpArguments,

    #[command(flatten)]
    mqtt: MqttArguments,
}

const EXAMPLES: &str = "Examples:
  kehai-tracker site campus --http
  kehai-tracker site campus --area east --area west --http 0.0.0.0:8420 --mqtt mqtt://broker
  kehai-tracker site campus --zenoh router.json5 --http";

/// Between two looks at whether there is another picture, or the end.
const LOOK: Duration = Duration::from_millis(100);

/// Shows and publishes until Ctrl-C.
///
/// # Errors
/// One line: what is wrong with which file or address.
pub fn run(mut arguments: Arguments) -> Result<(), Failure> {
    if !arguments.mqtt.is_given() {
        arguments.http.serve_this_machine();
    }
    let stop = signals::end()?;
    let path = arguments.folder.join(format!("{}.toml", arguments.site));
    let mqtt = arguments.mqtt.broker(&path)?;
    if mqtt.as_ref().is_some_and(|mqtt| mqtt.commands) {
        return Err("--mqtt-commands is for the trackers of the areas: they have the modules".into());
    }
    let served = arguments.http.served(&path)?;
    let settings = TogetherSettings {
        campus: CampusSettings {
            site: arguments.site,
            expected: arguments.area,
            network: arguments.network.network(),
        },
        map: arguments.http.map(&served, &path)?,
        mqtt,
        path: path.clone(),
    };
    let together =
        Together::start(settings, |text| tracing::info!("{text}")).map_err(|error| match error {
            TogetherError::Map(error) => advised(error, &path),
            error => error.into(),
        })?;
    served.say(together.map_address(), None);
    let mut supervisor = Supervisor::ready();
    let mut frames = together.frames();
    while !stop.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
        if frames.has_changed().unwrap_or(false) {
            frames.mark_unchanged();
            supervisor.lives();
        }
    }
    Ok(())
}
