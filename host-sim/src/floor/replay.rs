//! Frames of a SensFloor through everything a device and a host make of them, in memory, on the frames' own time.
//!
//! ```text
//!   frames ─▶ bytes ─▶ device::tiles ─▶ device::Module ══ datagrams ══▶ SiteTracker ─▶ tracks, a line every 0.1 s
//!                 ◀─ requests ─┘                ◀══ subscriptions ══════════┘
//! ```

use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddrV4;
use std::sync::Arc;

use kehai::device::tiles::Tiles;
use kehai::device::{About, Module, Settings};
use kehai::floor::sensfloor::{FRAME_LEN, Frame, Layout, PITCH_MM};
use kehai::link::{Dropped, Lane, Outbox};
use kehai::wire::{Counter, ModuleId};
use kehai_emulator::recording::floor::{FloorRecording, StampedFrame};
use kehai_emulator::sensfloor::bytes;
use kehai_tracking::jsonl::TracksLine;
use kehai_tracking::session::subscription::Subscription;
use kehai_tracking::site::Site;
use kehai_tracking::site_tracker::SiteTracker;
use kehai_tracking::tracker::Selected;

/// Between two lines of tracks, µs.
pub const LINE_US: u64 = 100_000;

/// Before the first frame the host asks what device this is, µs; and nothing comes after the last one for so long.
const MARGIN_US: u64 = 1_000_000;

/// Name of the floor and of its zone.
const NAME: &str = "floor";

const DEVICE: ModuleId = ModuleId([2, 0, 0, 0, 0xf1, 0]);

/// What has been sent.
#[derive(Default)]
struct Sent(Vec<Vec<u8>>);

impl Outbox for Sent {
    fn try_send_to(&mut self, _: Lane, _: SocketAddrV4, datagram: &[u8]) -> Result<(), Dropped> {
        self.0.push(datagram.to_vec());
        Ok(())
    }

    fn is_empty(&mut self, _: Lane) -> bool {
        true
    }

    fn reopen(&mut self, _: Lane) {}
}

/// A device beside a SensFloor, and a host that follows the people on it.
pub struct FloorChain {
    tiles: Tiles,
    module: Box<Module<1>>,
    sent: Sent,
    site_tracker: SiteTracker,
    now_us: u64,
    /// Readings that reached the host.
    readings: u64,
}

impl FloorChain {
    /// Both switched on at time 0.
    ///
    /// # Errors
    /// A site of such a floor cannot be.
    pub fn new(layout: &Layout) -> Result<Self, String> {
        let about = About {
            module: DEVICE,
            secret: [7; 16],
            firmware: env!("CARGO_PKG_VERSION"),
            build: "",
            board: "replay",
            watchdog_reset: false,
        };
        let mut module = Box::new(Module::new(about));
        module.begin(1, Settings { tiles: Some(*layout), ..Settings::new() });
        module.rename(NAME);
        let mut site_tracker = SiteTracker::new(&Arc::new(site(layout)?), Selected::default());
        site_tracker.sessions_mut().meet(DEVICE, &Subscription::default(), 0);
        let (tiles, sent) = (Tiles::new(), Sent::default());
        Ok(Self { tiles, module, sent, site_tracker, now_us: 0, readings: 0 })
    }

    /// Bytes of the floor's line at `at_us`.
    pub fn receive(&mut self, bytes: &[u8], at_us: u64) {
        self.tiles.receive(bytes, at_us);
    }

    /// Lets time pass; the requests to the floor meanwhile, and when each was sent.
    pub fn until(&mut self, at_us: u64) -> Vec<(u64, [u8; FRAME_LEN])> {
        let mut requests = Vec::new();
        loop {
            let host_us =
                self.site_tracker.sessions().get(DEVICE).map_or(u64::MAX, |session| session.next_us());
            let module_us = self.module.poll(self.now_us, &mut self.sent);
            self.deliver();
            // Nothing is due more often than each ms, whatever it says.
            let next_us = host_us.min(module_us).min(self.tiles.next_us()).max(self.now_us + 1000);
            if next_us > at_us {
                self.now_us = self.now_us.max(at_us);
                return requests;
            }
            self.now_us = next_us;
            let request = self.module.tiles(&mut self.tiles, next_us, &mut self.sent);
            requests.extend(request.map(|request| (next_us, request)));
            self.deliver();
        }
    }

    /// Everything that is under way arrives.
    fn deliver(&mut self) {
        loop {
            let mut asked = Vec::new();
            if let Some(session) = self.site_tracker.sessions_mut().get_mut(DEVICE) {
                session.poll(self.now_us, |datagram| asked.push(datagram.to_vec()));
            }
            let host = SocketAddrV4::new([127, 0, 0, 1].into(), 4040);
            for mut datagram in asked {
                self.module.receive(host, &mut datagram, self.now_us, &mut self.sent);
            }
            if self.sent.0.is_empty() {
                return;
            }
            let before = self.site_tracker.sessions().get(DEVICE).map_or(0, |session| session.reports());
            for datagram in std::mem::take(&mut self.sent.0) {
                self.site_tracker.receive(&datagram, self.now_us);
            }
            let after = self.site_tracker.sessions().get(DEVICE).map_or(0, |session| session.reports());
            self.readings += after - before;
        }
    }

    /// The tracks at `at_us`, a time that was reached by [`until`](Self::until).
    pub fn line(&mut self, at_us: u64) -> TracksLine {
        self.site_tracker.line(at_us as f64 * 1e-6)
    }
}

/// The site that is this floor and nothing else: its corner is the origin.
fn site(layout: &Layout) -> Result<Site, String> {
    let (columns, rows) = layout.panels();
    let pitch_m = f64::from(PITCH_MM) / 1000.0;
    let (width_m, depth_m) = (f64::from(columns) * pitch_m, f64::from(rows) * pitch_m);
    let text = format!(
        "[[floor]]\nname = \"{NAME}\"\nx = 0\ny = 0\ncolumns = {columns}\nrows = {rows}\npitch_m = {pitch_m}\n\
         [[zone]]\nname = \"{NAME}\"\npolygon = [[0, 0], [{width_m}, 0], [{width_m}, {depth_m}], [0, {depth_m}]]\n\
         count = true\n"
    );
    Site::parse("floor", &text).map_err(|error| error.to_string())
}

/// The smallest floor that has all tiles of the group that speaks most.
///
/// # Errors
/// It has more tiles than a floor may have.
pub fn layout_of(frames: &[StampedFrame]) -> Result<Layout, String> {
    let mut groups: BTreeMap<u16, (usize, BTreeSet<(u8, u8)>)> = BTreeMap::new();
    for (_, Frame { group, tile, .. }) in frames {
        let (count, tiles) = groups.entry(*group).or_default();
        *count += 1;
        tiles.insert(*tile);
    }
    let (group, (_, tiles)) = groups.into_iter().max_by_key(|(_, (count, _))| *count).ok_or("no frame")?;
    let range = |of: fn(&(u8, u8)) -> u8| {
        let least = tiles.iter().map(of).min().unwrap_or(0);
        (least, tiles.iter().map(of).max().unwrap_or(0) - least)
    };
    let ((x, columns), (y, rows)) = (range(|tile| tile.0), range(|tile| tile.1));
    let (columns, rows) = (columns.saturating_add(1), rows.saturating_add(1));
    Layout::new(group, (x, y), (columns, rows)).ok_or_else(|| {
        format!(
            "{columns} × {rows} tiles of group {group} from ({x}, {y}) on are too large a floor: at most 64; say which with \
             --tiles GROUP,X,Y,COLUMNS,ROWS"
        )
    })
}

/// What a recording shows.
#[derive(Clone, Debug)]
pub struct FloorReplay {
    /// A line every 0.1 s, on the recording's time.
    pub lines: Vec<TracksLine>,
    /// Readings of the device that reached the host.
    pub readings: u64,
    /// Frames that cannot be: a value of 253, with which frames begin.
    pub damaged: u32,
    /// Frames of another group, or of tiles beside the floor.
    pub foreign: u32,
    /// Panels that did not work at the end; at most [`FAULTY`](kehai::floor::FAULTY), behind which nothing is known.
    pub faulty: usize,
}

impl FloorReplay {
    /// Plays a recording.
    ///
    /// # Errors
    /// [`FloorChain::new`]'s.
    pub fn run(recording: &FloorRecording, layout: &Layout) -> Result<Self, String> {
        let mut chain = FloorChain::new(layout)?;
        let begin_us = recording.frames.first().map_or(0, |(stamp_us, _)| *stamp_us);
        let end_us = recording.frames.last().map_or(0, |(stamp_us, _)| *stamp_us) - begin_us + 2 * MARGIN_US;
        let mut frames = recording.frames.iter().peekable();
        let mut lines = Vec::new();
        for line_us in (MARGIN_US..end_us).step_by(LINE_US as usize) {
            while let Some((stamp_us, frame)) =
                frames.next_if(|(stamp_us, _)| stamp_us - begin_us + MARGIN_US <= line_us)
            {
                let at_us = stamp_us - begin_us + MARGIN_US;
                // A recording answers no requests.
                let _ = chain.until(at_us);
                chain.receive(&bytes(frame), at_us);
            }
            let _ = chain.until(line_us);
            let mut line = chain.line(line_us);
            line.t = (line_us - MARGIN_US + begin_us) as f64 * 1e-6;
            lines.push(line);
        }
        let count = |counter| chain.module.counters().get(counter);
        let (damaged, foreign) = (count(Counter::ScansDamaged), count(Counter::SensorUnexpected));
        let faulty =
            chain.site_tracker.floors().iter().map(|floor| floor.stuck.len() + floor.dead.len()).sum();
        Ok(Self { lines, readings: chain.readings, damaged, foreign, faulty })
    }
}
