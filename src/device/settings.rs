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
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    fn fault(text: &str) -> (u8, SettingFault) {
        let BadSetting { line, fault } = Settings::new().changed_by(text).unwrap_err();
        (line, fault)
    }

    #[test]
    fn settings_read_as_they_were_written() {
        let text = "name=Tür 3\nforeground_mm=150\nopen_range_mm=3000\nlearn_scans=100\n\
                    first_step=100\nlast_step=600\ncluster=2\nskip=1\ntiles=10,1,2,6,4\naddress=10.1.2.3/16,10.1.0.1\n\
                    hosts=10.1.2.4,192.168.178.254\n";
        let settings = Settings::new().changed_by(text).unwrap();
        assert_eq!(settings.text().as_str(), text);
        assert_eq!(
            Settings::restored(text.as_bytes()),
            Restored { settings: settings.clone(), address_unusable: false }
        );
        let defaults = Settings::new();
        let unnamed = settings.changed_by(&defaults.text()).unwrap();
        assert_eq!(unnamed, Settings { name: settings.name, ..defaults }, "a name is kept");
    }

    #[test]
    fn the_longest_settings_fit_the_text() {
        let hosts = ["223.255.255.255"; HOSTS].join(",");
        let text = std::format!(
            "name={}\naddress=223.255.255.254/30,223.255.255.253\nhosts={hosts}",
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
        assert_eq!(fault("skip=1\nname="), (1, SettingFault::Value));
        assert_eq!(fault(&std::format!("name={}", "n".repeat(33))), (0, SettingFault::Range));
        assert_eq!(fault("first_step=700\nlast_step=100\n"), (1, SettingFault::Conflict));
        for text in [
            "tiles=",
            "tiles=10",
            "tiles=10,1,1,6",
            "tiles=10,1,1,6,4,2",
            "tiles=a,1,1,6,4",
            "tiles=10,,1,6,4",
        ] {
            assert_eq!(fault(text), (0, SettingFault::Value), "{text}");
        }
        for text in ["tiles=10,1,1,9,8", "tiles=10,1,1,0,4", "tiles=65536,1,1,6,4", "tiles=1,250,1,6,4"] {
            assert_eq!(fault(text), (0, SettingFault::Range), "{text}");
        }
        assert_eq!(fault("address=10.0.0.7"), (0, SettingFault::Value));
        assert_eq!(fault("address=10.0.0/24"), (0, SettingFault::Value));
        assert_eq!(fault("address=10.0.0.7.8/24"), (0, SettingFault::Value));
        assert_eq!(fault("address=10.0.0.7/24,10.0.1.1"), (0, SettingFault::Conflict));
        assert_eq!(fault("skip=1\naddress=224.0.0.1/24"), (1, SettingFault::Range));
        assert_eq!(fault("address=10.0.0.7/31"), (0, SettingFault::Range));
        assert_eq!(fault("address=10.0.0.7/24,10.0.0.7"), (0, SettingFault::Conflict));
        assert_eq!(fault("hosts=10.0.0.8,255.255.255.255"), (0, SettingFault::Range));
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
        let restored =
            Settings::restored(b"body_radius_mm=190\nskip=3\ncluster=1000\nfirst_step=9\nlast_step=8");
        assert_eq!(restored.settings, Settings { skip: 3, ..Settings::new() });
        assert!(!restored.address_unusable);
    }

    #[test]
    fn a_stored_address_that_no_interface_can_have_gives_way_to_the_default_and_is_said() {
        for address in ["224.0.0.1/24", "255.255.255.255/30", "10.0.0.7/24,10.0.1.1", "10.0.0.7", ""] {
            let restored =
                Settings::restored(std::format!("skip=1\naddress={address}\ncluster=2").as_bytes());
            assert_eq!(restored.settings, Settings { skip: 1, cluster: 2, ..Settings::new() }, "{address}");
            assert!(restored.address_unusable, "{address}");
        }
    }

    const KEYS: [&str; 12] = [
        "name",
        "foreground_mm",
        "open_range_mm",
        "learn_scans",
        "first_step",
        "last_step",
        "cluster",
        "skip",
        "tiles",
        "address",
        "hosts",
        "speed",
    ];

    fn hostile_line() -> impl Strategy<Value = std::string::String> {
        let address = || any::<[u8; 4]>().prop_map(|of| Ipv4Addr::from(of).to_string());
        let network = || (address(), 0..=33u8).prop_map(|(address, bits)| std::format!("{address}/{bits}"));
        let value = prop_oneof![
            any::<i64>().prop_map(|value| value.to_string()),
            any::<u16>().prop_map(|value| value.to_string()),
            prop::collection::vec(address(), 0..10).prop_map(|hosts| hosts.join(",")),
            network(),
            Just("auto".into()),
            any::<std::string::String>(),
        ];
        prop_oneof![
            (0..KEYS.len(), value).prop_map(|(key, value)| std::format!("{}={value}", KEYS[key])),
            network().prop_map(|network| std::format!("address={network}")),
            (network(), address()).prop_map(|(network, way)| std::format!("address={network},{way}")),
        ]
    }

    proptest! {
        /// From the wire or from a store: smoltcp accepts every address in use.
        #[test]
        fn no_text_gives_settings_that_cannot_be_started_with(
            lines in prop::collection::vec(hostile_line(), 1..6),
        ) {
            let text = lines.join("\n");
            let restored = Settings::restored(text.as_bytes()).settings;
            let changed = Settings::new().changed_by(&text);
            for settings in [Some(restored), changed.ok()].into_iter().flatten() {
                if let Addressing::Static(address) = settings.addressing {
                    let own = address.address();
                    prop_assert!(!own.is_multicast() && !own.is_broadcast() && !own.is_unspecified());
                    prop_assert!(!own.is_loopback() && (1..=30).contains(&address.prefix_bits()));
                }
                prop_assert!(settings.hosts.iter().all(|host| !host.is_multicast() && !host.is_broadcast()));
                let stored = Settings::restored(settings.text().as_bytes());
                prop_assert_eq!(stored, Restored { settings, address_unusable: false });
            }
        }
    }
}
