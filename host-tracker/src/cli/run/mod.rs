//! `kehai-tracker run`: follows people with live modules.

mod arguments;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use host_tracker::alarm_handle::AlarmChange;
use host_tracker::backup;
use host_tracker::daemon::{Daemon, DaemonError, Next};
use host_tracker::output_file;
use kehai_tracking::alarm::AlarmKind;
use kehai_tracking::alarm_list::Became;
use kehai_tracking::snapshot::{ModuleLine, Snapshot};

use super::failure::Failure;
use super::http::{Served, advised};
use super::refusals::Refusals;
use super::signals::Signals;
use super::supervisor::Supervisor;
use super::tracks_out::TracksQueue;
pub use arguments::Arguments;
use arguments::SITE;

/// Between two looks at whether it is to end.
const WAIT: Duration = Duration::from_millis(200);

/// How long the end waits for the last lines of tracks: a disk that is busy takes some seconds, a reader that stands still for ever.
const LAST_LINES: Duration = Duration::from_secs(5);

/// Runs the tracker until Ctrl-C.
///
/// # Errors
/// One line: what is wrong with which file or address.
pub fn run(mut arguments: Arguments) -> Result<(), Failure> {
    if arguments.site.is_none() {
        arguments.http.serve_this_machine();
    }
    let site_path = arguments.site.take().unwrap_or_else(|| SITE.into());
    if backup::finish(&site_path)? {
        tracing::warn!("a restoration that was interrupted is finished");
    }
    let tells_others = arguments.tells_others();
    let end_s = arguments.seconds.map_or(f64::INFINITY, |seconds| seconds as f64);
    let tracks_out = arguments.tracks_out.take().or_else(|| (!tells_others).then(|| "-".into()));
    let signals = Signals::taken()?;
    let (settings, served) = arguments.settings(&site_path)?;
    let mut out = tracks_out.as_deref().map(open).transpose()?;
    let is_new = !site_path.exists();
    let mut daemon =
        Daemon::start(settings, |text| tracing::info!("{text}")).map_err(|error| match error {
            DaemonError::Map(error) => advised(error, &site_path),
            error => error.into(),
        })?;
    say_begun(&daemon, &served, is_new.then_some(&site_path));
    let mut supervisor = Supervisor::ready();
    let mut refusals = Refusals::default();
    let mut last = Arc::<Snapshot>::default();
    while !signals.end.load(Ordering::Relaxed) && last.line.t < end_s {
        if signals.hang_up.swap(false, Ordering::Relaxed) {
            read_anew(&daemon, &site_path);
        }
        let has_snapshot = match daemon.next(WAIT) {
            Next::Snapshot(snapshot) => {
                last = snapshot;
                supervisor.lives();
                true
            }
            Next::Waiting => false,
            Next::Ended => break,
        };
        refusals.log(daemon.outputs());
        daemon.alarm_changes().iter().for_each(say);
        if let Some(out) = out.as_mut().filter(|_| has_snapshot) {
            out.line(&last);
            daemon.alarms().set(AlarmKind::TracksOut, out.trouble().as_deref());
        }
        // The reader of the lines has had enough, and there is no other.
        if out.as_ref().is_some_and(TracksQueue::is_closed) && !tells_others {
            break;
        }
    }
    drop(supervisor);
    let stopped = daemon.stop();
    if let Some(out) = out {
        out.close(LAST_LINES);
    }
    stopped?;
    summary(&last, tells_others)
}

/// Logs where everything is served, and who makes the site's file if it is still to be made.
fn say_begun(daemon: &Daemon, served: &Served, new_site: Option<&PathBuf>) {
    served.say(daemon.map_address(), daemon.door_address());
    if let Some(address) = daemon.viewers_address() {
        tracing::info!("Foxglove and Lichtblick are served at ws://{address}");
    }
    if let Some(file) = new_site {
        let file = file.display();
        tracing::info!(
            "there is no {file} yet: the live map guides from the modules to a site, and makes it"
        );
    }
}

/// Uses the site's file as it is now, and logs what became of it.
fn read_anew(daemon: &Daemon, site: &Path) {
    let file = site.display();
    if let Err(error) = fs::metadata(site) {
        return tracing::error!("{file}: not used, the site stays as it was: {error}");
    }
    match daemon.read_site_anew() {
        Ok(true) => tracing::info!("{file}: read anew"),
        Ok(false) => tracing::info!("{file}: read anew, nothing has changed"),
        Err(error) => tracing::error!("{file}: not used, the site stays as it was: {error}"),
    }
}

fn open(file: &Path) -> Result<TracksQueue, String> {
    if file.as_os_str() == "-" {
        let name = "standard output".to_owned();
        return TracksQueue::start(Box::new(io::stdout()), name).map_err(|error| error.to_string());
    }
    let name = file.display().to_string();
    let out = output_file::begin(file).map_err(|error| format!("{name}: {error}"))?;
    TracksQueue::start(Box::new(out), name).map_err(|error| error.to_string())
}

/// Logs what has become of an alarm.
fn say(change: &AlarmChange) {
    let alarm = &change.alarm;
    match change.became {
        Became::Raised => tracing::warn!("{alarm}: {}", alarm.text),
        Became::Acknowledged => {
            let by = alarm.acknowledged.as_ref().map_or("", |seen| &seen.by);
            tracing::info!("{alarm}: acknowledged by {by}");
        }
        Became::Ended => tracing::info!("{alarm}: over"),
    }
}

/// Logs how the modules were. That none has answered is a failure where a run is for its lines, and not of a service, which
/// waits for modules to come.
fn summary(last: &Snapshot, serves: bool) -> Result<(), Failure> {
    let answered: Vec<&ModuleLine> = last.modules.iter().filter(|module| !module.id.is_empty()).collect();
    for module in &answered {
        let offset =
            module.clock_offset_ms.map_or("unknown".to_owned(), |offset_ms| format!("{offset_ms:.1} ms"));
        let lost = module.lost_share.map_or("unknown".to_owned(), |share| format!("{:.1} %", share * 100.0));
        tracing::info!(
            "module {} ({}): {}, {:.1} scans/s, {lost} lost, clock offset {offset}",
            module.name,
            module.id,
            module.state,
            module.scans_hz,
        );
    }
    let missing = "no module answered: is it switched on and in this network? kehai-tracker module list shows what is \
                   there; --module gives an address";
    match answered.is_empty() {
        true if serves => tracing::warn!("{missing}"),
        true => return Err(missing.into()),
        false => {}
    }
    Ok(())
}
