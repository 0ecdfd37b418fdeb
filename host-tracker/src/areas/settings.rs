//! Which area a tracker follows, and how it is published: `campus/east`, over Zenoh.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use kehai_tracking::areas::{AreaName, NameError};

/// Of which area, over what.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct AreaSettings {
    /// The area.
    pub place: AreaPlace,
    /// How Zenoh is reached.
    pub network: Network,
}

/// An area and the site it belongs to, as `campus/east`.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct AreaPlace {
    /// The whole site.
    pub site: AreaName,
    /// The area.
    pub area: AreaName,
}

/// How Zenoh is reached.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub enum Network {
    /// As a peer that finds others in this network by multicast.
    #[default]
    Found,
    /// As this file of Zenoh's says, JSON5.
    File(PathBuf),
}

impl fmt::Display for AreaPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.site, self.area)
    }
}

impl FromStr for AreaPlace {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (site, area) = text.split_once('/').ok_or("an area is SITE/AREA, as campus/east")?;
        let name = |text: &str| text.parse().map_err(|error: NameError| error.to_string());
        Ok(Self { site: name(site)?, area: name(area)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_area_is_named_with_its_site() {
        let place: AreaPlace = "campus/east".parse().unwrap();
        assert_eq!(place.to_string(), "campus/east");
        for text in ["east", "campus/", "campus/a/b", "campus/*"] {
            assert!(text.parse::<AreaPlace>().is_err(), "{text}");
        }
    }
}
