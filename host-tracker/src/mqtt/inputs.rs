//! Inputs: the topics on which the tracker is told something, and what the log says of one for which the broker keeps a message.
//!
//! An input that was published with *retain* comes again at every connection, and may be from yesterday.

use std::collections::BTreeSet;

use kehai_tracking::door::Input;
use kehai_tracking::text::printable;

use super::presses::Button;
use super::topics::Topics;

/// Inputs of which this is said: all of a dozen doors. A flood of topics fills neither the log nor the memory.
const SAID: usize = 100;

/// Whether a topic is an input of a door, a button of a module, or that of signs: the tracker never publishes there.
pub(super) fn is_input(topics: &Topics, topic: &str) -> bool {
    let rest = topic.strip_prefix(&topics.site()).and_then(|rest| rest.strip_prefix('/'));
    let mut words = rest.unwrap_or_default().splitn(3, '/');
    match (words.next(), words.next(), words.next()) {
        (Some("sign"), None, None) => true,
        (Some("door"), Some(_), Some(input)) => Input::named(input).is_some(),
        (Some("module"), Some(_), Some(button)) => Button::named(button).is_some(),
        _ => false,
    }
}

/// The inputs of which it was said, over all connections.
#[derive(Debug, Default)]
pub(super) struct KeptInputs(BTreeSet<String>);

impl KeptInputs {
    /// The broker keeps a message for this input: what is to be said of it, if it is new.
    pub(super) fn note(&mut self, topic: &str) -> Option<String> {
        if self.0.len() >= SAID || !self.0.insert(topic.to_owned()) {
            return None;
        }
        let topic = printable(topic);
        Some(format!(
            "it keeps a message for {topic}, which is not taken: its sender must publish without retain"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::super::messages::tests::topics;
    use super::*;

    #[test]
    fn an_input_is_told_from_what_is_published_beside_it() {
        for input in ["sign", "door/front/exit", "door/of-before/lock/taken", "module/left/learn"] {
            assert!(is_input(&topics(), &format!("kehai/front-door/{input}")), "{input}");
        }
        for other in [
            "sign/refused",
            "door/front",
            "door/front/lock",
            "door/front/refused",
            "module/left",
            "zone/exit",
        ] {
            assert!(!is_input(&topics(), &format!("kehai/front-door/{other}")), "{other}");
        }
        assert!(!is_input(&topics(), "kehai/front-door-2/sign"));
    }

    #[test]
    fn each_is_said_once_and_a_flood_of_them_ends() {
        let mut kept = KeptInputs::default();
        let said = kept.note("kehai/home/door/front\n/exit").unwrap();
        assert!(said.contains("kehai/home/door/front\u{fffd}/exit, which is not taken"), "{said}");
        assert_eq!(kept.note("kehai/home/door/front\n/exit"), None);
        let many = (0..2 * SAID).filter_map(|number| kept.note(&format!("kehai/home/door/{number}/exit")));
        assert_eq!(many.count(), SAID - 1);
    }
}
