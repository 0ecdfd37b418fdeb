//! `kehai-sim floor`: a floor of pressure panels as a device, with simulated people on it.

use std::error::Error;
use std::net::{SocketAddrV4, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::Args;
use host_sim::floor::gait::{Habit, Sole, Walker, Way};
use host_sim::floor::panels::{Broken, PITCH_M, reading};
use host_sim::world::random::{Purpose, Stream};
use kehai::floor::{Bits, Floor, PANELS};
use kehai::wire::{Identity, PORT};
use kehai_emulator::pc::floor::{self, Panels};
use kehai_tracking::floor::Plan;
use kehai_tracking::geometry::{Point, Pose};

/// A floor of pressure panels on this PC, with people who walk on it to and fro
///
/// It answers at its UDP port as a device with a floor does; hosts are told its address (kehai-tracker run --module). Ends
/// with Ctrl-C.
#[derive(Debug, Args)]
#[command(after_help = "Example:
  kehai-sim floor --name mat --people 2 --listen 127.0.0.1:4041")]
pub struct Arguments {
    /// Name of the device
    #[arg(long, value_name = "NAME", default_value = "floor", value_parser = super::module::name)]
    name: String,

    /// Address and port to listen at
    #[arg(long, value_name = "ADDR", default_value_t = SocketAddrV4::new([0; 4].into(), PORT), value_parser = super::module::listen)]
    listen: SocketAddrV4,

    /// Columns of panels
    #[arg(long, value_name = "N", default_value_t = 24)]
    columns: u8,

    /// Rows of panels; at most 1024 panels in all
    #[arg(long, value_name = "N", default_value_t = 24)]
    rows: u8,

    /// People on it, side by side
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u8).range(0..=8))]
    people: u8,

    /// Panels that are always down: row · columns + column
    #[arg(long, value_name = "PANEL", value_delimiter = ',')]
    stuck: Vec<usize>,

    /// Panels that are never down
    #[arg(long, value_name = "PANEL", value_delimiter = ',')]
    dead: Vec<usize>,

    /// How the people walk
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

/// People walk no nearer to the edge than this, m: a foot and a half.
const EDGE_M: f64 = 0.2;

/// People on a floor.
struct Crowd {
    plan: Plan,
    walkers: Vec<Walker>,
    broken: Broken,
}

impl Crowd {
    fn new(arguments: &Arguments) -> Self {
        let &Arguments { columns, rows, people, seed, .. } = arguments;
        let plan =
            Plan { corner: Pose { at: Point::default(), yaw_rad: 0.0 }, columns, rows, pitch_m: PITCH_M };
        let (width_m, depth_m) = (f64::from(columns) * PITCH_M, f64::from(rows) * PITCH_M);
        let walker = |number: u8| {
            let mut random = Stream::new(seed, Purpose::Walk, [0xf100, u64::from(number)]);
            let y = depth_m * (f64::from(number) + 0.5) / f64::from(people.max(1));
            let ends = [EDGE_M, (width_m - EDGE_M).max(EDGE_M + PITCH_M)].map(|x| Point::new(x, y));
            Walker {
                way: Way::ToAndFro(ends[0], ends[1]),
                begun_m: random.between(0.0, width_m),
                speed_mps: random.between(0.6, 0.9),
                habit: Habit::random(&mut random),
            }
        };
        let broken = Broken { stuck: arguments.stuck.clone(), dead: arguments.dead.clone() };
        Self { plan, walkers: (0..people).map(walker).collect(), broken }
    }
}

impl Panels for Crowd {
    fn read(&mut self, at_us: u64) -> Bits {
        let at_s = at_us as f64 * 1e-6;
        let soles: Vec<Sole> = self.walkers.iter().flat_map(|walker| walker.soles(at_s)).collect();
        reading(&self.plan, &soles, &self.broken)
    }
}

/// Runs the floor until Ctrl-C.
///
/// # Errors
/// One line that says what is wrong with which number or address.
pub fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    let &Arguments { columns, rows, .. } = arguments;
    let floor = Floor::new(columns, rows)
        .ok_or_else(|| format!("--columns {columns} --rows {rows}: a floor has 1 to {PANELS} panels"))?;
    if let Some(panel) = arguments.stuck.iter().chain(&arguments.dead).find(|panel| **panel >= floor.panels())
    {
        return Err(format!("panel {panel}: the last one is {}", floor.panels() - 1).into());
    }
    let socket = UdpSocket::bind(arguments.listen)
        .map_err(|error| format!("cannot listen at {}: {error}", arguments.listen))?;
    let address = socket.local_addr()?;
    let mut crowd = Crowd::new(arguments);
    let told = |Identity { module, boot }: Identity| {
        eprintln!("floor {module} at {address}, start {boot}; Ctrl-C ends it");
    };
    Ok(floor::run(&socket, &arguments.name, &floor, &mut crowd, &stop, told)?)
}
