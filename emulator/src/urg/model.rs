//! The sensors that can be emulated: what they say about themselves, and what they can do. A row each.
//!
//! | name | steps | period | reach | link | SCIP |
//! |---|---|---|---|---|---|
//! | `urg-04lx` | 44…725 of 1024 | 100 ms | 5.6 m | RS-232C | 1.1 at power-up, 2.0 |
//! | `urg-04lx-ug01` | 44…725 of 1024 | 100 ms | 5.6 m | USB | 2.0 |
//! | `uhg-08lx` | 0…768 of 1024 | 67 ms | 11 m | USB | 2.0 |
//! | `utm-30lx` | 0…1080 of 1440 | 25 ms | 60 m | USB | 2.0 |
//! | `ust-10lx` | 0…1080 of 1440 | 25 ms | 30 m | Ethernet | 2.2 |
//!
//! Source: recorded `PP`, `VV` and `II` replies where they are known; the UHG-08LX's are put together from
//! its data sheet and its family. Serial numbers are invented. Nothing is shared with the table of the
//! library under test (`kehai::sensor_model`): two readings of the protocol check each other.

use crate::source::SensorGeometry;

/// How a sensor behaves where models differ.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Family {
    /// URG-04LX, UHG-08LX: SCIP 2.0, replies on the rhythm of the mirror.
    Classic,
    /// UTM-30LX: as classic, with intensities and a fixed motor speed.
    TopUrg,
    /// UST-10LX: SCIP 2.2, replies on ticks of 1 ms, multi-echo, reboot, state codes.
    Ust,
}

/// What the sensor is plugged in with.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Interface {
    /// A serial line whose speed matters.
    Rs232,
    /// USB: a bit rate is accepted and has no effect.
    Usb,
    /// Ethernet: there is no bit rate.
    Ethernet,
}

/// How a sensor treats requests before it has started up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WhileBooting {
    /// It hears nothing.
    Silent,
    /// It answers, and refuses whatever needs the mirror: 10 or 01.
    Refuses,
    /// It answers as if it were ready, but measures nothing and denies `TM0` (10) until a measurement was asked for.
    /// Seen in another author's emulator of the UTM-30LX-EW.
    Accepts,
}

/// What `QT` does in the time-sync state.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum QuitInTimeSync {
    /// It leaves that state, against the text of the protocol: UTM-30LX-EW, UST.
    Leaves,
    /// It is refused as any other request there: 0E or, in SCIP 2.2, 10. Only `TM2` leaves that state.
    Refused,
}

/// What `II` says of the bit rate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum BitRateText {
    /// The rate of the serial line.
    OfLine,
    /// This, whatever was set.
    Fixed(&'static str),
}

/// One sensor model, or a variation of it: the fields are public.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Model {
    /// Name on the command line.
    pub name: &'static str,
    /// `MODL` of `PP` and `II`.
    pub model_text: &'static str,
    /// `PROD` of `VV`.
    pub product: &'static str,
    /// `FIRM` of `VV`.
    pub firmware: &'static str,
    /// `FIRM` of the SCIP 1.1 `V`, which has a format of its own.
    pub firmware_scip11: &'static str,
    /// `PROT` of `VV`.
    pub protocol: &'static str,
    /// `SERI` of `VV`.
    pub serial: &'static str,
    /// Where it behaves differently.
    pub family: Family,
    /// What it is plugged in with.
    pub interface: Interface,
    /// Bit rate after power-up.
    pub power_up_baud: u32,
    /// Whether it starts in SCIP 1.1 after each power-up.
    pub powers_up_in_scip11: bool,
    /// `PP`.
    pub geometry: SensorGeometry,
    /// Last step a request may name; steps outside the measured ones read 19.
    pub max_step: u16,
    /// `SBPS` of `II`.
    pub bit_rate_text: BitRateText,
    /// Before it has started up.
    pub while_booting: WhileBooting,
    /// `QT` in the time-sync state.
    pub quit_in_time_sync: QuitInTimeSync,
}

const CLASSIC_240: SensorGeometry = SensorGeometry {
    first_step: 44,
    last_step: 725,
    front_step: 384,
    steps_per_turn: 1024,
    range_min_mm: 20,
    range_max_mm: 5600,
    period_us: 100_000,
};

const TURN_270: SensorGeometry = SensorGeometry {
    first_step: 0,
    last_step: 1080,
    front_step: 540,
    steps_per_turn: 1440,
    range_min_mm: 20,
    range_max_mm: 30_000,
    period_us: 25_000,
};

/// The classic sensor with a serial line.
pub const URG_04LX: Model = Model {
    name: "urg-04lx",
    model_text: "URG-04LX(Hokuyo Automatic Co.,Ltd.)",
    product: "SOKUIKI Sensor URG-04LX",
    firmware: "3.3.00(16/Apr./2008)",
    firmware_scip11: "3.3.00,08/04/16(20-4095[mm],240[deg],44-725[step],600[rpm])",
    protocol: "SCIP 2.0",
    serial: "H0000001",
    family: Family::Classic,
    interface: Interface::Rs232,
    power_up_baud: 19_200,
    powers_up_in_scip11: true,
    geometry: CLASSIC_240,
    max_step: 768,
    bit_rate_text: BitRateText::OfLine,
    while_booting: WhileBooting::Silent,
    quit_in_time_sync: QuitInTimeSync::Refused,
};

/// The simple one with USB only; it names itself as the classic one.
pub const URG_04LX_UG01: Model = Model {
    name: "urg-04lx-ug01",
    product: "SOKUIKI Sensor URG-04LX UG01(Simple-URG)",
    firmware: "3.3.01(16/Apr./2009)",
    serial: "H0000002",
    interface: Interface::Usb,
    powers_up_in_scip11: false,
    ..URG_04LX
};

/// The one with the longer reach and a faster mirror.
pub const UHG_08LX: Model = Model {
    name: "uhg-08lx",
    model_text: "UHG-08LX(Hokuyo Automatic Co.,Ltd.)",
    product: "SOKUIKI Sensor UHG-08LX",
    firmware: "1.0.00(01/Apr./2008)",
    serial: "H0000003",
    interface: Interface::Usb,
    powers_up_in_scip11: false,
    geometry: SensorGeometry {
        first_step: 0,
        last_step: 768,
        range_min_mm: 30,
        range_max_mm: 11_000,
        period_us: 66_667,
        ..CLASSIC_240
    },
    bit_rate_text: BitRateText::Fixed("USB only"),
    ..URG_04LX
};

/// The outdoor one: 1081 steps, 40 revolutions a second.
pub const UTM_30LX: Model = Model {
    name: "utm-30lx",
    model_text: "UTM-30LX(Hokuyo Automatic Co.,Ltd.)",
    product: "SOKUIKI Sensor TOP-URG UTM-30LX",
    firmware: "P.1.05(17/Apr./2009)",
    serial: "H0000004",
    family: Family::TopUrg,
    interface: Interface::Usb,
    powers_up_in_scip11: false,
    geometry: SensorGeometry { range_min_mm: 23, range_max_mm: 60_000, ..TURN_270 },
    max_step: 1080,
    bit_rate_text: BitRateText::Fixed("USB Full Speed"),
    ..URG_04LX
};

/// The Ethernet one.
pub const UST_10LX: Model = Model {
    name: "ust-10lx",
    model_text: "UST-10LX",
    product: "UST-10LX",
    firmware: "2.23.0000",
    protocol: "SCIP 2.2",
    serial: "H0000005",
    family: Family::Ust,
    interface: Interface::Ethernet,
    powers_up_in_scip11: false,
    geometry: TURN_270,
    max_step: 1080,
    bit_rate_text: BitRateText::Fixed("Ethernet 100[Mbps]"),
    while_booting: WhileBooting::Refuses,
    quit_in_time_sync: QuitInTimeSync::Leaves,
    ..URG_04LX
};

/// Every model, in the order of the help text.
pub const MODELS: [Model; 5] = [URG_04LX, URG_04LX_UG01, UHG_08LX, UTM_30LX, UST_10LX];

impl Model {
    /// The model of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        MODELS.into_iter().find(|model| model.name == name)
    }

    /// The same sensor with the geometry of a recording or a scene, stated in its `PP`.
    #[must_use]
    pub fn with_geometry(self, geometry: SensorGeometry) -> Self {
        let same_turn = geometry.steps_per_turn == self.geometry.steps_per_turn;
        let max_step = if same_turn { self.max_step.max(geometry.last_step) } else { geometry.last_step };
        Self { geometry, max_step, ..self }
    }

    /// Whether it has the malfunction of SCIP 2.2, status 0L, and `RB` against it.
    #[must_use]
    pub fn reboots(&self) -> bool {
        self.family == Family::Ust
    }

    /// Motor speed in revolutions a minute.
    #[must_use]
    pub fn rpm(&self) -> u32 {
        (60_000_000 + self.geometry.period_us / 2) / self.geometry.period_us.max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_found_by_name_and_have_the_published_steps() {
        let steps: Vec<_> = MODELS.iter().map(|model| (model.geometry.steps(), model.rpm())).collect();
        assert_eq!(steps, [(682, 600), (682, 600), (769, 900), (1081, 2400), (1081, 2400)]);
        assert_eq!(Model::named("ust-10lx"), Some(UST_10LX));
        assert_eq!(Model::named("ust-10"), None);
    }

    #[test]
    fn a_recordings_geometry_replaces_the_models() {
        let geometry = SensorGeometry { first_step: 128, last_step: 639, ..URG_04LX.geometry };
        let model = URG_04LX.with_geometry(geometry);
        assert_eq!((model.geometry.steps(), model.max_step), (512, 768));
    }
}
