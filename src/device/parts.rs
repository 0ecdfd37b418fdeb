//! Background profiles and raw scans, which do not fit a datagram.
//!
//! ```text
//!   report, part 0 of profile to A │ report, part 1 to A │ report, part 0 to B │ …   one part a report
//!   report, raw part 0, raw part 1 │ report, raw part 0 …                             all of each scan
//! ```

use core::net::SocketAddrV4;

use super::Module;
use crate::background::BeamProfile;
use crate::link::Outbox;
use crate::scan::{Geometry, Scan, ScanTime};
use crate::wire::{
    Counter, List, Message, PROFILE_PART_BEAMS, PartHead, ProfilePart, RAW_PART_BEAMS, RawPart, Refusal,
};
use heapless::Vec;

/// The parts that are sent: of the newest raw scan, and of the background profile.
#[derive(Clone, Debug)]
pub(super) struct Parts<const BEAMS: usize> {
    raw: RawScan<BEAMS>,
    /// Version of the background whose parts are sent.
    profile_version: u16,
    /// Place of the subscriber that was sent a part last.
    profile_turn: u8,
}

impl<const BEAMS: usize> Parts<BEAMS> {
    pub(super) const fn new() -> Self {
        Self { raw: RawScan::new(), profile_version: 0, profile_turn: 0 }
    }
}

/// The newest scan that was sent raw: its parts can be asked for until the next one.
#[derive(Clone, Debug)]
struct RawScan<const BEAMS: usize> {
    object: u32,
    setup: u16,
    time: ScanTime,
    geometry: Option<Geometry>,
    ranges_mm: Vec<u16, BEAMS>,
}

impl<const BEAMS: usize> RawScan<BEAMS> {
    const fn new() -> Self {
        let time = ScanTime { sensor_ms: 0, stamp_us: 0, uncertainty_us: 0 };
        Self { object: 0, setup: 0, time, geometry: None, ranges_mm: Vec::new() }
    }

    fn set(&mut self, scan: &Scan<'_>, object: u32, setup: u16) {
        (self.object, self.setup, self.time) = (object, setup, scan.time);
        self.geometry = Some(*scan.geometry);
        self.ranges_mm.clear();
        for &range_mm in scan.ranges_mm {
            if self.ranges_mm.push(range_mm).is_err() {
                break;
            }
        }
    }

    fn parts(&self) -> u8 {
        self.ranges_mm.len().div_ceil(RAW_PART_BEAMS).min(32) as u8
    }

    fn part(&self, part: u8) -> Option<RawPart<'_>> {
        let first = usize::from(part) * RAW_PART_BEAMS;
        let rest = self.ranges_mm.get(first..)?;
        let ranges_mm = rest.get(..RAW_PART_BEAMS).unwrap_or(rest);
        let first_step = self.geometry.as_ref()?.step(first as u16);
        let head = PartHead { object: self.object, part, parts: self.parts(), first_step, setup: self.setup };
        Some(RawPart { head, time: self.time, ranges_mm: List::new(ranges_mm) })
    }
}

/// The numbers of the parts that `wanted` asks for, bit i for part i, 0 for all `parts`.
fn numbers(wanted: u32, parts: u8) -> impl Iterator<Item = u8> {
    let wanted = wants(wanted, parts);
    (0..parts.min(32)).filter(move |&part| wanted >> part & 1 != 0)
}

const fn wants(wanted: u32, parts: u8) -> u32 {
    let all = if parts >= 32 { u32::MAX } else { (1 << parts) - 1 };
    if wanted == 0 { all } else { wanted & all }
}

impl<const BEAMS: usize> Module<BEAMS> {
    fn profile_parts(&self) -> u8 {
        self.pipeline.background().profile().len().div_ceil(PROFILE_PART_BEAMS).min(32) as u8
    }

    /// Notes which parts of the profile the subscriber at `at` is to get.
    pub(super) fn want_profile(&mut self, at: SocketAddrV4, version: u16, parts: u32) -> Result<(), Refusal> {
        let background = self.pipeline.background();
        if !background.is_known() {
            return Err(Refusal::NoBackground);
        }
        if version != 0 && version != background.version() {
            return Err(Refusal::Superseded);
        }
        self.drop_old_profile();
        let parts = wants(parts, self.profile_parts());
        let subscriber = self.subscribers.of(at).ok_or(Refusal::BadCookie)?;
        subscriber.profile_parts |= parts;
        Ok(())
    }

    /// Parts of another version are of no use: subscribers learn of the new version from the reports.
    fn drop_old_profile(&mut self) -> u16 {
        let version = self.pipeline.background().version();
        if version != self.parts.profile_version {
            self.parts.profile_version = version;
            self.subscribers.iter_mut().for_each(|subscriber| subscriber.profile_parts = 0);
        }
        version
    }

    /// Sends one part of the profile to one of the subscribers that wait for it, in turn.
    pub(super) fn send_profile_part(&mut self, now_us: u64, out: &mut impl Outbox) {
        let version = self.drop_old_profile();
        let last = self.parts.profile_turn;
        let waiting = || {
            let places = self.subscribers.places().zip(0u8..);
            places.filter_map(|(subscriber, place)| {
                Some((subscriber.filter(|one| one.profile_parts != 0)?, place))
            })
        };
        let Some((subscriber, place)) =
            waiting().find(|(_, place)| *place > last).or_else(|| waiting().next())
        else {
            return;
        };
        let (at, wanted) = (subscriber.at, subscriber.profile_parts);
        self.parts.profile_turn = place;
        let part = wanted.trailing_zeros().min(31) as u8;
        if let Some(subscriber) = self.subscribers.of(at) {
            subscriber.profile_parts &= !(1 << part);
        }
        let Some(geometry) = self.setup.geometry() else { return };
        let first = usize::from(part) * PROFILE_PART_BEAMS;
        let mut beams = Vec::<BeamProfile, PROFILE_PART_BEAMS>::new();
        for beam in self.pipeline.background().profile().skip(first).take(PROFILE_PART_BEAMS) {
            let _ = beams.push(beam);
        }
        let head = PartHead {
            object: version.into(),
            part,
            parts: self.profile_parts(),
            first_step: geometry.step(first as u16),
            setup: self.setup.number(),
        };
        let message = Message::ProfilePart(ProfilePart { head, beams: List::new(&beams) });
        let encoded = message.encode(self.identity, &mut self.datagram);
        let datagram = encoded.ok().and_then(|length| self.datagram.get(..length)).unwrap_or(&[]);
        let dropped = (&mut self.counters, Counter::PartsDropped);
        self.subscribers.send(
            datagram,
            |subscriber| subscriber.at == at,
            dropped,
            now_us,
            &mut self.guard.over(out),
        );
    }

    /// Sends the scan to the subscribers to raw scans.
    pub(super) fn send_raw(&mut self, scan: &Scan<'_>, now_us: u64, out: &mut impl Outbox) {
        if self.subscribers.iter_mut().all(|subscriber| subscriber.raw_until_us <= now_us) {
            return;
        }
        self.parts.raw.set(scan, self.pipeline.judgement().sequence, self.setup.number());
        self.send_raw_parts(0, None, now_us, out);
    }

    /// Sends parts of the newest raw scan once more.
    pub(super) fn raw_again(
        &mut self,
        at: SocketAddrV4,
        (object, parts): (u32, u32),
        now_us: u64,
        out: &mut impl Outbox,
    ) -> Result<(), Refusal> {
        self.subscribers.of(at).ok_or(Refusal::BadCookie)?;
        if object != self.parts.raw.object || self.parts.raw.ranges_mm.is_empty() {
            return Err(Refusal::Superseded);
        }
        self.send_raw_parts(parts, Some(at), now_us, out);
        Ok(())
    }

    fn send_raw_parts(&mut self, wanted: u32, to: Option<SocketAddrV4>, now_us: u64, out: &mut impl Outbox) {
        for part in numbers(wanted, self.parts.raw.parts()) {
            let Some(part) = self.parts.raw.part(part) else { continue };
            let encoded = Message::RawPart(part).encode(self.identity, &mut self.datagram);
            let datagram = encoded.ok().and_then(|length| self.datagram.get(..length)).unwrap_or(&[]);
            let dropped = (&mut self.counters, Counter::PartsDropped);
            self.subscribers.send(
                datagram,
                |subscriber| match to {
                    Some(at) => subscriber.at == at,
                    None => subscriber.raw_until_us > now_us,
                },
                dropped,
                now_us,
                &mut self.guard.over(out),
            );
        }
    }
}
