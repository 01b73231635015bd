//! From a rig's name to the rig.

use crate::rig::{Rig, RigError};
use crate::rig_file::{self, RigFile};
use crate::sim::{SimRig, SimSettings};
use crate::wire::HostClock;
use std::io::Read;

/// Opens the rig called `name`: `sim`, or `sim:NAME` for a simulated rig that people share by name.
///
/// Two programs that open the same name get two rigs; keeping one name to one program is the
/// caller's business.
pub fn open(name: &str, settings: &SimSettings) -> Result<Box<dyn Rig>, RigError> {
    let is_sim = name == "sim"
        || name.strip_prefix("sim:").is_some_and(|own| {
            !own.is_empty() && !own.chars().any(|c| !(c.is_alphanumeric() || " _-".contains(c)))
        });
    if is_sim {
        Ok(Box::new(SimRig::named(name, *settings)))
    } else {
        Err(RigError::Unknown { name: name.to_owned() })
    }
}

#[must_use]
pub fn is_rig_file(name: &str) -> bool {
    name.ends_with(".toml")
}

pub fn read_rig_file(file: &str) -> Result<RigFile, RigError> {
    Ok(RigFile::parse(file, &read_rig_text(file)?)?)
}

/// The text of a rig file.
pub fn read_rig_text(file: &str) -> Result<String, RigError> {
    let unreadable = |detail: String| RigError::File { file: file.to_owned(), detail };
    let mut bytes = Vec::new();
    std::fs::File::open(file)
        .and_then(|open| {
            // One more than allowed, so that too much is noticed and nothing endless is read.
            open.take(rig_file::BYTES_MAX as u64 + 1).read_to_end(&mut bytes)
        })
        .map_err(|err| unreadable(err.to_string()))?;
    String::from_utf8(bytes).map_err(|_| unreadable("it is not a text file".into()))
}

/// Opens the rig that a file describes and checks its devices against it. Nothing moves.
pub fn open_wired(file: &str, clock: &HostClock) -> Result<Box<dyn Rig>, RigError> {
    read_rig_file(file)?
        .open(clock)
        .map_err(|error| RigError::Device { file: file.to_owned(), error })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::Nanos;

    #[test]
    fn shared_name_is_in_the_description() {
        for name in ["sim", "sim:bench 2"] {
            let rig = open(name, &SimSettings::default()).unwrap();
            assert_eq!(rig.description().name, name);
            assert!(rig.is_virtual());
        }
    }

    #[test]
    fn error_of_a_rig_file_names_the_file() {
        let clock: HostClock = std::sync::Arc::new(|| Nanos::ZERO);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("bench.toml").display().to_string();
        assert!(is_rig_file(&file) && !is_rig_file("sim"));
        let message = |file: &str| match open_wired(file, &clock) {
            Ok(_) => panic!("{file} was opened"),
            Err(err) => err.to_string(),
        };
        assert!(message(&file).contains("cannot be read"));
        std::fs::write(&file, b"\xff").unwrap();
        assert!(message(&file).contains("not a text"));
        std::fs::write(&file, "device = \"marlin\"").unwrap();
        assert!(message(&file).contains("bench.toml, line 1: device"));
        let text = "device = \"galil\"\nport = \"/dev/there-is-no-such-port\"\nmm_per_pulse = 0.015\n\
            travel_mm = 150\nspeed_max_mm_s = 20\nacceleration_mm_s2 = 61.44\nconverter = \"16 bit\"\n";
        std::fs::write(&file, text).unwrap();
        assert!(matches!(
            open_wired(&file, &clock),
            Err(RigError::Device { file: named, .. }) if named == file
        ));
    }

    #[test]
    fn other_names_are_refused_by_name() {
        for name in ["", "Sim", "sim:", "simulated", "/dev/ttyUSB0", "sim:a\nb"] {
            let Err(err) = open(name, &SimSettings::default()) else {
                panic!("'{name}' was opened");
            };
            assert!(err.to_string().contains(name));
        }
    }
}
