//! `kehai-tracker calibrate`: finds where the modules are while a person walks about.

use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use clap::Args;
use host_tracker::calibration::Calibration;
use host_tracker::service::{Options, Service};
use host_tracker::site_file::SiteFile;
use host_tracker::store::pose::{self, Source};
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use kehai_tracking::calibration::advice::LONGEST_S;
use kehai_tracking::calibration::status::Status;
use kehai_tracking::site::{Module, Site};
use kehai_tracking::snapshot::{Snapshot, unix_ms};
use kehai_tracking::tracker::Selected;

use super::address::address;
use super::failure::Failure;
use super::keys::keys_file;
use super::log::say;
use super::output::print;
use super::signals;

/// Find where the modules are, by walking about
///
/// One person walks where two modules at a time see them; the terminal says where to go next. The first module of the
/// site that has a place is held fixed: it says where x and y are. Modules that are found and not in the site yet are added. Floors of the site are
/// found by walking across them.
/// Nothing is written before it is accepted.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The site; its first module that has a place stays where it is
    #[arg(long, value_name = "FILE.toml")]
    site: PathBuf,

    /// A module's address, beside those that are found; port 4040 if none is given
    #[arg(long, value_name = "HOST[:PORT]")]
    module: Vec<String>,

    /// The keys of the site's modules, made by kehai-tracker module claim [default: beside the site file, as SITE.keys]
    #[arg(long, value_name = "FILE", env = "KEHAI_KEYS")]
    keys: Option<PathBuf>,

    /// Look for no modules on the network: only those at --module
    #[arg(long, requires = "module")]
    no_mdns: bool,

    /// Write the poses into the site's file without asking
    #[arg(long)]
    accept: bool,

    /// Say everything as JSON, a line a second and the result last; asks nothing
    #[arg(long)]
    json: bool,

    /// Keep the accepted poses in this database, too
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,

    /// Longest walk
    #[arg(long, value_name = "N", default_value_t = LONGEST_S as u64)]
    seconds: u64,
}

const EXAMPLES: &str = "Examples:
  kehai-tracker calibrate --site home.toml                  walk, look at the result, accept it or not
  kehai-tracker calibrate --site home.toml --accept --db home.db
  kehai-tracker calibrate --site home.toml --json --no-mdns --module 192.168.1.20 --module 192.168.1.21

Ctrl-C ends the walk: the result is worked out from what there is.";

/// Between two looks at whether it is to end.
const WAIT: Duration = Duration::from_millis(200);

/// Most areas that are printed, the largest of them.
const AREAS: usize = 8;

/// Frames until modules have answered and new ones have been added: five seconds.
const SETTLES: u32 = 50;

/// Finds the poses.
///
/// # Errors
/// One line: what is wrong with which file or address, or why no poses were found.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let file = SiteFile::load(&arguments.site)?;
    let options = options(arguments, &file)?;
    let stop = signals::end()?;
    let service = Service::start(options)?;
    let session = service.calibration();
    let mut terminal = (!arguments.json).then(Terminal::new).transpose()?;
    walk(&service, &session, arguments.seconds, &stop, |status| match &mut terminal {
        Some(terminal) => {
            terminal.show(status);
            Ok(())
        }
        None => print(serde_json::to_string(status)?),
    })?;
    session.finish();
    let status = session.status();
    drop(terminal);
    if arguments.json {
        print(serde_json::to_string(&status)?)?;
    }
    service.stop()?;
    if let Some(refused) = status.refused {
        return Err(refused.into());
    }
    let Some((found, poses)) = status.found.zip(session.mountings()) else {
        return Err("nothing was seen: is a module switched on, and in the site?".into());
    };
    if !arguments.json {
        print(&found.quality)?;
        for module in &found.modules {
            print(format_args!("  {}", module.text))?;
        }
        print(format_args!(
            "  at least one module sees {:.0} m², two see {:.0} m²",
            found.coverage.seen_m2[0], found.coverage.seen_m2[1]
        ))?;
        for area in found.coverage.areas.iter().take(AREAS) {
            print(format_args!("  {:5.1} m² by {}", area.m2, area.modules.join(", ")))?;
        }
    }
    if !(arguments.accept || (!arguments.json && asked(&arguments.site)?)) {
        say("nothing was written; --accept writes it without asking");
        return Ok(());
    }
    // What was edited during the walk stays.
    file.look(|_| Ok(()))?;
    file.save_poses(&poses, |_| Ok(()))?;
    if let Some(db) = &arguments.db {
        pose::note(db, &poses, unix_ms(), Source::Calibration)?;
    }
    say(written(&arguments.site, poses.len()));
    Ok(())
}

/// What was written, and how a tracker comes to use it: it does not look at the file by itself.
fn written(site: &Path, poses: usize) -> String {
    let poses = if poses == 1 { "1 pose".to_owned() } else { format!("{poses} poses") };
    format!(
        "{}: {poses} written; a tracker that runs takes them after SIGHUP (service: sudo systemctl \
         reload kehai-tracker)",
        site.display()
    )
}

/// What the tracker is started with that listens to the walk.
fn options(arguments: &Arguments, file: &SiteFile) -> Result<Options, Failure> {
    let modules = arguments.module.iter();
    let modules = modules.map(|text| address(text).map_err(|error| format!("--module {error}")));
    Ok(Options {
        site: (*file.current().site).clone(),
        modules: modules.collect::<Result<_, _>>()?,
        discover: !arguments.no_mdns,
        tracker: Selected::default(),
        keys: Some(keys_file(arguments.keys.as_deref(), &arguments.site)?),
        ..Options::default()
    })
}

/// Listens until the guide has enough, the time is over, or the user ends it.
fn walk(
    service: &Service,
    session: &Calibration,
    seconds: u64,
    stop: &AtomicBool,
    mut show: impl FnMut(&Status) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let frames = service.queue();
    let mut count = 0;
    loop {
        let frame = match frames.recv_timeout(WAIT) {
            Ok(frame) => frame,
            Err(RecvTimeoutError::Timeout) if !stop.load(Ordering::Relaxed) => continue,
            Err(_) => return Ok(()),
        };
        count += 1;
        if count < SETTLES {
            continue;
        }
        if count == SETTLES {
            add_strangers(service, &frame)?;
            session.begin();
            continue;
        }
        if count % 10 == 0 {
            let status = session.status();
            show(&status)?;
            if status.enough || status.since_s >= seconds as f64 {
                return Ok(());
            }
        }
        if stop.load(Ordering::Relaxed) {
            return Ok(());
        }
    }
}

/// Adds every module that was found to the site.
fn add_strangers(service: &Service, frame: &Snapshot) -> Result<(), Failure> {
    // The site is read in a statement of its own: as long as it is borrowed, a change waits for its lock.
    let site = with_strangers(&service.site().borrow(), frame);
    if let Some(site) = site {
        service.sites().change(site)?;
    }
    Ok(())
}

/// The site with every module that was found and is not in it; None if there is none.
fn with_strangers(site: &Site, frame: &Snapshot) -> Option<Site> {
    let known = |name: &str| {
        site.modules.iter().any(|module| module.name == name)
            || site.floors.iter().any(|floor| floor.name == name)
    };
    let there = frame.modules.iter().filter(|line| !line.id.is_empty() && !line.name.is_empty());
    let new: Vec<Module> =
        there.filter(|line| !known(&line.name)).map(|line| Module::unplaced(line.name.clone())).collect();
    (!new.is_empty()).then(|| Site { modules: [site.modules.clone(), new].concat(), ..site.clone() })
}

/// Whether the user at the terminal wants it written.
fn asked(file: &Path) -> io::Result<bool> {
    if !io::stdin().is_terminal() {
        return Ok(false);
    }
    print!("Write these poses into {}? [y/N] ", file.display());
    io::stdout().flush()?;
    let mut answer = String::new();
    io::stdin().read_line(&mut answer)?;
    Ok(matches!(answer.trim(), "y" | "Y" | "yes"))
}

/// Bars in the terminal: one a pair, and a line that says where to walk. Without colours, so NO_COLOR changes nothing; if
/// stderr is no terminal, the advice is written when it changes.
struct Terminal {
    all: MultiProgress,
    advice: ProgressBar,
    bars: Vec<([String; 2], ProgressBar)>,
    style: ProgressStyle,
    plain: bool,
    last: String,
}

impl Terminal {
    fn new() -> Result<Self, Failure> {
        let all = MultiProgress::with_draw_target(ProgressDrawTarget::stderr());
        let advice = all.add(ProgressBar::new_spinner());
        advice.set_style(ProgressStyle::with_template("{wide_msg}")?);
        let style = ProgressStyle::with_template("  {prefix:32!} {bar:24} {msg}")?;
        let plain = !io::stderr().is_terminal();
        Ok(Self { all, advice, bars: Vec::new(), style, plain, last: String::new() })
    }

    fn show(&mut self, status: &Status) {
        let sees = if status.sees.is_empty() {
            "no module sees you".into()
        } else {
            format!("seen by {}", status.sees.join(", "))
        };
        let crowd = if status.crowded_s > 0.5 {
            format!("; {:.0} s with several people are not used", status.crowded_s)
        } else {
            String::new()
        };
        if self.plain {
            // What changes is worth a line, its seconds are not.
            let what: String = status.advice.chars().take_while(|letter| !letter.is_ascii_digit()).collect();
            if what != self.last {
                say(format_args!("{:.0} %: {}", status.progress * 100.0, status.advice));
                self.last = what;
            }
            return;
        }
        self.advice.set_message(format!("{}\n  {sees}{crowd}", status.advice));
        for pair in &status.pairs {
            let known = self.bars.iter().position(|(modules, _)| *modules == pair.modules);
            let index = known.unwrap_or_else(|| {
                let bar = self.all.add(ProgressBar::new((pair.needed_s * 10.0) as u64));
                bar.set_style(self.style.clone());
                bar.set_prefix(pair.modules.join(" + "));
                self.bars.push((pair.modules.clone(), bar));
                self.bars.len() - 1
            });
            if let Some((_, bar)) = self.bars.get(index) {
                bar.set_position((pair.common_s.min(pair.needed_s) * 10.0) as u64);
                bar.set_message(format!("{:.0} of {:.0} s", pair.common_s.min(pair.needed_s), pair.needed_s));
            }
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // What is drawn there is over.
        let _ = self.all.clear();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use clap::Parser as _;
    use kehai_tracking::snapshot::ModuleLine;

    use super::*;

    /// How long a change of the site may take before it is taken to hang.
    const PATIENCE: Duration = Duration::from_secs(30);

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        arguments: Arguments,
    }

    #[test]
    fn modules_that_have_keys_are_heard_by_the_keys_beside_the_site() {
        let folder = tempfile::tempdir().unwrap();
        let site = folder.path().join("home.toml");
        std::fs::write(&site, "").unwrap();
        let words = ["calibrate", "--site", site.to_str().unwrap()];
        let Line { arguments } = Line::try_parse_from(words).unwrap();
        let options = options(&arguments, &SiteFile::load(&site).unwrap()).unwrap();
        assert_eq!(options.keys, Some(folder.path().join("home.keys")));
    }

    #[test]
    fn poses_that_were_written_are_said_with_what_lets_a_tracker_take_them() {
        let said = written(Path::new("home.toml"), 4);
        assert!(said.starts_with("home.toml: 4 poses written; ") && said.lines().count() == 1, "{said}");
        assert!(written(Path::new("home.toml"), 1).starts_with("home.toml: 1 pose written; "));
        assert!(said.contains("SIGHUP") && said.contains("systemctl reload kehai-tracker"), "{said}");
    }

    #[test]
    fn a_module_that_was_found_is_added_to_the_site_in_use() {
        let line = ModuleLine { name: "new".into(), id: "02:00".into(), ..ModuleLine::default() };
        let frame = Snapshot { modules: vec![line], ..Snapshot::default() };
        let (done, added) = mpsc::channel();
        std::thread::spawn(move || {
            let service = Service::start(Options::default()).unwrap();
            add_strangers(&service, &frame).unwrap();
            let site = service.site().borrow().clone();
            done.send(site).unwrap();
        });
        let site = added.recv_timeout(PATIENCE).unwrap();
        assert_eq!((site.modules[0].name.as_str(), site.modules[0].placed), ("new", false));
    }
}
