//! `kehai-sim demo`: an emulated sensor in a simulated room, through driver and pipeline, drawn live.

mod view;

use std::error::Error;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use host_sim::chain::Chain;
use host_sim::picture::{Picture, TruthShown, exposure};
use host_sim::world::World;
use host_sim::world::geometry::Point;
use host_sim::world::scene::Scene;
use kehai::background::Learning;
use kehai::candidate::Candidate;
use kehai::centre::{Estimator, centre};
use kehai::pipeline::Settings;
use kehai::scan::Geometry;
use kehai::sensor::SensorState;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};

use view::{Seen, View};

/// How long a headless demo runs when nothing else is said, in s of the scene.
const HEADLESS_S: f64 = 30.0;
/// Distance between a candidate's centre and a person for which the one counts as the other, m.
const MATCH_M: f64 = 0.4;

/// Watch it work: an emulated sensor in a furnished room, through the real driver and pipeline
///
/// Drawn live in the terminal until q or Ctrl-C, then as a picture. Without a terminal, or with --headless, it runs as
/// fast as it can and prints a summary.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim demo
  kehai-sim demo --headless --seconds 60
  kehai-sim demo --scene crossing")]
pub struct Arguments {
    /// No terminal: run as fast as possible, print a summary
    #[arg(long)]
    headless: bool,

    /// Stop after so many seconds of the scene
    #[arg(long, value_name = "N", value_parser = seconds, allow_negative_numbers = true)]
    seconds: Option<f64>,

    /// A scene of one's own, or one that comes with the program
    #[arg(long, value_name = "FILE.toml", default_value = "demo")]
    scene: String,

    /// Seed of everything random
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// Where the picture goes
    #[arg(long, value_name = "FILE", default_value = "kehai-demo.svg")]
    svg: PathBuf,
}

/// Runs it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let scene = Scene::load(&arguments.scene)?;
    let mut demo = Demo::new(&arguments.scene, &scene, arguments.seed.unwrap_or(scene.seed))?;
    let live = !arguments.headless && std::io::stdout().is_terminal();
    if live {
        demo.live(arguments.seconds.unwrap_or(f64::INFINITY))?;
    } else {
        let until_s = arguments.seconds.unwrap_or(HEADLESS_S);
        while demo.t_s < until_s && demo.advance()? {}
    }
    demo.finish(&arguments.svg)
}

/// A run and everything it adds up.
struct Demo {
    world: World,
    chain: Chain,
    t_s: f64,
    picture: Picture,
    view: View,
    scans: u32,
    judged: u32,
    wide: u32,
    narrow: u32,
    /// Unhidden or not: people in the scene, summed over judged scans, and those a candidate stands for.
    people: u32,
    found: u32,
    errors_m: Vec<f64>,
}

impl Demo {
    fn new(name: &str, scene: &Scene, seed: u64) -> Result<Self, Box<dyn Error>> {
        let world = World::new(scene, seed);
        let (module, sensor) =
            world.sensors().first().ok_or_else(|| format!("{name}: the scene has no module"))?;
        let model = sensor.config().model.name;
        let title = format!("{model} in the scene {name}, module {module}");
        let chain = Chain::new(Box::new(sensor.clone()), sensor.config(), Settings::default());
        let colour = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty());
        let view =
            View { title: title.clone(), colour, bounds: [[-0.5, -1.0], [2.0, 1.0]], ..View::default() };
        let picture = Picture { title, ..Picture::default() };
        Ok(Self {
            world,
            chain,
            t_s: 0.0,
            picture,
            view,
            scans: 0,
            judged: 0,
            wide: 0,
            narrow: 0,
            people: 0,
            found: 0,
            errors_m: Vec::new(),
        })
    }

    /// One scan further; false when the sensor has no more.
    fn advance(&mut self) -> Result<bool, Box<dyn Error>> {
        let sensor = &self.world.sensors()[0].1;
        let (pose, duration_s) = (sensor.pose(), self.world.duration_s());
        let Some(judged) = self.chain.next_scan()? else { return Ok(false) };
        let (scan, judgement) = (judged.scan, judged.judgement);
        self.t_s = scan.time.stamp_us as f64 / 1e6;
        self.scans += 1;
        let shown = exposure::scan(self.t_s, &scan, judgement);
        let people = if self.t_s <= duration_s { self.world.truth(self.t_s).people } else { Vec::new() };
        let truth: Vec<[f64; 2]> = people
            .iter()
            .map(|person| {
                let place = pose.to_sensor(Point::new(person.x, person.y));
                [place.x, place.y]
            })
            .collect();
        if judgement.background_version != 0 {
            self.judged += 1;
            self.wide += shown.candidates.iter().filter(|candidate| !candidate.narrow).count() as u32;
            self.narrow += shown.candidates.iter().filter(|candidate| candidate.narrow).count() as u32;
            self.people += truth.len() as u32;
            for person in &truth {
                let distance_m = |place: [f64; 2]| (place[0] - person[0]).hypot(place[1] - person[1]);
                let nearest_m =
                    shown.candidates.iter().map(|c| distance_m(c.centre_m)).fold(f64::INFINITY, f64::min);
                if nearest_m < MATCH_M {
                    self.found += 1;
                    self.errors_m.push(nearest_m);
                }
            }
        }
        self.view.learning = match judgement.learning {
            Learning::Idle => None,
            Learning::Running { scans, of, .. } => Some((scans.into(), of.into())),
        };
        self.view.candidates = judgement.candidates().iter().map(|c| seen(c, scan.geometry)).collect();
        self.view.foreground.clone_from(&shown.foreground);
        if self.scans.is_multiple_of(5) {
            let of_people = truth.iter().map(|&position_m| TruthShown { t_s: self.t_s, position_m });
            self.picture.truth.extend(of_people);
        }
        self.view.truth = truth;
        self.picture.scans.push(shown);
        let geometry = *scan.geometry;
        self.look_around(&geometry);
        Ok(true)
    }

    /// Takes over what does not change with each scan.
    fn look_around(&mut self, geometry: &Geometry) {
        let model: Vec<_> = self.chain.pipeline().background().model().collect();
        let background = exposure::background(geometry, model.iter().copied());
        self.view.walls = background.iter().filter_map(host_sim::picture::BeamShown::wall_m).collect();
        for place in self.view.walls.iter().chain(&self.view.truth) {
            let [low, high] = &mut self.view.bounds;
            for ((low, high), place) in low.iter_mut().zip(high).zip(place) {
                *low = low.min(place - 0.2);
                *high = high.max(place + 0.2);
            }
        }
        self.picture.background = background;
        self.view.t_s = self.t_s;
        self.view.sensor_state = state_in_words(self.chain.state()).into();
        self.view.figures = vec![
            ("scans", self.scans.to_string()),
            ("missing scans", self.chain.counters().scans_missing.to_string()),
            ("people in the scene", self.view.truth.len().to_string()),
            (
                "centre off (median)",
                self.median_m().map_or_else(|| "-".into(), |m| format!("{:.0} mm", m * 1000.0)),
            ),
            ("background version", self.chain.pipeline().background().version().to_string()),
        ];
    }

    fn median_m(&self) -> Option<f64> {
        let mut sorted = self.errors_m.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied()
    }

    /// Draws each scan at the time it is taken, until a key ends it.
    fn live(&mut self, until_s: f64) -> Result<(), Box<dyn Error>> {
        let mut terminal = ratatui::try_init()?;
        let started = Instant::now();
        let result = loop {
            if self.t_s >= until_s {
                break Ok(());
            }
            match self.advance() {
                Ok(true) => {}
                Ok(false) => break Ok(()),
                Err(error) => break Err(error),
            }
            if let Err(error) = terminal.draw(|frame| self.view.draw(frame)) {
                break Err(error.into());
            }
            let due = Duration::from_secs_f64(self.t_s);
            match wait_for_key(due.saturating_sub(started.elapsed())) {
                Ok(false) => {}
                Ok(true) => break Ok(()),
                Err(error) => break Err(error.into()),
            }
        };
        ratatui::try_restore()?;
        result
    }

    /// Prints the summary and saves the picture.
    fn finish(mut self, svg: &std::path::Path) -> Result<(), Box<dyn Error>> {
        let share = |part: u32, whole: u32| 100.0 * f64::from(part) / f64::from(whole.max(1));
        let median = self.median_m().map_or_else(|| "-".into(), |m| format!("{:.0} mm", m * 1000.0));
        self.picture.subtitle = format!(
            "{} scans, {} judged · {} wide and {} narrow candidates · centre off by {median} (median)",
            self.scans, self.judged, self.wide, self.narrow
        );
        self.picture.save(svg).map_err(|error| format!("{}: cannot be written: {error}", svg.display()))?;
        println!("{}", self.picture.title);
        println!(
            "  scans                {} in {:.1} s, {} missing",
            self.scans,
            self.t_s,
            self.chain.counters().scans_missing
        );
        println!(
            "  judged               {}, background version {}",
            self.judged,
            self.chain.pipeline().background().version()
        );
        println!("  candidates           {} wide, {} narrow", self.wide, self.narrow);
        println!(
            "  people               {} sightings due, {:.1} % with a candidate (hidden ones included)",
            self.people,
            share(self.found, self.people)
        );
        println!("  centre off           {median} (median)");
        println!("  picture              {}", svg.display());
        Ok(())
    }
}

fn seen(candidate: &Candidate, geometry: &Geometry) -> Seen {
    let place = centre(candidate, geometry, Estimator::default());
    let [xx, _, yy] = place.covariance_m2;
    let angle_rad = f64::from(geometry.step_rad()) * f64::from(candidate.last_step - candidate.first_step);
    let (first_m, last_m) = (f64::from(candidate.first_mm) / 1000.0, f64::from(candidate.last_mm) / 1000.0);
    let square = first_m * first_m + last_m * last_m - 2.0 * first_m * last_m * angle_rad.cos();
    Seen {
        centre_m: [f64::from(place.x_m), f64::from(place.y_m)],
        deviation_m: f64::from((xx + yy) / 2.0).max(0.0).sqrt(),
        width_m: square.max(0.0).sqrt(),
        narrow: candidate.narrow,
    }
}

const fn state_in_words(state: SensorState) -> &'static str {
    match state {
        SensorState::Searching => "searching",
        SensorState::Booting => "booting",
        SensorState::Starting => "starting",
        SensorState::Streaming => "streaming",
        SensorState::Stalled => "stalled",
        SensorState::Abnormal => "abnormal",
        SensorState::TooLarge { .. } => "too many beams",
        SensorState::Unusable(_) => "unusable",
        SensorState::Refused(_) => "refuses to measure",
        SensorState::Paused => "stopped",
    }
}

/// Waits; true when somebody wants to leave.
fn wait_for_key(time: Duration) -> std::io::Result<bool> {
    let until = Instant::now() + time;
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if !event::poll(left)? {
            return Ok(false);
        }
        if let Event::Key(key) = event::read()? {
            let control_c = key.code == KeyCode::Char('c') && key.modifiers.contains(KeyModifiers::CONTROL);
            if key.kind == KeyEventKind::Press
                && (control_c || matches!(key.code, KeyCode::Char('q') | KeyCode::Esc))
            {
                return Ok(true);
            }
        }
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds.is_finite() => Ok(seconds),
        _ => Err("a number of seconds above 0".into()),
    }
}
