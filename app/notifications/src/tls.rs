//! Encryption of connections: rustls with ring, and the certificates of the computer or of a file.

use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use rustls::{ClientConfig, RootCertStore};
use rustls_platform_verifier::BuilderVerifierExt;
use std::sync::Arc;

/// The certificates of a text in PEM form.
pub(crate) fn authorities(pem: &[u8]) -> Result<RootCertStore, String> {
    let mut store = RootCertStore::empty();
    for certificate in CertificateDer::pem_slice_iter(pem) {
        let certificate = certificate.map_err(|err| format!("it has no certificate ({err})"))?;
        store.add(certificate).map_err(|err| format!("a certificate cannot be used ({err})"))?;
    }
    match store.is_empty() {
        true => Err("it has no certificate".to_owned()),
        false => Ok(store),
    }
}

/// Trusts the certificates of a file alone, or where there is none those that the computer trusts.
pub(crate) fn client_config(ca_file: Option<&[u8]>) -> Result<Arc<ClientConfig>, String> {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let builder = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(|err| err.to_string())?;
    let builder = match ca_file {
        Some(pem) => builder.with_root_certificates(authorities(pem)?),
        None => builder.with_platform_verifier().map_err(|err| err.to_string())?,
    };
    Ok(Arc::new(builder.with_no_client_auth()))
}

/// For connections that are not encrypted: it trusts nothing.
pub(crate) fn no_encryption() -> Result<ClientConfig, String> {
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let builder = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .map_err(|err| err.to_string())?;
    Ok(builder.with_root_certificates(RootCertStore::empty()).with_no_client_auth())
}
