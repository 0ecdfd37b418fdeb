//! `kehai-sim plan`: where modules are to be mounted on a site, and how well people will be counted there.

use std::error::Error;
use std::io::Write;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::picture::coverage::CoveragePicture;
use host_sim::plan::choose::Number;
use host_sim::plan::expect::{Expected, expect};
use host_sim::plan::layout::{Layout, Survey};
use host_sim::plan::report::Share;
use host_sim::plan::visit::Visitors;
use host_sim::plan::{ORDINARY_CLOTHES, Task};
use host_sim::world::gathering::MOST_PEOPLE;
use host_sim::world::optics::SensorModel;
use indicatif::ProgressBar;
use kehai_tracking::site::Site;
use serde::Serialize;

/// As many layouts are simulated.
const LAYOUTS: usize = 3;

/// Plan where modules go: places on the walls of a site, what they see with people standing about, and the count to expect
///
/// Places are chosen one after the other, each where it adds most to the share of the zones that is seen, and that is seen from two
/// sides. Then people walk through the best three layouts in the simulator, and the best of them is written. The same
/// site and options give the same output every time.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  kehai-sim plan hall.toml --people 5 --out planned.toml --svg planned.svg
  kehai-sim plan hall.toml --modules 3 --sensor ust-10lx --height 0.8
  kehai-sim plan hall.toml --keep --modules 1          where one more module helps most")]
pub struct Arguments {
    /// The site's file: walls, zones and entries
    #[arg(value_name = "SITE.toml")]
    file: PathBuf,

    /// So many new modules; 0 with --keep: what is there [default: as many as add 2 % each, at most 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=64), requires_if("0", "keep"))]
    modules: Option<u8>,

    /// The modules in the file that have a place stay, and new ones are added; else the file's are left out
    #[arg(long)]
    keep: bool,

    /// The sensor of every module
    #[arg(long, value_name = "NAME", default_value = "urg-04lx", value_parser = sensor)]
    sensor: SensorModel,

    /// Scanning planes of new modules above the floor
    #[arg(long, value_name = "METRES", default_value_t = 0.9, value_parser = height)]
    height: f64,

    /// Share of the light that clothes give back: 0.55 for ordinary ones, 0.1 for black cotton; how far people are seen
    #[arg(long, value_name = "SHARE", default_value_t = ORDINARY_CLOTHES, value_parser = share)]
    clothes: f64,

    /// People on the site at one time
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u8).range(1..=MOST_PEOPLE as i64))]
    people: u8,

    /// First and last seed of the simulated runs, of a minute each
    #[arg(long, value_name = "FIRST-LAST", default_value = "0-39", value_parser = super::runs::seeds)]
    seeds: RangeInclusive<u64>,

    /// Write the site with the modules of the best layout to this file
    #[arg(long, value_name = "NAME.toml")]
    out: Option<PathBuf>,

    /// Draw what the best layout sees
    #[arg(long, value_name = "NAME.svg")]
    svg: Option<PathBuf>,

    /// Print everything as one JSON object
    #[arg(long)]
    json: bool,
}

fn sensor(name: &str) -> Result<SensorModel, String> {
    SensorModel::named(name).ok_or_else(|| {
        let names: Vec<&str> = SensorModel::ALL.iter().map(|model| model.emulated().name).collect();
        format!("one of {}", names.join(", "))
    })
}

fn height(text: &str) -> Result<f64, String> {
    between(text, 0.05, 2.5).ok_or_else(|| "0.05 to 2.5 m".to_owned())
}

fn share(text: &str) -> Result<f64, String> {
    between(text, 0.02, 1.0).ok_or_else(|| "0.02 (black) to 1 (white)".to_owned())
}

fn between(text: &str, low: f64, high: f64) -> Option<f64> {
    text.parse().ok().filter(|value| (low..=high).contains(value))
}

/// What is printed.
#[derive(Debug, Serialize)]
struct Plan {
    site: String,
    sensor: &'static str,
    height_m: f64,
    people: usize,
    m2: f64,
    /// Places that were compared.
    places: usize,
    /// Modules of the file that have no place: they see nothing here.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    left_out: Vec<String>,
    /// With the first module, the first two, …
    steps: Vec<Share>,
    /// The best first, by the share of exact counts.
    layouts: Vec<Judged>,
}

/// A layout and what the simulator says of it.
#[derive(Debug, Serialize)]
struct Judged {
    #[serde(skip)]
    layout: Layout,
    modules: Vec<kehai_tracking::site::Module>,
    value: f64,
    /// All zones together, then each.
    shares: Vec<Share>,
    /// Share of the time with the right number, mean and interval at 95 %.
    exact: f64,
    exact_95: [f64; 2],
    runs: usize,
}

/// Does it.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let name = arguments.file.display().to_string();
    let text = std::fs::read_to_string(&arguments.file).map_err(|error| format!("{name}: {error}"))?;
    let mut site = Site::parse(&name, &text)?;
    if arguments.out.as_deref().is_some_and(|out| is_same(out, &arguments.file)) {
        return Err(format!(
            "{name}: is the site itself, whose comments would be lost: give --out another name"
        )
        .into());
    }
    if arguments.svg.as_deref().is_some_and(|svg| is_same(svg, &arguments.file)) {
        return Err(format!("{name}: is the site itself: give --svg another name").into());
    }
    if site.zones.is_empty() {
        return Err(format!("{name}: has no zone: draw where people are to be counted").into());
    }
    if !arguments.keep {
        site.modules.clear();
    }
    let task = Task {
        site,
        model: arguments.sensor,
        height_m: arguments.height,
        clothes: arguments.clothes,
        people: usize::from(arguments.people),
        seed: 0,
    };
    let survey = Survey::of(&task)?;
    if survey.places.is_empty() {
        return Err(format!("{name}: no wall from which a zone is seen: draw walls around the zones").into());
    }
    let number =
        arguments.modules.map_or(Number::WhileItGains, |number| Number::Exactly(usize::from(number)));
    let plan = plan(arguments, &task, &survey, number).map_err(|what| format!("{name}: {what}"))?;
    let best = plan.layouts.first().ok_or_else(|| format!("{name}: no further module adds anything"))?;
    if let Some(out) = &arguments.out {
        write(out, arguments, &task, best)?;
    }
    if let Some(out) = &arguments.svg {
        draw(out, &plan, &task, &survey, best)?;
    }
    print(&plan, arguments)
}

fn plan(arguments: &Arguments, task: &Task, survey: &Survey, number: Number) -> Result<Plan, Box<dyn Error>> {
    let layouts = survey.best(number, LAYOUTS);
    let first = layouts.first().map(|layout| layout.places.clone()).unwrap_or_default();
    let so_far = |number: usize| survey.layout(first.iter().take(number).copied().collect());
    let steps = (1..=first.len()).filter_map(|number| survey.shares(&so_far(number)).into_iter().next());
    let visitors = Visitors::of(task)?;
    let modules: Vec<_> = layouts.iter().map(|layout| survey.modules(layout)).collect();
    let bar = ProgressBar::new(layouts.len() as u64 * arguments.seeds.clone().count() as u64);
    let expected = expect(&visitors, &modules, &arguments.seeds, || bar.inc(1))?;
    bar.finish_and_clear();
    let judged = |((layout, modules), expected): ((Layout, _), Expected)| {
        let mean = expected.mean()?;
        Some(Judged {
            modules,
            value: layout.value,
            shares: survey.shares(&layout),
            layout,
            exact: mean.mean,
            exact_95: [mean.interval.low, mean.interval.high],
            runs: mean.number,
        })
    };
    let mut judged: Vec<Judged> = layouts.into_iter().zip(modules).zip(expected).filter_map(judged).collect();
    // Of equal ones that of the higher value stays before.
    judged.sort_by(|one, other| other.exact.total_cmp(&one.exact));
    Ok(Plan {
        site: arguments.file.display().to_string(),
        sensor: task.model.emulated().name,
        height_m: task.height_m,
        people: task.people,
        m2: survey.ground.m2(),
        places: survey.places.len(),
        left_out: task.left_out().map(|module| module.name.clone()).collect(),
        steps: steps.collect(),
        layouts: judged,
    })
}

fn is_same(one: &Path, other: &Path) -> bool {
    one == other
        || std::fs::canonicalize(one)
            .is_ok_and(|one| std::fs::canonicalize(other).is_ok_and(|other| one == other))
}

fn write(out: &Path, arguments: &Arguments, task: &Task, best: &Judged) -> Result<(), Box<dyn Error>> {
    let modules = best.modules.iter().chain(task.left_out()).cloned().collect();
    let site = Site { modules, ..task.site.clone() };
    let [low, high] = best.exact_95;
    let head = format!(
        "# Planned by kehai-sim plan from {} for {} people: {}\n# Rename each module to the name or identity of the device that is mounted there.\n\n",
        arguments.file.display(),
        task.people,
        format_args!(
            "the count is exact {:.1} % of the time ({:.1}–{:.1}), simulated.",
            100.0 * best.exact,
            100.0 * low,
            100.0 * high
        ),
    );
    std::fs::write(out, head + &toml::to_string(&site)?)
        .map_err(|error| format!("{}: {error}", out.display()).into())
}

fn draw(out: &Path, plan: &Plan, task: &Task, survey: &Survey, best: &Judged) -> Result<(), Box<dyn Error>> {
    let site = Site { modules: best.modules.clone(), ..task.site.clone() };
    let all = best.shares.first().cloned().unwrap_or_default();
    let picture = CoveragePicture {
        title: format!("{}, {} {} at {:.2} m", plan.site, best.modules.len(), plan.sensor, plan.height_m),
        subtitle: format!(
            "with {} people: {:.0} % seen by one module, {:.0} % from two sides; {:.1} m² blind; count exact {:.1} % of the time, simulated",
            plan.people,
            100.0 * all.one,
            100.0 * all.two,
            all.blind_m2,
            100.0 * best.exact
        ),
        site: &site,
        cell_m: survey.ground.cell_m,
        cells: &survey.cells(&best.layout),
    };
    picture.save(out).map_err(|error| format!("{}: {error}", out.display()).into())
}

fn print(plan: &Plan, arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let mut out = std::io::stdout().lock();
    if arguments.json {
        serde_json::to_writer(&mut out, plan)?;
        writeln!(out)?;
        return Ok(());
    }
    let Plan { site, sensor, height_m, people, m2, places, left_out, .. } = plan;
    writeln!(
        out,
        "{site}: {m2:.1} m² in zones, {places} places for a {sensor} at {height_m:.2} m, {people} people"
    )?;
    if !left_out.is_empty() {
        writeln!(out, "left out, as they have no place: {}", left_out.join(", "))?;
    }
    writeln!(out, "\nnew modules   seen by one   from two sides")?;
    for (number, share) in (1..).zip(&plan.steps) {
        writeln!(out, "{number:>11}   {:>9.1} %   {:>12.1} %", 100.0 * share.one, 100.0 * share.two)?;
    }
    writeln!(out, "\nlayout   seen by one   from two sides   count exact, of the time (95 %)")?;
    for (letter, layout) in ('A'..).zip(&plan.layouts) {
        let all = layout.shares.first().cloned().unwrap_or_default();
        let [low, high] = layout.exact_95.map(|share| 100.0 * share);
        writeln!(
            out,
            "{letter:<6}   {:>9.1} %   {:>12.1} %   {:.1} % ({low:.1}–{high:.1}), {} runs of a minute",
            100.0 * all.one,
            100.0 * all.two,
            100.0 * layout.exact,
            layout.runs
        )?;
    }
    let Some(best) = plan.layouts.first() else { return Ok(()) };
    writeln!(out, "\nA: module              x        y      yaw")?;
    for module in &best.modules {
        writeln!(
            out,
            "   {:<14} {:>6.2} m {:>6.2} m {:>6.1}°",
            module.name, module.x, module.y, module.yaw_deg
        )?;
    }
    writeln!(out, "\nA: zone           seen by one   from two sides   blind")?;
    for share in best.shares.iter().skip(1) {
        writeln!(
            out,
            "   {:<14} {:>9.1} %   {:>12.1} %   {:.1} of {:.1} m²",
            share.zone,
            100.0 * share.one,
            100.0 * share.two,
            share.blind_m2,
            share.m2
        )?;
    }
    Ok(())
}
