//! Where a station listens, and who may call it.

use std::net::SocketAddr;
use std::path::PathBuf;

/// The port where none is chosen.
pub const STATION_PORT: u16 = 7480;

/// The file of tokens in the library.
pub const TOKENS_FILE: &str = "station-tokens.json";

/// Version of that file.
pub const TOKENS_FORMAT: u32 = 1;

/// Certificate chain and private key, each a PEM file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TlsFiles {
    pub certificate: PathBuf,
    pub key: PathBuf,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StationSettings {
    pub address: SocketAddr,
    pub tls: Option<TlsFiles>,
    /// Serve other computers without TLS: whoever listens on the network reads tokens and values.
    pub is_plain_allowed: bool,
    /// Names by which browsers may call the station, beside addresses and localhost.
    pub names: Vec<String>,
    /// Tokens, sessions and queue.
    pub library: PathBuf,
}
