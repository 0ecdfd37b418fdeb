//! How a module is: once a second, and at once when something changes.
//!
//! ```text
//!  uptime, µs        varint            learning        option of
//!  sequence          varint              scans taken     varint
//!  setup             varint              of              varint
//!  background        varint              started anew    varint
//!  sensor            u8, a code          moved           option of first and last step, varints
//!    detail          2 varints         counters        list of varints, in the order of `Counter`
//!  alarms            varint, bits      suspects        list of first step, last step, nearest mm, varints
//!  storing           u8, 0 or 1        events          list of number, µs, code, version, host (4 u8)
//!  subscribers       u8
//! ```

use super::codec::{
    Item, List, Malformed, Reader, TooLong, VARINT_U16, VARINT_U32, VARINT_U64, Writer, code_enum,
    count_bytes,
};
use super::counters::{COUNTERS, Counters};
use super::{DATAGRAM_MAX, HEADER_LEN};
use crate::background::{Learning, SUSPECTS, Suspect};
use crate::scip::Status;
use crate::sensor::SensorState;
use serde::{Deserialize, Serialize};

code_enum! {
    /// What the module's sensor is doing: [`SensorState`] on the wire.
    SensorCode {
        /// [`SensorState::Searching`].
        Searching = 0, "no sensor answers";
        /// [`SensorState::Booting`].
        Booting = 1, "the sensor is booting";
        /// [`SensorState::Starting`].
        Starting = 2, "the sensor is being set up";
        /// [`SensorState::Streaming`].
        Streaming = 3, "scans come";
        /// [`SensorState::Stalled`].
        Stalled = 4, "no scans come any more";
        /// [`SensorState::Abnormal`].
        Abnormal = 5, "the sensor reports a fault of its own";
        /// [`SensorState::TooLarge`]; detail: beams of a scan, beams there is memory for.
        TooLarge = 6, "the sensor has more beams than there is memory for";
        /// [`SensorState::Unusable`]; detail: the place of the `GeometryError` in its enum.
        Unusable = 7, "the sensor's parameters describe no scan";
        /// [`SensorState::Refused`]; detail: the two characters of the status.
        Refused = 8, "the sensor refuses to measure";
        /// [`SensorState::Paused`]: by the module, while it stores something.
        Paused = 9, "stopped while storing";
    }
}

/// What the module's sensor is doing, and the numbers that belong to it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SensorHealth {
    /// What it is doing.
    pub code: SensorCode,
    /// As the code says; 0 otherwise.
    pub detail: (u16, u16),
}

impl From<SensorState> for SensorHealth {
    fn from(state: SensorState) -> Self {
        let (code, detail) = match state {
            SensorState::Searching => (SensorCode::Searching, (0, 0)),
            SensorState::Booting => (SensorCode::Booting, (0, 0)),
            SensorState::Starting => (SensorCode::Starting, (0, 0)),
            SensorState::Streaming => (SensorCode::Streaming, (0, 0)),
            SensorState::Stalled => (SensorCode::Stalled, (0, 0)),
            SensorState::Abnormal => (SensorCode::Abnormal, (0, 0)),
            SensorState::TooLarge { beams, capacity } => (SensorCode::TooLarge, (beams, capacity)),
            SensorState::Unusable(error) => (SensorCode::Unusable, (error as u16, 0)),
            SensorState::Paused => (SensorCode::Paused, (0, 0)),
            SensorState::Refused(Status([one, two])) => (SensorCode::Refused, (one.into(), two.into())),
        };
        Self { code, detail }
    }
}

code_enum! {
    /// What happened.
    EventKind {
        /// Learning began: asked for, or because there was no background.
        LearnStarted = 0, "learning began";
        /// A new background is in use.
        Learned = 1, "a new background was learned";
        /// People moved in view: learning began anew.
        LearnRestarted = 2, "people moved: learning began anew";
        /// A host's wish to absorb was carried out.
        Absorbed = 3, "a place became background";
        /// The sensor or what it measures has changed: the background is forgotten.
        BackgroundForgotten = 4, "the background was forgotten";
        /// A beam's drift made a new version of the profile.
        BackgroundDrifted = 5, "the background drifted";
        /// A host has changed settings.
        SettingsChanged = 6, "settings were changed";
        /// A host has asked for a restart.
        Restarting = 7, "restarting";
        /// An address was stored that no interface can have: the module runs over DHCP.
        AddressUnusable = 8, "the stored address cannot be used: over DHCP";
        /// No host was answered over new addressing: the previous one is back.
        AddressReturned = 9, "no host came over the new address: the previous one is back";
        /// Three starts in a row did not last: this one is over DHCP, whatever is stored.
        AddressDefault = 10, "three starts did not last: over DHCP";
        /// The board's button was held: settings and background are erased.
        FactoryReset = 11, "settings and background were erased by the button";
        /// A host has set the keys.
        KeysSet = 12, "keys were set";
        /// A new image runs, on trial.
        ImageOnTrial = 13, "a new image runs on trial";
        /// The image has confirmed itself.
        ImageConfirmed = 14, "the new image works and stays";
        /// The image did not confirm itself: the one before is back.
        ImageReverted = 15, "the new image did not work: the one before is back";
        /// The image that came is not signed by a maker that the boot loader knows.
        ImageForged = 16, "the image is not signed by its maker: not started";
        /// The image that came is not what its manifest says.
        ImageDamaged = 17, "the image is damaged: not started";
        /// The image that came is for another board, or another program.
        ImageOther = 18, "the image is for another board or program: not started";
        /// The image that came is older than may start.
        ImageTooOld = 19, "the image is older than may start: not started";
    }
}

/// Conditions that need an operator's attention, a bit each. Bits are only ever added.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Alarms(pub u32);

impl Alarms {
    /// No scan for `NO_SCAN_INTERVALS` of `sensor/timeouts.rs`, or none ever.
    pub const NO_SCANS: Self = Self(1);
    /// There is no background: nothing is judged.
    pub const NO_BACKGROUND: Self = Self(1 << 1);
    /// Learning waits for people in view to leave.
    pub const LEARNING_WAITS: Self = Self(1 << 2);
    /// The background holds things with the shape of a person.
    pub const SUSPECTS: Self = Self(1 << 3);
    /// Settings or background cannot be stored.
    pub const STORE_FAILED: Self = Self(1 << 4);
    /// The sensor's clock cannot be followed well: stamps are more than 20 ms uncertain.
    pub const CLOCK_UNCERTAIN: Self = Self(1 << 5);
    /// The last start was caused by the watchdog.
    pub const WATCHDOG: Self = Self(1 << 6);

    /// All that are known, with their names.
    pub const NAMES: [(Self, &'static str); 7] = [
        (Self::NO_SCANS, "no_scans"),
        (Self::NO_BACKGROUND, "no_background"),
        (Self::LEARNING_WAITS, "learning_waits"),
        (Self::SUSPECTS, "suspects"),
        (Self::STORE_FAILED, "store_failed"),
        (Self::CLOCK_UNCERTAIN, "clock_uncertain"),
        (Self::WATCHDOG, "watchdog"),
    ];

    /// These and those.
    #[must_use]
    pub const fn with(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// Whether any of `others` is on.
    #[must_use]
    pub const fn has(self, others: Self) -> bool {
        self.0 & others.0 != 0
    }
}

/// How far learning is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LearningProgress {
    /// Scans taken since the last start.
    pub scans: u16,
    /// Scans wanted.
    pub of: u16,
    /// How often people moving in view made it start anew.
    pub restarts: u16,
    /// Where, the last time: first and last step.
    pub moved: Option<(u16, u16)>,
}

impl LearningProgress {
    /// What the pipeline says; nothing when nothing is being learned.
    #[must_use]
    pub const fn of(learning: Learning) -> Option<Self> {
        match learning {
            Learning::Idle => None,
            Learning::Running { scans, of, restarts, moved } => Some(Self { scans, of, restarts, moved }),
        }
    }
}

/// Most events in a health message: the newest.
pub const EVENTS: usize = 8;

/// An event for the host, sent several times so that it arrives.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Event {
    /// Counts the events since the start, from 1.
    pub number: u32,
    /// When, µs since boot.
    pub at_us: u64,
    /// What.
    pub kind: EventKind,
    /// The background version afterwards.
    pub background_version: u16,
    /// The host that asked for it, IPv4; 0: no host did.
    pub by: [u8; 4],
}

/// Health, to be sent or as received.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Health<'a> {
    /// What fits in single values.
    pub head: HealthHead,
    /// Everything dropped, refused or done again since the start.
    pub counters: Counters,
    /// What the newest learned background holds that has the shape of a person.
    pub suspects: List<'a, Suspect>,
    /// The newest [`EVENTS`] events, oldest first.
    pub events: List<'a, Event>,
}

/// The single values of [`Health`].
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HealthHead {
    /// µs since boot.
    pub uptime_us: u64,
    /// Sequence of the newest report; 0: none yet.
    pub sequence: u32,
    /// As in the reports.
    pub setup: u16,
    /// Newest background version; 0: never learned.
    pub background_version: u16,
    /// What the sensor is doing.
    pub sensor: SensorHealth,
    /// What needs attention.
    pub alarms: Alarms,
    /// Something is being stored; the stream is stopped meanwhile.
    pub storing: bool,
    /// Subscribers now.
    pub subscribers: u8,
    /// How far learning is; nothing when nothing is being learned.
    pub learning: Option<LearningProgress>,
}

const HEAD_MAX: usize = VARINT_U64
    + VARINT_U32
    + 2 * VARINT_U16
    + (1 + 2 * VARINT_U16)
    + VARINT_U32
    + 1
    + 1
    + (1 + 3 * VARINT_U16 + 1 + 2 * VARINT_U16);

/// Most bytes of a health message.
pub const HEALTH_MAX: usize = HEAD_MAX
    + count_bytes(COUNTERS)
    + COUNTERS * <u32 as Item>::MAX
    + count_bytes(SUSPECTS)
    + SUSPECTS * Suspect::MAX
    + count_bytes(EVENTS)
    + EVENTS * Event::MAX;

const _: () = assert!(HEADER_LEN + HEALTH_MAX <= DATAGRAM_MAX);

impl<'a> Health<'a> {
    pub(super) fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put(&self.head)?;
        self.counters.list().write(writer)?;
        self.suspects.write(writer)?;
        self.events.write(writer)
    }

    pub(super) fn read(reader: &mut Reader<'a>) -> Result<Self, Malformed> {
        Ok(Self {
            head: reader.required()?,
            counters: Counters::of_list(reader.list()?),
            suspects: reader.added(Reader::list)?,
            events: reader.added(Reader::list)?,
        })
    }
}

impl Item for Suspect {
    const MAX: usize = 3 * VARINT_U16;

    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put(&(self.first_step, self.last_step, self.near_mm))
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let (first_step, last_step, near_mm) = reader.required()?;
        Ok(Self { first_step, last_step, near_mm })
    }
}

impl Item for Event {
    const MAX: usize = VARINT_U32 + VARINT_U64 + 1 + VARINT_U16 + 4;

    fn write(&self, writer: &mut Writer<'_>) -> Result<(), TooLong> {
        writer.put(self)
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        reader.required()
    }
}
