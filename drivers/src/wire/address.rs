//! The address of a device, and why a connection to it can fail.

use super::link::{Link, SerialLink, TcpLink};
use crate::serial::list_ports;
use serialport::{FlowControl, SerialPort};
use std::fmt;
use std::io::ErrorKind;
use std::net::{TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::time::Duration;
use thiserror::Error;

/// A controller in the same laboratory answers within milliseconds.
const CONNECT_MAX: Duration = Duration::from_secs(3);

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DeviceAddress {
    /// A serial port, 8 data bits, no parity, one stop bit.
    Serial { port: String, baud: u32, has_handshake: bool },
    /// `HOST:PORT`.
    Tcp(String),
    /// A program of this computer with its arguments, started in a folder.
    Program { words: Vec<String>, folder: PathBuf },
}

impl fmt::Display for DeviceAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial { port, baud, .. } => write!(f, "{port} at {baud} baud"),
            Self::Tcp(address) => f.write_str(address),
            Self::Program { words, folder } => {
                write!(f, "{} in {}", words.join(" "), folder.display())
            }
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum WireError {
    #[error("the serial port {port} does not exist; this computer has {present}")]
    Missing { port: String, present: String },
    #[error("the serial port {port} is in use by another program; close that program first")]
    Busy { port: String },
    #[error(
        "this account may not open {port}; add the account to the group that owns the port (on Linux usually `sudo usermod -aG dialout $USER`) and log in again"
    )]
    Forbidden { port: String },
    #[error("the serial port {port} cannot be opened ({detail}); check cable and settings")]
    Port { port: String, detail: String },
    #[error("'{address}' is not an address ({detail}); give HOST:PORT, such as 192.168.1.10:23")]
    Address { address: String, detail: String },
    #[error(
        "no device answers at {address} ({detail}); check power and address of the device, and that it has a free connection"
    )]
    Unreachable { address: String, detail: String },
    #[error(
        "the program {program} cannot be started ({detail}); check its name and its path, which counts from the folder of the rig file"
    )]
    Program { program: String, detail: String },
}

impl DeviceAddress {
    /// Opens it. Two programs cannot have one serial port.
    pub fn open(&self) -> Result<Box<dyn Link>, WireError> {
        match self {
            Self::Serial { port, baud, has_handshake } => {
                let flow = if *has_handshake { FlowControl::Hardware } else { FlowControl::None };
                let opened: Box<dyn SerialPort> = serialport::new(port, *baud)
                    .flow_control(flow)
                    .timeout(Duration::from_millis(1))
                    .open()
                    .map_err(|err| port_error(port, &err))?;
                Ok(Box::new(SerialLink(opened)))
            }
            Self::Tcp(address) => {
                let wrong =
                    |detail: String| WireError::Address { address: address.clone(), detail };
                let resolved = address
                    .to_socket_addrs()
                    .map_err(|err| wrong(err.to_string()))?
                    .next()
                    .ok_or_else(|| wrong("no computer has this name".into()))?;
                let opened = TcpStream::connect_timeout(&resolved, CONNECT_MAX)
                    .and_then(TcpLink::new)
                    .map_err(|err| WireError::Unreachable {
                        address: address.clone(),
                        detail: err.to_string(),
                    })?;
                Ok(Box::new(opened))
            }
            Self::Program { words, folder } => start_program(words, folder),
        }
    }
}

#[cfg(unix)]
fn start_program(words: &[String], folder: &Path) -> Result<Box<dyn Link>, WireError> {
    let started = super::program::ProgramLink::start(words, folder);
    let link = started.map_err(|err| WireError::Program {
        program: words.first().cloned().unwrap_or_default(),
        detail: err.to_string(),
    })?;
    Ok(Box::new(link))
}

/// Pipes of Windows cannot be waited for with a time limit.
#[cfg(not(unix))]
fn start_program(words: &[String], _folder: &Path) -> Result<Box<dyn Link>, WireError> {
    Err(WireError::Program {
        program: words.first().cloned().unwrap_or_default(),
        detail:
            "programs as devices need Linux or macOS; let it listen at a TCP port and give address"
                .into(),
    })
}

fn port_error(port: &str, err: &serialport::Error) -> WireError {
    use serialport::ErrorKind as Kind;
    let port = port.to_owned();
    match err.kind() {
        Kind::Io(ErrorKind::NotFound) => WireError::Missing { port, present: port_list() },
        Kind::Io(ErrorKind::PermissionDenied) => WireError::Forbidden { port },
        Kind::Io(ErrorKind::ResourceBusy) => WireError::Busy { port },
        // A second open with serialport 4.10 fails with this kind and "Unable to acquire exclusive lock on serial
        // port"; on Windows a missing port has it too, with other words.
        Kind::NoDevice if err.description.contains("lock") => WireError::Busy { port },
        Kind::NoDevice if !std::path::Path::new(&port).exists() => {
            WireError::Missing { port, present: port_list() }
        }
        _ => WireError::Port { port, detail: err.to_string() },
    }
}

fn port_list() -> String {
    match list_ports() {
        Ok(ports) if ports.is_empty() => "none".to_owned(),
        Ok(ports) => ports
            .into_iter()
            .map(|port| format!("{} ({})", port.name, port.description))
            .collect::<Vec<_>>()
            .join(", "),
        Err(err) => err.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn serial(port: &str) -> WireError {
        let place =
            DeviceAddress::Serial { port: port.into(), baud: 115_200, has_handshake: false };
        let Err(err) = place.open() else {
            panic!("{port} was opened");
        };
        err
    }

    #[test]
    fn missing_port_error_lists_the_ports_there_are() {
        let err = serial("/dev/there-is-no-such-port");
        assert!(matches!(err, WireError::Missing { .. }), "{err:?}");
        assert!(err.to_string().contains("this computer has"), "{err}");
    }

    #[test]
    fn file_is_refused_as_a_port() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let err = serial(&file.path().display().to_string());
        assert!(matches!(err, WireError::Port { .. }), "{err:?}");
    }

    #[test]
    fn addresses_are_checked_before_connecting() {
        for wrong in ["", "localhost", "localhost:x", "127.0.0.1:99999"] {
            let Err(err) = DeviceAddress::Tcp(wrong.into()).open() else {
                panic!("'{wrong}' was opened");
            };
            assert!(matches!(err, WireError::Address { .. }), "{err}");
            assert!(err.to_string().contains("HOST:PORT"));
        }
    }

    #[test]
    fn refused_connection_names_the_address() {
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let address = free.local_addr().unwrap().to_string();
        drop(free);
        let Err(err) = DeviceAddress::Tcp(address.clone()).open() else {
            panic!("a connection was accepted");
        };
        assert!(err.to_string().contains(&address), "{err}");
    }
}
