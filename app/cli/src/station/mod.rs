//! The station of a rig: `palpate serve`, `palpate token`, and `--serve` of other commands.

pub(super) mod serve;
pub(super) mod token;

use super::Failure;
use super::output::Output;
use super::rig::OpenRig;
use clap::Args;
use palpate_analysis::station_settings::{STATION_PORT, StationSettings, TlsFiles};
use palpate_runner::{Runner, RunnerHandle};
use palpate_sessions::library_folder;
use palpate_station::remote::RemoteBench;
use palpate_station::{BoundStation, Station, StationError};
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

/// How a station is reached.
#[derive(Clone, Debug, Default, Args)]
pub struct StationArgs {
    /// Certificate chain of the station, a PEM file; without it only this computer is served
    #[arg(long, value_name = "FILE", requires = "key")]
    certificate: Option<PathBuf>,
    /// Private key of the certificate, a PEM file
    #[arg(long, value_name = "FILE", requires = "certificate")]
    key: Option<PathBuf>,
    /// Serve other computers without TLS: whoever listens on the network can read tokens and values
    #[arg(long, conflicts_with = "certificate")]
    plain: bool,
    /// A name by which browsers may call the station, beside its addresses; may be repeated
    #[arg(long = "host-name", value_name = "HOST")]
    names: Vec<String>,
}

/// A station beside a run or a window.
#[derive(Clone, Debug, Default, Args)]
pub struct ServeBesideArgs {
    /// Serve the rig over HTTP meanwhile: watch and stop it from a browser, at this address or port, or at 127.0.0.1:7480
    #[arg(long, value_name = "ADDRESS", value_parser = parse_address, num_args = 0..=1, require_equals = true,
        default_missing_value = "7480")]
    serve: Option<SocketAddr>,
    #[command(flatten)]
    station: StationArgs,
}

impl ServeBesideArgs {
    /// The settings of the station, if there is to be one.
    pub fn settings(&self) -> Result<Option<StationSettings>, Failure> {
        self.serve.map(|address| self.station.settings(address)).transpose()
    }

    /// Takes the address, where a station is wanted: before anything moves.
    pub fn bind(&self) -> Result<Option<BoundStation>, Failure> {
        let settings = self.settings()?;
        settings.map(|settings| BoundStation::bind(&settings).map_err(failure)).transpose()
    }
}

/// Serves a run: it can be watched and stopped, and nothing can be started.
pub(super) fn serve_run(
    bound: Option<BoundStation>,
    runner: &Runner,
    output: &Output,
) -> Result<Option<Station>, Failure> {
    let Some(bound) = bound else { return Ok(None) };
    let station = bound.serve(runner.handle(), None).map_err(failure)?;
    output.note(&format!("the rig is served at {}/", station.url()));
    Ok(Some(station))
}

/// Parses an address, or a port of this computer.
pub(super) fn parse_address(text: &str) -> Result<SocketAddr, String> {
    let local = IpAddr::V4(Ipv4Addr::LOCALHOST);
    let whole = text.parse::<SocketAddr>().ok();
    let port = || text.parse::<u16>().ok().map(|port| SocketAddr::new(local, port));
    let address = || text.parse::<IpAddr>().ok().map(|ip| SocketAddr::new(ip, STATION_PORT));
    whole.or_else(port).or_else(address).ok_or_else(|| {
        format!("'{text}' is not an address; give for example 127.0.0.1:{STATION_PORT} or 0.0.0.0:{STATION_PORT}")
    })
}

/// The address where none is given: this computer alone.
pub(super) fn usual_address() -> SocketAddr {
    SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), STATION_PORT)
}

impl StationArgs {
    /// The settings for an address.
    pub fn settings(&self, address: SocketAddr) -> Result<StationSettings, Failure> {
        let tls = self.certificate.clone().zip(self.key.clone());
        Ok(StationSettings {
            address,
            tls: tls.map(|(certificate, key)| TlsFiles { certificate, key }),
            is_plain_allowed: self.plain,
            names: self.names.clone(),
            library: library_folder().map_err(Failure::usage)?,
        })
    }
}

/// Starts a station.
pub(super) fn start(
    settings: &StationSettings,
    runner: RunnerHandle,
    bench: Option<RemoteBench>,
) -> Result<Station, Failure> {
    Station::start(settings, runner, bench).map_err(failure)
}

fn failure(err: StationError) -> Failure {
    match err {
        StationError::Plain { .. } => {
            Failure::usage(format!("{err}; add --certificate FILE --key FILE, or --plain"))
        }
        StationError::Tls { .. } => Failure::usage(err),
        StationError::Listen { .. } | StationError::Thread(_) => Failure::failed(err),
    }
}

/// What runs over the network are made with.
pub(super) fn remote_bench(bench: &OpenRig, library: PathBuf) -> RemoteBench {
    RemoteBench {
        calibration: bench.calibration.clone(),
        limits: bench.limits,
        to_acknowledge: bench.doubts.clone(),
        is_virtual: bench.rig.is_virtual(),
        library,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_a_port_or_both() {
        let of = |text| parse_address(text).map(|address| address.to_string());
        assert_eq!(of("9000").as_deref(), Ok("127.0.0.1:9000"));
        assert_eq!(of("0.0.0.0").as_deref(), Ok("0.0.0.0:7480"));
        assert_eq!(of("[::1]:80").as_deref(), Ok("[::1]:80"));
        for wrong in ["", "localhost:80", "1.2.3.4:99999", "70000"] {
            assert!(of(wrong).is_err(), "{wrong}");
        }
    }
}
