//! A run of the laboratory, recorded as the tracker does it.
#![allow(dead_code, reason = "each test uses its own part of it")]

use std::path::{Path, PathBuf};
use std::sync::Arc;

use host_sim::run::{Conditions, Options, Record};
use host_sim::world::scene::Scene;
use host_sim::world::variation::{Letter, Variation};
use host_tracker::alarm_handle::AlarmHandle;
use host_tracker::record::Recorder;
use kehai_tracking::alarm::{Active, AlarmKind, Cause, Source};
use kehai_tracking::now::Now;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::Selected;

/// When the tracker's clock stood at 0, ns since 1970.
pub const BEGUN_NS: u64 = 1_700_000_000_123_456_789;

/// A file that is gone with its test.
pub struct Temporary(pub PathBuf);

impl Temporary {
    pub fn new(name: &str) -> Self {
        Self(std::env::temp_dir().join(format!("kehai-recording-{}-{name}.mcap", std::process::id())))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        // It may never have been made.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// What is recorded when.
const CHANGED_US: u64 = 5_000_000;
const ALARM_US: u64 = 7_000_000;

/// The site of a scene with everything in it that is drawn.
fn furnished(site: &Site) -> Site {
    let more = "[[line]]\nname = \"front\"\nfrom = [-1, -1]\nto = [1, -1]\n\
                [[exclude]]\nname = \"shelf\"\npolygon = [[8, 8], [9, 8], [9, 9]]\n\
                [[reader]]\nname = \"desk\"\nx = 1.0\ny = 0.2\nreach_m = 0.8\n\
                [[module]]\nname = \"box\"\nx = 0\ny = 0\nplaced = false\n";
    let more: Site = toml::from_str(more).unwrap();
    let mut site = site.clone();
    site.modules.extend(more.modules);
    site.lines.extend(more.lines);
    site.excludes.extend(more.excludes);
    site.readers.extend(more.readers);
    site
}

/// Follows a run with `site_tracker`, and records it as one of `written`; how many datagrams and lines there were.
pub fn record(file: &Path, site_tracker: Selected, written: Selected) -> (u64, u64) {
    let mut scene = Scene::load("door-area").unwrap();
    let (people, condition) = (Some(3), Some(Letter::H));
    scene.vary(&Variation { people, condition, ..Variation::default() }).unwrap();
    let options = Options { conditions: Conditions::DISTURBED, ..Options::default() };
    let run = Record::of(&scene, 7, &options).unwrap();
    let alarms = AlarmHandle::default();
    let recorder = Recorder::create(file, BEGUN_NS, written, &run.site, None).unwrap();
    let mut recorder = recorder.with_alarms(alarms.listen());
    let site = furnished(&run.site);
    let mut site_tracker = SiteTracker::new(&Arc::new(run.site.clone()), site_tracker);
    let (mut lines, mut datagrams) = (0, 0);
    for arrival in &run.arrivals {
        while (lines + 1) * 100_000 <= arrival.at_us {
            lines += 1;
            let at_us = lines * 100_000;
            recorder.line(at_us, &site_tracker.line(at_us as f64 * 1e-6));
            if at_us == CHANGED_US {
                recorder.told(at_us, &site);
                site_tracker.change_site(&Arc::new(site.clone()));
            }
            if at_us >= ALARM_US {
                let text = "nothing comes from it".to_owned();
                let silent = Active {
                    source: Source::Device("left".into()),
                    cause: Cause::Fault(AlarmKind::Silent),
                    text,
                };
                let active = (at_us == ALARM_US).then_some(silent);
                let now = Now { steady_s: at_us as f64 * 1e-6, unix_ms: (BEGUN_NS / 1000 + at_us) / 1000 };
                let _ = alarms.observe(now, active);
                recorder.alarms(at_us);
            }
        }
        datagrams += 1;
        recorder.datagram(arrival.at_us, &arrival.bytes);
        let seen = site_tracker.receive(&arrival.bytes, arrival.at_us);
        if let Some(observation) = seen {
            let module = &run.site.modules[observation.view.module].name;
            recorder.scan(arrival.at_us, module, &observation);
        }
        // Faster than life: the queue is given time.
        if datagrams % 4000 == 0 {
            std::thread::sleep(std::time::Duration::from_millis(50));
        }
    }
    assert_eq!((recorder.lost(), recorder.trouble()), (0, None));
    (datagrams, lines)
}
