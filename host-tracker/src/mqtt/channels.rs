//! Every topic: what its payload is, who publishes it, and whether the broker keeps it.
//!
//! ```text
//!   Channel { address, payload, … } ─▶ `schema::asyncapi` ─▶ GET /api/asyncapi.json, docs/schemas/asyncapi.json
//!             └ compared with what is published by the tests below, and by those with a broker
//! ```

use kehai_tracking::door::{DoorLine, Input};
use kehai_tracking::names::message::Message as Sign;

use super::payloads::{
    Alarm, Alarms, Availability, Discovery, DoorAlarmOrder, Line, Lock, Module, Name, Present, Refused,
    Total, Tracker, Zone,
};
use super::presses::{Button, Pressed};
use crate::type_schema::{Make, of};

/// What a payload is.
#[derive(Clone, Copy)]
pub enum Payload {
    /// JSON that the tracker publishes, of this schema.
    Json(Make),
    /// JSON that it takes.
    Taken(Make),
    /// What an input of a door says.
    Input(Input),
    /// A word, not as JSON.
    Word(Make),
    /// A word that the tracker takes.
    TakenWord(Make),
}

/// A topic, or those that differ in the names between braces alone.
#[derive(Clone)]
pub struct Channel {
    pub id: String,
    pub address: String,
    pub about: &'static str,
    pub payload: Payload,
    /// The broker gives its newest message to clients that subscribe later; an empty one takes it away.
    pub is_retained: bool,
}

impl Channel {
    fn new(id: &str, address: &str, about: &'static str, payload: Payload) -> Self {
        let is_order = matches!(payload, Payload::Taken(_) | Payload::TakenWord(_) | Payload::Input(_));
        let (id, address) = (id.to_owned(), address.to_owned());
        Self { id, address, about, payload, is_retained: !is_order }
    }

    /// An order or a refusal, which holds at its time alone.
    fn passes(self) -> Self {
        Self { is_retained: false, ..self }
    }
}

/// All of them. `{prefix}` is `kehai`, and `{discovery}` is `homeassistant`, if nothing else is said.
pub fn channels() -> Vec<Channel> {
    use Payload::{Json, Taken, Word};
    let site = |id, rest: &str, about, payload| {
        Channel::new(id, &format!("{{prefix}}/{{site}}/{rest}"), about, payload)
    };
    let available = |id, rest, about| site(id, rest, about, Word(of::<Availability>));
    let mut all = vec![
        available("status", "status", "Whether the tracker runs and knows something; also its last will."),
        site("tracker", "tracker", "The tracker itself.", Json(of::<Tracker>)),
        site("presence", "presence", "That a tracker is there, every 10 s.", Json(of::<Present>)).passes(),
        site("total", "total", "The whole site.", Json(of::<Total>)),
        available("totalAvailability", "total/availability", "Whether something is known of it."),
        site("zone", "zone/{zone}", "A zone.", Json(of::<Zone>)),
        available("zoneAvailability", "zone/{zone}/availability", "Whether something is known of it."),
        site("line", "line/{line}", "A counting line.", Json(of::<Line>)),
        available("lineAvailability", "line/{line}/availability", "Whether something of it is seen."),
        site("module", "module/{module}", "A module of the site.", Json(of::<Module>)),
        available("moduleAvailability", "module/{module}/availability", "Whether it is heard."),
        site("moduleRefused", "module/{module}/refused", "A press that did nothing.", Json(of::<Refused>))
            .passes(),
        site(
            "name",
            "name/{label}",
            "An ID that was read, by the first digits of its hash.",
            Json(of::<Name>),
        ),
        site("alarms", "alarms", "How many alarms stand.", Json(of::<Alarms>)),
        site("trackerAlarm", "alarm/tracker/{alarm}", "An alarm of the tracker itself.", Json(of::<Alarm>)),
        site("moduleAlarm", "alarm/module/{module}/{alarm}", "An alarm of a module.", Json(of::<Alarm>)),
        site("doorAlarm", "alarm/door/{door}/{alarm}", "An alarm of a door.", Json(of::<Alarm>)),
        site("zoneAlarm", "alarm/zone/{zone}/{alarm}", "An alarm of a zone.", Json(of::<Alarm>)),
        site("areaAlarm", "alarm/area/{area}/{alarm}", "An alarm of an area.", Json(of::<Alarm>)),
        site("door", "door/{door}", "A guarded door.", Json(of::<DoorLine>)),
        site("doorLock", "door/{door}/lock", "What the lock is to be: a lease.", Json(of::<Lock>)).passes(),
        site("doorAlarmOrder", "door/{door}/alarm", "What the alarm is to be.", Json(of::<DoorAlarmOrder>))
            .passes(),
        site("doorRefused", "door/{door}/refused", "An input that changed nothing.", Json(of::<Refused>))
            .passes(),
        site("sign", "sign", "What a reader of cards or tags has read.", Taken(of::<Sign>)),
        site("signRefused", "sign/refused", "A sign that changed nothing.", Json(of::<Refused>)).passes(),
        Channel::new(
            "discovery",
            "{discovery}/device/{device}/config",
            "A device, for Home Assistant.",
            Json(of::<Discovery>),
        ),
    ];
    all.extend(Input::NAMED.map(|(input, name)| {
        let (id, address) = (name.replace('/', "-"), format!("{{prefix}}/{{site}}/door/{{door}}/{name}"));
        Channel::new(&format!("door-{id}"), &address, "An input of a door.", Payload::Input(input))
    }));
    all.extend(Button::NAMED.map(|(_, name)| {
        let (id, address) =
            (format!("module-{name}"), format!("{{prefix}}/{{site}}/module/{{module}}/{name}"));
        let about = "A button of a module, with --mqtt-commands.";
        Channel::new(&id, &address, about, Payload::TakenWord(of::<Pressed>))
    }));
    all
}

/// Whether a topic is one of an address.
#[cfg(test)]
fn is_of(topic: &str, address: &str) -> bool {
    let (mut parts, mut wanted) = (topic.split('/'), address.split('/'));
    loop {
        match (parts.next(), wanted.next()) {
            (None, None) => return true,
            (Some(part), Some(wanted)) if wanted.starts_with('{') || part == wanted => {}
            _ => return false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::holds::Holds;
    use super::super::home_assistant::{About, discovery};
    use super::super::inputs::is_input;
    use super::super::messages::tests::{frame, site, topics};
    use super::super::{alarms, messages, presses};
    use super::*;
    use kehai_tracking::alarm::{Active, AlarmKind, AlarmLine, Cause, Source};
    use kehai_tracking::alarm_list::AlarmList;
    use kehai_tracking::jsonl::ZoneKnown;
    use kehai_tracking::lines::CrossedLine;
    use kehai_tracking::names::NameLine;
    use kehai_tracking::now::Now;
    use kehai_tracking::site::Site;
    use kehai_tracking::snapshot::{Snapshot, active_alarms};

    /// A frame with something of everything.
    fn full() -> Snapshot {
        let mut frame = frame();
        let line = CrossedLine {
            name: "front".into(),
            inward: Some(1),
            outward: None,
            state: ZoneKnown::Known,
            unknown_s: 0.0,
            unfollowed: 0,
        };
        frame.lines.push(line);
        let (label, tracks, zones) = ("a11ce000".into(), vec![], vec![]);
        frame.names.push(NameLine { card: None, label, heard_s: 0.0, read_s: None, tracks, zones });
        let site = "[[zone]]\nname = \"hall\"\nsecure = true\npolygon = [[-1, -1], [1, -1], [1, 1], [-1, 1]]\n\
                    [[door]]\nname = \"front\"\nzone = \"hall\"\nline = [[-0.45, 1.0], [0.45, 1.0]]\nfail = \"secure\"\n";
        let site = Site::parse("site", site).unwrap();
        let doors = crate::doors::DoorHandle::new(&site, None).states();
        frame.doors = doors.into_iter().map(|door| door.line).collect();
        frame.doors[0].trouble = None;
        frame.doors[0].alarm = Some(kehai_tracking::door::Alarm::Followed);
        frame.modules[0].alarms = vec![AlarmLine::new(AlarmKind::Dirty, "clean it")];
        let own = [AlarmLine::new(AlarmKind::Database, "disk full")];
        let crowded = Active {
            source: Source::Zone("hall".into()),
            cause: Cause::Fault(AlarmKind::Crowded),
            text: "let some leave".into(),
        };
        let lost = Active {
            source: Source::Area("west".into()),
            cause: Cause::Fault(AlarmKind::Silent),
            text: "nothing is heard of it".into(),
        };
        let mut list = AlarmList::new(1);
        list.observe(
            Now { steady_s: 0.1, unix_ms: 100 },
            active_alarms(&own, &frame.modules, &frame.doors).chain([crowded, lost]),
        );
        frame.alarms = list.standing().to_vec();
        frame
    }

    #[test]
    fn every_topic_is_of_one_channel_and_every_channel_is_published() {
        let (frame, site, topics) = (full(), site(), topics());
        let mut published: Vec<String> =
            messages::states(&frame, &site, &topics, &Holds::default()).into_keys().collect();
        published.extend(alarms::states(&frame, &site, &topics).into_keys());
        published.extend(discovery(&frame, &About::default(), &topics).into_keys());
        published.push(topics.status());
        for topic in &published {
            let of: Vec<String> = channels()
                .into_iter()
                .filter(|channel| is_of(topic, &channel.address))
                .map(|channel| channel.id)
                .collect();
            assert_eq!(of.len(), 1, "{topic}: {of:?}");
        }
        let unheard: Vec<String> = channels()
            .into_iter()
            .filter(|channel| {
                channel.is_retained && !published.iter().any(|topic| is_of(topic, &channel.address))
            })
            .map(|channel| channel.id)
            .collect();
        assert!(unheard.is_empty(), "never published: {unheard:?}");
    }

    #[test]
    fn what_is_taken_is_what_is_described() {
        let (frame, topics) = (full(), topics());
        for channel in channels() {
            let topic = channel.address.replace("{prefix}/{site}", &topics.site()).replace("{door}", "front");
            let topic = topic.replace("{module}", "left");
            let button = presses::button(&frame, &site(), &topics, &topic).is_some();
            assert_eq!(button, matches!(channel.payload, Payload::TakenWord(_)), "{topic}");
            let is_taken = !matches!(channel.payload, Payload::Json(_) | Payload::Word(_));
            assert_eq!(is_input(&topics, &topic), is_taken, "{topic}");
            let input = messages::door_input(&frame, &topics, &topic).map(|(_, input)| input);
            match channel.payload {
                Payload::Input(wanted) => assert_eq!(input, Some(wanted), "{topic}"),
                Payload::Taken(_) => assert_eq!(topic, topics.sign()),
                Payload::Json(_) | Payload::Word(_) | Payload::TakenWord(_) => {
                    assert_eq!(input, None, "{topic}")
                }
            }
        }
    }
}
