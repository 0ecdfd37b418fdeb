//! In which domain of ROS 2 the tracker publishes, and how Zenoh is reached.

use crate::areas::Network;

/// Where, over what.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Ros2Settings {
    /// The domain, as in `ROS_DOMAIN_ID`.
    pub domain: u32,
    /// How Zenoh is reached; [`Network::Found`]: as nodes of rmw_zenoh do, by the router of this machine.
    pub network: Network,
}

#[cfg(feature = "zenoh")]
impl Ros2Settings {
    /// The configuration of a session. Without a file it is that of a node with rmw_zenoh: a peer of the router at this machine's
    /// port 7447, which tells it of other nodes; it may come later.
    ///
    /// # Errors
    /// The file cannot be used.
    pub(super) fn config(&self) -> Result<zenoh::Config, crate::areas::LinkError> {
        const NODE: &str = r#"{
            mode: "peer",
            connect: { endpoints: ["tcp/localhost:7447"], timeout_ms: -1, exit_on_failure: false },
            listen: { endpoints: ["tcp/localhost:0"] },
            scouting: { multicast: { enabled: false }, gossip: { enabled: true } },
        }"#;
        match &self.network {
            Network::Found => {
                let wrong = |error: zenoh::Error| crate::areas::LinkError::Open(error.to_string());
                zenoh::Config::from_json5(NODE).map_err(wrong)
            }
            network @ Network::File(_) => network.config(),
        }
    }
}

#[cfg(all(test, feature = "zenoh"))]
mod tests {
    use super::*;

    #[test]
    fn without_a_file_the_router_of_this_machine_is_asked_and_no_other() {
        let config = Ros2Settings { domain: 0, network: Network::Found }.config().unwrap();
        let get = |key: &str| config.get_json(key).unwrap();
        assert_eq!(get("mode"), r#""peer""#);
        assert_eq!(get("connect/endpoints"), r#"["tcp/localhost:7447"]"#);
        assert_eq!(get("scouting/multicast/enabled"), "false");
        let missing = Ros2Settings { domain: 0, network: Network::File("no-such.json5".into()) };
        assert!(missing.config().unwrap_err().to_string().contains("no-such.json5"));
    }
}
