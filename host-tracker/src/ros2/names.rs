//! Keys, liveliness tokens, and names of topics and frames.
//!
//! ```text
//!   topic   0/kehai/markers/visualization_msgs::msg::dds_::MarkerArray_/RIHS01_…
//!   node    @ros2_lv/0/ZID/0/0/NN/%/%/kehai_tracker                                      % is the root: of enclaves, of namespaces
//!   its     @ros2_lv/0/ZID/0/3/MP/%/%/kehai_tracker/%kehai%markers/TYPE/HASH/QOS         number 3 of this session
//!           its XXH3 of 128 bits is the publisher's gid
//! ```
//!
//! Source: rmw_zenoh, `docs/design.md` and `liveliness_utils.cpp`; names of topics: <https://design.ros2.org/articles/topic_and_service_names.html>.

use std::collections::BTreeMap;

use twox_hash::XxHash3_128;

use super::describe::Type;
use super::encode::Gid;
use super::qos::Qos;

/// The frame of the site: of walls, zones and people.
pub const MAP: &str = "map";

const NODE: &str = "kehai_tracker";

/// The tracker as a node: its domain, and the identity of its session.
#[derive(Clone, Debug)]
pub struct Node {
    pub domain: u32,
    pub session: String,
}

impl Node {
    /// The token of the node.
    pub fn token(&self) -> String {
        format!("{}/{NODE}", self.entity(0, "NN"))
    }

    /// The token of its publisher of that number, from 1.
    pub fn publisher_token(&self, number: u32, topic: &str, kind: &Type, qos: Qos) -> String {
        let (entity, name) = (self.entity(number, "MP"), topic.replace('/', "%"));
        format!("{entity}/{NODE}/{name}/{}/{}/{}", dds_name(kind), kind.hash(), qos.text())
    }

    /// The key of a topic, which begins with `/`.
    pub fn topic(&self, topic: &str, kind: &Type) -> String {
        format!("{}{topic}/{}/{}", self.domain, dds_name(kind), kind.hash())
    }

    /// Where those who come late ask for what was said under a key, as Zenoh's advanced subscribers do.
    pub fn history(&self, key: &str, number: u32) -> String {
        format!("{key}/@adv/pub/{}/{number}/_", self.session)
    }

    fn entity(&self, number: u32, what: &str) -> String {
        format!("@ros2_lv/{}/{}/0/{number}/{what}/%/%", self.domain, self.session)
    }
}

/// Whose messages are, by the publisher's token.
pub fn gid(token: &str) -> Gid {
    XxHash3_128::oneshot(token.as_bytes()).to_le_bytes()
}

/// `people_msgs/msg/Person` as `people_msgs::msg::dds_::Person_`.
fn dds_name(kind: &Type) -> String {
    let (package, name) = kind.name.rsplit_once('/').unwrap_or_default();
    format!("{}::dds_::{name}_", package.replace('/', "::"))
}

/// A part of a topic's name for each of these names, no two the same.
pub fn parts<'a>(names: impl IntoIterator<Item = &'a str>) -> BTreeMap<String, String> {
    let mut parts: BTreeMap<String, String> = BTreeMap::new();
    for name in names {
        let part = part(name);
        let others = (2..).map(|number| format!("{part}_{number}"));
        let mut candidates = std::iter::once(part.clone()).chain(others);
        let free = candidates.find(|candidate| !parts.values().any(|taken| taken == candidate));
        parts.entry(name.to_owned()).or_insert(free.unwrap_or(part));
    }
    parts
}

/// The topic of a module's scans.
pub fn scan_topic(part: &str) -> String {
    format!("/kehai/{part}/scan")
}

/// The frame of a module: x where its front step points, y to the left, z up; also of one that hangs head down.
pub fn module_frame(part: &str) -> String {
    format!("kehai/{part}")
}

/// A name in letters, digits and single underlines; what is beyond ASCII is its number, as in topics of MQTT.
fn part(name: &str) -> String {
    let mut part = String::new();
    for character in name.chars() {
        match character {
            'a'..='z' | 'A'..='Z' | '0'..='9' => part.push(character),
            _ if !character.is_ascii() => part.push_str(&format!("u{:x}", u32::from(character))),
            _ if part.ends_with('_') => {}
            _ => part.push('_'),
        }
    }
    // A part may not begin with a digit.
    if part.starts_with(|first: char| !first.is_ascii_alphabetic()) || part.is_empty() {
        part.insert(0, 'm');
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros2::describe::Message;
    use crate::ros2::messages::{MarkerArray, TfMessage};
    use crate::ros2::qos::Durability;

    fn node() -> Node {
        Node { domain: 7, session: "a1b2".into() }
    }

    #[test]
    fn a_key_has_domain_topic_type_and_hash() {
        let key = node().topic("/kehai/markers", &MarkerArray::TYPE);
        let hash = MarkerArray::TYPE.hash();
        assert_eq!(key, format!("7/kehai/markers/visualization_msgs::msg::dds_::MarkerArray_/{hash}"));
        assert_eq!(node().history("7/k", 3), "7/k/@adv/pub/a1b2/3/_");
    }

    #[test]
    fn tokens_say_the_node_and_what_it_publishes() {
        assert_eq!(node().token(), "@ros2_lv/7/a1b2/0/0/NN/%/%/kehai_tracker");
        let qos = Qos { durability: Durability::TransientLocal, depth: 1 };
        let token = node().publisher_token(3, "/tf_static", &TfMessage::TYPE, qos);
        let hash = TfMessage::TYPE.hash();
        assert_eq!(
            token,
            format!(
                "@ros2_lv/7/a1b2/0/3/MP/%/%/kehai_tracker/%tf_static/tf2_msgs::msg::dds_::TFMessage_/{hash}/:1:,1:,:,:,,"
            )
        );
    }

    /// Of XXH3's own tests: the hash of nothing.
    #[test]
    fn a_gid_has_the_lower_half_first() {
        let (high, low) = (0x99aa_06d3_0147_98d8_u64, 0x6001_c324_468d_497f_u64);
        let gid = gid("");
        assert_eq!((&gid[..8], &gid[8..]), (&low.to_le_bytes()[..], &high.to_le_bytes()[..]));
    }

    #[test]
    fn parts_of_topics_are_what_ros_allows_and_differ() {
        let parts = parts(["left", "left-1", "left_1", "left 1", "1", "a--b", "玄関", "", "left"]);
        let part = |name: &str| parts[name].as_str();
        assert_eq!(
            [part("left"), part("left-1"), part("left_1"), part("left 1")],
            ["left", "left_1", "left_1_2", "left_1_3"]
        );
        assert_eq!([part("1"), part("a--b"), part("玄関"), part("")], ["m1", "a_b", "u7384u95a2", "m"]);
        assert_eq!(
            (scan_topic("left"), module_frame("left")),
            ("/kehai/left/scan".into(), "kehai/left".into())
        );
    }
}
