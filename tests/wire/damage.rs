//! A message arrives as it was sent; damaged and foreign bytes are refused.

use crate::samples::*;
use kehai::candidate::{CANDIDATES, CONTOUR_POINTS_WIDE, Candidate, End, EndKind, NECKS, Neck};
use kehai::centre::{Estimator, centre};
use kehai::scan::{Geometry, GeometryParts};
use kehai::unseen::{UNSEEN_SPANS, UnseenReason, UnseenSpan};
use kehai::wire::{
    BEYOND_UNIT_MM, DATAGRAM_MAX, HEADER_LEN, Incoming, List, Message, NECK_UNIT_MM, Refusal, Report,
    SIZED_MAX, Size, Unreadable,
};
use proptest::collection::vec;
use proptest::prelude::*;

#[test]
fn a_message_that_is_cut_off_never_reads_as_a_shorter_one() {
    for bytes in samples() {
        for length in 0..bytes.len() {
            // What was added later may be missing as a whole: of a report its sizes, from their number on.
            let added = match Message::decode(&bytes[..length]) {
                Ok((_, Message::Health(_))) => true,
                Ok((_, Message::Report(_))) => length == bytes.len() - 1 - 2 * 3,
                _ => false,
            };
            assert!(added || Message::decode(&bytes[..length]).is_err(), "{length} of {}", bytes.len());
        }
    }
    for one in REQUESTS {
        let bytes = request(one);
        for length in 0..bytes.len() {
            let result = Incoming::open(&bytes[..length]).map(|incoming| incoming.request(MODULE));
            assert!(
                matches!(result, Err(Unreadable::TooShort) | Ok(Err(Refusal::Malformed))),
                "{one:?} {length}"
            );
        }
    }
}

fn any_end() -> impl Strategy<Value = End> {
    let kinds = [EndKind::Free, EndKind::Body, EndKind::Wall, EndKind::View, EndKind::Neck];
    (proptest::sample::select(kinds.to_vec()), any::<i16>()).prop_map(|(kind, step_mm)| End { kind, step_mm })
}

fn any_candidate() -> impl Strategy<Value = Candidate> {
    let steps = (0..725u16, 0..200u16, any::<u16>(), any::<u16>());
    let ranges = (0..6000u16, 0..6000u16, 0..6000u16, any::<u16>());
    let neck = (any::<u16>(), any::<u16>()).prop_map(|(step, depth_mm)| Neck { step, depth_mm });
    let shape = (any_end(), any_end(), vec(any::<u8>(), 0..=CONTOUR_POINTS_WIDE), vec(neck, 0..=NECKS));
    (steps, ranges, shape, any::<(bool, bool, u16)>()).prop_map(|(steps, ranges, shape, flags)| Candidate {
        first_step: steps.0,
        last_step: steps.0 + steps.1,
        near_step: steps.2,
        beams: steps.3,
        first_mm: ranges.0,
        mid_mm: ranges.1,
        last_mm: ranges.2,
        near_mm: ranges.3,
        first_end: shape.0,
        last_end: shape.1,
        contour: shape.2.into_iter().collect(),
        necks: shape.3.into_iter().collect(),
        touches: flags.0,
        narrow: flags.1,
        static_ds: flags.2,
    })
}

fn any_span() -> impl Strategy<Value = UnseenSpan> {
    let reasons = [UnseenReason::NoReturn, UnseenReason::TooShort, UnseenReason::Overflow];
    let near_mm = proptest::option::of(0..65_535u16);
    (any::<(u16, u16)>(), proptest::sample::select(reasons.to_vec()), near_mm)
        .prop_map(|((first_step, beams), reason, near_mm)| UnseenSpan { first_step, beams, reason, near_mm })
}

fn any_size() -> impl Strategy<Value = Size> {
    any::<(u16, u8)>().prop_map(|(volume_l, top_cm)| Size { volume_l, top_cm })
}

/// A candidate without the fields that are rounded on the wire.
fn exact(candidate: &Candidate) -> Candidate {
    let mut exact = candidate.clone();
    (exact.first_end.step_mm, exact.last_end.step_mm) = (0, 0);
    exact.necks.iter_mut().for_each(|neck| neck.depth_mm = 0);
    exact
}

fn check_step(sent_mm: i16, got_mm: i16) -> Result<(), TestCaseError> {
    let limited_mm = sent_mm.clamp(-128 * BEYOND_UNIT_MM, 126 * BEYOND_UNIT_MM);
    let near = (got_mm - limited_mm).abs() <= BEYOND_UNIT_MM / 2;
    prop_assert!(
        if sent_mm == i16::MAX { got_mm == i16::MAX } else { near },
        "{} became {}",
        sent_mm,
        got_mm
    );
    Ok(())
}

proptest! {
    #[test]
    fn reports_arrive_as_they_were_but_for_the_two_rounded_numbers(
        candidates in vec(any_candidate(), 0..=CANDIDATES),
        unseen in vec(any_span(), 0..=UNSEEN_SPANS),
        sizes in vec(any_size(), SIZED_MAX),
        sized in any::<bool>(),
    ) {
        let sized = sized && candidates.len() <= SIZED_MAX;
        let sizes = if sized { &sizes[..candidates.len()] } else { &[] };
        let report = Report { head: HEAD, candidates: List::new(&candidates), unseen: List::new(&unseen), sizes: List::new(sizes) };
        let bytes = datagram(Message::Report(report));
        let (_, Message::Report(received)) = Message::decode(&bytes).unwrap() else { panic!() };
        prop_assert_eq!(received.head, HEAD);
        prop_assert_eq!(received.unseen, report.unseen);
        prop_assert_eq!(received.sizes, report.sizes);
        prop_assert_eq!(received.candidates.len(), candidates.len());
        let geometry = Geometry::new(GeometryParts {
            first_step: 44, last_step: 725, cluster: 1, front_step: 384, steps_per_turn: 1024,
            period_us: 100_000, range_min_mm: 20, range_max_mm: 5600,
        }).unwrap();
        for (sent, got) in candidates.iter().zip(received.candidates.iter()) {
            prop_assert_eq!(exact(sent), exact(&got));
            check_step(sent.first_end.step_mm, got.first_end.step_mm)?;
            check_step(sent.last_end.step_mm, got.last_end.step_mm)?;
            for (sent, got) in sent.necks.iter().zip(&got.necks) {
                prop_assert!(sent.depth_mm.min(1020).abs_diff(got.depth_mm) <= NECK_UNIT_MM / 2);
            }
            for estimator in [Estimator::Silhouette, Estimator::TwoPoint { radius_mm: 190 }] {
                prop_assert_eq!(centre(sent, &geometry, estimator), centre(&got, &geometry, estimator));
            }
        }
        // What has been rounded once stays.
        prop_assert_eq!(datagram(Message::Report(received)), bytes);
    }

    #[test]
    fn any_bytes_are_read_or_refused(
        header in any::<(u8, u8, bool)>(),
        message in vec(any::<u8>(), 0..1500),
    ) {
        let (version, kind, ours) = header;
        let mut bytes = datagram(Message::Done { request_id: 0 });
        bytes.truncate(HEADER_LEN);
        bytes[VERSION_AT] = if ours { 1 } else { version };
        bytes[KIND_AT] = if ours { kind & 0x9f } else { kind };
        bytes.extend(message);
        prop_assert_eq!(bytes.len() > DATAGRAM_MAX, Message::decode(&bytes) == Err(Unreadable::TooLong));
        read_everything(&bytes)?;
        read_everything(&bytes[HEADER_LEN..])?;
    }

    #[test]
    fn damaged_messages_are_read_or_refused(
        which in 0..21usize,
        damage in vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        length in any::<prop::sample::Index>(),
    ) {
        let mut bytes = samples().into_iter().chain(REQUESTS.map(request)).nth(which).unwrap();
        for (at, value) in damage {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        read_everything(&bytes)?;
        bytes.truncate(length.index(bytes.len()));
        read_everything(&bytes)?;
    }
}

/// Decodes a datagram as both sides would; a decoded message can be encoded again without change.
fn read_everything(bytes: &[u8]) -> Result<(), TestCaseError> {
    if let Ok(incoming) = Incoming::open(bytes)
        && let Ok(request) = incoming.request(incoming.header.identity)
    {
        let mut out = [0; DATAGRAM_MAX];
        let length =
            request.encode(incoming.header.identity, incoming.request_id, incoming.cookie, &mut out).unwrap();
        let again = Incoming::open(&out[..length]).unwrap();
        prop_assert_eq!(again.request(incoming.header.identity), Ok(request));
    }
    if let Ok((header, message)) = Message::decode(bytes) {
        let text = format!("{message:?}");
        prop_assert!(!text.is_empty());
        let mut out = [0; DATAGRAM_MAX];
        let length = message.encode(header.identity, &mut out).unwrap();
        let (_, again) = Message::decode(&out[..length]).unwrap();
        // Texts longer than allowed are cut when they are sent on.
        prop_assert!(again == message || matches!(message, Message::Info(_)));
    }
    Ok(())
}
