//! A sensor's identity and state: the `VV` and `II` replies, by key.
//!
//! ```text
//!   KEY : VALUE ; S \n      S covers KEY:VALUE; a VALUE may contain `;` and `:`
//!
//!   VV   VEND PROD FIRM PROT SERI            free text
//!   II   MODL LASR SCSP MESM SBPS TIME STAT  formats differ from family to family:
//!        TIME  6A5404        six hexadecimal digits (classic URG, UTM, UXM)
//!        TIME  0Y\3          four characters of the code (UTM-30LX-EW, UST)
//!        SCSP  Initial(600[rpm])<-Default setting by user      or  2400
//!        SBPS  19200[bps]<-Default setting by user             or  USB only
//! ```
//!
//! Whatever a reply leaves out or words in a way not known here reads `None` or empty. Some
//! URG-04LX send a wrong checksum with `SERI` and a stray line, so `VV` is for logs, not for
//! decisions. Source: SCIP 2.0 (C-42-03320B), `VV` and `II`; recorded replies.

use super::{encoding, parameters::number, text::Text};

/// The `VV` reply. Its checksums are not held against it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Version {
    /// `PROD`, the product's name.
    pub product: Text<40>,
    /// `FIRM`, the firmware.
    pub firmware: Text<32>,
    /// `PROT`, the protocol.
    pub protocol: Text<16>,
    /// `SERI`, the serial number.
    pub serial: Text<16>,
}

impl Version {
    pub(super) fn set_field(&mut self, key: &[u8], value: &[u8]) {
        match key {
            b"PROD" => self.product = Text::new(value),
            b"FIRM" => self.firmware = Text::new(value),
            b"PROT" => self.protocol = Text::new(value),
            b"SERI" => self.serial = Text::new(value),
            _ => {}
        }
    }
}

/// The `II` reply. In a fault it may hold less than half of this.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SensorState {
    /// `LASR`: whether the laser is on.
    pub laser_on: Option<bool>,
    /// `SCSP`: turns per minute.
    pub speed_rpm: Option<u32>,
    /// `MESM`: what it is doing, in the sensor's words.
    pub mode: Text<32>,
    /// `SBPS`: bit rate of the serial line in baud; `None` on USB and Ethernet.
    pub bit_rate_baud: Option<u32>,
    /// `TIME`: the sensor's clock, ms in 24 bits.
    pub stamp_ms: Option<u32>,
    /// `STAT`: how it is, in the sensor's words.
    pub condition: Text<40>,
}

impl SensorState {
    pub(super) fn set_field(&mut self, key: &[u8], value: &[u8]) {
        match key {
            b"LASR" => {
                self.laser_on = match value {
                    b"ON" => Some(true),
                    b"OFF" => Some(false),
                    _ => None,
                }
            }
            b"SCSP" => self.speed_rpm = number_before(value, b"[rpm]").or_else(|| number(value)),
            b"MESM" => self.mode = Text::new(value),
            b"SBPS" => self.bit_rate_baud = number_before(value, b"[bps]"),
            b"TIME" => self.stamp_ms = stamp(value),
            b"STAT" => self.condition = Text::new(value),
            _ => {}
        }
    }
}

/// The `%ST` reply: three digits.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StateCode {
    /// 000 (100 becoming unstable).
    Standby,
    /// 001: not ready yet.
    Booting,
    /// 002 (102): answers `TM` only.
    TimeSynchronisation,
    /// 003 (103).
    SingleScan,
    /// 004 (104): streaming.
    MultiScan,
    /// 005: laser and motor off.
    Sleep,
    /// 006: on its way out of sleep.
    Waking,
    /// 900: a fault.
    Error,
    /// Any other.
    Other,
}

impl StateCode {
    pub(super) fn new(digits: &[u8]) -> Self {
        match digits {
            b"000" | b"100" => Self::Standby,
            b"001" => Self::Booting,
            b"002" | b"102" => Self::TimeSynchronisation,
            b"003" | b"103" => Self::SingleScan,
            b"004" | b"104" => Self::MultiScan,
            b"005" => Self::Sleep,
            b"006" => Self::Waking,
            b"900" => Self::Error,
            _ => Self::Other,
        }
    }
}

/// The sensor's clock in either of its two spellings.
fn stamp(text: &[u8]) -> Option<u32> {
    match text.len() {
        4 => encoding::decode(text),
        6 => text.iter().try_fold(0u32, |stamp, &c| {
            char::from(c).to_digit(16).map(|digit| stamp.wrapping_shl(4) | digit)
        }),
        _ => None,
    }
}

/// The number right in front of the first `unit`.
fn number_before(text: &[u8], unit: &[u8]) -> Option<u32> {
    let at = (0..text.len()).find(|&at| text.get(at..).is_some_and(|rest| rest.starts_with(unit)))?;
    let head = text.get(..at)?;
    let digits = head.iter().rev().take_while(|c| c.is_ascii_digit()).count();
    number(head.get(head.len().checked_sub(digits)?..)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_is_read_in_both_spellings() {
        assert_eq!(stamp(b"6A5404"), Some(6_968_324));
        assert_eq!(stamp(b"0Y\\3"), Some(170_755));
        assert_eq!(stamp(b"j;o["), encoding::decode(b"j;o["));
        assert!(stamp(b"j;o[").is_some());
        assert_eq!(stamp(b"6A540x"), None);
        assert_eq!(stamp(b""), None);
    }

    #[test]
    fn speeds_and_rates_are_found_in_every_wording() {
        let speed = |text: &[u8]| {
            let mut state = SensorState::default();
            state.set_field(b"SCSP", text);
            state.speed_rpm
        };
        assert_eq!(speed(b"Initial(600[rpm])<-Default setting by user"), Some(600));
        assert_eq!(speed(b"90%(540[rpm])"), Some(540));
        assert_eq!(speed(b"2400"), Some(2400));
        assert_eq!(speed(b"fast"), None);
        assert_eq!(number_before(b"19200[bps]<-Default setting by user", b"[bps]"), Some(19_200));
        assert_eq!(number_before(b"Ethernet 100 [Mbps]", b"[bps]"), None);
        assert_eq!(number_before(b"[bps]", b"[bps]"), None);
    }

    #[test]
    fn state_codes_have_their_unstable_twins() {
        assert_eq!(StateCode::new(b"104"), StateCode::MultiScan);
        assert_eq!(StateCode::new(b"900"), StateCode::Error);
        assert_eq!(StateCode::new(b"101"), StateCode::Other);
    }
}
