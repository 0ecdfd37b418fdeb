//! The depth camera as a device on the wire.
//!
//! ```text
//!   frames ─▶ FanSource ─▶ emulated sensor `KEHAI-DEPTH` ─▶ SCIP over TCP, on this PC ─▶ the firmware's tasks ─▶ UDP
//!             background, foreground, fan                                                driver, pipeline, session
//!                └▶ sizes of the bodies ────────────────────────────────────────────────────────▶ reports
//! ```
//!
//! All pixels of a frame are taken at once, but a range finder turns: its beam `k` is said to be measured `k` steps
//! after the stamp. The stamp is put so that the middle of the fan is right; its ends are then off by half of
//! `field of view / 360° · period`: 19 ms at 70° and 5 frames/s, 3 cm at walking pace.

use std::error::Error;
use std::io;
use std::net::{Ipv4Addr, SocketAddrV4, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use kehai::update::maker::DEVELOPMENT;
use kehai_emulator::pc::device::{Beside, Pc};
use kehai_emulator::pc::flash::Flash;
use kehai_emulator::pc::line::Place;
use kehai_emulator::pc::udp::Udp;
use kehai_emulator::serve::{self, Control};
use kehai_emulator::source::{RangeSource, Revolution, SensorGeometry, SourceScan};
use kehai_emulator::urg::model::{Model, UST_10LX};
use kehai_emulator::urg::{Config, Urg};

use crate::background::{Background, FRAMES, Learner};
use crate::camera::Camera;
use crate::cluster::Density;
use crate::fan::Fan;
use crate::foreground::{self, Limits};
use crate::sizes::{Bodies, Sizes};
use crate::source::{BadFrame, Frames};

/// What has come from the camera so far.
#[derive(Debug, Default)]
pub struct Counts {
    /// Frames that could be read.
    pub good: AtomicU64,
    /// Frames that could not: each is a scan in which nothing was seen.
    pub bad: AtomicU64,
}

/// Too few frames to learn the background from.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error(
    "holds {good} good frames, the background takes {FRAMES}; give a recording without people with --background"
)]
pub struct TooFew {
    /// Good frames.
    pub good: usize,
}

/// Learns the background from the next good frames; `on_bad` is told of the others.
///
/// # Errors
/// [`TooFew`] of them.
pub fn learn(frames: &mut dyn Frames, on_bad: &mut dyn FnMut(&BadFrame)) -> Result<Background, TooFew> {
    let mut learner = Learner::default();
    while let Some(frame) = frames.next_frame() {
        match frame {
            Ok(frame) => {
                if let Some(background) = learner.push(frame) {
                    return Ok(background);
                }
            }
            Err(bad) => on_bad(&bad),
        }
    }
    Err(TooFew { good: FRAMES - learner.wanted() })
}

/// Gives an emulated sensor the ring of one frame after another.
pub struct FanSource {
    frames: Box<dyn Frames>,
    camera: Camera,
    limits: Limits,
    background: Background,
    fan: Fan,
    latest_mm: Vec<u32>,
    on_bad: Box<dyn FnMut(&BadFrame) + Send>,
    counts: Arc<Counts>,
    sizes: Arc<Sizes>,
}

impl FanSource {
    /// The rings of `frames` in front of `background`.
    #[must_use]
    pub fn new(
        frames: Box<dyn Frames>,
        camera: Camera,
        background: Background,
        on_bad: Box<dyn FnMut(&BadFrame) + Send>,
    ) -> Self {
        let limits = Limits::USUAL;
        let fan = Fan::new(&camera, &background, &limits);
        let latest_mm = fan.not_seen();
        let (counts, sizes) = (Arc::default(), Arc::default());
        Self { frames, camera, limits, background, fan, latest_mm, on_bad, counts, sizes }
    }

    /// What has come so far; goes on counting.
    #[must_use]
    pub fn counts(&self) -> Arc<Counts> {
        Arc::clone(&self.counts)
    }

    /// The sizes of the bodies in its scans, for the reports of them.
    #[must_use]
    pub fn sizes(&self) -> Arc<Sizes> {
        Arc::clone(&self.sizes)
    }

    /// The sensor it is measured by.
    #[must_use]
    pub fn config(&self) -> Config {
        let model = Model {
            name: "kehai-depth",
            model_text: "KEHAI-DEPTH",
            product: "Depth camera as a fan of ranges",
            firmware: env!("CARGO_PKG_VERSION"),
            serial: "D0000001",
            ..UST_10LX
        };
        Config { paced: false, boot_us: 0, ..Config::new(model.with_geometry(self.fan.geometry())) }
    }

    /// Time from step 0 to the middle of the fan, µs.
    fn middle_us(&self, period_us: u32) -> u64 {
        let geometry = self.fan.geometry();
        u64::from(period_us) * u64::from(geometry.front_step) / u64::from(geometry.steps_per_turn)
    }

    fn scan_of(&self, revolution: Revolution) -> SourceScan {
        // The frame was taken at the start of the revolution; the stamp goes before it, never before zero.
        let start_us = revolution.start_us.saturating_sub(self.middle_us(revolution.period_us));
        SourceScan {
            start_us: start_us.max(revolution.earliest_us.min(revolution.start_us)),
            ready_us: revolution.start_us + u64::from(revolution.period_us),
            ranges_mm: self.latest_mm.clone(),
        }
    }
}

impl RangeSource for FanSource {
    fn geometry(&self) -> SensorGeometry {
        self.fan.geometry()
    }

    fn scan(&mut self, revolution: Revolution) -> Option<SourceScan> {
        let Some(frame) = self.frames.next_frame() else {
            // What was seen last is not seen any more.
            self.latest_mm = self.fan.not_seen();
            return None;
        };
        self.latest_mm = match frame {
            Ok(frame) => {
                self.counts.good.fetch_add(1, Ordering::Relaxed);
                let points = foreground::of(&frame, &self.background, &self.camera, &self.limits);
                let (ring_mm, nearest) = self.fan.ring_and_nearest(&frame, &points);
                let bodies = Bodies::of(ring_mm.clone(), &nearest, &points, &self.camera, &Density::USUAL);
                self.sizes.remember(bodies);
                ring_mm
            }
            Err(bad) => {
                self.counts.bad.fetch_add(1, Ordering::Relaxed);
                (self.on_bad)(&bad);
                self.fan.not_seen()
            }
        };
        Some(self.scan_of(revolution))
    }

    fn latest(&mut self, revolution: Revolution) -> Option<SourceScan> {
        Some(self.scan_of(revolution))
    }
}

/// How a device is switched on.
pub struct Start<'a> {
    /// Its port.
    pub port: &'a Udp,
    /// Its store.
    pub flash: &'a Flash,
    /// Its name.
    pub name: &'a str,
    /// Whether it is announced by DNS-SD.
    pub announced: bool,
}

/// Runs the device until `stop` is set. `on_start` is told at every start who it is.
///
/// # Errors
/// What the PC lacks.
pub fn run(
    source: FanSource,
    start: &Start<'_>,
    stop: &AtomicBool,
    mut on_start: impl FnMut(kehai::wire::Identity),
) -> Result<(), Box<dyn Error>> {
    let listener = TcpListener::bind(SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0))?;
    let place = Place::Tcp(listener.local_addr()?.to_string());
    let sizes = source.sizes();
    let sensor = Urg::new(source.config(), Box::new(source), 0);
    let pc = Pc {
        beside: Beside::Sensor,
        sensor: &place,
        port: start.port,
        flash: start.flash,
        name: Some(start.name),
        unique: Some("kehai-depth"),
        maker: DEVELOPMENT,
        announced: start.announced,
        amend: Some(sizes),
    };
    std::thread::scope(|scope| {
        let serving = scope.spawn(|| {
            let mut control = Control { stop, on_status: &mut |_| {} };
            serve::serve_tcp(&listener, sensor, &mut control)
        });
        let mut run = Ok(());
        while run.is_ok() && !stop.load(Ordering::Relaxed) && !serving.is_finished() {
            run = pc.start(stop, &mut on_start);
        }
        stop.store(true, Ordering::Relaxed);
        let served = serving.join().unwrap_or_else(|_| Err(io::Error::other("the sensor's thread ended")));
        run.and(served.map_err(Into::into))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::SMALL;
    use crate::fan::NOT_SEEN;
    use crate::frame::Frame;
    use crate::golden::{Body, background, render};
    use crate::source::Fault;
    use kehai::pipeline::Settings;
    use kehai::sensor_model::SensorModel;
    use kehai::unseen::UnseenReason;
    use kehai::wire::{DATAGRAM_MAX, Identity, Message, Report};
    use kehai_emulator::chain::Chain;
    use kehai_emulator::pc::amended::Amend;

    /// Frames of a test; None is one that cannot be read.
    struct Clip(std::vec::IntoIter<Option<Frame>>);

    impl Frames for Clip {
        fn next_frame(&mut self) -> Option<Result<Frame, BadFrame>> {
            let bad = || BadFrame { place: "clip".into(), fault: Fault::Torn("test".into()), stamp_us: 0 };
            Some(self.0.next()?.ok_or_else(bad))
        }
    }

    fn clip(frames: Vec<Option<Frame>>) -> Box<dyn Frames> {
        Box::new(Clip(frames.into_iter()))
    }

    fn source(frames: Vec<Option<Frame>>) -> FanSource {
        FanSource::new(clip(frames), SMALL, background(&SMALL), Box::new(|_| {}))
    }

    #[test]
    fn the_firmwares_pipeline_finds_a_body_and_a_bad_frame_is_unseen() {
        let body = Body { x_m: 2.0, y_m: 0.0, radius_m: 0.25, top_m: 1.7 };
        let empty = || Some(render(&SMALL, &[], 0));
        let mut frames: Vec<_> = (0..100).map(|_| empty()).collect();
        frames.extend([Some(render(&SMALL, &[body], 1)), None, empty()]);
        let source = source(frames);
        let (config, counts, sizes) = (source.config(), source.counts(), source.sizes());
        let settings = Settings::of(&SensorModel::of(config.model.model_text), 10_000);
        let mut chain = Chain::new(Box::new(source), config, settings);
        let (mut seen, mut sized) = (Vec::new(), Vec::new());
        while let Some(scan) = chain.next_scan().unwrap() {
            let judgement = scan.judgement;
            let places: Vec<_> = judgement.candidates().iter().map(|candidate| candidate.near_mm).collect();
            let blind = judgement
                .unseen()
                .iter()
                .any(|span| span.reason == UnseenReason::NoReturn && span.beams > 50);
            let mut datagram = [0; DATAGRAM_MAX];
            let report = Message::Report(Report::of(judgement, 1, 0));
            let length = report.encode(Identity::default(), &mut datagram).unwrap();
            let mut room = [0; DATAGRAM_MAX];
            if let Some(length) = sizes.amend(&datagram[..length], &mut room) {
                let (_, Message::Report(report)) = Message::decode(&room[..length]).unwrap() else {
                    panic!()
                };
                sized.extend(report.sizes.iter());
            }
            seen.push((judgement.background_version, places, blind));
        }
        let [.., with_body, bad, after] = &seen[..] else { panic!("{seen:?}") };
        assert_eq!(with_body.0, 1);
        assert!(matches!(with_body.1[..], [1730..=1780]), "{with_body:?}");
        assert_eq!((&bad.1[..], bad.2), (&[][..], true));
        assert_eq!((&after.1[..], after.2), (&[][..], false));
        // From 1 m up to 1.7 m, of the round front at most the half, 69 l, at least the middle 110°, 21 l: the rest grazes.
        let [size] = sized[..] else { panic!("{sized:?}") };
        assert!((21..=69).contains(&size.volume_l) && (165..=171).contains(&size.top_cm), "{size:?}");
        assert_eq!(counts.good.load(Ordering::Relaxed), 102);
        assert_eq!(counts.bad.load(Ordering::Relaxed), 1);
    }

    #[test]
    fn the_background_needs_thirty_good_frames() {
        let frame = || Some(render(&SMALL, &[], 0));
        let mut told = 0;
        let mut few = clip((0..35).map(|n| if n % 6 == 0 { None } else { frame() }).collect());
        assert_eq!(learn(&mut *few, &mut |_| told += 1), Err(TooFew { good: 29 }));
        assert_eq!(told, 6);
        let mut enough = clip((0..31).map(|_| frame()).collect());
        assert!(learn(&mut *enough, &mut |_| {}).is_ok());
        assert!(enough.next_frame().is_some());
    }

    #[test]
    fn a_single_request_takes_no_frame_and_a_bad_one_is_not_seen() {
        let mut source = source(vec![Some(render(&SMALL, &[], 0)), None]);
        let at = Revolution { start_us: 1_000_000, period_us: 200_000, earliest_us: 0 };
        assert!(source.latest(at).unwrap().ranges_mm.iter().all(|&range_mm| range_mm == NOT_SEEN));
        let scan = source.scan(at).unwrap();
        assert!(scan.ranges_mm.iter().all(|&range_mm| range_mm > 3900));
        // Step 27 of 287 of a turn of 200 ms.
        assert_eq!(1_000_000 - scan.start_us, 18_815);
        // A frame that cannot be read is not seen in any bearing, whatever stood there before.
        assert!(source.scan(at).unwrap().ranges_mm.iter().all(|&range_mm| range_mm == NOT_SEEN));
        assert!(source.scan(at).is_none());
    }

    #[test]
    fn after_the_end_nothing_is_seen() {
        let mut source = source(vec![Some(render(&SMALL, &[], 0))]);
        let at = Revolution { start_us: 1_000_000, period_us: 200_000, earliest_us: 0 };
        assert!(source.scan(at).is_some() && source.latest(at).unwrap().ranges_mm[0] > 3900);
        assert!(source.scan(at).is_none());
        assert!(source.latest(at).unwrap().ranges_mm.iter().all(|&range_mm| range_mm == NOT_SEEN));
    }

    #[test]
    fn a_bad_frame_at_the_end_of_learning_hides_no_open_door() {
        // Nothing returns; sixty scans are learned from, and every second frame cannot be read.
        let nothing = crate::background::still(SMALL.width, vec![0; SMALL.width * SMALL.height]);
        let body = Body { x_m: 2.0, y_m: 0.0, radius_m: 0.25, top_m: 1.7 };
        let shown = |bodies: &[Body]| {
            let frame = render(&SMALL, bodies, 0);
            let mut values: Vec<u16> = frame
                .depth_mm()
                .iter()
                .map(|value_mm| if *value_mm < 2500 { *value_mm } else { 0 })
                .collect();
            // Some of the floor is always seen.
            values[SMALL.width * SMALL.height - 1] = 1900;
            Some(Frame::new(SMALL.width, SMALL.height, values, 0).unwrap())
        };
        let mut frames: Vec<_> = (0..130).map(|n| if n % 2 == 1 { None } else { shown(&[]) }).collect();
        frames.extend([shown(&[body])]);
        let source = FanSource::new(clip(frames), SMALL, nothing, Box::new(|_| {}));
        let config = source.config();
        let settings = Settings::of(&SensorModel::of(config.model.model_text), 10_000);
        let mut chain = Chain::new(Box::new(source), config, settings);
        let mut found = 0;
        while let Some(scan) = chain.next_scan().unwrap() {
            found = scan.judgement.candidates().len();
        }
        assert_eq!(found, 1);
    }
}
