//! Search for a rig: the devices at the serial ports of this computer, and the rig files in some folders. Nothing moves.

use crate::detect::{DetectedDevice, detect_device};
use crate::open::{is_rig_file, read_rig_file};
use crate::rig::RigError;
use crate::serial::PortInfo;
use crate::wire::{DeviceAddress, HostClock};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Bits a second at which ports are asked.
pub const BAUD: u32 = 115_200;

/// Most files of a folder that are looked at.
const FILES_MAX: usize = 1000;

/// A serial port, and what the device at it says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundPort {
    pub port: PortInfo,
    /// What answers, or why it could not be asked.
    pub device: Result<DetectedDevice, String>,
}

/// A file that describes a rig.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundRigFile {
    pub path: PathBuf,
    /// Addresses of its devices, that of the axis first; or its mistakes.
    pub places: Result<Vec<DeviceAddress>, String>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FoundRigs {
    pub files: Vec<FoundRigFile>,
    pub ports: Vec<FoundPort>,
}

/// Asks a port, or `HOST:PORT` of a device on a network, which device is there.
pub fn detect_at(at: &str, baud: u32, clock: &HostClock) -> Result<DetectedDevice, String> {
    // A name with a number behind the last colon is an address; ports of Windows end in their colon.
    let is_address = at
        .rsplit_once(':')
        .is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
    let place = if is_address {
        DeviceAddress::Tcp(at.to_owned())
    } else {
        DeviceAddress::Serial { port: at.to_owned(), baud, has_handshake: false }
    };
    let mut link = place.open().map_err(|err| err.to_string())?;
    detect_device(link.as_mut(), clock).map_err(|err| format!("the link failed: {err}"))
}

/// Reads the rig files of the folders and asks every port; `report` gets how many ports are asked, of how many, and the
/// next one, and may end the search.
pub fn find_rigs(
    folders: &[PathBuf],
    ports: Vec<PortInfo>,
    clock: &HostClock,
    report: &dyn Fn(usize, usize, &str) -> ControlFlow<()>,
) -> FoundRigs {
    let mut found = FoundRigs::default();
    for folder in folders {
        for file in rig_files(folder) {
            if !found.files.iter().any(|one| one.path == file.path) {
                found.files.push(file);
            }
        }
    }
    let count = ports.len();
    for (asked, port) in ports.into_iter().enumerate() {
        if report(asked, count, &port.name).is_break() {
            break;
        }
        let device = detect_at(&port.name, BAUD, clock);
        found.ports.push(FoundPort { port, device });
    }
    found
}

/// The rig files of a folder in order of their names. Other files of the same ending, such as protocols, are left out; a
/// rig file with mistakes is not.
fn rig_files(folder: &Path) -> Vec<FoundRigFile> {
    let items = std::fs::read_dir(folder).into_iter().flatten().flatten().take(FILES_MAX);
    let mut paths: Vec<PathBuf> = items.map(|item| item.path()).collect();
    paths.retain(|path| path.is_file() && is_rig_file(&path.to_string_lossy()));
    paths.sort_unstable();
    let read = |path: PathBuf| match read_rig_file(&path.to_string_lossy()) {
        Ok(file) => Some(FoundRigFile { places: Ok(file.places().to_vec()), path }),
        Err(RigError::RigFile(err)) if names_device(&path) => {
            Some(FoundRigFile { places: Err(err.to_string()), path })
        }
        Err(_) => None,
    };
    paths.into_iter().filter_map(read).collect()
}

/// Whether a file has the key that every rig file has and nothing else of palpate's.
fn names_device(path: &Path) -> bool {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let is_device = |line: &str| line.split('=').next().is_some_and(|key| key.trim() == "device");
    text.lines().take_while(|line| !line.trim_start().starts_with('[')).any(is_device)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::Nanos;

    const RIG: &str = "device = \"galil\"\nport = \"/dev/there-is-no-such-port\"\nmm_per_pulse = 0.015\n\
        travel_mm = 150\nspeed_max_mm_s = 20\nacceleration_mm_s2 = 61.44\nconverter = \"16 bit\"\n";

    #[test]
    fn rig_files_are_found_once_and_other_files_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("bench.toml"), RIG).unwrap();
        std::fs::write(at("wrong.toml"), RIG.replace("galil", "marlin")).unwrap();
        std::fs::write(at("protocol.toml"), "[[step]]\ndevice = \"hand\"\n").unwrap();
        std::fs::write(at("notes.txt"), RIG).unwrap();
        let clock: HostClock = std::sync::Arc::new(|| Nanos::ZERO);
        let folders = [folder.path().to_owned(), at("none"), folder.path().to_owned()];
        let port = PortInfo { name: "/dev/there-is-no-such-port".into(), description: "-".into() };
        let go_on = |_: usize, _: usize, _: &str| ControlFlow::Continue(());
        let found = find_rigs(&folders, vec![port.clone()], &clock, &go_on);
        let files: Vec<_> = found.files.iter().map(|one| one.path.clone()).collect();
        assert_eq!(files, [at("bench.toml"), at("wrong.toml")]);
        let places = found.files[0].places.as_ref().unwrap();
        assert_eq!(places[0].to_string(), "/dev/there-is-no-such-port at 115200 baud");
        assert!(found.files[1].places.as_ref().unwrap_err().contains("line 1: device"));
        // A port that cannot be opened says why, and the search goes on.
        assert_eq!(found.ports.len(), 1);
        assert!(found.ports[0].device.as_ref().unwrap_err().contains("does not exist"));
        let stop = |_: usize, _: usize, _: &str| ControlFlow::Break(());
        assert!(find_rigs(&[], vec![port], &clock, &stop).ports.is_empty());
    }
}
