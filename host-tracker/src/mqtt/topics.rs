//! Where everything goes at a broker, and what is sent there at once.
//!
//! ```text
//!   names ─▶ slugs ─▶ kehai/SITE/zone/ZONE, homeassistant/device/kehai_SITE/config
//!   State: payload ─▶ sent  ·  urgent, a part of it ─▶ at once when it changes
//! ```

use kehai_tracking::slug::slug;

/// Where everything goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topics {
    /// The site's name, as people read it.
    pub title: String,
    /// In front of everything.
    pub prefix: String,
    /// Prefix of the topics of Home Assistant's discovery; none: nothing is published there.
    pub home_assistant: Option<String>,
}

/// A state: what is sent, and the part of it that is sent at once when it changes; the rest waits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct State {
    pub payload: String,
    pub urgent: String,
}

impl State {
    pub fn at_once(payload: String) -> Self {
        Self { urgent: payload.clone(), payload }
    }
}

impl Topics {
    /// Of the site itself: whether the tracker runs.
    #[must_use]
    pub fn status(&self) -> String {
        format!("{}/status", self.site())
    }

    /// In front of everything about this site.
    #[must_use]
    pub fn site(&self) -> String {
        format!("{}/{}", self.prefix, slug(&self.title))
    }

    /// Where trackers say that they are there: of two under the same topics each notices the other.
    #[must_use]
    pub fn presence(&self) -> String {
        format!("{}/presence", self.site())
    }

    /// Where readers of cards and tags publish what they have read.
    #[must_use]
    pub fn sign(&self) -> String {
        format!("{}/sign", self.site())
    }

    /// The site among Home Assistant's devices. Slugs have no `_`: one site's devices are never another's.
    pub fn device(&self) -> String {
        format!("kehai_{}", slug(&self.title))
    }

    /// Whether a topic is one of this site's, by any sender at any time.
    #[must_use]
    pub fn owns(&self, topic: &str) -> bool {
        if topic.strip_prefix(&self.site()).is_some_and(|rest| rest.starts_with('/')) {
            return true;
        }
        let Some(prefix) = &self.home_assistant else { return false };
        let device = topic
            .strip_prefix(prefix)
            .and_then(|rest| rest.strip_prefix("/device/"))
            .and_then(|rest| rest.strip_suffix("/config"))
            .and_then(|id| id.strip_prefix(&self.device()));
        device.is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
    }

    /// What to subscribe to, to see everything that [`owns`](Self::owns) is true of.
    #[must_use]
    pub fn filters(&self) -> Vec<String> {
        let discovery = self.home_assistant.iter().map(|prefix| format!("{prefix}/device/+/config"));
        std::iter::once(format!("{}/#", self.site())).chain(discovery).collect()
    }
}

/// Names with their slugs, each its own: the second of two that are alike gets a number. In the order of the site's file what is added
/// last takes the topic of nothing that is there.
pub fn slugs<'a>(names: impl Iterator<Item = &'a str>) -> Vec<(&'a str, String)> {
    let mut slugs: Vec<(&str, String)> = Vec::new();
    for name in names {
        let plain = slug(name);
        let taken = |slug: &str| slugs.iter().any(|(_, known)| known == slug);
        let numbered = (2..).map(|number| format!("{plain}-{number}"));
        let own = std::iter::once(plain.clone()).chain(numbered).find(|slug| !taken(slug));
        slugs.push((name, own.unwrap_or_default()));
    }
    slugs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_alike_get_topics_of_their_own() {
        let names = ["Hall 1", "hall-1", "hall_1", "hall/1/#"];
        let slugs: Vec<String> = slugs(names.into_iter()).into_iter().map(|(_, slug)| slug).collect();
        assert_eq!(slugs, ["hall-1", "hall-1-2", "hall-1-3", "hall-1--"]);
    }

    #[test]
    fn a_site_owns_its_own_topics_and_no_other_site_s() {
        let topics = super::super::messages::tests::topics();
        for own in ["kehai/front-door/zone/x", "homeassistant/device/kehai_front-door/config"] {
            assert!(topics.owns(own), "{own}");
        }
        assert!(topics.owns("homeassistant/device/kehai_front-door_left/config"));
        for other in [
            "kehai/front-door-2/zone/x",
            "homeassistant/device/kehai_front-door-2/config",
            "homeassistant/device/shelly/config",
            "homeassistant/status",
        ] {
            assert!(!topics.owns(other), "{other}");
        }
    }
}
