//! The search for a lease, against servers that lease and servers that do not.

use super::*;
use proptest::prelude::*;
use std::vec::Vec;

const MAC: Mac = [0x52, 0x54, 0x00, 0x12, 0x34, 0x01];
const TRANSACTION: u32 = 0x0102_0304;
const SERVER_ADDRESS: [u8; 4] = [10, 1, 2, 1];
const GIVEN: [u8; 4] = [10, 1, 2, 77];
const MASK: [u8; 4] = [255, 255, 255, 0];
const REFUSE: u8 = 6;

fn search() -> LeaseSearch {
    LeaseSearch::new(MAC, TRANSACTION)
}

fn kind(message: &[u8]) -> u8 {
    option(message, MESSAGE_TYPE).unwrap()[0]
}

/// A server's answer to `message`.
fn answer(message: &[u8], kind: u8, options: &[(u8, &[u8])]) -> Vec<u8> {
    let mut answer = message[..OPTIONS].to_vec();
    answer[0] = 2;
    answer[16..20].copy_from_slice(&GIVEN);
    for (number, value) in [(MESSAGE_TYPE, &[kind][..]), (SERVER, &SERVER_ADDRESS)].iter().chain(options) {
        answer.push(PAD);
        answer.extend([&[*number, value.len() as u8], *value].concat());
    }
    answer.push(END);
    answer
}

fn lease(message: &[u8], kind: u8) -> Vec<u8> {
    answer(message, kind, &[(SUBNET_MASK, &MASK), (ROUTER, &SERVER_ADDRESS)])
}

/// What comes of a server's acknowledgement of this address, with these options.
fn acknowledged(address: [u8; 4], options: &[(u8, &[u8])]) -> Heard {
    let mut search = search();
    let discover = search.message();
    assert_eq!(search.hear(&lease(&discover, OFFER)), Heard::Offer);
    let mut acknowledgement = answer(&search.message(), ACKNOWLEDGE, options);
    acknowledgement[16..20].copy_from_slice(&address);
    search.hear(&acknowledgement)
}

#[test]
fn the_question_is_a_discover_of_this_client() {
    let question = search().message();
    assert_eq!(question[..12], [1, 1, 6, 0, 1, 2, 3, 4, 0, 0, 0x80, 0]);
    assert_eq!(question[28..34], MAC);
    assert_eq!(question[236..243], [99, 130, 83, 99, 53, 1, 1]);
    assert_eq!(option(&question, CLIENT), Some(&[1, 0x52, 0x54, 0x00, 0x12, 0x34, 0x01][..]));
    assert_eq!(option(&question, SERVER), None);
}

#[test]
fn an_offer_is_asked_for_and_only_its_acknowledgement_is_a_lease() {
    let mut search = search();
    let discover = search.message();
    assert_eq!(search.hear(&lease(&discover, ACKNOWLEDGE)), Heard::Nothing, "nothing was asked for");
    assert_eq!(search.hear(&lease(&discover, OFFER)), Heard::Offer);
    let request = search.message();
    assert_eq!(kind(&request), REQUEST);
    assert_eq!(option(&request, REQUESTED_ADDRESS), Some(&GIVEN[..]));
    assert_eq!(option(&request, SERVER), Some(&SERVER_ADDRESS[..]));
    assert_eq!(search.hear(&lease(&request, OFFER)), Heard::Nothing, "a second server's");
    assert_eq!(search.hear(&lease(&request, ACKNOWLEDGE)), Heard::Lease);
}

#[test]
fn a_server_that_offers_and_never_leases_is_asked_again_and_believed_once_it_does() {
    let mut search = search();
    for round in 0..100 {
        let discover = search.message();
        assert_eq!(kind(&discover), DISCOVER, "round {round}");
        assert_eq!(search.hear(&lease(&discover, OFFER)), Heard::Offer);
        let request = search.message();
        assert_eq!(kind(&request), REQUEST);
        // It is silent, or refuses.
        if round % 2 == 0 {
            assert_eq!(search.hear(&answer(&request, REFUSE, &[])), Heard::Nothing);
        }
    }
    let discover = search.message();
    assert_eq!(search.hear(&lease(&discover, OFFER)), Heard::Offer);
    let request = search.message();
    assert_eq!(search.hear(&lease(&request, ACKNOWLEDGE)), Heard::Lease);
}

#[test]
fn a_lease_that_no_interface_can_have_is_none() {
    let router = (ROUTER, &SERVER_ADDRESS[..]);
    assert_eq!(acknowledged(GIVEN, &[(SUBNET_MASK, &MASK), router]), Heard::Lease);
    assert_eq!(acknowledged(GIVEN, &[(SUBNET_MASK, &MASK)]), Heard::Lease, "no way out");
    let routers = [SERVER_ADDRESS, [10, 1, 2, 2]].concat();
    assert_eq!(acknowledged(GIVEN, &[(SUBNET_MASK, &MASK), (ROUTER, &routers)]), Heard::Lease);
    // The stack takes none without a mask, or with one that has holes.
    assert_eq!(acknowledged(GIVEN, &[router]), Heard::Nothing);
    assert_eq!(acknowledged(GIVEN, &[(SUBNET_MASK, &[255, 0, 255, 0])]), Heard::Nothing);
    assert_eq!(acknowledged(GIVEN, &[(SUBNET_MASK, &[255; 4])]), Heard::Nothing);
    assert_eq!(acknowledged(GIVEN, &[(SUBNET_MASK, &MASK), (ROUTER, &[10, 9, 9, 9])]), Heard::Nothing);
    assert_eq!(acknowledged([10, 1, 2, 255], &[(SUBNET_MASK, &MASK)]), Heard::Nothing);
    assert_eq!(acknowledged([224, 0, 0, 1], &[(SUBNET_MASK, &MASK)]), Heard::Nothing);
}

#[test]
fn only_a_whole_answer_to_the_own_message_counts() {
    let question = search().message();
    let offer = lease(&question, OFFER);
    let heard = |datagram: &[u8]| search().hear(datagram);
    assert_eq!(heard(&question), Heard::Nothing, "a question is no answer");
    assert_eq!(heard(&offer), Heard::Offer);
    assert_eq!(LeaseSearch::new(MAC, 8).hear(&offer), Heard::Nothing);
    assert_eq!(LeaseSearch::new([2; 6], TRANSACTION).hear(&offer), Heard::Nothing);
    // Two options, with a pad in front of each.
    let server_ends = OPTIONS + (1 + 2 + 1) + (1 + 2 + 4);
    assert!((0..server_ends).all(|len| heard(&offer[..len]) == Heard::Nothing));
    let mut nowhere = offer;
    nowhere[16..20].copy_from_slice(&[0; 4]);
    assert_eq!(heard(&nowhere), Heard::Nothing);
}

proptest! {
    #[test]
    fn any_options_are_heard(options in prop::collection::vec(any::<u8>(), 0..64)) {
        let mut search = search();
        let mut datagram = answer(&search.message(), OFFER, &[])[..OPTIONS].to_vec();
        datagram.extend(options);
        let heard = search.hear(&datagram);
        prop_assert_ne!(heard, Heard::Lease);
        prop_assert_eq!(kind(&search.message()) == REQUEST, heard == Heard::Offer);
    }
}
