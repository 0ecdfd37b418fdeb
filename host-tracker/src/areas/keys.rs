//! The keys of an area in Zenoh: `kehai/SITE/AREA/WHAT`.

use kehai_tracking::areas::AreaName;

use super::AreaPlace;

/// In front of all keys.
const ROOT: &str = "kehai";

/// What is said under a key.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum What {
    /// A frame.
    Frame,
    /// The site, to who asks.
    Site,
    /// A token, as long as the tracker is there.
    Alive,
}

impl What {
    const fn name(self) -> &'static str {
        match self {
            Self::Frame => "frame",
            Self::Site => "site",
            Self::Alive => "alive",
        }
    }
}

impl AreaPlace {
    pub(super) fn key(&self, what: What) -> String {
        format!("{ROOT}/{}/{}/{}", self.site, self.area, what.name())
    }
}

/// The key of that of all areas of a site.
pub(super) fn all(site: &AreaName, what: What) -> String {
    format!("{ROOT}/{site}/*/{}", what.name())
}

/// The area of a key; none if it is no key of ours.
pub(super) fn area_of(key: &str) -> Option<AreaName> {
    let mut parts = key.split('/');
    let (root, area) = (parts.next()?, parts.nth(1)?);
    if root != ROOT { None } else { area.parse().ok() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_area_is_found_again_in_its_key() {
        let place: AreaPlace = "campus/east".parse().unwrap();
        assert_eq!(place.key(What::Frame), "kehai/campus/east/frame");
        assert_eq!(area_of(&place.key(What::Alive)), Some(place.area));
        assert_eq!(all(&place.site, What::Site), "kehai/campus/*/site");
        assert_eq!((area_of("kehai/campus"), area_of("else/campus/east/frame")), (None, None));
    }
}
