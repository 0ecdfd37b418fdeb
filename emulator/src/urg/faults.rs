//! What goes wrong with a sensor and its line, seeded and repeatable.
//!
//! ```text
//! scan ─▶ damage_scan (whole scans: cut, overrun, foreign reply) ─▶ damage_bytes (rates) ─▶ wire
//! timed:  ──┤ at ├── for ──┤ …repeated every…        stall · stuck · abnormal · power · link
//! ```

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use super::LinkState;
pub use super::fault_kinds::{Fault, FaultError, KINDS, Kind, Window};

/// What a timed fault does to the sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum TimedEvent {
    None,
    Abnormal,
    PowerOff,
    PowerOn,
    Link(LinkState),
}

#[derive(Clone, Copy, Debug)]
struct Timed {
    window: Window,
    begin: TimedEvent,
    end: TimedEvent,
    next_us: Option<u64>,
    inside: bool,
}

/// The faults of one sensor, and how far they have come.
#[derive(Debug)]
pub(super) struct Faults {
    faults: Vec<Fault>,
    timed: Vec<Timed>,
    random: Pcg32,
    origin_us: u64,
    scans: u64,
    quits_heard: u32,
    times_refused: u32,
    garbage_sent: bool,
    done: u64,
    stall_counted_us: u64,
}

impl Faults {
    pub(super) fn new(faults: &[Fault], seed: u64, now_us: u64) -> Self {
        let timed = |fault: &Fault| {
            let (window, begin, end) = match *fault {
                Fault::Abnormal(window) => (window, TimedEvent::Abnormal, TimedEvent::None),
                Fault::PowerCycle(window) => (window, TimedEvent::PowerOff, TimedEvent::PowerOn),
                Fault::Unplug(window) => {
                    (window, TimedEvent::Link(LinkState::Silent), TimedEvent::Link(LinkState::Up))
                }
                Fault::Disconnect(window) => {
                    (window, TimedEvent::Link(LinkState::Closed), TimedEvent::Link(LinkState::Up))
                }
                _ => return None,
            };
            let next_us = Some(now_us + window.at_us);
            Some(Timed { window, begin, end, next_us, inside: false })
        };
        Self {
            timed: faults.iter().filter_map(timed).collect(),
            faults: faults.to_vec(),
            random: Pcg32::seed_from_u64(seed),
            origin_us: now_us,
            scans: 0,
            quits_heard: 0,
            times_refused: 0,
            garbage_sent: false,
            done: 0,
            stall_counted_us: 0,
        }
    }

    /// From `now_us` on, these and no others, each from its beginning.
    pub(super) fn replace(&mut self, faults: &[Fault], now_us: u64) {
        let Self { faults, timed, quits_heard, times_refused, garbage_sent, .. } =
            Self::new(faults, 0, now_us);
        (self.faults, self.timed, self.origin_us) = (faults, timed, now_us);
        (self.quits_heard, self.times_refused, self.garbage_sent) =
            (quits_heard, times_refused, garbage_sent);
    }

    /// Faults done so far.
    pub(super) fn done(&self) -> u64 {
        self.done
    }

    fn any<T>(&self, pick: impl Fn(&Fault) -> Option<T>) -> Option<T> {
        self.faults.iter().find_map(pick)
    }

    fn chance(&mut self, probability: f64) -> bool {
        f64::from(self.random.next_u32()) < probability * f64::from(u32::MAX)
    }

    /// A number from 0 to `below` − 1.
    fn below(&mut self, below: usize) -> usize {
        (self.random.next_u64() % (below.max(1) as u64)) as usize
    }

    /// When the next timed fault begins or ends.
    pub(super) fn next_us(&self) -> Option<u64> {
        self.timed.iter().filter_map(|timed| timed.next_us).min()
    }

    /// The timed event that is due.
    pub(super) fn timed_event(&mut self, now_us: u64) -> TimedEvent {
        let due = |timed: &&mut Timed| timed.next_us.is_some_and(|at_us| at_us <= now_us);
        let Some(timed) = self.timed.iter_mut().find(due) else { return TimedEvent::None };
        let at_us = timed.next_us.unwrap_or(now_us);
        let Window { for_us, every_us, .. } = timed.window;
        if timed.inside {
            timed.inside = false;
            let again_us = (at_us - for_us).saturating_add(every_us.max(for_us + 1));
            timed.next_us = (every_us > 0).then_some(again_us);
            timed.end
        } else {
            timed.inside = true;
            timed.next_us = Some(at_us + for_us);
            self.done += 1;
            timed.begin
        }
    }

    /// The end of the stall that `at_us` falls into, else `at_us`.
    pub(super) fn released_us(&self, at_us: u64) -> u64 {
        let since_us = at_us.saturating_sub(self.origin_us);
        let end_us = self.any(|fault| match fault {
            Fault::Stall(window) => window.end_us(since_us),
            _ => None,
        });
        end_us.map_or(at_us, |end_us| end_us + self.origin_us)
    }

    /// Whether stamp and ranges are frozen.
    pub(super) fn stuck(&mut self, now_us: u64) -> bool {
        let since_us = now_us.saturating_sub(self.origin_us);
        let end_us = self.any(|fault| match fault {
            Fault::Stuck(window) => window.end_us(since_us),
            _ => None,
        });
        if let Some(end_us) = end_us
            && self.stall_counted_us != end_us
        {
            self.stall_counted_us = end_us;
            self.done += 1;
        }
        end_us.is_some()
    }

    /// Whether this request is not heard.
    pub(super) fn ignores(&mut self, command: &[u8]) -> bool {
        let ignored = self.any(|fault| match fault {
            Fault::IgnoreQuit(count) => Some(*count),
            _ => None,
        });
        let ignored = command == b"QT" && ignored.is_some_and(|count| self.quits_heard < count);
        self.quits_heard += u32::from(ignored);
        self.done += u64::from(ignored);
        ignored
    }

    /// Whether this request silences the sensor.
    pub(super) fn wedges(&mut self, command: &[u8]) -> bool {
        let asks_too_much = matches!(command, [b'M' | b'G', b'E', ..] | [b'N' | b'H', b'D' | b'E', ..]);
        let wedged = asks_too_much && self.faults.contains(&Fault::Wedge);
        self.done += u64::from(wedged);
        wedged
    }

    /// Whether this `TM0` is refused.
    pub(super) fn busy_time(&mut self, command: &[u8]) -> bool {
        let refused = self.any(|fault| match fault {
            Fault::TimeBusy(count) => Some(*count),
            _ => None,
        });
        let refused = command == b"TM0" && refused.is_some_and(|count| self.times_refused < count);
        self.times_refused += u32::from(refused);
        self.done += u64::from(refused);
        refused
    }

    pub(super) fn silent_reboot(&mut self) -> bool {
        let silent = self.faults.contains(&Fault::SilentReboot);
        self.done += u64::from(silent);
        silent
    }

    pub(super) fn sleep_delay_us(&self) -> u64 {
        let delay = |fault: &Fault| match fault {
            Fault::SlowSleep(delay_us) => Some(*delay_us),
            _ => None,
        };
        self.any(delay).unwrap_or(0)
    }

    /// The lines of `VV`, perhaps spoilt.
    pub(super) fn damage_version(&mut self, mut lines: Vec<u8>) -> Vec<u8> {
        if !self.faults.contains(&Fault::BadVersion) {
            return lines;
        }
        self.done += 1;
        // The last line is SERI; its checksum stands before the last LF.
        if let Some(at) = lines.len().checked_sub(2)
            && let Some(sum) = lines.get_mut(at)
        {
            *sum = if *sum == b'o' { b'0' } else { *sum + 1 };
        }
        lines.extend_from_slice(b"0000\n");
        lines
    }

    /// Counts a scan about to be sent; true if it is to be a status 0M.
    pub(super) fn unstable_scan(&mut self) -> bool {
        self.scans += 1;
        let scans = self.scans;
        let unstable = self.any(|fault| match fault {
            Fault::Unstable(every) => Some(scans.is_multiple_of(*every)),
            _ => None,
        });
        let unstable = unstable.unwrap_or(false);
        self.done += u64::from(unstable);
        unstable
    }

    /// A whole scan, perhaps spoilt, and whether it is; `foreign` is the reply that may get in between.
    pub(super) fn damage_scan(
        &mut self,
        mut reply: Vec<u8>,
        foreign: impl Fn() -> Vec<u8>,
    ) -> (Vec<u8>, bool) {
        let mut damaged = false;
        for fault in self.faults.clone() {
            match fault {
                Fault::HalfScan(every) if self.scans.is_multiple_of(every) => {
                    let keep = 1 + self.below(reply.len().saturating_sub(1));
                    reply.truncate(keep);
                }
                Fault::Overrun(every, bytes) if self.scans.is_multiple_of(every) => {
                    let from = self.below(reply.len().saturating_sub(bytes));
                    reply.drain(from..(from + bytes).min(reply.len()));
                }
                Fault::ForeignReply(every) if self.scans.is_multiple_of(every) => {
                    // After a line of the data block: not the echo, the status, the stamp or the last one.
                    let ends = reply.iter().enumerate().filter(|&(_, &byte)| byte == b'\n');
                    let ends: Vec<usize> = ends.map(|(at, _)| at + 1).collect();
                    let data = ends.get(2..ends.len().saturating_sub(2)).unwrap_or_default();
                    let pick = self.below(data.len());
                    let at = data.get(pick).copied().unwrap_or(reply.len());
                    reply.splice(at..at, foreign());
                }
                _ => continue,
            }
            self.done += 1;
            damaged = true;
        }
        (reply, damaged)
    }

    /// Bytes about to be sent, perhaps spoilt.
    pub(super) fn damage_bytes(&mut self, bytes: Vec<u8>) -> Vec<u8> {
        let mut bytes = bytes;
        for fault in self.faults.clone() {
            match fault {
                Fault::BitFlip(rate) => {
                    for byte in &mut bytes {
                        if self.chance(rate) {
                            *byte ^= 1 << self.below(8);
                            self.done += 1;
                        }
                    }
                }
                Fault::LostByte(rate) => bytes.retain(|_| {
                    let lost = self.chance(rate);
                    self.done += u64::from(lost);
                    !lost
                }),
                Fault::ExtraByte(rate) => {
                    let mut out = Vec::with_capacity(bytes.len());
                    for byte in bytes {
                        if self.chance(rate) {
                            out.push(self.below(256) as u8);
                            self.done += 1;
                        }
                        out.push(byte);
                    }
                    bytes = out;
                }
                Fault::Garbage(count) if !self.garbage_sent => {
                    self.garbage_sent = true;
                    self.done += 1;
                    let noise: Vec<u8> = (0..count).map(|_| self.below(256) as u8).collect();
                    bytes = [noise, bytes].concat();
                }
                _ => {}
            }
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_does_the_same_damage() {
        let damage = |seed| {
            let mut faults = Faults::new(&[Fault::BitFlip(0.01), Fault::LostByte(0.01)], seed, 0);
            (faults.damage_bytes(vec![b'0'; 10_000]), faults.done())
        };
        assert_eq!(damage(1), damage(1));
        assert_ne!(damage(1), damage(2));
        let (bytes, done) = damage(1);
        assert!((100..300).contains(&done), "{done} faults");
        assert!((9850..9950).contains(&bytes.len()));
    }

    #[test]
    fn a_scan_that_is_as_long_as_before_is_damaged_all_the_same() {
        let foreign = b"II\n00P\n\n".to_vec();
        let mut faults = Faults::new(&[Fault::Overrun(1, foreign.len()), Fault::ForeignReply(1)], 1, 0);
        faults.unstable_scan();
        let scan = b"MD\n99b\nstamp\nfirst\nsecond\nthird\nfourth\nlast\n\n".to_vec();
        let whole = scan.len();
        let (spoilt, damaged) = faults.damage_scan(scan, || foreign.clone());
        assert_eq!((spoilt.len(), damaged), (whole, true));
    }

    #[test]
    fn faults_that_count_come_again_when_they_are_told_again() {
        let all = [Fault::IgnoreQuit(2), Fault::TimeBusy(1), Fault::Garbage(5)];
        let mut faults = Faults::new(&all, 1, 0);
        for time in 1..=2 {
            let ignored = (0..4).filter(|_| faults.ignores(b"QT")).count();
            let refused = (0..4).filter(|_| faults.busy_time(b"TM0")).count();
            let garbage = faults.damage_bytes(Vec::new()).len() + faults.damage_bytes(Vec::new()).len();
            assert_eq!((ignored, refused, garbage), (2, 1, 5), "time {time}");
            faults.replace(&all, 1000);
        }
    }

    #[test]
    fn a_foreign_reply_stands_between_two_data_lines() {
        let mut faults = Faults::new(&[Fault::ForeignReply(1)], 1, 0);
        faults.unstable_scan();
        let scan = b"MD\n99b\nstamp\nfirst\nsecond\nlast\n\n".to_vec();
        let (spoilt, damaged) = faults.damage_scan(scan, || b"II\n00P\n\n".to_vec());
        let spoilt = String::from_utf8(spoilt).unwrap();
        assert!(damaged);
        assert!(spoilt.contains("\nII\n00P\n\n"), "{spoilt}");
        assert!(spoilt.starts_with("MD\n99b\nstamp\n") && spoilt.ends_with("last\n\n"), "{spoilt}");
    }
}
