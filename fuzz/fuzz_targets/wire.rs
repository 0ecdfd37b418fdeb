//! Both ends on arbitrary bytes: no panic, and a decoded message keeps its meaning when it is encoded again.
//!
//! ```text
//!   input:  version │ kind │ message …       behind a header that is right otherwise, and
//!           all of it                        as a datagram of its own
//! ```
#![no_main]

use kehai::wire::{COUNTERS, DATAGRAM_MAX, HEADER_LEN, Header, Identity, Incoming, Message, ModuleId};
use libfuzzer_sys::fuzz_target;

const MODULE: Identity = Identity { module: ModuleId([2, 0, 0, 0, 0, 1]), boot: 1 };

/// The health of an older module grows by so many bytes at most when it is encoded again: a zero for each counter that it does
/// not have, and two empty lists.
const HEALTH_ADDED: usize = COUNTERS + 2;

fn as_module(datagram: &[u8]) {
    let Ok(incoming) = Incoming::open(datagram) else { return };
    let own = incoming.header.identity;
    match incoming.request(own) {
        Ok(request) => {
            let mut out = [0; DATAGRAM_MAX];
            let length = request.encode(own, incoming.request_id, incoming.cookie, &mut out).unwrap();
            let again = Incoming::open(&out[..length]).unwrap();
            assert_eq!(again.request(own), Ok(request));
        }
        Err(refusal) => {
            let mut out = [0; DATAGRAM_MAX];
            let length = Message::Refused(incoming.refused(refusal)).encode(own, &mut out).unwrap();
            assert!(length <= datagram.len());
        }
    }
}

fn as_host(datagram: &[u8]) {
    let Ok((header, message)) = Message::decode(datagram) else { return };
    let mut out = [0; DATAGRAM_MAX];
    let Ok(length) = message.encode(header.identity, &mut out) else {
        // A module of today sends none that long: only an older one's may grow beyond a datagram.
        assert!(matches!(message, Message::Health(_)) && datagram.len() > DATAGRAM_MAX - HEALTH_ADDED);
        return;
    };
    let (_, again) = Message::decode(&out[..length]).unwrap();
    // Texts longer than allowed are cut when they are sent on.
    assert!(again == message || matches!(message, Message::Info(_)));
}

fuzz_target!(|input: &[u8]| {
    as_module(input);
    as_host(input);
    let [version, kind, message @ ..] = input else { return };
    let header = Header { version: version % 3, ..Header::new(MODULE, *kind) };
    let mut datagram = Vec::with_capacity(HEADER_LEN + message.len());
    datagram.extend_from_slice(&header.bytes());
    datagram.extend_from_slice(message);
    as_module(&datagram);
    as_host(&datagram);
});
