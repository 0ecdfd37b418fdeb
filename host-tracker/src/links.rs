//! Who else is told than the map and the broker: the areas of a large site, ROS 2, viewers.
//!
//! ```text
//!   service ─ snapshots, site, scans, alarms ─┬─▶ areas::Area     Zenoh
//!                                             ├─▶ ros2::Ros2      Zenoh
//!                                             └─▶ viewer::Live    Foxglove's WebSocket
//! ```
//!
//! A program may be built without Zenoh or without Foxglove; then their settings are there and do nothing.

use crate::areas::AreaSettings;
use crate::ros2::Ros2Settings;
use crate::service::Service;

/// Which other programs are told; none, unless it is set.
#[derive(Debug, Default)]
pub struct LinkSettings {
    /// The area of a large site that this tracker follows.
    pub area: Option<AreaSettings>,
    /// The domain of ROS 2 in which people are published.
    pub ros2: Option<Ros2Settings>,
    /// The port of this machine at which Foxglove is served.
    pub foxglove: Option<u16>,
}

/// Why another program is not told.
#[derive(Debug, thiserror::Error)]
pub enum LinksError {
    /// Zenoh.
    #[cfg(feature = "zenoh")]
    #[error(transparent)]
    Zenoh(#[from] crate::areas::LinkError),
    /// Foxglove.
    #[cfg(feature = "foxglove")]
    #[error(transparent)]
    Viewers(#[from] crate::viewer::LiveError),
}

/// They are told until this is dropped.
#[derive(Debug)]
pub struct Links {
    #[cfg(feature = "zenoh")]
    _area: Option<crate::areas::Area>,
    #[cfg(feature = "zenoh")]
    _ros2: Option<crate::ros2::Ros2>,
    #[cfg(feature = "foxglove")]
    viewers: Option<crate::viewer::Live>,
}

impl Links {
    /// Begins to tell them. `say` is told when Zenoh cannot be reached, and that it is.
    ///
    /// # Errors
    /// [`LinksError`].
    #[cfg_attr(not(feature = "zenoh"), expect(unused_variables, reason = "only Zenoh comes and goes"))]
    pub fn start(settings: LinkSettings, service: &Service, say: fn(&str)) -> Result<Self, LinksError> {
        let LinkSettings { area, ros2, foxglove } = settings;
        #[cfg(not(feature = "zenoh"))]
        let _ = (area, ros2);
        #[cfg(not(feature = "foxglove"))]
        let _ = foxglove;
        Ok(Self {
            #[cfg(feature = "zenoh")]
            _area: area
                .map(|area| {
                    let alarms = service.alarms();
                    crate::areas::Area::start(area, service.queue(), service.site(), alarms, say)
                })
                .transpose()?,
            #[cfg(feature = "zenoh")]
            _ros2: ros2
                .map(|settings| {
                    let inputs = crate::ros2::Inputs {
                        snapshots: service.queue(),
                        site: service.site(),
                        scans: service.scans(),
                        alarms: service.alarms(),
                    };
                    crate::ros2::Ros2::start(&settings, inputs, say)
                })
                .transpose()?,
            #[cfg(feature = "foxglove")]
            viewers: foxglove
                .map(|port| {
                    let inputs = crate::viewer::Inputs {
                        snapshots: service.queue(),
                        site: service.site(),
                        scans: service.scans(),
                        changes: service.listed().listen(),
                        alarms: service.alarms(),
                    };
                    crate::viewer::Live::start(port, inputs)
                })
                .transpose()?,
        })
    }

    /// Where viewers are served, if they are.
    #[must_use]
    pub fn viewers(&self) -> Option<std::net::SocketAddr> {
        #[cfg(feature = "foxglove")]
        return self.viewers.as_ref().map(crate::viewer::Live::address);
        #[cfg(not(feature = "foxglove"))]
        None
    }
}
