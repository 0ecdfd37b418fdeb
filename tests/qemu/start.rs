//! How soon the real firmware image, in QEMU, reports after power-up, whatever its sensor was left in.
//!
//! ```text
//! guest time   0 power-up ── DHCP ── sensor found, set up ── first scan ── first report          N periods
//! ```
//!
//! Time is the guest's own, from its log and its reports.

use std::path::{Path, PathBuf};

use crate::support::board::{host_of, image, start, wait_for};
use kehai::store::flash::FlashStore;
use kehai::store::save_baud;
use kehai::wire::{Message, Request};
use kehai_emulator::pc::flash::{Flash, PAGE_LEN};
use kehai_emulator::qemu::{Line, Qemu};
use kehai_emulator::serve::UdpSensor;
use kehai_emulator::source::StillRoom;
use kehai_emulator::urg::model::URG_04LX;
use kehai_emulator::urg::{Config, Start, Urg};

const LEFT_RUNNING: &str = "MD0044072502000";

/// Bytes of the image's flash.
const FLASH_LEN: usize = 128 * 1024;
/// Bytes of the file that QEMU takes for it.
const FILE_LEN: u64 = 16 * 1024 * 1024;

/// A scan period.
const PERIOD_US: u64 = URG_04LX.geometry.period_us as u64;

fn urg(config: Config) -> Urg {
    Urg::new(config, Box::new(StillRoom::new(URG_04LX.geometry)), 0)
}

/// Flash of a module that has been in use.
struct Used(PathBuf);

impl Used {
    fn new(name: &str, last_baud: u32) -> Self {
        let path = std::env::temp_dir().join(format!("kehai-start-{}-{name}", std::process::id()));
        let flash = Flash::open(&path, FLASH_LEN / PAGE_LEN).unwrap();
        let mut store = FlashStore::new(flash, 0..FLASH_LEN as u32).unwrap();
        embassy_futures::block_on(save_baud(&mut store, last_baud)).unwrap();
        std::fs::File::options().write(true).open(&path).unwrap().set_len(FILE_LEN).unwrap();
        Self(path)
    }
}

impl Drop for Used {
    fn drop(&mut self) {
        // It may be gone with the whole folder.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Scan periods from power-up to the first report that a host gets.
fn periods(board: &mut Qemu) -> f64 {
    let first = host_of(board).more(1);
    let report = wait_for(board, "first report");
    // The host may have subscribed late: then its first report is not the first.
    report.at_us.max(first.head.stamp_us + PERIOD_US) as f64 / PERIOD_US as f64
}

/// A sensor at power-up, and in how many scan periods there must be a report.
struct Case {
    name: String,
    at_most: f64,
    config: Config,
    /// What the image remembers of a line: nothing where any speed will do, else perhaps a speed.
    line: Remembered,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Remembered {
    /// Any speed will do.
    Nothing,
    /// The speed matters.
    Speed(Option<u32>),
}

impl Case {
    fn new(at_most: f64, start: Start, baud: u32, line: Remembered) -> Self {
        let left_running = (line != Remembered::Nothing).then(|| LEFT_RUNNING.to_owned());
        let config = Config { start, baud, left_running, ..Config::new(URG_04LX) };
        let known = match line {
            Remembered::Nothing => "any speed",
            Remembered::Speed(None) => "rate unknown",
            Remembered::Speed(Some(_)) => "rate remembered",
        };
        Self { name: format!("{start:?} at {baud}, {known}"), at_most, config, line }
    }

    fn all() -> Vec<Self> {
        use Remembered::{Nothing, Speed};
        let mut cases: Vec<_> = [Start::Idle, Start::Scip11, Start::TimeSync]
            .map(|start| Self::new(20.0, start, 19_200, Nothing))
            .into();
        cases.push(Self::new(20.0, Start::Streaming, 250_000, Nothing));
        cases.push(Self::new(20.0, Start::Scip11, 19_200, Speed(None)));
        for baud in [19_200, 38_400, 57_600, 115_200, 250_000, 500_000, 750_000] {
            let (idle, streaming) = match baud {
                19_200 => (20.0, 40.0),
                115_200.. => (40.0, 20.0),
                _ => (40.0, 40.0),
            };
            cases.push(Self::new(idle, Start::Idle, baud, Speed(None)));
            cases.push(Self::new(streaming, Start::Streaming, baud, Speed(None)));
        }
        for baud in [19_200, 57_600, 250_000] {
            cases.push(Self::new(20.0, Start::Idle, baud, Speed(Some(baud))));
            cases.push(Self::new(40.0, Start::Streaming, baud, Speed(Some(baud))));
        }
        cases
    }

    /// There is a report in time.
    fn holds(&self, image: &Path, number: usize) {
        match self.line {
            Remembered::Nothing => {
                let sensor = UdpSensor::new(urg(self.config.clone())).unwrap();
                self.judge(&mut start(image, Line::AnySpeed(&sensor), None));
            }
            Remembered::Speed(last_baud) => {
                let flash = last_baud.map(|baud| Used::new(&number.to_string(), baud));
                let sensor = UdpSensor::new(urg(self.config.clone())).unwrap();
                let flash = flash.as_ref().map(|used| used.0.as_path());
                self.judge(&mut start(image, Line::Serial(&sensor), flash));
            }
        }
    }

    fn judge(&self, board: &mut Qemu) {
        let periods = periods(board);
        println!("{:<40} {periods:5.1} periods of {}", self.name, self.at_most);
        if periods > self.at_most {
            board.messages().unwrap().iter().for_each(|message| println!("    {message}"));
            panic!("{}: too late", self.name);
        }
    }
}

#[test]
fn after_power_up_the_module_gets_an_address_is_subscribed_to_reports_and_learns() {
    let Some(image) = image() else { return };
    let sensor = UdpSensor::new(urg(Config::new(URG_04LX))).unwrap();
    let mut board = start(image, Line::AnySpeed(&sensor), None);
    let lease = wait_for(&mut board, "address 10.0.2.15/24");
    let mut host = host_of(&board);
    host.subscribe();
    let first = host.more(1);
    let report = wait_for(&mut board, "first report");
    let learned = loop {
        let report = host.more(1);
        if report.head.background_version == 1 {
            break report.head;
        }
    };
    // Asked for, it learns again.
    host.health(|health| !health.head.storing);
    host.ask(Request::Learn { scans: 30 });
    host.look(|_, message| matches!(message, Message::Done { .. }).then_some(()));
    host.health(|health| health.head.learning.is_some());
    let again = loop {
        let report = host.more(1);
        if report.head.background_version == 2 {
            break report.head;
        }
    };
    let in_periods = |at_us: u64| at_us as f64 / PERIOD_US as f64;
    println!("address by DHCP                          {:5.1} periods", in_periods(lease.at_us));
    println!("first report                             {:5.1} periods of 20", in_periods(report.at_us));
    println!(
        "learned and stored, reports again        {:5.1} periods",
        in_periods(learned.stamp_us + PERIOD_US)
    );
    println!(
        "learned on request                       {:5.1} periods",
        in_periods(again.stamp_us + PERIOD_US)
    );
    assert!(in_periods(report.at_us.max(first.head.stamp_us + PERIOD_US)) <= 20.0, "{report}");
    assert!(lease.at_us < report.at_us, "{lease}");
    // The background is learned from 60 scans, and storing it may lose no more than 20.
    assert!(learned.sequence > 60, "{learned:?}");
    assert!(in_periods(learned.stamp_us) <= in_periods(first.head.stamp_us) + 60.0 + 20.0, "{learned:?}");
}

#[test]
fn the_first_report_comes_within_20_periods_of_power_up_and_within_40_at_rare_rates() {
    let Some(image) = image() else { return };
    for (number, case) in Case::all().iter().enumerate() {
        case.holds(image, number);
    }
}
