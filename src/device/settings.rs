//! Settings: what an installer may change. Text on the wire and in the store, a line for each.
//!
//! | key | value | default | takes effect |
//! |---|---|---|---|
//! | `name` | 1 to 32 bytes | none: the host name | at once |
//! | `foreground_mm` | 100 to 1000 | 100 | with the next learning |
//! | `open_range_mm` | `auto`, 500 to 60000 | `auto`: by model | at once |
//! | `learn_scans` | 30 to 6000 | 60 | with the next learning |
//! | `first_step`, `last_step` | `auto`, 0 to 9999 | `auto`: the sensor's | at once |
//! | `cluster` | 1 to 99 | 1 | at once |
//! | `skip` | 0 to 9 | 0 | at once |
//! | `tiles` | `none`, or group, x and y of the first tile, columns, rows: `10,1,1,6,4` | `none` | at once |
//! | `address` | `dhcp`, `10.0.0.7/24`, `10.0.0.7/24,10.0.0.1` with gateway | `dhcp` | with the next start, on [trial](super::trial) |
//! | `hosts` | up to 8 addresses, `,` between | empty: any host | at once |
//!
//! A change is taken whole or not at all; keys that are not named keep their values.

use core::net::Ipv4Addr;

use heapless::{String, Vec};

use super::text::{self, Number, cut, ipv4, number};
use crate::address::{InterfaceAddress, UnusableAddress, is_unicast};
use crate::background::{FOREGROUND_MIN_MM, FOREGROUND_SPREADS, LEARN_SCANS, LEARN_SCANS_MIN, LearnRequest};
use crate::floor::sensfloor::Layout;
use crate::pipeline;
use crate::scip::Width;
use crate::sensor::{LineSettings, SensorSettings};
use crate::sensor_model::SensorModel;
use crate::wire::{NAME_MAX, SETTINGS_TEXT_MAX, SettingFault};

/// Most bytes of the tiles of a floor.
const TILES_MAX: usize = "65535,252,252,64,64".len();

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
    Static(InterfaceAddress),
}

/// Most bytes of [`Addressing::text`]: an address, the bits of its network, a gateway.
pub const ADDRESSING_MAX: usize = 2 * "255.255.255.255".len() + "/30,".len();

impl Addressing {
    /// As in the settings: `dhcp`, `10.0.0.7/24`, `10.0.0.7/24,10.0.0.1`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn from_text(text: &[u8]) -> Result<Self, SettingFault> {
        if text == b"dhcp" {
            return Ok(Self::Dhcp);
        }
        let (network, gateway) = cut(text, b',');
        let (address, Some(prefix)) = cut(network, b'/') else { return Err(SettingFault::Value) };
        let address = Ipv4Addr::from(ipv4(address)?);
        let gateway = gateway.map(ipv4).transpose()?.map(Ipv4Addr::from);
        match InterfaceAddress::new(address, number(prefix, 0, 255)? as u8, gateway) {
            Ok(address) => Ok(Self::Static(address)),
            Err(UnusableAddress::Prefix | UnusableAddress::Host) => Err(SettingFault::Range),
            Err(UnusableAddress::Gateway) => Err(SettingFault::Conflict),
        }
    }

    /// As in the settings; [`from_text`](Self::from_text) gives it back.
    #[must_use]
    pub fn text(&self) -> String<ADDRESSING_MAX> {
        let mut text = String::new();
        match self {
            Self::Dhcp => text::push(&mut text, "dhcp"),
            Self::Static(address) => {
                text::push_ipv4(&mut text, address.address().octets());
                text::push(&mut text, "/");
                text::push(&mut text, Number::of(u32::from(address.prefix_bits())).as_str());
                if let Some(gateway) = address.gateway() {
                    text::push(&mut text, ",");
                    text::push_ipv4(&mut text, gateway.octets());
                }
            }
        }
        text
    }
}

/// All settings.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Settings {
    /// Given by the installer; empty until then, and never again.
    pub name: String<NAME_MAX>,
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
    /// The tiles of a SensFloor, where one is in the place of the sensor.
    pub tiles: Option<Layout>,
    /// Where the address comes from.
    pub addressing: Addressing,
    /// Hosts that may control the module; none: any host.
    pub hosts: Vec<Ipv4Addr, HOSTS>,
}

/// Settings as they were found in a store.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Restored {
    /// The settings.
    pub settings: Settings,
    /// An address was stored that no interface can have; the default is used.
    pub address_unusable: bool,
}

/// An invalid setting: its line, from 0, and the fault.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct BadSetting {
    /// Line of the text.
    pub line: u8,
    /// The fault.
    pub fault: SettingFault,
}

impl Settings {
    /// As the module comes.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            name: String::new(),
            foreground_mm: FOREGROUND_MIN_MM,
            open_range_mm: None,
            learn_scans: LEARN_SCANS,
            first_step: None,
            last_step: None,
            cluster: 1,
            skip: 0,
            tiles: None,
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
            changed.apply(first).map_err(|fault| BadSetting { line, fault })?;
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

    /// Settings from the store, perhaps of another version of this program: an unknown or invalid setting is left at
    /// its default.
    #[must_use]
    pub fn restored(text: &[u8]) -> Restored {
        let mut settings = Self::new();
        let mut address_unusable = false;
        let mut rest = Some(text);
        while let Some(text) = rest {
            let (first, behind) = cut(text, b'\n');
            let mut changed = settings.clone();
            match changed.apply(first) {
                Ok(()) => settings = changed,
                Err(_) => address_unusable |= matches!(cut(first, b'='), (b"address", _)),
            }
            rest = behind;
        }
        if settings.conflicts() {
            (settings.first_step, settings.last_step) = (None, None);
        }
        Restored { settings, address_unusable }
    }

    /// Applies one line; an empty line changes nothing.
    fn apply(&mut self, line: &[u8]) -> Result<(), SettingFault> {
        if line.is_empty() {
            return Ok(());
        }
        let (key, Some(value)) = cut(line, b'=') else { return Err(SettingFault::Syntax) };
        match key {
            b"name" => self.name = name(value)?,
            b"foreground_mm" => self.foreground_mm = number(value, FOREGROUND_MIN_MM, 1000)?,
            b"open_range_mm" => self.open_range_mm = optional(value, 500, 60_000)?,
            b"learn_scans" => self.learn_scans = number(value, LEARN_SCANS_MIN, 6000)?,
            b"first_step" => self.first_step = optional(value, 0, 9999)?,
            b"last_step" => self.last_step = optional(value, 0, 9999)?,
            b"cluster" => self.cluster = number(value, 1, 99)? as u8,
            b"skip" => self.skip = number(value, 0, 9)? as u8,
            b"tiles" => self.tiles = tiles(value)?,
            b"address" => self.addressing = Addressing::from_text(value)?,
            b"hosts" => self.hosts = hosts(value)?,
            _ => return Err(SettingFault::Key),
        }
        Ok(())
    }

    fn conflicts(&self) -> bool {
        matches!((self.first_step, self.last_step), (Some(first), Some(last)) if first > last)
    }

    /// All settings as text; [`restored`](Self::restored) gives them back.
    #[must_use]
    pub fn text(&self) -> String<SETTINGS_TEXT_MAX> {
        let mut text = String::new();
        let number = |value: u16| Number::of(u32::from(value));
        let or_auto = |value: Option<u16>| value.map(number);
        if !self.name.is_empty() {
            text::line(&mut text, "name", &self.name);
        }
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
        let mut value = String::<TILES_MAX>::new();
        match self.tiles {
            None => text::push(&mut value, "none"),
            Some(layout) => {
                let (columns, rows) = layout.tiles();
                let (x, y) = layout.first();
                text::push(&mut value, number(layout.group()).as_str());
                for part in [x, y, columns, rows] {
                    text::push(&mut value, ",");
                    text::push(&mut value, number(u16::from(part)).as_str());
                }
            }
        }
        text::line(&mut text, "tiles", &value);
        text::line(&mut text, "address", &self.addressing.text());
        let mut value = String::<{ 16 * HOSTS }>::new();
        for host in &self.hosts {
            let between = if value.is_empty() { "" } else { "," };
            text::push(&mut value, between);
            text::push_ipv4(&mut value, host.octets());
        }
        text::line(&mut text, "hosts", &value);
        text
    }

    /// Settings of the sensor's session, over `line`.
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

    /// Settings of the pipeline, for a sensor of this model with the range `range_max_mm`.
    #[must_use]
    pub fn pipeline(&self, model: &str, range_max_mm: u16) -> pipeline::Settings {
        let known = pipeline::Settings::of(&SensorModel::of(model), range_max_mm);
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
    // A module without a name could not be asked for by it any more.
    if text.is_empty() || text.bytes().any(|byte| byte.is_ascii_control()) {
        return Err(SettingFault::Value);
    }
    let mut name = String::new();
    name.push_str(text).map_err(|_| SettingFault::Range)?;
    Ok(name)
}

fn optional(value: &[u8], least: u16, most: u16) -> Result<Option<u16>, SettingFault> {
    if value == b"auto" { Ok(None) } else { number(value, least, most).map(Some) }
}

fn tiles(value: &[u8]) -> Result<Option<Layout>, SettingFault> {
    if value == b"none" {
        return Ok(None);
    }
    let mut rest = Some(value);
    let mut next = |most: u16| {
        let (part, behind) = cut(rest.ok_or(SettingFault::Value)?, b',');
        rest = behind;
        number(part, 0, most)
    };
    let group = next(u16::MAX)?;
    // Below 256 each.
    let [x, y, columns, rows] = [next(255)?, next(255)?, next(255)?, next(255)?].map(|part| part as u8);
    if rest.is_some() {
        return Err(SettingFault::Value);
    }
    Layout::new(group, (x, y), (columns, rows)).map(Some).ok_or(SettingFault::Range)
}

fn hosts(value: &[u8]) -> Result<Vec<Ipv4Addr, HOSTS>, SettingFault> {
    let mut hosts = Vec::new();
    let mut rest = Some(value).filter(|value| !value.is_empty());
    while let Some(value) = rest {
        let (host, behind) = cut(value, b',');
        let host =
            Some(Ipv4Addr::from(ipv4(host)?)).filter(|&host| is_unicast(host)).ok_or(SettingFault::Range)?;
        hosts.push(host).map_err(|_| SettingFault::Range)?;
        rest = behind;
    }
    Ok(hosts)
}

#[cfg(test)]
mod tests;
