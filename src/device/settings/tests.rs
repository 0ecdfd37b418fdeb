//! Settings that are taken, refused, and written as they are read.

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
    let text =
        std::format!("name={}\naddress=223.255.255.254/30,223.255.255.253\nhosts={hosts}", "n".repeat(32));
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
    for text in
        ["tiles=", "tiles=10", "tiles=10,1,1,6", "tiles=10,1,1,6,4,2", "tiles=a,1,1,6,4", "tiles=10,,1,6,4"]
    {
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
    let restored = Settings::restored(b"body_radius_mm=190\nskip=3\ncluster=1000\nfirst_step=9\nlast_step=8");
    assert_eq!(restored.settings, Settings { skip: 3, ..Settings::new() });
    assert!(!restored.address_unusable);
}

#[test]
fn a_stored_address_that_no_interface_can_have_gives_way_to_the_default_and_is_said() {
    for address in ["224.0.0.1/24", "255.255.255.255/30", "10.0.0.7/24,10.0.1.1", "10.0.0.7", ""] {
        let restored = Settings::restored(std::format!("skip=1\naddress={address}\ncluster=2").as_bytes());
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
