//! The options of `run` for MQTT: the broker, whom it is trusted by, and where everything goes there.

use std::path::{Path, PathBuf};

use clap::Args;
use host_tracker::mqtt::BrokerLink;
use host_tracker::mqtt::trust::{self, TrustFiles};
use host_tracker::mqtt::{Broker, Topics};

use super::failure::Failure;

#[derive(Debug, Args)]
pub(super) struct MqttArguments {
    /// Publish to this broker, with discovery for Home Assistant; mqtts:// is an encrypted connection
    #[arg(
        long,
        value_name = "mqtt[s]://[USER:PASSWORD@]HOST[:PORT]",
        env = "KEHAI_MQTT",
        hide_env_values = true
    )]
    mqtt: Option<Broker>,

    /// Who vouches for the broker of mqtts://, in PEM: an authority, or its own certificate [default: the system's authorities]
    #[arg(long, value_name = "FILE.pem", requires = "mqtt")]
    mqtt_ca: Option<PathBuf>,

    /// A certificate by which the broker of mqtts:// knows this tracker, in PEM
    #[arg(long, value_name = "FILE.pem", requires = "mqtt", requires = "mqtt_key")]
    mqtt_cert: Option<PathBuf>,

    /// The key of --mqtt-cert
    #[arg(long, value_name = "FILE.pem", requires = "mqtt_cert")]
    mqtt_key: Option<PathBuf>,

    /// In front of every topic
    #[arg(long, value_name = "TOPIC", default_value = "kehai", value_parser = prefix)]
    mqtt_prefix: String,

    /// Name of the site there [default: the site file's]
    #[arg(long, value_name = "NAME")]
    mqtt_site: Option<String>,

    /// Give modules buttons there: learn, restart, identify. Each client that may publish at the broker may press them; on a site
    /// with a door modules only blink
    #[arg(long, requires = "mqtt")]
    mqtt_commands: bool,

    /// Where Home Assistant discovers; empty: it is not told
    #[arg(long, value_name = "TOPIC", default_value = "homeassistant", value_parser = prefix)]
    home_assistant_prefix: String,
}

impl MqttArguments {
    /// Whether there is a broker.
    pub(super) const fn is_given(&self) -> bool {
        self.mqtt.is_some()
    }

    /// The broker, if there is one.
    ///
    /// # Errors
    /// One line: what is wrong with which file.
    pub(super) fn broker(self, site: &Path) -> Result<Option<BrokerLink>, Failure> {
        let topics = self.topics(site);
        let Some(broker) = self.mqtt else { return Ok(None) };
        let files = TrustFiles { authorities: self.mqtt_ca, own: self.mqtt_cert.zip(self.mqtt_key) };
        if !broker.encrypted && files != TrustFiles::default() {
            return Err("--mqtt-ca, --mqtt-cert and --mqtt-key are for a broker of mqtts://".into());
        }
        let trust = broker.encrypted.then(|| trust::config(&files)).transpose()?;
        Ok(Some(BrokerLink { broker, trust, topics, commands: self.mqtt_commands }))
    }

    fn topics(&self, site: &Path) -> Topics {
        let file = site.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        Topics {
            title: self.mqtt_site.clone().or(file).unwrap_or_default(),
            prefix: self.mqtt_prefix.clone(),
            home_assistant: Some(self.home_assistant_prefix.clone()).filter(|prefix| !prefix.is_empty()),
        }
    }
}

fn prefix(text: &str) -> Result<String, String> {
    if text.contains(['#', '+', '\0']) || text.starts_with('/') || text.ends_with('/') {
        return Err("a topic has neither # nor +, and no / at its ends".to_owned());
    }
    Ok(text.to_owned())
}
