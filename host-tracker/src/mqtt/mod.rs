//! What is known, published to a broker, with discovery for Home Assistant.
//!
//! ```text
//!   frames ─▶ messages     frame → topics and payloads, pure; which topics: `topics`
//!             └▶ outbox    what has changed, what is new to this broker, what is stale, pure
//!                └▶ publisher ─▶ session, link ─▶ broker      threads; a new connection begins with everything
//!
//!   kehai/SITE/status                      online │ offline (also the last will)
//!   kehai/SITE/tracker                     {"alarm":null,"alarms":[],"version":"…"}
//!   kehai/SITE/total                       {"state":"known","occupied":true,"count":5}
//!   kehai/SITE/total/availability
//!   kehai/SITE/zone/ZONE                   {"alarms":[],"state":"known","occupied":true,"count":2}
//!   kehai/SITE/zone/ZONE/availability      online │ offline: nothing is known of it
//!   kehai/SITE/module/MODULE               {"state":"watching","alarm":null,"alarms":[],"scans_hz":10.0,…}
//!   kehai/SITE/module/MODULE/availability
//!   kehai/SITE/door/DOOR                   {"phase":"unlocked","lock":"unlocked","alarm":null,…}
//!   kehai/SITE/alarms, kehai/SITE/alarm/…   as `alarms` says
//!   kehai/SITE/name/LABEL                  {"track":4,"probability":0.93,"x":1.2,…}     LABEL: eight digits of an ID's hash
//!   homeassistant/device/kehai_SITE…/config
//!
//!   kehai/SITE/door/DOOR/lock              {"id":8,"at_ms":…,"lock":"unlocked","for_ms":1500}    a lease, renewed
//!                                          {"id":9,"at_ms":…,"lock":"locked"}      again every second until it is taken
//!   kehai/SITE/door/DOOR/alarm             {"id":3,"at_ms":…,"alarm":"followed"}   or null: over
//!   kehai/SITE/door/DOOR/refused           {"at_ms":…,"why":"repeated: …"}         what came in changed nothing
//!   kehai/SITE/door/DOOR/card │ number │ contact │ exit │ reset │ lock/ready │ lock/taken │ alarm/taken     ◀─ as `door::inbox` says
//!   kehai/SITE/module/MODULE/learn │ restart │ identify     PRESS                     ◀─ with --mqtt-commands, as `presses` says
//!   kehai/SITE/module/MODULE/refused       {"at_ms":…,"why":"…"}             a press that did nothing
//!   kehai/SITE/presence                    {"instance":"5c1e…"}                    as `presence` says
//!   kehai/SITE/sign                        {"id":"04A22B…","reader":"hall"}        ◀─ as `names::message` says
//!   kehai/SITE/sign/refused                {"at_ms":…,"why":"late: …"}             what came in changed nothing
//! ```
//!
//! Everything but a door's orders, inputs, signs and presences is retained: an old "unlocked" must never reach a lock that comes back.
//! A retained input is not taken, and is left to its sender: what clears it would be a new input. *Unknown* is never *empty*: a zone that no module sees has neither count nor
//! occupancy, and is not available.
//!
//! Sources: MQTT 3.1.1; Home Assistant's MQTT discovery, *device discovery payload*.

mod alarms;
mod broker;
pub(crate) mod channels;
mod entities;
mod holds;
mod home_assistant;
mod inputs;
mod link;
mod messages;
mod outage;
mod outbox;
pub(crate) mod payloads;
mod presence;
pub mod presses;
mod publisher;
mod session;
mod topics;
pub mod trust;
mod unheard;

pub use broker::{Broker, BrokerError, BrokerLink};
pub use home_assistant::{About, discovery};
pub use messages::{door_input, states};
pub use outbox::{Outbox, Publication};
pub use publisher::{Buttons, Publisher, Settings, warn_or};
pub use topics::Topics;
