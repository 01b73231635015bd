//! Which service and which device: versions and lists over HTTP, and every reason to refuse.

use super::message::{ArmStatus, ServiceReport, is_plain_name};
use crate::figures::UseError;
use crate::http::{self, HttpError};
use serde::Deserialize;
use std::net::SocketAddr;
use thiserror::Error;

/// The first version whose messages have the fields used here; 3.1 names a force `values`.
const VERSION_MIN: [u32; 2] = [3, 5];
/// The first version that is not known: Haply announces for 4 that interfaces are removed.
const MAJOR_UNKNOWN: u32 = 4;

/// Why a device cannot be used.
#[derive(Debug, Error)]
pub enum InverseError {
    #[error(
        "the Inverse service does not answer at {address}: {source}; start the service or Haply Hub on this computer"
    )]
    NoService { address: SocketAddr, source: HttpError },
    #[error(
        "the program at {0} is not an Inverse service, because it reports no version; choose the address of the service"
    )]
    NotAService(SocketAddr),
    #[error(
        "the Inverse service has version {found}, but version 3.5 or later of 3 is needed; update it with Haply Hub"
    )]
    TooOld { found: String },
    #[error(
        "the Inverse service has version {found}, which palpate does not know; install a version from 3.5 to before 4"
    )]
    TooNew { found: String },
    #[error("the Inverse service has no Inverse3; connect the device and its power supply")]
    NoDevice,
    #[error("the Inverse service has no device named '{name}'; it has {known}")]
    UnknownDevice { name: String, known: String },
    #[error("the Inverse service has several devices ({known}); choose one by its name")]
    Ambiguous { known: String },
    #[error("the device '{0}' has no power; connect its power supply")]
    NoPower(String),
    #[error(
        "the device '{0}' is not calibrated; place its handle on the inkwell and wait until its light is steady"
    )]
    NotCalibrated(String),
    #[error("the device '{0}' is not ready; wait, or connect it again")]
    NotReady(String),
    #[error(
        "the device '{0}' is in use by a different program, whose forces would add to those of the scene; close that program"
    )]
    InUse(String),
    #[error(
        "the device '{0}' has no grip with a button, and without one the force cannot depend on a hand; connect a VerseGrip"
    )]
    NoGrip(String),
    #[error("the Inverse service lists devices in a form that palpate cannot read")]
    Format,
    #[error("the connection to the Inverse service cannot be opened ({0})")]
    Connect(String),
    #[error(
        "the Inverse service fails while its delay is measured ({0}); restart the service, or connect the device again"
    )]
    Silent(String),
    #[error("the thread of the haptic device cannot be started ({0}); close other programs")]
    Thread(std::io::Error),
    #[error(transparent)]
    Use(#[from] UseError),
}

/// A device that can be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundDevice {
    /// Its name in the service.
    pub name: String,
    /// The grip on it, whose button a hand must press.
    pub grip: String,
    /// Version of the service.
    pub version: String,
}

/// Asks a service for its version and its devices, and takes the one named, or the only one.
pub fn find(address: SocketAddr, name: Option<&str>) -> Result<FoundDevice, InverseError> {
    let no_service = |source| InverseError::NoService { address, source };
    let version = http::get(address, "/version").map_err(|err| match err {
        HttpError::Connect(_) | HttpError::Read(_) => no_service(err),
        _ => InverseError::NotAService(address),
    })?;
    let version = checked_version(&version, address)?;
    let devices = http::get(address, "/devices").map_err(no_service)?;
    let devices = ServiceReport::parse_devices(&devices).map_err(|_| InverseError::Format)?;
    let (name, status) = chosen(&devices, name)?;
    check_status(&name, status)?;
    let grip = devices.first_grip().filter(|grip| is_plain_name(grip)).map(str::to_owned);
    match grip {
        Some(grip) => Ok(FoundDevice { name, grip, version }),
        None => Err(InverseError::NoGrip(name)),
    }
}

/// The version in an answer of `/version`, if palpate knows it.
fn checked_version(answer: &str, address: SocketAddr) -> Result<String, InverseError> {
    #[derive(Deserialize)]
    struct Version {
        project_version: String,
    }
    #[derive(Deserialize)]
    struct Envelope {
        data: Version,
    }
    let bare = serde_json::from_str::<Version>(answer);
    let version = bare.or_else(|_| serde_json::from_str::<Envelope>(answer).map(|one| one.data));
    let found = version.map_err(|_| InverseError::NotAService(address))?.project_version;
    let mut parts = found.split('.').map(|part| part.parse::<u32>().ok());
    let (Some(Some(major)), Some(Some(minor))) = (parts.next(), parts.next()) else {
        return Err(InverseError::NotAService(address));
    };
    if major >= MAJOR_UNKNOWN {
        return Err(InverseError::TooNew { found });
    }
    if [major, minor] < VERSION_MIN {
        return Err(InverseError::TooOld { found });
    }
    Ok(found)
}

fn chosen(
    devices: &ServiceReport,
    name: Option<&str>,
) -> Result<(String, ArmStatus), InverseError> {
    // A name with quotes in it could change a message.
    let all: Vec<_> = devices.arms().filter(|(name, _)| is_plain_name(name)).collect();
    let known = || all.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let found = match (name, &all[..]) {
        (_, []) => return Err(InverseError::NoDevice),
        (Some(name), _) => all
            .iter()
            .find(|(known, _)| *known == name)
            .ok_or_else(|| InverseError::UnknownDevice { name: name.to_owned(), known: known() })?,
        (None, [only]) => only,
        (None, _) => return Err(InverseError::Ambiguous { known: known() }),
    };
    Ok((found.0.to_owned(), found.1))
}

fn check_status(name: &str, status: ArmStatus) -> Result<(), InverseError> {
    let name = name.to_owned();
    match status {
        ArmStatus { power_supply: false, .. } => Err(InverseError::NoPower(name)),
        ArmStatus { calibrated: false, .. } => Err(InverseError::NotCalibrated(name)),
        ArmStatus { ready: false, .. } => Err(InverseError::NotReady(name)),
        ArmStatus { in_use: true, .. } => Err(InverseError::InUse(name)),
        ArmStatus { .. } => Ok(()),
    }
}
