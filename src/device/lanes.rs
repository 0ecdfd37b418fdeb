//! Lanes for answers: a host that cannot be reached must not block the answers to others.
//!
//! ```text
//!   lane 0  │ waits for a host that answers no ARP │ ◀── further answers to that host, until it is full
//!   lane 1  │ empty                                │ ◀── the next answer to another host
//!
//!   no lane is empty: the longest-waiting one, if it has waited 0.3 s, is emptied and opened anew
//! ```

use core::net::{Ipv4Addr, SocketAddrV4};

use crate::link::{ANSWER_LANES, Lane, Outbox};
use crate::wire::{Counter, Counters};

/// An answer that waits for so long cannot be delivered, µs: a hundred times the duration of an ARP answer.
const STUCK_US: u64 = 300_000;

/// Answers waiting in a lane, as of its last inspection.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    /// Destination of the first of them.
    host: Ipv4Addr,
    since_us: u64,
    answers: u32,
}

/// The lanes for answers, and the choice for the next answer.
#[derive(Clone, Copy, Debug)]
pub(super) struct AnswerLanes {
    waiting: [Option<Waiting>; ANSWER_LANES],
    chosen: u8,
    now_us: u64,
}

impl AnswerLanes {
    pub(super) const fn new() -> Self {
        Self { waiting: [None; ANSWER_LANES], chosen: 0, now_us: 0 }
    }

    /// Sends an answer by the lane chosen.
    pub(super) fn send(
        &mut self,
        to: SocketAddrV4,
        answer: &[u8],
        counters: &mut Counters,
        out: &mut impl Outbox,
    ) {
        if out.try_send_to(Lane::Answers(self.chosen), to, answer).is_err() {
            counters.count(Counter::AnswersDropped);
        } else if let Some(waiting) = self.waiting.get_mut(usize::from(self.chosen)) {
            let new = Waiting { host: *to.ip(), since_us: self.now_us, answers: 0 };
            let waiting = waiting.get_or_insert(new);
            waiting.answers = waiting.answers.saturating_add(1);
        }
    }

    /// Chooses the lane for answers to `host`: a lane with answers to this host, else an empty lane, else the lane that
    /// has waited longest, which is emptied if it is stuck.
    pub(super) fn choose(
        &mut self,
        host: Ipv4Addr,
        now_us: u64,
        counters: &mut Counters,
        out: &mut impl Outbox,
    ) {
        self.now_us = now_us;
        let mut best = None;
        for (waiting, lane) in self.waiting.iter_mut().zip(0u8..) {
            if out.is_empty(Lane::Answers(lane)) {
                *waiting = None;
            }
            let since_us = match waiting {
                Some(waiting) if waiting.host == host => {
                    self.chosen = lane;
                    return;
                }
                Some(waiting) => waiting.since_us.saturating_add(1),
                None => 0,
            };
            if best.is_none_or(|(best_us, _)| since_us < best_us) {
                best = Some((since_us, lane));
            }
        }
        let Some((_, lane)) = best else { return };
        self.chosen = lane;
        if let Some(slot) = self.waiting.get_mut(usize::from(lane))
            && let Some(waiting) = *slot
            && now_us >= waiting.since_us.saturating_add(STUCK_US)
        {
            let dropped = counters.get(Counter::AnswersDropped).saturating_add(waiting.answers);
            counters.set(Counter::AnswersDropped, dropped);
            counters.count(Counter::SocketsReopened);
            out.reopen(Lane::Answers(lane));
            *slot = None;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::Dropped;
    use std::vec::Vec;

    /// Lanes that keep what is for some hosts.
    #[derive(Default)]
    struct Lanes {
        mute: Vec<Ipv4Addr>,
        queued: [Vec<Ipv4Addr>; ANSWER_LANES],
        reached: Vec<Ipv4Addr>,
        reopened: usize,
    }

    impl Outbox for Lanes {
        fn try_send_to(&mut self, lane: Lane, to: SocketAddrV4, _: &[u8]) -> Result<(), Dropped> {
            let Lane::Answers(lane) = lane else { panic!("not for answers") };
            let queue = &mut self.queued[usize::from(lane)];
            if queue.is_empty() && !self.mute.contains(to.ip()) {
                self.reached.push(*to.ip());
            } else {
                queue.push(*to.ip());
            }
            Ok(())
        }

        fn is_empty(&mut self, lane: Lane) -> bool {
            matches!(lane, Lane::Answers(lane) if self.queued[usize::from(lane)].is_empty())
        }

        fn reopen(&mut self, lane: Lane) {
            let Lane::Answers(lane) = lane else { panic!("not for answers") };
            self.queued[usize::from(lane)].clear();
            self.reopened += 1;
        }
    }

    const fn host(last: u8) -> Ipv4Addr {
        Ipv4Addr::new(10, 0, 0, last)
    }

    #[test]
    fn one_host_that_answers_no_arp_takes_one_lane_however_often_it_asks() {
        let (mut lanes, mut counters, mut out) = (AnswerLanes::new(), Counters::new(), Lanes::default());
        out.mute.push(host(1));
        for turn in 0..20 {
            for asking in [host(1), host(2)] {
                lanes.choose(asking, turn * 100_000, &mut counters, &mut out);
                lanes.send(SocketAddrV4::new(asking, 5000), b"answer", &mut counters, &mut out);
            }
        }
        assert_eq!(out.reached, [host(2); 20]);
        assert_eq!(out.reopened, 0);
    }

    #[test]
    fn when_all_lanes_wait_the_longest_is_emptied_and_what_it_held_is_counted() {
        let (mut lanes, mut counters, mut out) = (AnswerLanes::new(), Counters::new(), Lanes::default());
        let mut answer = |asking, at_us, out: &mut Lanes| {
            lanes.choose(asking, at_us, &mut counters, out);
            lanes.send(SocketAddrV4::new(asking, 5000), b"answer", &mut counters, out);
            [Counter::SocketsReopened, Counter::AnswersDropped].map(|counter| counters.get(counter))
        };
        out.mute.extend([host(1), host(2)]);
        for at_us in [0, 10_000] {
            answer(host(1), at_us, &mut out);
            answer(host(2), at_us + 1000, &mut out);
        }
        assert_eq!(answer(host(3), STUCK_US, &mut out), [1, 2]);
        assert_eq!((&out.reached[..], out.reopened), (&[host(3)][..], 1));
    }
}
