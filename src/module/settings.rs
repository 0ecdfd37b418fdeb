//! Settings: what an installer may change. Text on the wire and in the store, a line for each.
//!
//! | key | value | default | takes effect |
//! |---|---|---|---|
//! | `name` | up to 32 bytes | empty: the host name | at once |
//! | `body_radius_mm` | 100 to 400 | 190 | at once, for whoever asks |
//! | `foreground_mm` | 100 to 1000 | 100 | with the next learning |
//! | `open_range_mm` | `auto`, 500 to 60000 | `auto`: by model | at once |
//! | `learn_scans` | 30 to 6000 | 60 | with the next learning |
//! | `first_step`, `last_step` | `auto`, 0 to 9999 | `auto`: the sensor's | at once |
//! | `cluster` | 1 to 99 | 1 | at once |
//! | `skip` | 0 to 9 | 0 | at once |
//! | `address` | `dhcp`, `10.0.0.7/24`, `10.0.0.7/24,10.0.0.1` with gateway | `dhcp` | with the next start |
//! | `hosts` | up to 8 addresses, `,` between | empty: the first subscriber | at once |
//!
//! A change is taken whole or not at all; keys that are not named keep their values.

use core::net::Ipv4Addr;

use heapless::{String, Vec};

use super::text::{self, Number, cut, ipv4, number};
use crate::background::{FOREGROUND_MIN_MM, FOREGROUND_SPREADS, LEARN_SCANS, LEARN_SCANS_MIN, LearnRequest};
use crate::pipeline;
use crate::scip::Width;
use crate::sensor::{LineSettings, SensorSettings};
use crate::wire::{NAME_MAX, SETTINGS_TEXT_MAX, SettingFault};

/// Most hosts that may control a module.
pub const HOSTS: usize = 8;

/// Where the module's address comes from.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Addressing {
    /// DHCP, or else a link-local address.
    #[default]
    Dhcp,
    /// Given by the installer.
    Static {
        /// The module's address.
        address: [u8; 4],
        /// Bits of its network, 1 to 30.
        prefix: u8,
        /// The way out of its network.
        gateway: Option<[u8; 4]>,
    },
}

/// All settings.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Settings {
    /// Given by the installer; may be empty.
    pub name: String<NAME_MAX>,
    /// Radius of a body, mm.
    pub body_radius_mm: u16,
    /// Least distance in front of the background that counts, mm.
    pub foreground_mm: u16,
    /// Range at which black clothing is still seen, mm; by default the model's.
    pub open_range_mm: Option<u16>,
    /// Scans a background is learned from.
    pub learn_scans: u16,
    /// First step measured; by default the sensor's.
    pub first_step: Option<u16>,
    /// Last step measured; by default the sensor's.
    pub last_step: Option<u16>,
    /// Steps joined into one beam.
    pub cluster: u8,
    /// Scans left out after each one.
    pub skip: u8,
    /// Where the address comes from.
    pub addressing: Addressing,
    /// Hosts that may control the module; none: the first subscriber.
    pub hosts: Vec<Ipv4Addr, HOSTS>,
}

/// A setting that cannot be: the line, from 0, and what is wrong with it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BadSetting {
    /// Line of the text.
    pub line: u8,
    /// What is wrong.
    pub fault: SettingFault,
}

impl Settings {
    /// As the module comes.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            name: String::new(),
            body_radius_mm: 190,
            foreground_mm: FOREGROUND_MIN_MM,
            open_range_mm: None,
            learn_scans: LEARN_SCANS,
            first_step: None,
            last_step: None,
            cluster: 1,
            skip: 0,
            addressing: Addressing::Dhcp,
            hosts: Vec::new(),
        }
    }

    /// These settings with the changes of `text`.
    ///
    /// # Errors
    /// The first [`BadSetting`].
    pub fn changed_by(&self, text: &str) -> Result<Self, BadSetting> {
        let mut changed = self.clone();
        let mut line: u8 = 0;
        let mut rest = Some(text.as_bytes());
        while let Some(text) = rest {
            let (first, behind) = cut(text, b'\n');
            changed.take(first).map_err(|fault| BadSetting { line, fault })?;
            rest = behind;
            if rest.is_some_and(|rest| !rest.is_empty()) {
                line = line.saturating_add(1);
            }
        }
        if changed.conflicts() {
            Err(BadSetting { line, fault: SettingFault::Conflict })
        } else {
            Ok(changed)
        }
    }

    /// Settings from the store, perhaps of another version of this program: what it does not know is left out.
    #[must_use]
    pub fn restored(text: &[u8]) -> Self {
        let mut settings = Self::new();
        let mut rest = Some(text);
        while let Some(text) = rest {
            let (first, behind) = cut(text, b'\n');
            let mut changed = settings.clone();
            if changed.take(first).is_ok() {
                settings = changed;
            }
            rest = behind;
        }
        if settings.conflicts() { Self::new() } else { settings }
    }

    /// Takes one line; an empty one changes nothing.
    fn take(&mut self, line: &[u8]) -> Result<(), SettingFault> {
        if line.is_empty() {
            return Ok(());
        }
        let (key, Some(value)) = cut(line, b'=') else { return Err(SettingFault::Syntax) };
        match key {
            b"name" => self.name = name(value)?,
            b"body_radius_mm" => self.body_radius_mm = number(value, 100, 400)?,
            b"foreground_mm" => self.foreground_mm = number(value, FOREGROUND_MIN_MM, 1000)?,
            b"open_range_mm" => self.open_range_mm = optional(value, 500, 60_000)?,
            b"learn_scans" => self.learn_scans = number(value, LEARN_SCANS_MIN, 6000)?,
            b"first_step" => self.first_step = optional(value, 0, 9999)?,
            b"last_step" => self.last_step = optional(value, 0, 9999)?,
            b"cluster" => self.cluster = number(value, 1, 99)? as u8,
            b"skip" => self.skip = number(value, 0, 9)? as u8,
            b"address" => self.addressing = addressing(value)?,
            b"hosts" => self.hosts = hosts(value)?,
            _ => return Err(SettingFault::Key),
        }
        Ok(())
    }

    fn conflicts(&self) -> bool {
        let inverted = matches!((self.first_step, self.last_step), (Some(first), Some(last)) if first > last);
        let unreachable = match self.addressing {
            Addressing::Static { address, prefix, gateway: Some(gateway) } => {
                let [network, gateway] =
                    [address, gateway].map(|of| u32::from_be_bytes(of).checked_shr(32 - u32::from(prefix)));
                network != gateway
            }
            _ => false,
        };
        inverted || unreachable
    }

    /// All settings as text; [`restored`](Self::restored) gives them back.
    #[must_use]
    pub fn text(&self) -> String<SETTINGS_TEXT_MAX> {
        let mut text = String::new();
        let number = |value: u16| Number::of(u32::from(value));
        let or_auto = |value: Option<u16>| value.map(number);
        text::line(&mut text, "name", &self.name);
        text::line(&mut text, "body_radius_mm", number(self.body_radius_mm).as_str());
        text::line(&mut text, "foreground_mm", number(self.foreground_mm).as_str());
        text::line(
            &mut text,
            "open_range_mm",
            or_auto(self.open_range_mm).as_ref().map_or("auto", Number::as_str),
        );
        text::line(&mut text, "learn_scans", number(self.learn_scans).as_str());
        text::line(&mut text, "first_step", or_auto(self.first_step).as_ref().map_or("auto", Number::as_str));
        text::line(&mut text, "last_step", or_auto(self.last_step).as_ref().map_or("auto", Number::as_str));
        text::line(&mut text, "cluster", number(u16::from(self.cluster)).as_str());
        text::line(&mut text, "skip", number(u16::from(self.skip)).as_str());
        let mut value = String::<{ 16 * HOSTS }>::new();
        match self.addressing {
            Addressing::Dhcp => text::push(&mut value, "dhcp"),
            Addressing::Static { address, prefix, gateway } => {
                text::push_ipv4(&mut value, address);
                text::push(&mut value, "/");
                text::push(&mut value, number(u16::from(prefix)).as_str());
                if let Some(gateway) = gateway {
                    text::push(&mut value, ",");
                    text::push_ipv4(&mut value, gateway);
                }
            }
        }
        text::line(&mut text, "address", &value);
        value.clear();
        for host in &self.hosts {
            let between = if value.is_empty() { "" } else { "," };
            text::push(&mut value, between);
            text::push_ipv4(&mut value, host.octets());
        }
        text::line(&mut text, "hosts", &value);
        text
    }

    /// What the sensor is asked for, over `line`.
    #[must_use]
    pub const fn sensor(&self, line: LineSettings) -> SensorSettings {
        SensorSettings {
            first_step: self.first_step,
            last_step: self.last_step,
            cluster: self.cluster,
            skip: self.skip,
            width: Width::Three,
            line,
        }
    }

    /// What the pipeline is told, for a sensor of this model that reaches `range_max_mm`.
    #[must_use]
    pub fn pipeline(&self, model: &str, range_max_mm: u16) -> pipeline::Settings {
        let is = |name: &str| model.as_bytes().starts_with(name.as_bytes());
        let known = if is("URG-04LX") || is("UBG-04LX") {
            pipeline::Settings::URG_04LX
        } else if is("UHG-08LX") {
            pipeline::Settings::UHG_08LX
        } else if is("UTM-30LX") {
            pipeline::Settings::UTM_30LX
        } else {
            // No farther than the best that is known of small sensors.
            let small = pipeline::Settings::UST_10LX;
            pipeline::Settings { open_range_mm: small.open_range_mm.min(range_max_mm / 5 * 2), ..small }
        };
        pipeline::Settings {
            learn: LearnRequest { scans: self.learn_scans, even_if_moving: false },
            open_range_mm: self.open_range_mm.unwrap_or(known.open_range_mm),
            spread_min_mm: (self.foreground_mm / FOREGROUND_SPREADS).min(255) as u8,
            ..known
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::new()
    }
}

fn name(value: &[u8]) -> Result<String<NAME_MAX>, SettingFault> {
    let text = core::str::from_utf8(value).map_err(|_| SettingFault::Value)?;
    if text.bytes().any(|byte| byte.is_ascii_control()) {
        return Err(SettingFault::Value);
    }
    let mut name = String::new();
    name.push_str(text).map_err(|_| SettingFault::Range)?;
    Ok(name)
}

fn optional(value: &[u8], least: u16, most: u16) -> Result<Option<u16>, SettingFault> {
    if value == b"auto" { Ok(None) } else { number(value, least, most).map(Some) }
}

fn addressing(value: &[u8]) -> Result<Addressing, SettingFault> {
    if value == b"dhcp" {
        return Ok(Addressing::Dhcp);
    }
    let (network, gateway) = cut(value, b',');
    let (address, Some(prefix)) = cut(network, b'/') else { return Err(SettingFault::Value) };
    Ok(Addressing::Static {
        address: ipv4(address)?,
        prefix: number(prefix, 1, 30)? as u8,
        gateway: gateway.map(ipv4).transpose()?,
    })
}

fn hosts(value: &[u8]) -> Result<Vec<Ipv4Addr, HOSTS>, SettingFault> {
    let mut hosts = Vec::new();
    let mut rest = Some(value).filter(|value| !value.is_empty());
    while let Some(value) = rest {
        let (host, behind) = cut(value, b',');
        hosts.push(Ipv4Addr::from(ipv4(host)?)).map_err(|_| SettingFault::Range)?;
        rest = behind;
    }
    Ok(hosts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(text: &str) -> (u8, SettingFault) {
        let BadSetting { line, fault } = Settings::new().changed_by(text).unwrap_err();
        (line, fault)
    }

    #[test]
    fn settings_read_as_they_were_written() {
        let text = "name=Tür 3\nbody_radius_mm=200\nforeground_mm=150\nopen_range_mm=3000\nlearn_scans=100\n\
                    first_step=100\nlast_step=600\ncluster=2\nskip=1\naddress=10.1.2.3/16,10.1.0.1\n\
                    hosts=10.1.2.4,192.168.178.254\n";
        let settings = Settings::new().changed_by(text).unwrap();
        assert_eq!(settings.text().as_str(), text);
        assert_eq!(Settings::restored(text.as_bytes()), settings);
        let defaults = Settings::new();
        assert_eq!(settings.changed_by(&defaults.text()).unwrap(), defaults);
    }

    #[test]
    fn the_longest_settings_fit_the_text() {
        let hosts = ["255.255.255.255"; HOSTS].join(",");
        let text = std::format!(
            "name={}\naddress=255.255.255.254/30,255.255.255.253\nhosts={hosts}",
            "n".repeat(32)
        );
        let settings = Settings::new().changed_by(&text).unwrap();
        assert!(settings.text().ends_with(&std::format!("hosts={hosts}\n")));
        assert!(settings.text().len() < SETTINGS_TEXT_MAX / 2);
    }

    #[test]
    fn what_cannot_be_is_refused_by_line_and_fault() {
        assert_eq!(fault("skip"), (0, SettingFault::Syntax));
        assert_eq!(fault("skip=1\nspeed=3"), (1, SettingFault::Key));
        assert_eq!(fault("skip=fast"), (0, SettingFault::Value));
        assert_eq!(fault("skip="), (0, SettingFault::Value));
        assert_eq!(fault("skip=10"), (0, SettingFault::Range));
        assert_eq!(fault("learn_scans=29"), (0, SettingFault::Range));
        assert_eq!(fault("learn_scans=99999999999999"), (0, SettingFault::Range));
        assert_eq!(fault("name=a\tb"), (0, SettingFault::Value));
        assert_eq!(fault(&std::format!("name={}", "n".repeat(33))), (0, SettingFault::Range));
        assert_eq!(fault("first_step=700\nlast_step=100\n"), (1, SettingFault::Conflict));
        assert_eq!(fault("address=10.0.0.7"), (0, SettingFault::Value));
        assert_eq!(fault("address=10.0.0/24"), (0, SettingFault::Value));
        assert_eq!(fault("address=10.0.0.7.8/24"), (0, SettingFault::Value));
        assert_eq!(fault("address=10.0.0.7/24,10.0.1.1"), (0, SettingFault::Conflict));
        assert_eq!(fault("hosts=1.2.3.4,"), (0, SettingFault::Value));
        assert_eq!(fault("hosts=1.2.3.256"), (0, SettingFault::Value));
        assert_eq!(fault(&std::format!("hosts={}", ["1.2.3.4"; 9].join(","))), (0, SettingFault::Range));
    }

    #[test]
    fn nothing_of_a_change_is_taken_when_a_part_of_it_is_wrong() {
        let settings = Settings::new();
        assert!(settings.changed_by("skip=2\ncluster=100").is_err());
        assert_eq!(settings, Settings::new());
        assert_eq!(settings.changed_by("").unwrap(), settings);
    }

    #[test]
    fn stored_settings_of_another_version_lose_only_what_is_not_known() {
        let settings = Settings::restored(b"colour=red\nskip=3\ncluster=1000");
        assert_eq!(settings, Settings { skip: 3, ..Settings::new() });
    }
}
