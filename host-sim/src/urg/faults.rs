//! What goes wrong with a sensor and its line, seeded and repeatable.
//!
//! ```text
//! scan ─▶ damage_scan (whole scans: cut, overrun, foreign reply) ─▶ damage_bytes (rates) ─▶ wire
//! timed:  ──┤ at ├── for ──┤ …repeated every…        stall · stuck · abnormal · power · link
//! ```

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use super::LinkState;

/// One fault with its parameters; [`KINDS`] describes each.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Fault {
    /// `bit-flip:RATE`: a bit of a byte, with this probability a byte.
    BitFlip(f64),
    /// `lost-byte:RATE`: a byte does not arrive.
    LostByte(f64),
    /// `extra-byte:RATE`: a random byte comes before a byte.
    ExtraByte(f64),
    /// `half-scan:N`: every N-th scan ends somewhere in the middle.
    HalfScan(u64),
    /// `overrun:N,BYTES`: every N-th scan lacks some bytes in a row.
    Overrun(u64, usize),
    /// `foreign-reply:N`: every N-th scan holds a whole reply to `II` between two of its lines.
    ForeignReply(u64),
    /// `unstable:N`: every N-th scan is a status 0M without data.
    Unstable(u64),
    /// `stall:AT,FOR,EVERY`: nothing is sent for a while, then everything.
    Stall(Window),
    /// `stuck:AT,FOR,EVERY`: the same stamp and ranges again and again.
    Stuck(Window),
    /// `abnormal:AT,EVERY`: breaks; only a reboot helps.
    Abnormal(Window),
    /// `power-cycle:AT,FOR,EVERY`: no power for a while.
    PowerCycle(Window),
    /// `unplug:AT,FOR,EVERY`: bytes vanish for a while.
    Unplug(Window),
    /// `disconnect:AT,FOR,EVERY`: the connection is closed for a while.
    Disconnect(Window),
    /// `ignore-qt:N`: the first N requests to quit are not heard.
    IgnoreQuit(u32),
    /// `tm-busy:N`: the first N requests to enter the time-sync state are answered 10.
    TimeBusy(u32),
    /// `garbage:BYTES`: random bytes before the first reply.
    Garbage(usize),
    /// `bad-vv`: `VV` has a wrong checksum on SERI and a stray line.
    BadVersion,
    /// `wedge`: says nothing after a request for intensities or echoes until the power is cut.
    Wedge,
    /// `rb-silent`: reboots without answering the second `RB`.
    SilentReboot,
    /// `slow-sl:FOR`: the answer to `%SL` takes this many µs.
    SlowSleep(u64),
}

/// A stretch of time, in µs after the sensor was set up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Window {
    /// Begins.
    pub at_us: u64,
    /// Lasts.
    pub for_us: u64,
    /// Comes back after this time from one beginning to the next; 0: once.
    pub every_us: u64,
}

impl Window {
    /// The end of the window that `at_us` lies in.
    fn end_us(&self, at_us: u64) -> Option<u64> {
        let since_us = at_us.checked_sub(self.at_us)?;
        let begin_us = match self.every_us {
            0 => self.at_us,
            every_us => at_us - since_us % every_us,
        };
        let end_us = begin_us.saturating_add(self.for_us);
        (at_us < end_us).then_some(end_us)
    }
}

/// One kind of fault, for parsing and for the help text.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Name on the command line.
    pub name: &'static str,
    /// Its arguments, in words.
    pub arguments: &'static str,
    /// What it does.
    pub help: &'static str,
    /// Values of arguments left out; there are no more than these.
    defaults: &'static [f64],
    make: fn(&[f64]) -> Fault,
}

/// Every kind of fault. Times are in seconds after the start; EVERY 0 means once.
pub const KINDS: [Kind; 20] = [
    Kind {
        name: "bit-flip",
        arguments: "RATE",
        help: "a bit of a byte is wrong, with this probability [0.0001]",
        defaults: &[0.0001],
        make: |a| Fault::BitFlip(a[0]),
    },
    Kind {
        name: "lost-byte",
        arguments: "RATE",
        help: "a byte is lost, with this probability [0.0001]",
        defaults: &[0.0001],
        make: |a| Fault::LostByte(a[0]),
    },
    Kind {
        name: "extra-byte",
        arguments: "RATE",
        help: "a random byte comes before a byte, with this probability [0.0001]",
        defaults: &[0.0001],
        make: |a| Fault::ExtraByte(a[0]),
    },
    Kind {
        name: "half-scan",
        arguments: "N",
        help: "every N-th scan breaks off somewhere [10]",
        defaults: &[10.0],
        make: |a| Fault::HalfScan(count(a[0])),
    },
    Kind {
        name: "overrun",
        arguments: "N,BYTES",
        help: "every N-th scan lacks some bytes in a row, as by overrun [10,16]",
        defaults: &[10.0, 16.0],
        make: |a| Fault::Overrun(count(a[0]), count(a[1]) as usize),
    },
    Kind {
        name: "foreign-reply",
        arguments: "N",
        help: "every N-th scan has a whole reply to II in its middle [10]",
        defaults: &[10.0],
        make: |a| Fault::ForeignReply(count(a[0])),
    },
    Kind {
        name: "unstable",
        arguments: "N",
        help: "every N-th scan is a status 0M without data [10]",
        defaults: &[10.0],
        make: |a| Fault::Unstable(count(a[0])),
    },
    Kind {
        name: "stall",
        arguments: "AT,FOR,EVERY",
        help: "nothing is sent for a while, then all of it at once [5,0.39,0]",
        defaults: &[5.0, 0.39, 0.0],
        make: |a| Fault::Stall(window(a)),
    },
    Kind {
        name: "stuck",
        arguments: "AT,FOR,EVERY",
        help: "the same stamp and ranges in every scan [5,1,0]",
        defaults: &[5.0, 1.0, 0.0],
        make: |a| Fault::Stuck(window(a)),
    },
    Kind {
        name: "abnormal",
        arguments: "AT,EVERY",
        help: "breaks: all but VV, II, RB is answered 0L until a reboot [5,0]",
        defaults: &[5.0, 0.0],
        make: |a| Fault::Abnormal(window(&[a[0], 0.0, a[1]])),
    },
    Kind {
        name: "power-cycle",
        arguments: "AT,FOR,EVERY",
        help: "no power for a while: bit rate and SCIP 2.0 are forgotten [5,1,0]",
        defaults: &[5.0, 1.0, 0.0],
        make: |a| Fault::PowerCycle(window(a)),
    },
    Kind {
        name: "unplug",
        arguments: "AT,FOR,EVERY",
        help: "the cable carries nothing for a while [5,1,0]",
        defaults: &[5.0, 1.0, 0.0],
        make: |a| Fault::Unplug(window(a)),
    },
    Kind {
        name: "disconnect",
        arguments: "AT,FOR,EVERY",
        help: "the connection is closed for a while [5,1,0]",
        defaults: &[5.0, 1.0, 0.0],
        make: |a| Fault::Disconnect(window(a)),
    },
    Kind {
        name: "ignore-qt",
        arguments: "N",
        help: "the first N requests to quit are not heard [1]",
        defaults: &[1.0],
        make: |a| Fault::IgnoreQuit(count(a[0]) as u32),
    },
    Kind {
        name: "tm-busy",
        arguments: "N",
        help: "the first N TM0 are answered 10 [1]",
        defaults: &[1.0],
        make: |a| Fault::TimeBusy(count(a[0]) as u32),
    },
    Kind {
        name: "garbage",
        arguments: "BYTES",
        help: "random bytes come before the first reply [64]",
        defaults: &[64.0],
        make: |a| Fault::Garbage(count(a[0]) as usize),
    },
    Kind {
        name: "bad-vv",
        arguments: "",
        help: "VV has a wrong checksum on SERI and a stray line",
        defaults: &[],
        make: |_| Fault::BadVersion,
    },
    Kind {
        name: "wedge",
        arguments: "",
        help: "asked for intensities or echoes, it is silent until powered off",
        defaults: &[],
        make: |_| Fault::Wedge,
    },
    Kind {
        name: "rb-silent",
        arguments: "",
        help: "reboots without an answer to the second RB",
        defaults: &[],
        make: |_| Fault::SilentReboot,
    },
    Kind {
        name: "slow-sl",
        arguments: "FOR",
        help: "the answer to %SL takes this long [1]",
        defaults: &[1.0],
        make: |a| Fault::SlowSleep(micros(a[0])),
    },
];

fn count(value: f64) -> u64 {
    value.round().max(1.0) as u64
}

fn micros(seconds: f64) -> u64 {
    (seconds * 1e6).round() as u64
}

fn window(arguments: &[f64]) -> Window {
    Window { at_us: micros(arguments[0]), for_us: micros(arguments[1]), every_us: micros(arguments[2]) }
}

/// Why a `--fault` cannot be understood.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
pub enum FaultError {
    /// There is no such kind.
    #[error("unknown fault `{0}`; known are {list}", list = names())]
    Unknown(String),
    /// An argument is not a number in its range.
    #[error("fault `{kind}`: `{argument}` is not {wanted}; use {kind}:{arguments}")]
    Argument {
        /// Which fault.
        kind: &'static str,
        /// What was given.
        argument: String,
        /// What is wanted.
        wanted: &'static str,
        /// Arguments of the fault.
        arguments: &'static str,
    },
    /// More arguments than the fault has.
    #[error("fault `{kind}`: too many arguments; use {kind}{colon}{arguments}")]
    TooMany {
        /// Which fault.
        kind: &'static str,
        /// `:`, if there are any arguments.
        colon: &'static str,
        /// Arguments of the fault.
        arguments: &'static str,
    },
}

fn names() -> String {
    KINDS.map(|kind| kind.name).join(", ")
}

impl std::str::FromStr for Fault {
    type Err = FaultError;

    /// Reads `KIND` or `KIND:ARGUMENT,ARGUMENT…`; arguments left out have the default of [`KINDS`].
    fn from_str(text: &str) -> Result<Self, FaultError> {
        let (name, given) = text.split_once(':').map_or((text, None), |(name, given)| (name, Some(given)));
        let kind = KINDS.iter().find(|kind| kind.name == name);
        let kind = kind.ok_or_else(|| FaultError::Unknown(name.to_owned()))?;
        let mut values = kind.defaults.to_vec();
        for (n, argument) in given.into_iter().flat_map(|given| given.split(',')).enumerate() {
            let Some(value) = values.get_mut(n) else {
                let colon = if kind.arguments.is_empty() { "" } else { ":" };
                return Err(FaultError::TooMany { kind: kind.name, colon, arguments: kind.arguments });
            };
            let is_rate = kind.arguments == "RATE";
            let is_count = !is_rate && (kind.arguments.starts_with('N') || kind.arguments == "BYTES");
            let (highest, wanted) = match (is_rate, is_count) {
                (true, _) => (1.0, "a probability from 0 to 1"),
                (_, true) => (1e9, "a whole number from 1"),
                _ => (1e9, "a number of seconds from 0"),
            };
            let parsed = argument.trim().parse::<f64>().ok();
            let legal = |value: &f64| {
                (0.0..=highest).contains(value) && (!is_count || (value.fract() == 0.0 && *value >= 1.0))
            };
            *value = parsed.filter(legal).ok_or_else(|| FaultError::Argument {
                kind: kind.name,
                argument: argument.to_owned(),
                wanted,
                arguments: kind.arguments,
            })?;
        }
        Ok((kind.make)(&values))
    }
}

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

    /// A whole scan, perhaps spoilt; `foreign` is the reply that may get in between.
    pub(super) fn damage_scan(&mut self, mut reply: Vec<u8>, foreign: impl Fn() -> Vec<u8>) -> Vec<u8> {
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
        }
        reply
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

    fn parsed(text: &str) -> Result<Fault, String> {
        text.parse::<Fault>().map_err(|error| error.to_string())
    }

    #[test]
    fn faults_are_read_with_and_without_arguments() {
        assert_eq!(parsed("bit-flip"), Ok(Fault::BitFlip(0.0001)));
        assert_eq!(parsed("bit-flip:0.5"), Ok(Fault::BitFlip(0.5)));
        assert_eq!(parsed("overrun:3"), Ok(Fault::Overrun(3, 16)));
        let window = Window { at_us: 2_000_000, for_us: 500_000, every_us: 0 };
        assert_eq!(parsed("unplug:2,0.5"), Ok(Fault::Unplug(window)));
        for kind in KINDS {
            assert!(parsed(kind.name).is_ok(), "{}", kind.name);
        }
    }

    #[test]
    fn wrong_faults_are_refused_in_one_clear_line() {
        let unknown = parsed("bitflip").unwrap_err();
        assert!(unknown.starts_with("unknown fault `bitflip`; known are bit-flip, lost-byte,"), "{unknown}");
        let wrong = |text| parsed(text).unwrap_err();
        assert_eq!(
            wrong("bit-flip:2"),
            "fault `bit-flip`: `2` is not a probability from 0 to 1; use bit-flip:RATE"
        );
        assert_eq!(
            wrong("half-scan:0"),
            "fault `half-scan`: `0` is not a whole number from 1; use half-scan:N"
        );
        assert_eq!(
            wrong("stall:-1"),
            "fault `stall`: `-1` is not a number of seconds from 0; use stall:AT,FOR,EVERY"
        );
        assert_eq!(wrong("wedge:1"), "fault `wedge`: too many arguments; use wedge");
        assert_eq!(wrong("stall:nan"), wrong("stall:-1").replace("-1", "nan"));
    }

    #[test]
    fn windows_repeat_when_told_to() {
        let once = Window { at_us: 100, for_us: 10, every_us: 0 };
        assert_eq!([99, 100, 109, 110].map(|at| once.end_us(at)), [None, Some(110), Some(110), None]);
        let again = Window { every_us: 50, ..once };
        assert_eq!([155, 160].map(|at| again.end_us(at)), [Some(160), None]);
    }

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
    fn a_foreign_reply_stands_between_two_data_lines() {
        let mut faults = Faults::new(&[Fault::ForeignReply(1)], 1, 0);
        faults.unstable_scan();
        let scan = b"MD\n99b\nstamp\nfirst\nsecond\nlast\n\n".to_vec();
        let spoilt = faults.damage_scan(scan, || b"II\n00P\n\n".to_vec());
        let spoilt = String::from_utf8(spoilt).unwrap();
        assert!(spoilt.contains("\nII\n00P\n\n"), "{spoilt}");
        assert!(spoilt.starts_with("MD\n99b\nstamp\n") && spoilt.ends_with("last\n\n"), "{spoilt}");
    }
}
