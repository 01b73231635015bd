//! The words of what rigs, their devices and ports refuse.

use palpate_drivers::RigError;
use palpate_drivers::device::OpenError;
use palpate_drivers::galil::{GalilError, GalilOpenError};
use palpate_drivers::grbl::GrblOpenError;
use palpate_drivers::serial::SerialError;
use palpate_drivers::sim::SimSettingError;
use palpate_drivers::text::DeviceError;
use palpate_drivers::wire::WireError;
use palpate_test_support::assert_messages;

fn detail() -> String {
    "no such device".into()
}

#[test]
fn messages_of_rigs_and_ports_name_what_is_wrong() {
    let file = || "bench.toml".to_owned();
    let port = || "/dev/ttyUSB0".to_owned();
    let address = || "192.0.2.1:23".to_owned();
    let thread = OpenError::Thread("no memory".into());
    assert_messages! {
        RigError::Unknown { name: "robot".into() } => ["'robot'"],
        RigError::File { file: file(), detail: detail() } => ["bench.toml", "no such device"],
        RigError::CannotReconnect => ["again"],
        RigError::Device { file: file(), error: thread } => ["bench.toml", "no memory"],
        WireError::Missing { port: port(), present: "none".into() } => ["/dev/ttyUSB0", "none"],
        WireError::Busy { port: port() } => ["/dev/ttyUSB0"],
        WireError::Forbidden { port: port() } => ["/dev/ttyUSB0", "dialout"],
        WireError::Port { port: port(), detail: detail() } => ["/dev/ttyUSB0", "no such device"],
        WireError::Address { address: address(), detail: detail() } => ["192.0.2.1:23", "no such device"],
        WireError::Unreachable { address: address(), detail: detail() } => ["192.0.2.1:23", "no such device"],
        WireError::Program { program: "my_stage".into(), detail: detail() } => ["my_stage", "no such device", "folder of the rig file"],
        SerialError::Listing { detail: detail() } => ["no such device"],
        SimSettingError { setting: "profile", value: "perfect".into(), choices: "ideal or lab" } => ["profile", "'perfect'", "ideal or lab"],
    }
}

#[test]
fn messages_of_a_galil_controller_name_what_is_wrong() {
    let error = GalilError { code: 6, words: "number out of range".into() };
    let revision = || "DMC4143 Rev 1.3a".to_owned();
    assert_messages! {
        GalilOpenError::Lost { detail: detail() } => ["no such device"],
        GalilOpenError::Silent => ["Galil"],
        GalilOpenError::NoGalil { got: "ok".into() } => ["'ok'"],
        GalilOpenError::Unsupported { revision: revision(), why: "it has no analogue input" } => ["DMC4143 Rev 1.3a", "it has no analogue input"],
        GalilOpenError::OtherSerial { found: "77".into(), expected: 78 } => ["77", "78"],
        GalilOpenError::NoAxis { revision: revision(), axes: 1, axis: 'C' } => ["DMC4143 Rev 1.3a", "1 axes", "axis C"],
        GalilOpenError::SetOtherwise { command: "SP 20".into(), found: "10".into() } => ["SP 20", "10"],
        GalilOpenError::Refused { command: "SP 20".into(), error } => ["SP 20", "number out of range"],
        GalilOpenError::NoRecording("it has no program".into()) => ["it has no program", "\"auto\""],
    }
}

#[test]
fn messages_of_a_grbl_board_and_a_load_cell_name_what_is_wrong() {
    let (device, expected) = ("HX711", || "78".to_owned());
    assert_messages! {
        GrblOpenError::Lost { detail: detail() } => ["no such device"],
        GrblOpenError::Silent => ["115200"],
        GrblOpenError::NotGrbl { found: "a gauge".into() } => ["a gauge"],
        GrblOpenError::OtherVersion { version: "0.9".into() } => ["Grbl 0.9", "Grbl 1.1"],
        GrblOpenError::OtherBoard { found: "left".into(), expected: "right".into() } => ["'left'", "'right'"],
        GrblOpenError::Locked { reason: "homing".into() } => ["homing", "unlock = true"],
        GrblOpenError::State("Door".into()) => ["Door"],
        GrblOpenError::OnALimit { axis: 'X' } => ["axis X"],
        GrblOpenError::SetOtherwise { number: 110, meaning: "speed", found: 500.0, wanted: "1200".into() } => ["$110=500", "speed", "$110=1200"],
        GrblOpenError::TooFine { number: 100, found: 3200.0 } => ["$100=3200"],
        GrblOpenError::OnASwitch { axis: 'X' } => ["axis X", "closed_is_home"],
        GrblOpenError::Refused { line: "$$".into(), detail: "error:8".into() } => ["$$", "error:8"],
        DeviceError::Silent { device, hint: "check its power" } => ["HX711", "check its power"],
        DeviceError::Other { device, found: "Grbl".into() } => ["HX711", "Grbl"],
        DeviceError::OtherSerial { device, found: "77".into(), expected: expected() } => ["HX711", "77", "78"],
        DeviceError::Unfit { device, detail: "its gain is 32".into() } => ["HX711", "its gain is 32"],
        DeviceError::Lost { device, detail: detail() } => ["HX711", "no such device"],
    }
}
