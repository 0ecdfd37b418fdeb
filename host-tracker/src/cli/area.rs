//! The options of `run` and `site` for Zenoh: which area, and how it is reached.

use std::path::PathBuf;

use clap::Args;
use host_tracker::areas::{AreaPlace, AreaSettings, Network};

#[derive(Debug, Args)]
pub(super) struct AreaArguments {
    /// Follow an area of a large site: publish it to Zenoh, where kehai-tracker site puts all areas of the site together
    #[arg(long, value_name = "SITE/AREA")]
    area: Option<AreaPlace>,

    #[command(flatten)]
    network: NetworkArguments,
}

#[derive(Debug, Args)]
pub(super) struct NetworkArguments {
    /// Zenoh's own configuration, JSON5: whom to connect to, certificates, access rules [default: a peer that finds others by
    /// multicast]
    #[arg(long, value_name = "FILE.json5", env = "KEHAI_ZENOH")]
    zenoh: Option<PathBuf>,
}

impl AreaArguments {
    pub(super) fn settings(self) -> Option<AreaSettings> {
        let network = self.network.network();
        self.area.map(|place| AreaSettings { place, network })
    }
}

impl NetworkArguments {
    pub(super) fn network(self) -> Network {
        self.zenoh.map_or(Network::Found, Network::File)
    }
}
