//! Requests to the sensor.
//!
//! ```text
//!   M D 0044 0725 01 0 00 \n                until \n: what the sensor echoes
//!   │ │  │    │   │  │ └ scans, 00 without end; in a scan's echo: scans that remain
//!   │ │  │    │   │  └ scans left out after each
//!   │ │  │    │   └ steps joined into one value (the smallest is sent)
//!   │ │  first and last step
//!   │ └ D three characters a value, S two
//!   └ M until QT, G once (without the last two fields)
//!
//!   T M 1 ; t a g \n                        a tag, at most 7 characters here, is echoed as well
//! ```
//!
//! Source: SCIP 2.0 (C-42-03320B), command formats.

/// Longest tag behind `;`. The protocol allows 16 characters; with 7, an echo is no longer than
/// what the reader keeps of every line.
pub const MAX_TAG: usize = 7;

/// Longest echo: `SS` and its rate, `;` and a tag; `MD` and `MS` have 15 characters.
pub const MAX_ECHO: usize = 8 + 1 + MAX_TAG;

/// The bit rates of `SS`, in baud. Not every model supports all of them.
pub const BIT_RATES: [u32; 7] = [19_200, 38_400, 57_600, 115_200, 250_000, 500_000, 750_000];

/// Characters that carry one value.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Width {
    /// `MS`, `GS`: up to 4095 mm.
    Two,
    /// `MD`, `GD`: up to 262 143 mm.
    Three,
}

impl Width {
    /// The number of characters.
    #[must_use]
    pub const fn characters(self) -> u8 {
        match self {
            Self::Two => 2,
            Self::Three => 3,
        }
    }
}

/// What to measure.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Measurement {
    /// First step, 0 to 9999.
    pub first_step: u16,
    /// Last step, inclusive, `first_step` to 9999.
    pub last_step: u16,
    /// Steps joined into one value, 1 to 99.
    pub cluster: u8,
    /// Scans left out after each one sent, 0 to 9. `Get` does not use it.
    pub skip: u8,
    /// Scans to send, 1 to 99; 0 until `QT`. `Get` does not use it.
    pub scans: u8,
    /// Characters a value.
    pub width: Width,
}

impl Measurement {
    /// Steps from first to last; 0 when they are inverted.
    #[must_use]
    pub const fn steps(&self) -> u16 {
        if self.last_step < self.first_step {
            0
        } else {
            (self.last_step - self.first_step).saturating_add(1)
        }
    }

    /// Values of a scan when a last incomplete group counts. A sensor may leave that group out:
    /// see [`min_beams`](Self::min_beams).
    #[must_use]
    pub const fn beams(&self) -> u16 {
        self.steps().div_ceil(self.divisor())
    }

    /// Values of a scan when a last incomplete group is left out.
    #[must_use]
    pub const fn min_beams(&self) -> u16 {
        self.steps() / self.divisor()
    }

    /// Bytes of one scan's reply to `MD` or `MS` without a tag: what the line must carry each period.
    #[must_use]
    pub const fn reply_bytes(&self) -> u32 {
        const ECHO_STATUS_STAMP_AND_END: u32 = 16 + 4 + 6 + 1;
        let characters = self.beams() as u32 * self.width.characters() as u32;
        ECHO_STATUS_STAMP_AND_END + characters + 2 * characters.div_ceil(64)
    }

    const fn divisor(&self) -> u16 {
        if self.cluster == 0 { 1 } else { self.cluster as u16 }
    }
}

/// Everything this library asks of a sensor.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Command {
    /// `VV`: the sensor's maker, product, firmware and serial number.
    Version,
    /// `PP`: what it can measure.
    Parameters,
    /// `II`: how it is.
    State,
    /// `%ST`: its state as three digits (SCIP 2.2).
    StateCode,
    /// `BM`: laser on.
    LaserOn,
    /// `QT`: stop measuring, laser off.
    Quit,
    /// `RS`: reset; motor and bit rate to default.
    Reset,
    /// `RT`: reset, but keep motor speed and bit rate.
    Restart,
    /// `RB`: reboot; to be sent twice within a second.
    Reboot,
    /// `SS`: bit rate, one of [`BIT_RATES`].
    BitRate(u32),
    /// `TM0`: enter the time-synchronisation state.
    TimeEnter,
    /// `TM1`: read the sensor's clock.
    TimeRead,
    /// `TM2`: leave the time-synchronisation state.
    TimeLeave,
    /// `SCIP2.0`: leave SCIP 1.1.
    Scip20,
    /// `MD` or `MS`: measure, scan after scan.
    Measure(Measurement),
    /// `GD` or `GS`: the latest scan; the laser must be on.
    Get(Measurement),
}

/// Why a command cannot be sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CommandError {
    /// The last step comes before the first, or has more than four digits.
    Steps,
    /// The cluster is not 1 to 99.
    Cluster,
    /// The skip is not 0 to 9.
    Skip,
    /// The number of scans is not 0 to 99.
    Scans,
    /// Not one of [`BIT_RATES`].
    BitRate,
    /// The tag is longer than 7 characters, or has one that is not a letter, a digit, a space or
    /// `._+@`, or belongs to a measurement.
    Tag,
}

impl core::fmt::Display for CommandError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Steps => "the last step must be 9999 at most and not before the first",
            Self::Cluster => "the cluster must be 1 to 99",
            Self::Skip => "the skip must be 0 to 9",
            Self::Scans => "the number of scans must be 0 to 99",
            Self::BitRate => "not a bit rate of these sensors",
            Self::Tag => "a tag is at most 7 letters, digits, spaces or ._+@, and not for a measurement",
        })
    }
}

impl core::error::Error for CommandError {}

impl Command {
    /// The request as it goes on the wire.
    ///
    /// # Errors
    /// A parameter is outside its limits.
    pub fn encode(&self) -> Result<Request, CommandError> {
        self.encode_tagged(b"")
    }

    /// The request with `;` and `tag` behind it, which the sensor repeats in every echo; without
    /// them when `tag` is empty. It tells late replies from awaited ones; scans carry a stamp, so
    /// measurements take none.
    ///
    /// # Errors
    /// A parameter is outside its limits, or the tag has an illegal character.
    pub fn encode_tagged(&self, tag: &[u8]) -> Result<Request, CommandError> {
        let mut request = Request { command: *self, bytes: [0; MAX_ECHO + 1], length: 0, fixed: 0 };
        match *self {
            Self::Version => request.push(b"VV"),
            Self::Parameters => request.push(b"PP"),
            Self::State => request.push(b"II"),
            Self::StateCode => request.push(b"%ST"),
            Self::LaserOn => request.push(b"BM"),
            Self::Quit => request.push(b"QT"),
            Self::Reset => request.push(b"RS"),
            Self::Restart => request.push(b"RT"),
            Self::Reboot => request.push(b"RB"),
            Self::BitRate(rate_baud) => {
                if !BIT_RATES.contains(&rate_baud) {
                    return Err(CommandError::BitRate);
                }
                request.push(b"SS");
                request.push(&digits::<6>(rate_baud));
            }
            Self::TimeEnter => request.push(b"TM0"),
            Self::TimeRead => request.push(b"TM1"),
            Self::TimeLeave => request.push(b"TM2"),
            Self::Scip20 => request.push(b"SCIP2.0"),
            Self::Measure(measurement) => {
                if measurement.skip > 9 {
                    return Err(CommandError::Skip);
                }
                if measurement.scans > 99 {
                    return Err(CommandError::Scans);
                }
                request.push_measurement(b'M', &measurement)?;
                request.push(&digits::<1>(measurement.skip.into()));
                request.fixed = request.length;
                request.push(&digits::<2>(measurement.scans.into()));
            }
            Self::Get(measurement) => request.push_measurement(b'G', &measurement)?,
        }
        if !tag.is_empty() {
            let legal = |c: &u8| c.is_ascii_alphanumeric() || b" ._+@".contains(c);
            let measurement = matches!(self, Self::Measure(_) | Self::Get(_));
            if measurement || tag.len() > MAX_TAG || !tag.iter().all(legal) {
                return Err(CommandError::Tag);
            }
            request.push(b";");
            request.push(tag);
        }
        request.push(b"\n");
        Ok(request)
    }
}

/// A request as it goes on the wire.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Request {
    command: Command,
    bytes: [u8; MAX_ECHO + 1],
    length: u8,
    /// Characters in front of the count of scans.
    fixed: u8,
}

impl Request {
    /// The bytes to send, line feed included.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.length)).unwrap_or(&[])
    }

    /// The first line of its reply, without the line feed.
    #[must_use]
    pub fn echo(&self) -> &[u8] {
        self.as_bytes().split_last().map_or(&[], |(_, echo)| echo)
    }

    /// The command.
    #[must_use]
    pub const fn command(&self) -> Command {
        self.command
    }

    /// How many scans remain after this one if `echo` is an echo of this `MD` or `MS` request:
    /// equal but for that count, which is at most the number asked for.
    #[must_use]
    pub fn remaining(&self, echo: &[u8]) -> Option<u8> {
        let Command::Measure(Measurement { scans, .. }) = self.command else { return None };
        let fixed = usize::from(self.fixed);
        let (asked_head, _) = self.echo().split_at_checked(fixed)?;
        let (head, rest) = echo.split_at_checked(fixed)?;
        let &[tens, units] = rest else { return None };
        if head != asked_head || !tens.is_ascii_digit() || !units.is_ascii_digit() {
            return None;
        }
        let remaining = (tens & 0x0F) * 10 + (units & 0x0F);
        (remaining <= scans).then_some(remaining)
    }

    fn push_measurement(&mut self, kind: u8, measurement: &Measurement) -> Result<(), CommandError> {
        let &Measurement { first_step, last_step, cluster, width, .. } = measurement;
        if last_step < first_step || last_step > 9999 {
            return Err(CommandError::Steps);
        }
        if cluster == 0 || cluster > 99 {
            return Err(CommandError::Cluster);
        }
        self.push(&[kind, if width == Width::Three { b'D' } else { b'S' }]);
        self.push(&digits::<4>(first_step.into()));
        self.push(&digits::<4>(last_step.into()));
        self.push(&digits::<2>(cluster.into()));
        Ok(())
    }

    /// Appends; the longest request fills `bytes` exactly.
    fn push(&mut self, bytes: &[u8]) {
        let free = self.bytes.get_mut(usize::from(self.length)..).unwrap_or_default();
        for (slot, &byte) in free.iter_mut().zip(bytes) {
            *slot = byte;
            self.length = self.length.saturating_add(1);
        }
    }
}

/// The last `N` decimal digits of `value`.
fn digits<const N: usize>(mut value: u32) -> [u8; N] {
    let mut digits = [b'0'; N];
    for digit in digits.iter_mut().rev() {
        *digit = b'0' + (value % 10) as u8;
        value /= 10;
    }
    digits
}

#[cfg(test)]
mod tests {
    use super::*;

    const URG: Measurement =
        Measurement { first_step: 44, last_step: 725, cluster: 1, skip: 0, scans: 0, width: Width::Three };

    fn bytes(command: Command) -> std::vec::Vec<u8> {
        command.encode().unwrap().as_bytes().into()
    }

    #[test]
    fn commands_read_as_in_recorded_transcripts() {
        assert_eq!(bytes(Command::Get(URG)), b"GD0044072501\n");
        assert_eq!(bytes(Command::Measure(URG)), b"MD0044072501000\n");
        let short = Measurement { cluster: 2, skip: 3, scans: 10, width: Width::Two, ..URG };
        assert_eq!(bytes(Command::Measure(short)), b"MS0044072502310\n");
        assert_eq!(bytes(Command::Get(short)), b"GS0044072502\n");
        assert_eq!(bytes(Command::BitRate(57_600)), b"SS057600\n");
        assert_eq!(bytes(Command::BitRate(115_200)), b"SS115200\n");
        let plain: [(Command, &[u8]); 13] = [
            (Command::Version, b"VV\n"),
            (Command::Parameters, b"PP\n"),
            (Command::State, b"II\n"),
            (Command::StateCode, b"%ST\n"),
            (Command::LaserOn, b"BM\n"),
            (Command::Quit, b"QT\n"),
            (Command::Reset, b"RS\n"),
            (Command::Restart, b"RT\n"),
            (Command::Reboot, b"RB\n"),
            (Command::TimeEnter, b"TM0\n"),
            (Command::TimeRead, b"TM1\n"),
            (Command::TimeLeave, b"TM2\n"),
            (Command::Scip20, b"SCIP2.0\n"),
        ];
        for (command, text) in plain {
            assert_eq!(bytes(command), text);
        }
    }

    #[test]
    fn a_tag_follows_the_request() {
        let tagged = Command::TimeRead.encode_tagged(b"k7").unwrap();
        assert_eq!(tagged.as_bytes(), b"TM1;k7\n");
        assert_eq!(tagged.echo(), b"TM1;k7");
        let longest = Command::BitRate(750_000).encode_tagged(b"0123abc").unwrap();
        assert_eq!(longest.as_bytes(), b"SS750000;0123abc\n");
        assert_eq!(longest.echo().len(), MAX_ECHO);
        for bad in [&b"01234567"[..], b"a;b", b"a\nb", b"\xff"] {
            assert_eq!(Command::Quit.encode_tagged(bad), Err(CommandError::Tag));
        }
        assert_eq!(Command::Get(URG).encode_tagged(b"a"), Err(CommandError::Tag));
    }

    #[test]
    fn illegal_parameters_are_refused_by_name() {
        let refused = |measurement| Command::Measure(measurement).encode().unwrap_err();
        assert_eq!(refused(Measurement { last_step: 43, ..URG }), CommandError::Steps);
        assert_eq!(refused(Measurement { last_step: 10_000, ..URG }), CommandError::Steps);
        assert_eq!(refused(Measurement { cluster: 0, ..URG }), CommandError::Cluster);
        assert_eq!(refused(Measurement { cluster: 100, ..URG }), CommandError::Cluster);
        assert_eq!(refused(Measurement { skip: 10, ..URG }), CommandError::Skip);
        assert_eq!(refused(Measurement { scans: 100, ..URG }), CommandError::Scans);
        assert_eq!(Command::BitRate(9600).encode(), Err(CommandError::BitRate));
        assert!(Command::Measure(Measurement { last_step: 44, ..URG }).encode().is_ok());
    }

    #[test]
    fn the_count_of_an_echo_is_read_and_all_else_must_be_equal() {
        let ten = Command::Measure(Measurement { scans: 10, ..URG }).encode().unwrap();
        assert_eq!(ten.remaining(b"MD0044072501010"), Some(10));
        assert_eq!(ten.remaining(b"MD0044072501009"), Some(9));
        assert_eq!(ten.remaining(b"MD0044072501011"), None);
        assert_eq!(ten.remaining(b"MD004407250100"), None);
        assert_eq!(ten.remaining(b"MD0044072501009;x"), None);
        assert_eq!(ten.remaining(b"MD004407250100 "), None);
        assert_eq!(ten.remaining(b"MS0044072501009"), None);
        let endless = Command::Measure(URG).encode().unwrap();
        assert_eq!(endless.remaining(b"MD0044072501000"), Some(0));
        assert_eq!(endless.remaining(b"MD0044072501001"), None);
        assert_eq!(Command::Get(URG).encode().unwrap().remaining(b"GD0044072501"), None);
    }

    #[test]
    fn reply_sizes_are_those_of_the_table() {
        let size = |last_step, width| Measurement { first_step: 0, last_step, width, ..URG }.reply_bytes();
        assert_eq!(size(681, Width::Two), 1435);
        assert_eq!(size(681, Width::Three), 2137);
        assert_eq!(size(725, Width::Three), 2275);
        assert_eq!(size(768, Width::Two), 1615);
        assert_eq!(size(1080, Width::Three), 3372);
        assert_eq!(Measurement { cluster: 2, ..URG }.reply_bytes(), 1082);
    }

    #[test]
    fn a_cluster_that_does_not_divide_leaves_the_count_open_by_one() {
        let odd = Measurement { first_step: 0, last_step: 724, cluster: 2, ..URG };
        assert_eq!((odd.min_beams(), odd.beams()), (362, 363));
        let even = Measurement { cluster: 2, ..URG };
        assert_eq!((even.min_beams(), even.beams()), (341, 341));
    }
}
