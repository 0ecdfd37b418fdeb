//! The status of a reply: two characters, never a number (`0A` to `0M` are not 0).
//!
//! ```text
//!   MD0044072501000 \n    echo
//!   9 9 b \n              status, checksum
//! ```
//!
//! Source: SCIP 2.0 (C-42-03320B) p. 23 and the status page of the vendor's wiki.

/// Two status characters as they came.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Status(pub [u8; 2]);

impl Status {
    /// Accepted.
    pub const OK: Self = Self(*b"00");
    /// A scan follows.
    pub const DATA: Self = Self(*b"99");
    /// `BM`: the laser is on already. `TM0`: in that state already.
    pub const ALREADY: Self = Self(*b"02");
    /// `SS`: the line runs at that rate already. `TM2`: not in that state.
    pub const ALREADY_AT_RATE: Self = Self(*b"03");
    /// `SS`: this model has no such rate.
    pub const NOT_FOR_MODEL: Self = Self(*b"04");
    /// Command not defined; in time-synchronisation state: any command but `TM`.
    pub const NOT_DEFINED: Self = Self(*b"0E");
    /// Command not supported by this model.
    pub const NOT_SUPPORTED: Self = Self(*b"0F");
    /// The sensor has a fault; only a reboot helps.
    pub const ABNORMAL: Self = Self(*b"0L");
    /// Denied in this state; for `GD` and `GS`: the laser is off.
    pub const DENIED: Self = Self(*b"10");

    /// The meaning of the status in a reply to `MD` or `MS`.
    #[must_use]
    pub const fn of_measurement(self) -> MeasurementStatus {
        match self.0 {
            [b'0', b'0'] => MeasurementStatus::Accepted,
            [b'9', b'9'] => MeasurementStatus::Data,
            [b'9', b'8'] => MeasurementStatus::Resumed,
            [b'0', b'M'] => MeasurementStatus::Unstable,
            [b'0', b'L'] => MeasurementStatus::Abnormal,
            [b'2', b'1'..=b'9'] | [b'3' | b'4', b'0'..=b'9'] => MeasurementStatus::Verifying,
            [b'5'..=b'8', b'0'..=b'9'] | [b'9', b'0'..=b'7'] => MeasurementStatus::Hardware,
            _ => MeasurementStatus::Refused,
        }
    }
}

/// What a status says about a running or requested measurement.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MeasurementStatus {
    /// 00: the measurement starts.
    Accepted,
    /// 99: a scan follows.
    Data,
    /// 0M: unstable; this scan has no data, the next may.
    Unstable,
    /// 0L: the sensor has a fault and needs a reboot.
    Abnormal,
    /// 21 to 49: stopped to verify an error; [`Resumed`](Self::Resumed) or a fault follows.
    Verifying,
    /// 50 to 97: hardware trouble; the measurement is over.
    Hardware,
    /// 98: goes on after the verification.
    Resumed,
    /// Anything else: the request was not accepted.
    Refused,
}

impl core::fmt::Display for Status {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.0.iter().try_for_each(|&c| f.write_fmt(format_args!("{}", c.escape_ascii())))
    }
}

impl core::fmt::Debug for Status {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_fmt(format_args!("Status({self})"))
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Status {
    fn format(&self, f: defmt::Formatter<'_>) {
        let [first, second] = self.0;
        defmt::write!(f, "Status({} {})", char::from(first), char::from(second));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn letters_are_not_zero() {
        assert_ne!(Status(*b"0A"), Status::OK);
        assert_eq!(Status(*b"0A").of_measurement(), MeasurementStatus::Refused);
    }

    #[test]
    fn the_measurement_statuses_lie_where_the_specification_says() {
        let of = |text: &[u8; 2]| Status(*text).of_measurement();
        assert_eq!(of(b"20"), MeasurementStatus::Refused);
        for tens in b'2'..=b'4' {
            assert_eq!(of(&[tens, b'1']), MeasurementStatus::Verifying);
            assert_eq!(of(&[tens, b'9']), MeasurementStatus::Verifying);
        }
        assert_eq!(of(b"50"), MeasurementStatus::Hardware);
        assert_eq!(of(b"97"), MeasurementStatus::Hardware);
        assert_eq!(of(b"98"), MeasurementStatus::Resumed);
        assert_eq!(of(b"99"), MeasurementStatus::Data);
        assert_eq!(of(b"0M"), MeasurementStatus::Unstable);
        assert_eq!(of(b"0L"), MeasurementStatus::Abnormal);
    }

    #[test]
    fn a_status_prints_as_its_characters() {
        assert_eq!(Status::DATA.to_string(), "99");
        assert_eq!(Status([0, b'A']).to_string(), "\\x00A");
    }
}
