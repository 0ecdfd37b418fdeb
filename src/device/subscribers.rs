//! The subscribers to the reports: four places, each kept for five seconds by a renewal.
//!
//! ```text
//!   place 0 │ host, renewed 0.3 s ago │ raw scans until … │ profile parts wanted, a bit each
//!   place 1 │ host, renewed 4.9 s ago │    two of one address at most: a third gets the place of the one
//!   place 2 │ free                    │    that has been silent for two seconds, or none
//!   place 3 │ …                       │    a renewing subscriber is never put out
//! ```
//!
//! A program that starts anew has another port, and its old place is still taken: so two, and so no wait for the end
//! of the lease.

use core::net::{Ipv4Addr, SocketAddrV4};

use crate::link::{Lane, Outbox};
use crate::wire::{Counter, Counters};

/// Places for subscribers.
pub const PLACES: usize = 4;

/// A subscriber is forgotten so long after its last subscribe, µs: five renewals lost in a row.
pub const LEASE_US: u64 = 5_000_000;

/// Places of one address: no host takes them all, and a program that starts anew finds one.
const PLACES_OF_ADDRESS: usize = 2;

/// A subscriber silent for so long, µs, gives its place to another one of its address: it renews each second.
const SILENT_US: u64 = 2_000_000;

/// A lane that accepts nothing for so long is opened anew, µs: longer than the delay from a lost ARP answer.
const STUCK_US: u64 = 1_000_000;

/// All places are taken, or those that the address may have.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Full;

/// One subscriber.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Subscriber {
    /// Its address and port.
    pub at: SocketAddrV4,
    renewed_us: u64,
    /// It gets raw scans until then, µs.
    pub raw_until_us: u64,
    /// Parts of the background profile it is still to get, bit i for part i.
    pub profile_parts: u32,
    /// Time since which its lane accepts nothing, µs.
    stuck_since_us: Option<u64>,
}

/// All places.
#[derive(Clone, Debug)]
pub struct Subscribers {
    places: [Option<Subscriber>; PLACES],
    had_one: bool,
}

impl Subscribers {
    /// No subscriber yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { places: [None; PLACES], had_one: false }
    }

    /// Number of subscribers.
    #[must_use]
    pub fn len(&self) -> u8 {
        self.places.iter().flatten().fold(0, |count: u8, _| count.saturating_add(1))
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether there has been one since the start.
    #[must_use]
    pub const fn had_one(&self) -> bool {
        self.had_one
    }

    /// Keeps the place of the host at `at`, or gives it one. A new place comes with an empty lane.
    ///
    /// # Errors
    /// [`Full`].
    pub fn renew(&mut self, at: SocketAddrV4, now_us: u64, out: &mut impl Outbox) -> Result<(), Full> {
        if let Some(subscriber) = self.of(at) {
            subscriber.renewed_us = now_us;
            return Ok(());
        }
        let (place, slot) = self.place_for(*at.ip(), now_us).ok_or(Full)?;
        *slot = Some(Subscriber {
            at,
            renewed_us: now_us,
            raw_until_us: 0,
            profile_parts: 0,
            stuck_since_us: None,
        });
        self.had_one = true;
        out.reopen(Lane::Place(place));
        Ok(())
    }

    /// A place for one more subscriber at this address: a free one, or once it has as many as it may, that of a silent
    /// one.
    fn place_for(&mut self, address: Ipv4Addr, now_us: u64) -> Option<(u8, &mut Option<Subscriber>)> {
        let of_address =
            |slot: &Option<Subscriber>| slot.is_some_and(|subscriber| *subscriber.at.ip() == address);
        let taken = self.places.iter().filter(|slot| of_address(slot)).count();
        let mut places = (0u8..).zip(&mut self.places);
        if taken < PLACES_OF_ADDRESS {
            return places.find(|(_, slot)| slot.is_none());
        }
        let silent = |subscriber: Subscriber| now_us >= subscriber.renewed_us.saturating_add(SILENT_US);
        places.find(|(_, slot)| of_address(slot) && slot.is_some_and(silent))
    }

    /// The subscriber at this address and port.
    pub fn of(&mut self, at: SocketAddrV4) -> Option<&mut Subscriber> {
        self.places.iter_mut().flatten().find(|subscriber| subscriber.at == at)
    }

    /// All subscribers.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Subscriber> {
        self.places.iter_mut().flatten()
    }

    /// All places, in order.
    pub fn places(&self) -> impl Iterator<Item = Option<&Subscriber>> {
        self.places.iter().map(Option::as_ref)
    }

    /// Removes the subscribers that have not renewed in time, and counts them.
    pub fn expire(&mut self, now_us: u64, counters: &mut Counters) {
        for slot in &mut self.places {
            if slot.is_some_and(|subscriber| now_us >= subscriber.renewed_us.saturating_add(LEASE_US)) {
                *slot = None;
                counters.count(Counter::SubscribersForgotten);
            }
        }
    }

    /// Removes the subscribers that are not to be `kept`.
    pub fn keep_only(&mut self, kept: impl Fn(SocketAddrV4) -> bool) {
        for slot in &mut self.places {
            if slot.is_some_and(|subscriber| !kept(subscriber.at)) {
                *slot = None;
            }
        }
    }

    /// Keeps every subscriber `more_us` longer: the module did not listen for that time.
    pub fn extend(&mut self, more_us: u64) {
        self.iter_mut().for_each(|subscriber| {
            subscriber.renewed_us = subscriber.renewed_us.saturating_add(more_us);
        });
    }

    /// When the next one is forgotten unless it renews, µs.
    #[must_use]
    pub fn next_us(&self) -> Option<u64> {
        self.places.iter().flatten().map(|subscriber| subscriber.renewed_us.saturating_add(LEASE_US)).min()
    }

    /// Sends to the wanted subscribers; what cannot be queued at once is dropped and counted as `dropped`.
    pub fn send(
        &mut self,
        datagram: &[u8],
        wanted: impl Fn(&Subscriber) -> bool,
        (counters, dropped): (&mut Counters, Counter),
        now_us: u64,
        out: &mut impl Outbox,
    ) {
        for (slot, place) in self.places.iter_mut().zip(0u8..) {
            let Some(subscriber) = slot.as_mut().filter(|subscriber| wanted(subscriber)) else { continue };
            let lane = Lane::Place(place);
            if out.try_send_to(lane, subscriber.at, datagram).is_ok() {
                subscriber.stuck_since_us = None;
                continue;
            }
            counters.count(dropped);
            let since_us = *subscriber.stuck_since_us.get_or_insert(now_us);
            if now_us >= since_us.saturating_add(STUCK_US) {
                subscriber.stuck_since_us = None;
                counters.count(Counter::SocketsReopened);
                out.reopen(lane);
            }
        }
    }
}

impl Default for Subscribers {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::Dropped;

    /// Takes `room` datagrams a lane, remembers what was done.
    #[derive(Default)]
    struct Lanes {
        queued: [usize; PLACES],
        room: usize,
        reopened: usize,
    }

    impl Outbox for Lanes {
        fn try_send_to(&mut self, lane: Lane, _: SocketAddrV4, _: &[u8]) -> Result<(), Dropped> {
            let Lane::Place(place) = lane else { panic!("reports take their own lane") };
            let queued = &mut self.queued[usize::from(place)];
            *queued += 1;
            if *queued > self.room { Err(Dropped) } else { Ok(()) }
        }

        fn is_empty(&mut self, lane: Lane) -> bool {
            matches!(lane, Lane::Place(place) if self.queued[usize::from(place)] == 0)
        }

        fn reopen(&mut self, lane: Lane) {
            let Lane::Place(place) = lane else { return };
            self.queued[usize::from(place)] = 0;
            self.reopened += 1;
        }
    }

    fn host(last: u8) -> SocketAddrV4 {
        SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, last), 5000)
    }

    #[test]
    fn the_fifth_is_refused_and_takes_the_place_of_one_who_left() {
        let (mut subscribers, mut counters) = (Subscribers::new(), Counters::new());
        let out = &mut Lanes::default();
        for last in 1..=4 {
            assert_eq!(subscribers.renew(host(last), 0, out), Ok(()));
        }
        assert_eq!(subscribers.renew(host(5), 1, out), Err(Full));
        for last in 2..=4 {
            assert_eq!(subscribers.renew(host(last), 3_000_000, out), Ok(()));
        }
        subscribers.expire(LEASE_US - 1, &mut counters);
        assert_eq!(subscribers.len(), 4);
        subscribers.expire(LEASE_US, &mut counters);
        assert_eq!((subscribers.len(), counters.get(Counter::SubscribersForgotten)), (3, 1));
        assert_eq!(subscribers.renew(host(5), LEASE_US, out), Ok(()));
    }

    #[test]
    fn an_address_has_two_places_and_a_third_program_of_it_gets_that_of_a_silent_one() {
        let (mut subscribers, out) = (Subscribers::new(), &mut Lanes::default());
        let program = |port| SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 1), port);
        assert_eq!(subscribers.renew(program(1), 0, out), Ok(()));
        assert_eq!(subscribers.renew(program(2), 0, out), Ok(()));
        assert_eq!(
            subscribers.renew(program(3), 1_000_000, out),
            Err(Full),
            "two places are free, but not for it"
        );
        assert_eq!(subscribers.renew(program(2), 1_900_000, out), Ok(()));
        assert_eq!(subscribers.renew(program(3), 2_000_000, out), Ok(()), "the first has been silent");
        assert!(subscribers.of(program(1)).is_none());
        assert_eq!((subscribers.len(), out.reopened), (2, 3), "with an empty lane");
        assert_eq!(subscribers.renew(program(1), 2_000_000, out), Err(Full));
        for last in 2..=3 {
            assert_eq!(subscribers.renew(host(last), 2_000_000, out), Ok(()), "others have theirs");
        }
    }

    #[test]
    fn a_lane_that_takes_nothing_for_a_second_is_opened_anew() {
        let (mut subscribers, mut counters) = (Subscribers::new(), Counters::new());
        let out = &mut Lanes { room: 3, ..Lanes::default() };
        subscribers.renew(host(1), 0, out).unwrap();
        let opened = out.reopened;
        for scan in 0..20 {
            let dropped = (&mut counters, Counter::ReportsDropped);
            subscribers.send(b"report", |_| true, dropped, scan * 100_000, out);
        }
        // Three fit; the eleventh failure comes a second after the first.
        assert_eq!(out.reopened - opened, 1);
        assert_eq!(counters.get(Counter::SocketsReopened), 1);
        assert_eq!(counters.get(Counter::ReportsDropped), 11 + 3);
    }
}
