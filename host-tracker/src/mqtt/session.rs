//! One connection to a broker: what is published over it, and what is done with messages that arrive.
//!
//! ```text
//!   frames ─▶ outbox ─▶ due ─▶ retained topics        a sign ─▶ signs
//!   doors ─▶ orders, never retained                   a press ─▶ presser ─▶ module
//!                                                     a card, a number, … ─▶ door
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError};
use std::time::{Duration, Instant};

use rumqttc::{Client, QoS};
use tokio::sync::watch;
use tracing::Level;

use super::home_assistant::About;
use super::inputs::{KeptInputs, is_input};
use super::link::News;
use super::messages::{door_input, door_topics};
use super::outage::Outage;
use super::outbox::{Outbox, Publication};
use super::payloads::{Availability, DoorAlarmOrder, Lock, Refused, written};
use super::presence::Presence;
use super::presses::{NotPressed, Presser, Target, button};
use crate::doors::DoorHandle;
use crate::log_limit::CountLog;
use crate::shared_count::SharedCount;
use crate::signs::SignHandle;
use crate::tracker_alarms::TrackerAlarms;
use kehai_tracking::alarm::AlarmKind;
use kehai_tracking::door::doors::Output;
use kehai_tracking::site::Site;
use kehai_tracking::snapshot::{Snapshot, unix_ms};

/// Wait for a frame.
pub(super) const WAIT: Duration = Duration::from_millis(100);

/// News of the link that are taken at a time: between two rounds doors' orders go out, which have leases to renew.
const ROUND: usize = 1024;

/// Whether a round has left news of the link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Left {
    Nothing,
    Perhaps,
}

/// One connection.
pub(super) struct Session<'a> {
    pub client: Client,
    pub site: watch::Receiver<Arc<Site>>,
    pub map_url: Option<&'a str>,
    pub outbox: &'a mut Outbox,
    pub connected: bool,
    /// The newest frame.
    pub newest: Arc<Snapshot>,
    /// Where the orders of each door go, also of one that has just gone from the site.
    pub door_topics: BTreeMap<String, String>,
    pub doors: Option<&'a DoorHandle>,
    pub signs: Option<&'a SignHandle>,
    pub presser: Option<&'a Presser>,
    pub outage: &'a mut Outage,
    pub presence: &'a mut Presence,
    pub alarms: &'a TrackerAlarms,
    /// Messages that found no room on their way here, over all connections, and what the log has said of them.
    pub dropped: &'a SharedCount,
    pub drop_log: &'a mut CountLog<1>,
    pub kept_inputs: &'a mut KeptInputs,
    /// Says something of this broker.
    pub say: &'a dyn Fn(Level, &str),
}

impl Session<'_> {
    /// Publishes until the connection ends, and returns why it did; None when it was stopped.
    pub fn run(
        &mut self,
        frames: &Receiver<Arc<Snapshot>>,
        told: Option<&Receiver<Output>>,
        news: &Receiver<News>,
        stop: &AtomicBool,
        begun: Instant,
    ) -> Option<String> {
        let mut left = Left::Nothing;
        loop {
            let wait = match left {
                Left::Nothing => WAIT,
                Left::Perhaps => Duration::ZERO,
            };
            let fresh = match frames.recv_timeout(wait) {
                Ok(frame) => Some(frame),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => {
                    self.end();
                    return None;
                }
            };
            if stop.load(Ordering::Relaxed) {
                self.end();
                return None;
            }
            // Only the newest snapshot matters.
            let fresh = frames.try_iter().last().or(fresh);
            if let Some(frame) = &fresh {
                self.use_snapshot(frame);
            }
            left = match self.take_news(news) {
                Ok(left) => left,
                Err(reason) => return Some(reason),
            };
            self.say_dropped();
            if let Err(reason) = self.look_for_another(Instant::now()) {
                return Some(reason);
            }
            if let Some(presser) = self.presser {
                presser.refusals().for_each(|(target, why)| self.refuse(&target, &why));
            }
            // What was published while no broker was connected is stale: the doors repeat what still holds.
            let orders: Vec<Output> = told.map(|told| told.try_iter().collect()).unwrap_or_default();
            if self.connected
                && let Err(reason) = self.publish_due(&orders, fresh.as_deref(), begun)
            {
                return Some(reason);
            }
        }
    }

    /// From now on this is what is known; with it the site, if that has changed.
    fn use_snapshot(&mut self, frame: &Arc<Snapshot>) {
        self.newest = Arc::clone(frame);
        if self.site.has_changed().unwrap_or(false) {
            let site = Arc::clone(&self.site.borrow_and_update());
            let map_url = self.map_url.map(str::to_owned);
            self.outbox.set_about(About { site, map_url, buttons: self.presser.is_some() });
        }
        self.door_topics.extend(door_topics(frame, self.outbox.topics()));
    }

    /// What the link has said, a round's share of it; an error is why the connection has ended.
    fn take_news(&mut self, news: &Receiver<News>) -> Result<Left, String> {
        for _ in 0..ROUND {
            match news.try_recv() {
                Ok(News::Connected) => self.begin()?,
                Ok(News::Retained(topic, payload)) => self.note_retained(&topic, &payload),
                Ok(News::Message(topic, payload)) => self.receive(&topic, &payload),
                Ok(News::Ended(reason)) => return Err(reason),
                Err(TryRecvError::Empty) => return Ok(Left::Nothing),
                Err(TryRecvError::Disconnected) => return Err("the link has ended".to_owned()),
            }
        }
        Ok(Left::Perhaps)
    }

    /// The broker keeps this message under this topic.
    fn note_retained(&mut self, topic: &str, payload: &[u8]) {
        self.outbox.retained(topic, payload);
        let is_input = is_input(self.outbox.topics(), topic);
        if let Some(text) = is_input.then(|| self.kept_inputs.note(topic)).flatten() {
            (self.say)(Level::WARN, &text);
        }
    }

    fn say_dropped(&mut self) {
        let dropped = self.dropped.get();
        if self.drop_log.is_due([dropped], Instant::now()) {
            (self.say)(Level::WARN, &format!("{dropped} messages came too fast, and were dropped"));
        }
    }

    /// Says that this tracker is there, and raises the alarm while another one says so under the same topics.
    fn look_for_another(&mut self, now: Instant) -> Result<(), String> {
        if self.connected
            && let Some(said) = self.presence.due(now)
        {
            let topic = self.outbox.topics().presence();
            self.client
                .try_publish(topic, QoS::AtMostOnce, false, said)
                .map_err(|error| error.to_string())?;
        }
        let text = self.presence.is_shared(now).then(|| self.text_of_another());
        self.alarms.set(AlarmKind::SameName, text.as_deref());
        Ok(())
    }

    fn text_of_another(&self) -> String {
        let topics = self.outbox.topics().site();
        format!(
            "another tracker publishes under {topics} at this broker, too, and each overwrites what the other says: give one of them another --mqtt-site"
        )
    }

    /// The broker has taken the connection.
    fn begin(&mut self) -> Result<(), String> {
        self.connected = true;
        if self.outage.end() {
            (self.say)(Level::INFO, "connected");
        }
        self.outbox.connected();
        self.presence.connected();
        for filter in self.outbox.topics().filters() {
            self.client.try_subscribe(filter, QoS::AtLeastOnce).map_err(|error| error.to_string())?;
        }
        Ok(())
    }

    /// Publishes what doors order, and what has changed.
    fn publish_due(
        &mut self,
        orders: &[Output],
        fresh: Option<&Snapshot>,
        begun: Instant,
    ) -> Result<(), String> {
        orders.iter().try_for_each(|order| self.order(order))?;
        let now_ms = u64::try_from(begun.elapsed().as_millis()).unwrap_or(u64::MAX);
        let due = self.outbox.due(fresh, now_ms);
        due.into_iter().try_for_each(|publication| self.publish(publication))
    }

    /// Presses a button of a module, if there are buttons.
    fn press(&self, target: Target, payload: &[u8]) {
        let Some(presser) = self.presser else { return };
        let judged = target.judge(payload, &self.site.borrow());
        if let Err(why) = judged.and_then(|address| presser.press(target.clone(), address)) {
            self.refuse(&target, &why);
        }
    }

    fn refuse(&self, target: &Target, why: &NotPressed) {
        tracing::warn!("module {}: {} from the MQTT broker: {why}", target.module, target.button.name());
        let refused = written(&Refused { at_ms: unix_ms(), why: why.to_string() });
        let topic = format!("{}/module/{}/refused", self.outbox.topics().site(), target.slug);
        // Without room for it the log has it.
        let _ = self.client.try_publish(topic, QoS::AtMostOnce, false, refused);
    }

    /// Passes a message to a door, which publishes what becomes of it, takes a sign, or presses a button.
    fn receive(&mut self, topic: &str, payload: &[u8]) {
        if topic == self.outbox.topics().presence() {
            if self.presence.hear(payload, Instant::now()) {
                (self.say)(Level::WARN, &self.text_of_another());
            }
            return;
        }
        if topic == self.outbox.topics().status() {
            if payload == Availability::Offline.name().as_bytes() {
                self.outbox.said_offline();
            }
            return;
        }
        let sign_topic = self.outbox.topics().sign();
        if let Some(signs) = self.signs.filter(|_| topic == sign_topic) {
            if let Err(why) = signs.tell(payload) {
                let refused = written(&Refused { at_ms: unix_ms(), why: why.to_string() });
                // Without room for it the count in the metrics says so.
                let _ =
                    self.client.try_publish(format!("{sign_topic}/refused"), QoS::AtMostOnce, false, refused);
            }
            return;
        }
        let target = button(&self.newest, &self.site.borrow(), self.outbox.topics(), topic);
        if let Some(target) = target {
            self.press(target, payload);
            return;
        }
        let input = door_input(&self.newest, self.outbox.topics(), topic);
        if let Some((doors, (name, input))) = self.doors.zip(input) {
            doors.post(&name, input, payload);
        }
    }

    /// What a door orders: never retained, and kept by no broker.
    fn order(&self, order: &Output) -> Result<(), String> {
        let at_ms = unix_ms();
        let (door, kind, payload) = match order {
            Output::Lock { door, order } => (door, "lock", written(&Lock { at_ms, order: *order })),
            Output::Alarm { door, id, alarm } => {
                (door, "alarm", written(&DoorAlarmOrder { alarm: *alarm, at_ms, id: *id }))
            }
            Output::NotTaken { door, why } => {
                (door, "refused", written(&Refused { at_ms, why: why.clone() }))
            }
            Output::Passage(_) => return Ok(()),
        };
        let Some(topic) = self.door_topics.get(door) else { return Ok(()) };
        // Said again while it holds: a broker that kept it for a lock that is away would deliver an old one.
        self.client
            .try_publish(format!("{topic}/{kind}"), QoS::AtMostOnce, false, payload)
            .map_err(|error| error.to_string())
    }

    fn publish(&self, Publication { topic, payload }: Publication) -> Result<(), String> {
        self.client.try_publish(topic, QoS::AtLeastOnce, true, payload).map_err(|error| error.to_string())
    }

    fn end(&self) {
        if self.connected {
            let _ = self.publish(self.outbox.farewell());
        }
        let _ = self.client.try_disconnect();
    }
}

#[cfg(test)]
mod tests {
    use rumqttc::MqttOptions;

    use super::super::messages::tests::topics;
    use super::*;

    /// Calls `test` with a session without a broker; what it has said.
    fn with_session(alarms: &TrackerAlarms, test: impl FnOnce(&mut Session<'_>)) -> Vec<String> {
        let (client, _connection) = Client::new(MqttOptions::new("test", "localhost", 1883), 10);
        let dropped = SharedCount::default();
        dropped.add(7);
        let said = std::cell::RefCell::new(Vec::new());
        let mut session = Session {
            client,
            site: watch::channel(Arc::default()).1,
            map_url: None,
            outbox: &mut Outbox::new(topics()),
            connected: false,
            newest: Arc::default(),
            door_topics: BTreeMap::new(),
            doors: None,
            signs: None,
            presser: None,
            outage: &mut Outage::default(),
            presence: &mut Presence::new(),
            alarms,
            dropped: &dropped,
            drop_log: &mut CountLog::default(),
            kept_inputs: &mut KeptInputs::default(),
            say: &|_, text| said.borrow_mut().push(text.to_owned()),
        };
        test(&mut session);
        drop(session);
        said.into_inner()
    }

    #[test]
    fn a_flood_of_messages_leaves_time_for_what_doors_order() {
        let said = with_session(&TrackerAlarms::default(), |session| {
            let (tell, news) = std::sync::mpsc::channel();
            for _ in 0..ROUND + 1 {
                tell.send(News::Message("kehai/front-door/door/front/card".into(), Vec::new())).unwrap();
            }
            assert_eq!(session.take_news(&news), Ok(Left::Perhaps));
            assert_eq!(session.take_news(&news), Ok(Left::Nothing));
            session.say_dropped();
            session.say_dropped();
        });
        assert_eq!(said, ["7 messages came too fast, and were dropped"]);
    }

    #[test]
    fn another_tracker_under_the_same_topics_is_an_alarm_that_says_what_to_do() {
        let (alarms, now) = (TrackerAlarms::default(), Instant::now());
        let said = with_session(&alarms, |session| {
            let topic = topics().presence();
            let own = session.presence.due(now).unwrap();
            session.receive(&topic, own.as_bytes());
            assert_eq!(session.look_for_another(now), Ok(()));
            assert_eq!(alarms.lines(), [], "it hears itself");
            session.receive(&topic, Presence::new().due(now).unwrap().as_bytes());
            session.receive(&topic, Presence::new().due(now).unwrap().as_bytes());
            assert_eq!(session.look_for_another(now), Ok(()));
            let lines = alarms.lines();
            let [alarm] = &lines[..] else { panic!("{lines:?}") };
            assert_eq!(alarm.kind, AlarmKind::SameName);
            assert!(alarm.text.contains("kehai/front-door") && alarm.text.contains("--mqtt-site"));
            assert_eq!(session.look_for_another(now + Duration::from_secs(60)), Ok(()));
            assert_eq!(alarms.lines(), [], "the other one is gone");
        });
        assert_eq!(said.len(), 1, "once in the log: {said:?}");
    }
}
