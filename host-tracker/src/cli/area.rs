//! The options of `run` and `site` for Zenoh: which area, which domain of ROS 2, and how it is reached.

use std::path::PathBuf;

use clap::Args;
use host_tracker::areas::{AreaPlace, AreaSettings, Network};
use host_tracker::ros2::Ros2Settings;

#[derive(Debug, Args)]
pub(super) struct ZenohArguments {
    /// Follow an area of a large site: publish it to Zenoh, where kehai-tracker site puts all areas of the site together
    #[arg(long, value_name = "SITE/AREA")]
    area: Option<AreaPlace>,

    /// Publish people, markers, modules and scans to ROS 2, as a node with rmw_zenoh does [default without --zenoh: by the router of
    /// this machine, ros2 run rmw_zenoh_cpp rmw_zenohd]
    #[arg(long)]
    ros2: bool,

    /// The domain of ROS 2
    #[arg(long, value_name = "N", env = "ROS_DOMAIN_ID", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=LAST_DOMAIN))]
    ros2_domain: u32,

    #[command(flatten)]
    network: NetworkArguments,
}

/// Beyond it DDS has no ports, and ROS 2 takes none.
const LAST_DOMAIN: i64 = 232;

#[derive(Debug, Args)]
pub(super) struct NetworkArguments {
    /// Zenoh's own configuration, JSON5: whom to connect to, certificates, access rules [default for areas: a peer that finds others by
    /// multicast]
    #[arg(long, value_name = "FILE.json5", env = "KEHAI_ZENOH")]
    zenoh: Option<PathBuf>,
}

impl ZenohArguments {
    /// Whether anything is published.
    pub(super) const fn is_given(&self) -> bool {
        self.area.is_some() || self.ros2
    }

    pub(super) fn settings(self) -> (Option<AreaSettings>, Option<Ros2Settings>) {
        let network = self.network.network();
        let domain = self.ros2_domain;
        let ros2 = self.ros2.then(|| Ros2Settings { domain, network: network.clone() });
        (self.area.map(|place| AreaSettings { place, network }), ros2)
    }
}

impl NetworkArguments {
    pub(super) fn network(self) -> Network {
        self.zenoh.map_or(Network::Found, Network::File)
    }
}
