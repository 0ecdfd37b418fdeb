//! Every message fits a datagram, and no host is sent more than it spends.

use crate::samples::*;
use kehai::background::{BeamProfile, SUSPECTS};
use kehai::candidate::{CANDIDATES, Candidate};
use kehai::floor::{FAULTY, Fault, PANELS};
use kehai::scan::ScanTime;
use kehai::unseen::UNSEEN_SPANS;
use kehai::wire::{
    AUTHENTICATION_LEN, CHUNK_MAX, Cookie, DATAGRAM_MAX, EVENTS, FaultyPanel, HEADER_LEN, HEALTH_MAX, Health,
    INFO_MAX, Info, List, Message, PRESSED_MAX, PROFILE_PART_BEAMS, PROFILE_PART_MAX, PartHead, Pressed,
    ProfilePart, RAW_PART_BEAMS, RAW_PART_MAX, REPORT_MAX, REQUEST_MAX, RawPart, Refusal, Refused, Report,
    Request, SETTINGS_MAX, SETTINGS_TEXT_MAX, SIZED_MAX, TooLong,
};

#[test]
fn the_largest_of_every_message_fits_a_datagram_and_has_the_stated_size() {
    let candidates = vec![widest_candidate(); CANDIDATES];
    let unseen = [WIDEST_SPAN; UNSEEN_SPANS];
    let report = Report {
        head: HEAD,
        candidates: List::new(&candidates),
        unseen: List::new(&unseen),
        sizes: List::default(),
    };
    let report_len = datagram(Message::Report(report)).len();
    println!("largest report {report_len} of {DATAGRAM_MAX} bytes, {AUTHENTICATION_LEN} for authentication");
    assert_eq!(report_len, HEADER_LEN + REPORT_MAX);
    let (candidates, sizes) = (vec![widest_candidate(); SIZED_MAX], [SIZE; SIZED_MAX]);
    let sized = Report { candidates: List::new(&candidates), sizes: List::new(&sizes), ..report };
    assert!(datagram(Message::Report(sized)).len() <= HEADER_LEN + REPORT_MAX);
    let health = Health {
        head: HEALTH_HEAD,
        counters: largest_counters(),
        suspects: List::new(&[SUSPECT; SUSPECTS]),
        events: List::new(&[EVENT; EVENTS]),
    };
    assert_eq!(datagram(Message::Health(health)).len(), HEADER_LEN + HEALTH_MAX);
    assert_eq!(datagram(Message::Info(largest_info())).len(), HEADER_LEN + INFO_MAX);
    let beams = [BeamProfile::default(); PROFILE_PART_BEAMS];
    let part = ProfilePart { head: PartHead::default(), beams: List::new(&beams) };
    assert_eq!(datagram(Message::ProfilePart(part)).len(), HEADER_LEN + PROFILE_PART_MAX);
    let ranges_mm = List::new(&[1; RAW_PART_BEAMS]);
    let part = RawPart { head: PartHead::default(), time: ScanTime::default(), ranges_mm };
    assert_eq!(datagram(Message::RawPart(part)).len(), HEADER_LEN + RAW_PART_MAX);
    let (down, faulty) = ([255; PANELS / 8], [FaultyPanel { panel: 0, fault: Fault::Dead }; FAULTY]);
    let pressed =
        Pressed { head: HEAD, columns: 32, rows: 32, down: List::new(&down), faulty: List::new(&faulty) };
    assert_eq!(datagram(Message::Pressed(pressed)).len(), HEADER_LEN + PRESSED_MAX);
    let text = "x".repeat(SETTINGS_TEXT_MAX);
    let settings = Message::Settings { request_id: 1, text: &text };
    assert_eq!(datagram(settings).len(), HEADER_LEN + SETTINGS_MAX);
    let longest = REQUESTS.iter().map(|&one| request(one).len()).max().unwrap();
    // The offset of the sample is a byte shorter than the longest.
    assert!(longest <= HEADER_LEN + REQUEST_MAX);
    let chunk = Request::UpdateChunk { offset: u32::MAX, bytes: &[0; CHUNK_MAX] };
    assert_eq!(request(chunk).len(), HEADER_LEN + REQUEST_MAX);
    let longer = text + "x";
    let refused = Request::SetSettings { text: &longer }.encode(MODULE, 1, Cookie::NONE, &mut [0; 2000]);
    assert_eq!(refused, Err(TooLong));
}

#[test]
fn a_torso_takes_about_thirty_bytes() {
    let torso = Candidate { contour: [1; 7].into_iter().collect(), ..Candidate::default() };
    let report = |candidates| Report {
        head: HEAD,
        candidates: List::new(candidates),
        unseen: List::default(),
        sizes: List::default(),
    };
    let (one, none) = (&[torso][..], &[][..]);
    let bytes = datagram(Message::Report(report(one))).len() - datagram(Message::Report(report(none))).len();
    assert_eq!(bytes, 29);
}

#[test]
fn texts_are_cut_between_characters() {
    let bytes = datagram(Message::Info(largest_info()));
    let (_, Message::Info(info)) = Message::decode(&bytes).unwrap() else { panic!() };
    assert_eq!((info.firmware.len(), info.name.len(), info.sensor.unwrap().model.len()), (24, 32, 16));
    let odd = format!("x{LONG}");
    let bytes = datagram(Message::Info(Info { name: &odd, ..largest_info() }));
    let (_, Message::Info(info)) = Message::decode(&bytes).unwrap() else { panic!() };
    assert_eq!(info.name, &odd[..31]);
}

#[test]
fn no_host_is_sent_more_than_it_spends_before_it_has_shown_its_address() {
    let shortest = REQUESTS.iter().map(|&one| request(one).len()).min().unwrap();
    let refused = Refused { request_id: u32::MAX, kind: 255, refusal: Refusal::VERSION };
    assert!(datagram(Message::Refused(refused)).len() <= shortest);
    let cookie = Message::Cookie { request_id: u32::MAX, t1: [255; 8], cookie: Cookie([255; 8]) };
    assert!(datagram(cookie).len() <= request(Request::Subscribe { t1: [0; 8] }).len());
}

#[test]
fn a_buffer_that_is_too_short_is_an_error_at_every_length() {
    let whole = datagram(Message::Info(largest_info()));
    for length in 0..whole.len() {
        let mut out = vec![0; length];
        assert_eq!(Message::Info(largest_info()).encode(MODULE, &mut out), Err(TooLong));
    }
}
