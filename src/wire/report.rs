//! What a scan showed: one report for every scan, also when nothing was found.
//!
//! ```text
//!    0  sequence            u32     scans reported, or that would have been with no subscriber
//!    4  setup               u16     steps with any change of sensor, geometry or measurement: see info
//!    6  background version  u16     what the scan was judged with; 0: with nothing
//!    8  stamp               u64     step 0 on the module's clock, µs since boot
//!   16  sensor stamp        u64     the same on the sensor's, ms, its 24 bits unwrapped
//!   24  uncertainty         u32     of the stamp, µs
//!   28  lost scans          u32     lost before they could be reported, since boot
//!   32  candidates          list, 24 at most: 22 to 46 bytes each
//!       unseen spans        list, 28 at most: 7 bytes each
//!       sizes               list, one for each candidate: 3 bytes each; missing where a device measures none
//!
//!  candidate                                   unseen span
//!    0  first step      u16                      0  first step  u16
//!    2  last step       u16                      2  beams       u16
//!    4  nearest step    u16                      4  near range  u16, mm; 65535: none
//!    6  valid beams     u16                      6  reason      u8: 0 no return, 1 too short,
//!    8  first range     u16, mm                                     2 overflow
//!   10  middle range    u16, mm
//!   12  last range      u16, mm                neck
//!   14  nearest range   u16, mm                  0  step        u16
//!   16  static for      u16, 0.1 s               2  depth       u8, 4 mm
//!   18  beyond first    i8, 20 mm; 127: nothing returned
//!   19  beyond last     i8, 20 mm; 127: nothing returned
//!   20  ends            low nibble first, high nibble last: 0 free, 1 body, 2 wall, 3 view, 4 neck
//!   21  counts          bits 0-3 contour points, 4-5 necks, 6 touches, 7 narrow
//!   22  contour         u8 each, 4 mm beyond the nearest range
//!       necks           3 bytes each
//!                                             size
//!                                              0  volume      u16, litres
//!                                              2  top         u8, cm above the floor; 0: neither is known
//! ```
//!
//! All fixed and little endian. A torso at 2 m is 29 bytes: 7 points, no neck.
//!
//! Of a candidate everything arrives as it was but two kinds of numbers: the range step beyond an end
//! ([`BEYOND_UNIT_MM`], −2.56 to 2.52 m) and the depth of a neck ([`NECK_UNIT_MM`], up to 1.02 m), rounded and
//! limited. Neither enters a position: [`centre`](crate::centre::centre) gives the same bits on both sides.
//! Unseen spans arrive as they were. An end or a reason of a newer peer reads as `View`
//! or `Overflow`: nothing is taken from either.

use super::codec::{Item, List, Malformed, Reader, TooLong, Writer, count_bytes};
use super::{DATAGRAM_MAX, HEADER_LEN};
use crate::candidate::{
    CANDIDATES, CONTOUR_POINTS_WIDE, CONTOUR_UNIT_MM, Candidate, End, EndKind, NECKS, Neck,
};
use crate::pipeline::Judgement;
use crate::scan::{NO_RETURN_MM, ScanTime};
use crate::unseen::{UNSEEN_SPANS, UnseenReason, UnseenSpan};
use serde::{Deserialize, Serialize};

/// Unit of the range step beyond an end, mm: a tenth of an arm's length.
pub const BEYOND_UNIT_MM: i16 = 20;

/// Unit of the depth of a neck, mm: that of the contour it is seen in.
pub const NECK_UNIT_MM: u16 = CONTOUR_UNIT_MM;

/// Range step beyond an end where nothing returned.
const NOTHING_BEYOND: i8 = i8::MAX;

/// Most candidates of a report with sizes: a report with more of them has none. So it is shorter than the longest without.
pub const SIZED_MAX: usize = 16;

/// Bytes of a report's head.
pub(super) const HEAD_LEN: usize = 4 + 2 + 2 + 8 + 8 + 4 + 4;

/// Most bytes of a report's message. With the header, and so with room for authentication, it fits a
/// datagram:
///
/// | part | bytes |
/// |---|---|
/// | header, 25 of it for authentication | 40 |
/// | fixed fields | 32 |
/// | 24 candidates of 22 + 15 + 3 · 3 | 1 + 1104 |
/// | 28 unseen spans of 7 | 1 + 196 |
/// | sum | 1374 |
/// | left for fields to come | 26 |
pub const REPORT_MAX: usize = HEAD_LEN
    + count_bytes(CANDIDATES)
    + CANDIDATES * Candidate::MAX
    + count_bytes(UNSEEN_SPANS)
    + UNSEEN_SPANS * UnseenSpan::MAX;

const _: () = assert!(HEADER_LEN + REPORT_MAX <= DATAGRAM_MAX);
const _: () = assert!(HEADER_LEN + REPORT_MAX == 1374, "the table above");
const _: () = assert!(
    SIZED_MAX * (Candidate::MAX + Size::MAX) + count_bytes(SIZED_MAX) <= CANDIDATES * Candidate::MAX,
    "with sizes a report is no longer than without"
);
const _: () = assert!(CONTOUR_POINTS_WIDE < 16 && NECKS < 4, "both counts fit their bits");

/// A report, to be sent or as received.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Report<'a> {
    /// What is known of the scan as a whole.
    pub head: ReportHead,
    /// What stood out from the background, in scan order.
    pub candidates: List<'a, Candidate>,
    /// Where nothing can be said.
    pub unseen: List<'a, UnseenSpan>,
    /// How large each candidate is, in the same order; empty where a device measures no sizes.
    pub sizes: List<'a, Size>,
}

/// How large what is seen of a body is, by a device that measures more than a plane.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Size {
    /// Volume of the part that is seen, litres; 65 535: that or more.
    pub volume_l: u16,
    /// Its highest point above the floor, cm; 255: that or more; 0: neither is known.
    pub top_cm: u8,
}

impl Size {
    /// Nothing is known of this candidate's size.
    pub const UNKNOWN: Self = Self { volume_l: 0, top_cm: 0 };

    /// Whether it says anything.
    #[must_use]
    pub const fn is_known(self) -> bool {
        self.top_cm != 0
    }
}

/// The fixed part of a report.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ReportHead {
    /// Counts the reports, also those made while there was no subscriber.
    #[serde(with = "postcard::fixint::le")]
    pub sequence: u32,
    /// Names the sensor, geometry and measurement that [`Info`](super::Info) describes.
    #[serde(with = "postcard::fixint::le")]
    pub setup: u16,
    /// Background version the scan was judged with; 0: none.
    #[serde(with = "postcard::fixint::le")]
    pub background_version: u16,
    /// When step 0 passed, µs since boot.
    #[serde(with = "postcard::fixint::le")]
    pub stamp_us: u64,
    /// The same moment by the sensor's clock, ms, unwrapped.
    #[serde(with = "postcard::fixint::le")]
    pub sensor_ms: u64,
    /// How far `stamp_us` may be off, µs.
    #[serde(with = "postcard::fixint::le")]
    pub uncertainty_us: u32,
    /// Scans lost before they could be reported, since boot.
    #[serde(with = "postcard::fixint::le")]
    pub lost_scans: u32,
}

impl ReportHead {
    /// When the scan was taken.
    #[must_use]
    pub const fn time(&self) -> ScanTime {
        let &Self { sensor_ms, stamp_us, uncertainty_us, .. } = self;
        ScanTime { sensor_ms, stamp_us, uncertainty_us }
    }
}

impl<'a> Report<'a> {
    /// The report of a judged scan.
    #[must_use]
    pub fn of(judgement: &'a Judgement, setup: u16, lost_scans: u32) -> Self {
        let ScanTime { sensor_ms, stamp_us, uncertainty_us } = judgement.time;
        let &Judgement { sequence, background_version, .. } = judgement;
        Self {
            head: ReportHead {
                sequence,
                setup,
                background_version,
                stamp_us,
                sensor_ms,
                uncertainty_us,
                lost_scans,
            },
            candidates: List::new(judgement.candidates()),
            unseen: List::new(judgement.unseen()),
            sizes: List::new(&[]),
        }
    }

    pub(super) fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put(&self.head)?;
        self.candidates.write(writer)?;
        self.unseen.write(writer)?;
        // A device without sizes sends the bytes that it sent before there were any.
        if self.sizes.is_empty() { Ok(()) } else { self.sizes.write(writer) }
    }

    pub(super) fn read(reader: &mut Reader<'a>) -> Result<Self, Malformed> {
        let (head, candidates, unseen) = (reader.required()?, reader.list()?, reader.list()?);
        let sizes: List<'a, Size> = reader.added(Reader::list)?;
        let fits = sizes.is_empty() || sizes.len() == candidates.len() && sizes.len() <= SIZED_MAX;
        if fits { Ok(Self { head, candidates, unseen, sizes }) } else { Err(Malformed) }
    }
}

impl Item for Candidate {
    const MAX: usize = 22 + CONTOUR_POINTS_WIDE + 3 * NECKS;

    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put_u16(self.first_step)?;
        writer.put_u16(self.last_step)?;
        writer.put_u16(self.near_step)?;
        writer.put_u16(self.beams)?;
        writer.put_u16(self.first_mm)?;
        writer.put_u16(self.mid_mm)?;
        writer.put_u16(self.last_mm)?;
        writer.put_u16(self.near_mm)?;
        writer.put_u16(self.static_ds)?;
        writer.put(&beyond(self.first_end.step_mm))?;
        writer.put(&beyond(self.last_end.step_mm))?;
        writer.put(&(end_code(self.first_end.kind) | end_code(self.last_end.kind) << 4))?;
        let counts = (self.contour.len() & 15) | (self.necks.len() & 3) << 4;
        writer.put(&(counts as u8 | u8::from(self.touches) << 6 | u8::from(self.narrow) << 7))?;
        self.contour.iter().try_for_each(|point| writer.put(point))?;
        self.necks.iter().try_for_each(|neck| {
            let depth = (neck.depth_mm.saturating_add(NECK_UNIT_MM / 2) / NECK_UNIT_MM).min(255);
            writer.put_u16(neck.step)?;
            writer.put(&(depth as u8))
        })
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let mut candidate = Self {
            first_step: reader.required_u16()?,
            last_step: reader.required_u16()?,
            near_step: reader.required_u16()?,
            beams: reader.required_u16()?,
            first_mm: reader.required_u16()?,
            mid_mm: reader.required_u16()?,
            last_mm: reader.required_u16()?,
            near_mm: reader.required_u16()?,
            static_ds: reader.required_u16()?,
            ..Self::default()
        };
        let (first_beyond, last_beyond): (i8, i8) = (reader.required()?, reader.required()?);
        let (ends, counts): (u8, u8) = (reader.required()?, reader.required()?);
        candidate.first_end = End { kind: end_kind(ends & 15), step_mm: step_mm(first_beyond) };
        candidate.last_end = End { kind: end_kind(ends >> 4), step_mm: step_mm(last_beyond) };
        candidate.touches = counts & 1 << 6 != 0;
        candidate.narrow = counts & 1 << 7 != 0;
        for _ in 0..counts & 15 {
            candidate.contour.push(reader.required()?).map_err(|_| Malformed)?;
        }
        for _ in 0..counts >> 4 & 3 {
            let (step, depth): (_, u8) = (reader.required_u16()?, reader.required()?);
            let neck = Neck { step, depth_mm: u16::from(depth) * NECK_UNIT_MM };
            candidate.necks.push(neck).map_err(|_| Malformed)?;
        }
        Ok(candidate)
    }
}

impl Item for UnseenSpan {
    const MAX: usize = 7;

    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put_u16(self.first_step)?;
        writer.put_u16(self.beams)?;
        writer.put_u16(self.near_mm.unwrap_or(NO_RETURN_MM))?;
        writer.put(&match self.reason {
            UnseenReason::NoReturn => 0u8,
            UnseenReason::TooShort => 1,
            UnseenReason::Overflow => 2,
        })
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        Ok(Self {
            first_step: reader.required_u16()?,
            beams: reader.required_u16()?,
            near_mm: Some(reader.required_u16()?).filter(|&range_mm| range_mm != NO_RETURN_MM),
            reason: match reader.required()? {
                0u8 => UnseenReason::NoReturn,
                1 => UnseenReason::TooShort,
                _ => UnseenReason::Overflow,
            },
        })
    }
}

impl Item for Size {
    const MAX: usize = 3;

    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put_u16(self.volume_l)?;
        writer.put(&self.top_cm)
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        Ok(Self { volume_l: reader.required_u16()?, top_cm: reader.required()? })
    }
}

const fn end_code(kind: EndKind) -> u8 {
    match kind {
        EndKind::Free => 0,
        EndKind::Body => 1,
        EndKind::Wall => 2,
        EndKind::View => 3,
        EndKind::Neck => 4,
    }
}

const fn end_kind(code: u8) -> EndKind {
    match code {
        0 => EndKind::Free,
        1 => EndKind::Body,
        2 => EndKind::Wall,
        4 => EndKind::Neck,
        _ => EndKind::View,
    }
}

/// In [`BEYOND_UNIT_MM`], rounded away from zero at a half.
fn beyond(step_mm: i16) -> i8 {
    if step_mm == i16::MAX {
        return NOTHING_BEYOND;
    }
    let half_mm = BEYOND_UNIT_MM / 2 * step_mm.signum();
    let units = step_mm.saturating_add(half_mm) / BEYOND_UNIT_MM;
    units.clamp(i8::MIN.into(), i16::from(NOTHING_BEYOND - 1)) as i8
}

fn step_mm(beyond: i8) -> i16 {
    if beyond == NOTHING_BEYOND { i16::MAX } else { i16::from(beyond) * BEYOND_UNIT_MM }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_beyond_an_end_keeps_its_sign_and_its_size_within_half_a_unit() {
        for exact_mm in i16::MIN..i16::MAX {
            let sent_mm = step_mm(beyond(exact_mm));
            let limited_mm = exact_mm.clamp(-2560, 2520);
            assert!((sent_mm - limited_mm).abs() <= BEYOND_UNIT_MM / 2, "{exact_mm} became {sent_mm}");
        }
        assert_eq!(step_mm(beyond(i16::MAX)), i16::MAX);
    }

    #[test]
    fn the_largest_candidate_and_span_have_the_stated_size() {
        let mut candidate = Candidate::default();
        while candidate.contour.push(255).is_ok() {}
        while candidate.necks.push(Neck { step: u16::MAX, depth_mm: u16::MAX }).is_ok() {}
        let mut room = [0; 100];
        let mut writer = Writer::new(&mut room);
        candidate.write(&mut writer).unwrap();
        assert_eq!(writer.finish(), Candidate::MAX);
        let span = UnseenSpan { first_step: 9, beams: 1, reason: UnseenReason::Overflow, near_mm: Some(1) };
        let mut writer = Writer::new(&mut room);
        span.write(&mut writer).unwrap();
        assert_eq!(writer.finish(), UnseenSpan::MAX);
    }

    #[test]
    fn ends_and_reasons_of_a_newer_peer_say_nothing() {
        let mut bytes = [0; 22];
        bytes[20] = 0xf5;
        let candidate = Candidate::read(&mut Reader::new(&bytes)).unwrap();
        assert_eq!((candidate.first_end.kind, candidate.last_end.kind), (EndKind::View, EndKind::View));
        let span = UnseenSpan::read(&mut Reader::new(&[0, 0, 1, 0, 0, 0, 77])).unwrap();
        assert_eq!(span.reason, UnseenReason::Overflow);
    }
}
