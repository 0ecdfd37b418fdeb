//! Peers of an older, a newer or another version.

use crate::samples::*;
use kehai::background::Suspect;
use kehai::candidate::Candidate;
use kehai::wire::{
    COUNTERS, Counter, Counters, HEADER_LEN, Health, HealthHead, Identity, Incoming, List, Message, ModuleId,
    Refusal, Refused, Report, Request, SIZED_MAX, Size, Unreadable,
};
use serde::Serialize;

#[test]
fn fields_added_by_a_newer_peer_are_ignored() {
    for bytes in samples() {
        let newer = [&bytes[..], &[1, 2, 3, 255]].concat();
        assert_eq!(Message::decode(&newer).unwrap().1, Message::decode(&bytes).unwrap().1);
    }
    for one in REQUESTS {
        let newer = [&request(one)[..], &[1, 2, 3, 255]].concat();
        assert_eq!(Incoming::open(&newer).unwrap().request(MODULE), Ok(one));
    }
}

/// Health as a module of an older version would send it: fewer counters, no suspects, no events.
fn older_health(counters: &[u32]) -> Vec<u8> {
    let empty = Health {
        head: HEALTH_HEAD,
        counters: Counters::new(),
        suspects: List::default(),
        events: List::default(),
    };
    let mut bytes = datagram(Message::Health(empty));
    bytes.truncate(bytes.len() - 1 - COUNTERS - 2);
    append(&mut bytes, counters);
    bytes
}

fn append(bytes: &mut Vec<u8>, value: impl Serialize) {
    let mut room = [0; 600];
    bytes.extend_from_slice(postcard::to_slice(&value, &mut room).unwrap());
}

#[test]
fn what_an_older_peer_does_not_send_takes_its_default() {
    let bytes = older_health(&[3, 5]);
    let (_, Message::Health(health)) = Message::decode(&bytes).unwrap() else { panic!() };
    assert_eq!(health.head, HEALTH_HEAD);
    assert_eq!((health.counters.get(Counter::ALL[0]), health.counters.get(Counter::ALL[1])), (3, 5));
    assert_eq!(health.counters.get(Counter::ALL[2]), 0);
    assert!(health.suspects.is_empty() && health.events.is_empty());
}

#[test]
fn a_report_with_sizes_is_one_to_a_peer_without_and_the_other_way_round() {
    let candidates = [widest_candidate(), Candidate::default()];
    let of = |sizes| Report {
        head: HEAD,
        candidates: List::new(&candidates),
        unseen: List::new(&[WIDEST_SPAN]),
        sizes,
    };
    let (with, without) = (of(List::new(&[SIZE, Size::UNKNOWN])), of(List::default()));
    let (long, short) = (datagram(Message::Report(with)), datagram(Message::Report(without)));
    // An older peer reads as far as it knows: the same bytes, and more behind them.
    assert_eq!(long[..short.len()], short);
    assert_eq!(long.len() - short.len(), 1 + 2 * 3);
    let read = |bytes: &[u8]| match Message::decode(bytes).unwrap().1 {
        Message::Report(report) => report.sizes.iter().collect::<Vec<_>>(),
        _ => panic!(),
    };
    assert_eq!(read(&long), [SIZE, Size::UNKNOWN]);
    assert!(SIZE.is_known() && !Size::UNKNOWN.is_known());
    assert_eq!(read(&short), []);
}

#[test]
fn as_many_sizes_as_candidates_or_none() {
    let decode = |candidates: usize, sizes: usize| {
        let (candidates, sizes) = (vec![Candidate::default(); candidates], vec![SIZE; sizes]);
        let (candidates, sizes) = (List::new(&candidates), List::new(&sizes));
        let bytes =
            datagram(Message::Report(Report { head: HEAD, candidates, unseen: List::default(), sizes }));
        Message::decode(&bytes).map(|_| ())
    };
    assert_eq!(decode(2, 2), Ok(()));
    assert_eq!(decode(24, 0), Ok(()));
    assert_eq!(decode(SIZED_MAX, SIZED_MAX), Ok(()));
    for (candidates, sizes) in [(2, 1), (2, 3), (0, 1), (SIZED_MAX + 1, SIZED_MAX + 1)] {
        assert!(decode(candidates, sizes).is_err(), "{candidates} candidates, {sizes} sizes");
    }
}

#[test]
fn counters_of_a_newer_peer_are_passed_over_and_what_follows_is_read() {
    let counters: Vec<u32> = (0..COUNTERS as u32 + 5).collect();
    let mut bytes = older_health(&counters);
    append(&mut bytes, [(1u16, 2u16, 3u16)].as_slice());
    let (_, Message::Health(health)) = Message::decode(&bytes).unwrap() else { panic!() };
    assert_eq!(health.counters.get(*Counter::ALL.last().unwrap()), COUNTERS as u32 - 1);
    let suspect = Suspect { first_step: 1, last_step: 2, near_mm: 3 };
    assert!(health.suspects.iter().eq([suspect]) && health.events.is_empty());
}

#[test]
fn an_older_reader_finds_its_fields_where_they_were() {
    // It knows the head and the counters, and stops there.
    let bytes = samples().remove(8);
    let message = &bytes[HEADER_LEN..];
    let (head, rest) = postcard::take_from_bytes::<HealthHead>(message).unwrap();
    let (count, rest) = postcard::take_from_bytes::<u16>(rest).unwrap();
    let (first, _) = postcard::take_from_bytes::<u32>(rest).unwrap();
    assert_eq!((head, usize::from(count), first), (HEALTH_HEAD, COUNTERS, u32::MAX));
}

#[test]
fn another_version_leaves_only_what_is_frozen() {
    let readable = samples().into_iter().filter_map(|mut bytes| {
        bytes[VERSION_AT] = 9;
        match Message::decode(&bytes) {
            Ok((header, _)) => Some(header.kind),
            Err(error) => {
                assert_eq!(error, Unreadable::Version(9));
                None
            }
        }
    });
    assert_eq!(readable.collect::<Vec<_>>(), [0x80, 0x81, 0x82, 0x83]);
    for one in REQUESTS {
        let mut bytes = request(one);
        bytes[VERSION_AT] = 9;
        let incoming = Incoming::open(&bytes).unwrap();
        assert!(!incoming.speaks_our_version());
        let frozen = matches!(one, Request::Subscribe { .. } | Request::Info);
        let expected = if frozen { Ok(one) } else { Err(Refusal::Version { min: 1, max: 1 }) };
        assert_eq!(incoming.request(MODULE), expected);
    }
}

#[test]
fn unknown_kinds_are_told_from_damage() {
    let mut bytes = request(Request::Restart);
    bytes[KIND_AT] = 0x7f;
    let incoming = Incoming::open(&bytes).unwrap();
    assert_eq!(incoming.request(MODULE), Err(Refusal::Unsupported));
    let refused = incoming.refused(Refusal::Unsupported);
    assert_eq!(refused, Refused { request_id: 5, kind: 0x7f, refusal: Refusal::Unsupported });
    let mut bytes = datagram(Message::Done { request_id: 1 });
    bytes[KIND_AT] = 0xff;
    assert_eq!(Message::decode(&bytes), Err(Unreadable::Kind(0xff)));
    assert_eq!(Incoming::open(&bytes), Err(Unreadable::WrongDirection));
    assert_eq!(Message::decode(&request(Request::Restart)), Err(Unreadable::WrongDirection));
}

#[test]
fn a_request_for_another_module_or_another_start_is_refused() {
    for one in REQUESTS {
        let bytes = request(one);
        let incoming = Incoming::open(&bytes).unwrap();
        let other = Identity { module: ModuleId([2, 0, 0, 0, 0, 8]), ..MODULE };
        assert_eq!(incoming.request(other), Err(Refusal::WrongModule));
        let frozen = matches!(one, Request::Subscribe { .. } | Request::Info);
        let later = Identity { boot: 8, ..MODULE };
        assert_eq!(incoming.request(later), if frozen { Ok(one) } else { Err(Refusal::WrongBoot) });
    }
    let mut bytes = request(Request::Restart);
    bytes[BOOT_AT..BOOT_AT + 4].fill(0);
    assert_eq!(Incoming::open(&bytes).unwrap().request(MODULE), Err(Refusal::WrongBoot));
}
