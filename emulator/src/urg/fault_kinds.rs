//! The kinds of faults, and how the command line names them.
//!
//! ```text
//! --fault KIND              with the values of the help text
//! --fault KIND:A,B,C        arguments left out keep them
//! ```

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
    /// `abnormal:AT,EVERY`: breaks; only a reboot helps, or, in SCIP 2.0, a reset.
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
    pub(super) fn end_us(&self, at_us: u64) -> Option<u64> {
        let since_us = at_us.checked_sub(self.at_us)?;
        let begin_us = match self.every_us {
            0 => self.at_us,
            every_us => at_us - since_us % every_us,
        };
        let end_us = begin_us.saturating_add(self.for_us);
        (at_us < end_us).then_some(end_us)
    }
}

/// What an argument of a fault is.
#[derive(Clone, Copy, Debug)]
enum Parameter {
    Rate,
    Count,
    Bytes,
    At,
    For,
    Every,
}

/// Which numbers an argument may be.
#[derive(Clone, Copy)]
enum Range {
    Probability,
    Whole,
    Seconds,
}

impl Parameter {
    /// As the help text calls it.
    const fn name(self) -> &'static str {
        match self {
            Self::Rate => "RATE",
            Self::Count => "N",
            Self::Bytes => "BYTES",
            Self::At => "AT",
            Self::For => "FOR",
            Self::Every => "EVERY",
        }
    }

    const fn range(self) -> Range {
        match self {
            Self::Rate => Range::Probability,
            Self::Count | Self::Bytes => Range::Whole,
            Self::At | Self::For | Self::Every => Range::Seconds,
        }
    }
}

impl Range {
    fn contains(self, value: f64) -> bool {
        match self {
            Self::Probability => (0.0..=1.0).contains(&value),
            Self::Whole => (1.0..=1e9).contains(&value) && value.fract() == 0.0,
            Self::Seconds => (0.0..=1e9).contains(&value),
        }
    }

    const fn wanted(self) -> &'static str {
        match self {
            Self::Probability => "a probability from 0 to 1",
            Self::Whole => "a whole number from 1",
            Self::Seconds => "a number of seconds from 0",
        }
    }
}

/// One kind of fault, for parsing and for the help text.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Name on the command line.
    pub name: &'static str,
    /// What it does.
    pub help: &'static str,
    /// What its arguments are, each with its value if it is left out; there are no more than these.
    parameters: &'static [(Parameter, f64)],
    make: fn(&[f64]) -> Fault,
}

impl Kind {
    /// As it is written on the command line, with all its arguments: `stall:AT,FOR,EVERY`.
    #[must_use]
    pub fn usage(&self) -> String {
        let arguments: Vec<&str> = self.parameters.iter().map(|(parameter, _)| parameter.name()).collect();
        let colon = if arguments.is_empty() { "" } else { ":" };
        format!("{}{colon}{}", self.name, arguments.join(","))
    }
}

/// Every kind of fault. Times are in seconds after the start; EVERY 0 means once.
pub const KINDS: [Kind; 20] = [
    Kind {
        name: "bit-flip",
        help: "a bit of a byte is wrong, with this probability [0.0001]",
        parameters: &[(Parameter::Rate, 0.0001)],
        make: |a| Fault::BitFlip(a[0]),
    },
    Kind {
        name: "lost-byte",
        help: "a byte is lost, with this probability [0.0001]",
        parameters: &[(Parameter::Rate, 0.0001)],
        make: |a| Fault::LostByte(a[0]),
    },
    Kind {
        name: "extra-byte",
        help: "a random byte comes before a byte, with this probability [0.0001]",
        parameters: &[(Parameter::Rate, 0.0001)],
        make: |a| Fault::ExtraByte(a[0]),
    },
    Kind {
        name: "half-scan",
        help: "every N-th scan breaks off somewhere [10]",
        parameters: &[(Parameter::Count, 10.0)],
        make: |a| Fault::HalfScan(count(a[0])),
    },
    Kind {
        name: "overrun",
        help: "every N-th scan lacks some bytes in a row, as by overrun [10,16]",
        parameters: &[(Parameter::Count, 10.0), (Parameter::Bytes, 16.0)],
        make: |a| Fault::Overrun(count(a[0]), count(a[1]) as usize),
    },
    Kind {
        name: "foreign-reply",
        help: "every N-th scan has a whole reply to II in its middle [10]",
        parameters: &[(Parameter::Count, 10.0)],
        make: |a| Fault::ForeignReply(count(a[0])),
    },
    Kind {
        name: "unstable",
        help: "every N-th scan is a status 0M without data [10]",
        parameters: &[(Parameter::Count, 10.0)],
        make: |a| Fault::Unstable(count(a[0])),
    },
    Kind {
        name: "stall",
        help: "nothing is sent for a while, then all of it at once [5,0.39,0]",
        parameters: &[(Parameter::At, 5.0), (Parameter::For, 0.39), (Parameter::Every, 0.0)],
        make: |a| Fault::Stall(window(a)),
    },
    Kind {
        name: "stuck",
        help: "the same stamp and ranges in every scan [5,1,0]",
        parameters: &[(Parameter::At, 5.0), (Parameter::For, 1.0), (Parameter::Every, 0.0)],
        make: |a| Fault::Stuck(window(a)),
    },
    Kind {
        name: "abnormal",
        help: "breaks, until a reboot (SCIP 2.2: 0L) or a reset (SCIP 2.0: 50) [5,0]",
        parameters: &[(Parameter::At, 5.0), (Parameter::Every, 0.0)],
        make: |a| Fault::Abnormal(window(&[a[0], 0.0, a[1]])),
    },
    Kind {
        name: "power-cycle",
        help: "no power for a while: bit rate and SCIP 2.0 are forgotten [5,1,0]",
        parameters: &[(Parameter::At, 5.0), (Parameter::For, 1.0), (Parameter::Every, 0.0)],
        make: |a| Fault::PowerCycle(window(a)),
    },
    Kind {
        name: "unplug",
        help: "the cable carries nothing for a while [5,1,0]",
        parameters: &[(Parameter::At, 5.0), (Parameter::For, 1.0), (Parameter::Every, 0.0)],
        make: |a| Fault::Unplug(window(a)),
    },
    Kind {
        name: "disconnect",
        help: "the connection is closed for a while [5,1,0]",
        parameters: &[(Parameter::At, 5.0), (Parameter::For, 1.0), (Parameter::Every, 0.0)],
        make: |a| Fault::Disconnect(window(a)),
    },
    Kind {
        name: "ignore-qt",
        help: "the first N requests to quit are not heard [1]",
        parameters: &[(Parameter::Count, 1.0)],
        make: |a| Fault::IgnoreQuit(count(a[0]) as u32),
    },
    Kind {
        name: "tm-busy",
        help: "the first N TM0 are answered 10 [1]",
        parameters: &[(Parameter::Count, 1.0)],
        make: |a| Fault::TimeBusy(count(a[0]) as u32),
    },
    Kind {
        name: "garbage",
        help: "random bytes come before the first reply [64]",
        parameters: &[(Parameter::Bytes, 64.0)],
        make: |a| Fault::Garbage(count(a[0]) as usize),
    },
    Kind {
        name: "bad-vv",
        help: "VV has a wrong checksum on SERI and a stray line",
        parameters: &[],
        make: |_| Fault::BadVersion,
    },
    Kind {
        name: "wedge",
        help: "asked for intensities or echoes, it is silent until powered off",
        parameters: &[],
        make: |_| Fault::Wedge,
    },
    Kind {
        name: "rb-silent",
        help: "reboots without an answer to the second RB",
        parameters: &[],
        make: |_| Fault::SilentReboot,
    },
    Kind {
        name: "slow-sl",
        help: "the answer to %SL takes this long [1]",
        parameters: &[(Parameter::For, 1.0)],
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
#[derive(Clone, Debug, thiserror::Error)]
pub enum FaultError {
    /// There is no such kind.
    #[error("unknown fault `{0}`; known are {list}", list = names())]
    Unknown(String),
    /// An argument is not a number in its range.
    #[error("fault `{}`: `{argument}` is not {wanted}; use {}", kind.name, kind.usage())]
    Argument {
        /// Which fault.
        kind: Kind,
        /// What was given.
        argument: String,
        /// What is wanted.
        wanted: &'static str,
    },
    /// More arguments than the fault has.
    #[error("fault `{}`: too many arguments; use {}", .0.name, .0.usage())]
    TooMany(Kind),
}

fn names() -> String {
    KINDS.map(|kind| kind.name).join(", ")
}

impl std::str::FromStr for Fault {
    type Err = FaultError;

    /// Reads `KIND` or `KIND:ARGUMENT,ARGUMENT…`; arguments left out have the default of [`KINDS`].
    fn from_str(text: &str) -> Result<Self, FaultError> {
        let (name, given) = text.split_once(':').map_or((text, None), |(name, given)| (name, Some(given)));
        let kind = KINDS.into_iter().find(|kind| kind.name == name);
        let kind = kind.ok_or_else(|| FaultError::Unknown(name.to_owned()))?;
        let mut values: Vec<f64> = kind.parameters.iter().map(|(_, default)| *default).collect();
        for (n, argument) in given.into_iter().flat_map(|given| given.split(',')).enumerate() {
            let Some((value, (parameter, _))) = values.get_mut(n).zip(kind.parameters.get(n)) else {
                return Err(FaultError::TooMany(kind));
            };
            let range = parameter.range();
            let parsed = argument.trim().parse().ok().filter(|value| range.contains(*value));
            *value = parsed.ok_or_else(|| FaultError::Argument {
                kind,
                argument: argument.to_owned(),
                wanted: range.wanted(),
            })?;
        }
        Ok((kind.make)(&values))
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
}
