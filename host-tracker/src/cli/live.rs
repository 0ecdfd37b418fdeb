//! A tracker that runs, as commands ask its live map: where it is, who asks, and which certificate is trusted.

use std::io;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use host_tracker::http_agent::{LONGEST, agent};
use rustls::CertificateError;
use serde::de::DeserializeOwned;
use serde_json::Value;

/// Longest wait for an answer: a tracker answers after its next snapshot.
const PATIENCE: Duration = Duration::from_secs(10);

#[derive(Debug, Args)]
pub struct LiveArguments {
    /// Where the live map of the tracker is
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8420")]
    tracker: String,

    /// A token with the role view, once there are users
    #[arg(long, value_name = "TOKEN", env = "KEHAI_TOKEN", hide_env_values = true)]
    token: Option<String>,

    /// The certificate to trust at https://, as home.cert.pem beside the site's file [default: the system's authorities]
    #[arg(long, value_name = "FILE.pem")]
    ca: Option<PathBuf>,
}

impl LiveArguments {
    /// What it answers to GET.
    ///
    /// # Errors
    /// One line: why there is no answer, or what the tracker refuses.
    pub fn get<T: DeserializeOwned>(&self, path: &str) -> Result<T, String> {
        let tracker = &self.tracker;
        let agent = agent(PATIENCE, self.ca.as_deref())
            .map_err(|why| format!("{}: {why}", self.ca.as_deref().unwrap_or("".as_ref()).display()))?;
        let mut request = agent.get(format!("{}{path}", tracker.trim_end_matches('/')));
        if let Some(token) = &self.token {
            request = request.header("Authorization", format!("Bearer {token}"));
        }
        let said = |why: ureq::Error| format!("{tracker}: {why}{}", self.advice(&why));
        let mut answered = request.call().map_err(said)?;
        let status = answered.status();
        if status.is_redirection() {
            return Err(format!("{tracker}: it is at https://, with --ca for its own certificate"));
        }
        let text = answered.body_mut().with_config().limit(LONGEST).read_to_string().map_err(said)?;
        let answer: Value =
            serde_json::from_str(&text).map_err(|_| format!("{tracker}: no tracker answers there"))?;
        if !status.is_success() {
            let why = answer["error"].as_str().unwrap_or("it does not say why");
            return Err(format!("{tracker}: {why}"));
        }
        serde_json::from_value(answer).map_err(|why| format!("{tracker}: {why}"))
    }

    /// What to do about a certificate that is not trusted.
    fn advice(&self, why: &ureq::Error) -> &'static str {
        let of_tls = match why {
            ureq::Error::Rustls(why) => Some(why),
            ureq::Error::Io(why) => io::Error::get_ref(why).and_then(|why| why.downcast_ref()),
            _ => None,
        };
        match of_tls {
            Some(rustls::Error::InvalidCertificate(CertificateError::UnknownIssuer)) => {
                ": name its certificate with --ca, as home.cert.pem beside the site's file"
            }
            _ => "",
        }
    }
}
