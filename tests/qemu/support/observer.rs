//! An emulated sensor with faults, and the reports that a host must have received from its module.
//!
//! ```text
//!   UdpSensor ══▶ board ══ user network, or a Switch ══▶ Host
//!     └ faults                                            └ reports, health
//! ```

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use kehai::wire::ModuleId;
use kehai_emulator::pc::host::{Host, Way};
use kehai_emulator::serve::UdpSensor;
use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry, SourceScan};
use kehai_emulator::urg::faults::Fault;
use kehai_emulator::urg::{Config, Urg};

use super::board::MAC;

pub const SECOND_US: u64 = 1_000_000;

/// Ranges by when their scan began, on the sensor's own time.
pub type Measured = Arc<Mutex<BTreeMap<u64, Vec<u32>>>>;

/// A source that records its scans.
pub struct Noted<S>(pub S, pub Measured);

impl<S: RangeSource> RangeSource for Noted<S> {
    fn geometry(&self) -> SensorGeometry {
        self.0.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let scan = self.0.scan(revolution)?;
        self.1.lock().unwrap().insert(scan.start_us, scan.ranges_mm.clone());
        Some(scan)
    }
}

/// A sensor for a board's line.
pub fn sensor(config: Config, source: impl RangeSource + 'static) -> UdpSensor {
    UdpSensor::new(Urg::new(config, Box::new(source), 0)).unwrap()
}

/// From now on this goes wrong with `sensor`, and nothing else; its own clock, ms.
pub fn from_now_on(sensor: &UdpSensor, faults: &[&str]) -> u64 {
    let faults: Vec<Fault> = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    sensor.with(|urg, now_us| {
        urg.set_faults(&faults, now_us);
        urg.stamp_ms(now_us).into()
    })
}

/// Stamps of all scans sent.
pub fn sent_ms(sensor: &UdpSensor) -> Vec<u64> {
    sensor.with(|urg, _| urg.truth().map(|truth| truth.stamp_ms.into()).collect())
}

/// What these tests ask of a host.
pub trait Observer {
    /// The module learns the background and stores it; the reports until then are forgotten.
    fn settle(&mut self);
    /// None of the reports kept is missing, or out of order.
    fn assert_no_report_missing(&self);
    /// Every scan that `sensor` sent between the first report kept and the last was reported, in order.
    fn assert_every_scan_reported(&self, sensor: &UdpSensor);
}

impl<W: Way> Observer for Host<W> {
    #[track_caller]
    fn settle(&mut self) {
        self.health(|health| health.head.background_version == 1 && health.head.storing);
        self.health(|health| !health.head.storing);
        assert_eq!(self.identity.module, ModuleId(MAC));
        self.more(2);
        self.reports.clear();
    }

    #[track_caller]
    fn assert_no_report_missing(&self) {
        for pair in self.reports.windows(2) {
            assert_eq!(pair[1].head.sequence, pair[0].head.sequence + 1);
        }
    }

    #[track_caller]
    fn assert_every_scan_reported(&self, sensor: &UdpSensor) {
        self.assert_no_report_missing();
        let reported: Vec<u64> = self.reports.iter().map(|report| report.head.sensor_ms).collect();
        let (Some(first), Some(last)) = (reported.first(), reported.last()) else { panic!("no reports") };
        let sent = sent_ms(sensor);
        let sent: Vec<u64> = sent.into_iter().filter(|stamp_ms| (first..=last).contains(&stamp_ms)).collect();
        assert_eq!(reported, sent);
    }
}
