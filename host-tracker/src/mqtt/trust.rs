//! Whom an encrypted connection to a broker trusts, and what it shows of this tracker.
//!
//! ```text
//!   mqtts://HOST ─▶ its certificate, for HOST ─▶ by an authority of --mqtt-ca, or of the system if there is none
//!                ◀─ --mqtt-cert, --mqtt-key    brokers that know their clients by certificates
//! ```

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use rustls::{ClientConfig, RootCertStore};

/// Files in PEM.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct TrustFiles {
    /// Authorities, or the broker's own certificate; without it those of the system.
    pub authorities: Option<PathBuf>,
    /// This tracker's certificate and its key.
    pub own: Option<(PathBuf, PathBuf)>,
}

/// Why no encrypted connection is possible, in one line.
#[derive(Debug, thiserror::Error)]
pub enum TrustError {
    /// A file.
    #[error("{}: this is no {what} in PEM: {why}", file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// What it should hold.
        what: &'static str,
        /// Why it does not.
        why: String,
    },
    /// No authority is known.
    #[error("this system knows no authority of certificates: name the broker's with --mqtt-ca")]
    NoAuthority,
    /// TLS cannot use them.
    #[error("the certificate for the broker cannot be used: {0}")]
    Unusable(#[from] rustls::Error),
}

/// What connections to a broker are encrypted by.
///
/// # Errors
/// [`TrustError`].
pub fn config(files: &TrustFiles) -> Result<Arc<ClientConfig>, TrustError> {
    let mut roots = RootCertStore::empty();
    match &files.authorities {
        Some(file) => {
            for authority in certificates(file)? {
                roots.add(authority)?;
            }
        }
        // Those that cannot be read are not trusted.
        None => drop(roots.add_parsable_certificates(rustls_native_certs::load_native_certs().certs)),
    }
    if roots.is_empty() {
        return Err(TrustError::NoAuthority);
    }
    let builder = ClientConfig::builder_with_provider(Arc::new(default_provider()))
        .with_safe_default_protocol_versions()?
        .with_root_certificates(roots);
    let config = match &files.own {
        Some((certificate, key)) => {
            let secret = PrivateKeyDer::from_pem_file(key).map_err(|why| wrong(key, "key", why))?;
            builder.with_client_auth_cert(certificates(certificate)?, secret)?
        }
        None => builder.with_no_client_auth(),
    };
    Ok(Arc::new(config))
}

fn certificates(file: &Path) -> Result<Vec<CertificateDer<'static>>, TrustError> {
    let read = CertificateDer::pem_file_iter(file).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    match read {
        Ok(found) if found.is_empty() => Err(wrong(file, "certificate", "there is none in it")),
        Ok(found) => Ok(found),
        Err(why) => Err(wrong(file, "certificate", why)),
    }
}

fn wrong(file: &Path, what: &'static str, why: impl ToString) -> TrustError {
    TrustError::File { file: file.to_path_buf(), what, why: why.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certificate::Certificate;

    #[test]
    fn files_that_will_not_do_are_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let site = folder.path().join("home.toml");
        let certificate = Certificate::own(&site, &["localhost".into()]).unwrap().file().to_path_buf();
        let key = site.with_extension("key.pem");
        let files = |authorities: &Path, own: Option<(&Path, &Path)>| TrustFiles {
            authorities: Some(authorities.into()),
            own: own.map(|(certificate, key)| (certificate.into(), key.into())),
        };
        assert!(config(&files(&certificate, Some((&certificate, &key)))).is_ok());
        for (files, part) in [
            (files(&key, None), "home.key.pem: this is no certificate in PEM"),
            (files(Path::new("/nowhere"), None), "/nowhere: this is no certificate"),
            (files(&certificate, Some((&certificate, &certificate))), "home.cert.pem: this is no key"),
        ] {
            let said = config(&files).unwrap_err().to_string();
            assert!(said.contains(part) && said.lines().count() == 1, "{said}");
        }
    }
}
