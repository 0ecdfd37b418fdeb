//! The client for HTTP: which authorities it trusts, and how long it waits.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use rustls::crypto::ring::default_provider;
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::{Error as PemError, PemObject as _};
use ureq::Agent;
use ureq::tls::{Certificate, RootCerts, TlsConfig};

/// Longest answer that is read, bytes: a frame of a thousand modules.
pub const LONGEST: u64 = 16 << 20;

/// One that waits for so long, goes where it is told only, and trusts the authorities of the system, or those of a file.
/// Answers of every status are answers.
///
/// # Errors
/// The file cannot be read, or is no certificate.
pub fn agent(patience: Duration, authorities: Option<&Path>) -> Result<Agent, PemError> {
    let known: Vec<CertificateDer<'static>> = match authorities {
        None => rustls_native_certs::load_native_certs().certs,
        Some(file) => CertificateDer::pem_file_iter(file)?.collect::<Result<_, _>>()?,
    };
    let roots: Vec<Certificate<'static>> =
        known.iter().map(|der| Certificate::from_der(der.as_ref()).to_owned()).collect();
    let tls = TlsConfig::builder()
        .root_certs(RootCerts::Specific(Arc::new(roots)))
        .unversioned_rustls_crypto_provider(Arc::new(default_provider()))
        .build();
    let config = Agent::config_builder().tls_config(tls).timeout_global(Some(patience)).max_redirects(0);
    Ok(config.http_status_as_error(false).build().into())
}
