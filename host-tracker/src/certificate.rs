//! What TLS shows of this tracker: a certificate of its own, made at the first start, or one from files.
//!
//! ```text
//!   home.toml ─ beside it ─▶ home.key.pem   ECDSA P-256, mode 0600 ─┐
//!                            home.cert.pem  signed by that key ─────┴─▶ rustls ─▶ SHA-256, said at each start
//! ```
//!
//! Its own certificate has no end that anybody sees (year 4096): one that ran out would shut out devices that know it, the button of a
//! way out among them. Who compares its fingerprint once, or gives the file to a device, needs no authority. It stays
//! the same as long as its files do, also when names and addresses of the machine change.
//!
//! Source: rustls with ring, which needs a C compiler and no library of the system; TLS 1.2 and 1.3.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rcgen::{CertificateParams, DnType, ExtendedKeyUsagePurpose, KeyPair};
use rustls::ServerConfig;
use rustls::crypto::ring::default_provider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer};
use sha2::{Digest, Sha256};

/// What its own certificate is for.
const SUBJECT: &str = "kehai-tracker";

/// A certificate with its key, ready for use. Clones are the same.
#[derive(Clone, Debug)]
pub struct Certificate {
    file: PathBuf,
    fingerprint: String,
    config: Arc<ServerConfig>,
}

/// Why there is none, in one line.
#[derive(Debug, thiserror::Error)]
pub enum CertificateError {
    /// The system.
    #[error("{}: {error}", file.display())]
    System {
        /// The file.
        file: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// The file holds something else.
    #[error("{}: this is no {what} in PEM: {why}", file.display())]
    Wrong {
        /// The file.
        file: PathBuf,
        /// What it should hold.
        what: &'static str,
        /// Why it does not.
        why: String,
    },
    /// The two do not belong together, or TLS cannot use them.
    #[error("{} with {}: {error}", file.display(), key.display())]
    Unusable {
        /// The certificate's file.
        file: PathBuf,
        /// The key's file.
        key: PathBuf,
        /// What TLS says.
        error: rustls::Error,
    },
    /// None can be made.
    #[error("no certificate can be made: {0}")]
    Unmade(#[from] rcgen::Error),
}

impl Certificate {
    /// That of a site, beside its file; made for these names and addresses if it is not there.
    ///
    /// # Errors
    /// [`CertificateError`]. Nothing is overwritten.
    pub fn own(site: &Path, names: &[String]) -> Result<Self, CertificateError> {
        let (file, key) = (site.with_extension("cert.pem"), site.with_extension("key.pem"));
        if !key.exists() {
            write(&key, &KeyPair::generate()?.serialize_pem(), 0o600)?;
        }
        if !file.exists() {
            let text = read(&key)?;
            let pair = KeyPair::from_pem(&text).map_err(|why| wrong(&key, "key", why))?;
            let mut parameters = CertificateParams::new(names)?;
            parameters.distinguished_name.push(DnType::CommonName, SUBJECT);
            // For browsers, and for a broker that knows its clients by certificates.
            parameters.extended_key_usages =
                vec![ExtendedKeyUsagePurpose::ServerAuth, ExtendedKeyUsagePurpose::ClientAuth];
            write(&file, &parameters.self_signed(&pair)?.pem(), 0o644)?;
        }
        Self::from_files(&file, &key)
    }

    /// From files in PEM: the certificate with those between it and its authority, and the key.
    ///
    /// # Errors
    /// [`CertificateError`].
    pub fn from_files(file: &Path, key: &Path) -> Result<Self, CertificateError> {
        let text = read(file)?;
        let chain: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(text.as_bytes()).collect();
        let chain = chain.map_err(|why| wrong(file, "certificate", why))?;
        let Some(first) = chain.first() else {
            return Err(wrong(file, "certificate", "there is none in it"));
        };
        let digits: Vec<String> = Sha256::digest(first).iter().map(|byte| format!("{byte:02X}")).collect();
        let fingerprint = digits.join(":");
        let secret =
            PrivateKeyDer::from_pem_slice(read(key)?.as_bytes()).map_err(|why| wrong(key, "key", why))?;
        let unusable = |error| CertificateError::Unusable { file: file.into(), key: key.into(), error };
        let mut config = ServerConfig::builder_with_provider(Arc::new(default_provider()))
            .with_safe_default_protocol_versions()
            .and_then(|builder| builder.with_no_client_auth().with_single_cert(chain, secret))
            .map_err(unusable)?;
        config.alpn_protocols = vec![b"http/1.1".to_vec()];
        Ok(Self { file: file.to_path_buf(), fingerprint, config: Arc::new(config) })
    }

    /// Its file.
    #[must_use]
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// The SHA-256 of it, as browsers show it: `AB:CD:…`.
    #[must_use]
    pub fn fingerprint(&self) -> &str {
        &self.fingerprint
    }

    /// For a server.
    #[must_use]
    pub fn config(&self) -> Arc<ServerConfig> {
        Arc::clone(&self.config)
    }
}

fn wrong(file: &Path, what: &'static str, why: impl ToString) -> CertificateError {
    CertificateError::Wrong { file: file.to_path_buf(), what, why: why.to_string() }
}

fn read(file: &Path) -> Result<String, CertificateError> {
    fs::read_to_string(file).map_err(|error| CertificateError::System { file: file.to_path_buf(), error })
}

/// Writes a file that is not there yet.
fn write(file: &Path, text: &str, mode: u32) -> Result<(), CertificateError> {
    let mut options = File::options();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, mode);
    #[cfg(not(unix))]
    let _ = mode;
    let written = options.open(file).and_then(|mut out| {
        out.write_all(text.as_bytes())?;
        out.sync_all()
    });
    if written.is_err() {
        // Half a file would be refused at the next start.
        let _ = fs::remove_file(file);
    }
    written.map_err(|error| CertificateError::System { file: file.to_path_buf(), error })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Vec<String> {
        ["localhost", "127.0.0.1", "::1", "hall.local"].map(String::from).to_vec()
    }

    #[test]
    fn its_own_is_made_once_and_its_key_is_for_its_owner_alone() {
        let folder = tempfile::tempdir().unwrap();
        let site = folder.path().join("home.toml");
        let made = Certificate::own(&site, &names()).unwrap();
        assert_eq!(made.fingerprint().len(), 32 * 3 - 1);
        assert!(made.file().ends_with("home.cert.pem"));
        let again = Certificate::own(&site, &["other".into()]).unwrap();
        assert_eq!(again.fingerprint(), made.fingerprint());
        #[cfg(unix)]
        {
            let data = fs::metadata(folder.path().join("home.key.pem")).unwrap();
            assert_eq!(std::os::unix::fs::PermissionsExt::mode(&data.permissions()) & 0o777, 0o600);
        }
        fs::remove_file(made.file()).unwrap();
        let renewed = Certificate::own(&site, &names()).unwrap();
        assert_ne!(renewed.fingerprint(), made.fingerprint());
    }

    #[test]
    fn what_does_not_belong_together_or_is_none_is_one_line() {
        let folder = tempfile::tempdir().unwrap();
        let [one, two] = ["one", "two"].map(|name| folder.path().join(name).with_extension("toml"));
        for site in [&one, &two] {
            Certificate::own(site, &names()).unwrap();
        }
        let key = two.with_extension("key.pem");
        let said = Certificate::from_files(&one.with_extension("cert.pem"), &key).unwrap_err().to_string();
        assert!(said.contains("one.cert.pem with ") && said.contains("two.key.pem"), "{said}");
        let said = Certificate::from_files(&key, &key).unwrap_err().to_string();
        assert!(said.contains("two.key.pem: this is no certificate in PEM"), "{said}");
        let said = Certificate::from_files(&one.with_extension("cert.pem"), &one.with_extension("cert.pem"));
        assert!(said.unwrap_err().to_string().contains("one.cert.pem: this is no key in PEM"));
        assert!(
            Certificate::from_files(Path::new("/nowhere"), &key)
                .unwrap_err()
                .to_string()
                .contains("/nowhere: ")
        );
        fs::write(&key, "damaged").unwrap();
        assert!(Certificate::own(&two, &names()).is_err());
        assert_eq!(fs::read_to_string(&key).unwrap(), "damaged", "left alone");
    }
}
