//! The skeletons themselves: written, started and run through the conformance suite, and through a rig.
//!
//! Where this computer is too busy for what depends on that, such as the longest answer, the test is skipped: the emulated
//! sidecar has it in simulated time.
#![expect(clippy::disallowed_methods, reason = "the skeletons run in real time")]

use palpate_drivers::RigEventBody;
use palpate_drivers::rig_file::RigFile;
use palpate_drivers::sidecar::conform::{
    ConformBench, ConformOptions, ConformReport, Verdict, run,
};
use palpate_drivers::sidecar::connect;
use palpate_drivers::sidecar::protocol::{
    HostMessage, ReceivedItem, SidecarMessage, SidecarParser,
};
use palpate_drivers::sidecar::skeleton::{SkeletonLanguage, skeleton};
use palpate_drivers::wire::{DeviceAddress, HostClock};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, MoveTo, RigCommand, SensorReading};
use palpate_model::units::{MmPerS, MmPerS2};
use palpate_test_support::skip;
use palpate_test_support::wait::{in_time, until};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Checks whose verdict does not depend on how busy the computer is.
const STEADY: [&str; 4] = ["introduction", "nonsense", "unknown-word", "too-fast"];

fn clock() -> HostClock {
    let start = Instant::now();
    Arc::new(move || Nanos(start.elapsed().as_nanos() as u64))
}

fn write(folder: &Path, language: SkeletonLanguage) {
    for file in skeleton("stage", language) {
        let to = folder.join(&file.path);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::fs::write(to, file.text).unwrap();
    }
}

fn conform(place: &DeviceAddress) -> ConformReport {
    let mut bench = ConformBench {
        open: &mut || place.open(),
        clock: clock(),
        wait: &|time| std::thread::sleep(Duration::from_nanos(time.0)),
        progress: &mut |_| {},
    };
    let watch = Nanos::from_millis(1_500);
    let options = ConformOptions { range_mm: Some(2.0), watch, ..ConformOptions::default() };
    run(&mut bench, &options).expect("the link holds")
}

/// Everything passes, or only what a busy computer makes fail.
fn check_all(place: &DeviceAddress) {
    in_time(|| {
        let report = conform(place);
        for name in STEADY {
            let check = report.checks.iter().find(|check| check.name == name);
            let check = check.unwrap_or_else(|| panic!("no check {name}: {report:#?}"));
            assert_eq!(check.verdict, Verdict::Pass, "{check:?}");
        }
        let failed = report.checks.iter().find(|check| check.verdict == Verdict::Fail);
        failed.map_or(Ok(()), |check| Err(format!("{check:?}")))?;
        assert!(report.trust.is_some_and(|trust| trust.speed_max_mm_s > 0.0));
        Ok(())
    });
}

#[test]
fn the_python_skeleton_keeps_to_the_protocol_and_is_a_rig() {
    if skip::lacks_program("python3") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), SkeletonLanguage::Python);
    let file = folder.path().join("stage.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    let rig_file = RigFile::parse(&file.display().to_string(), &text).unwrap();
    check_all(&rig_file.places()[0]);
    in_time(|| drive(&rig_file));
}

/// Enables the motor, moves and stops, as a runner does. A sidecar that gets no turn is a fault, as it must be.
fn drive(file: &RigFile) -> Result<(), String> {
    let time = clock();
    let mut rig = file.open(&time).unwrap();
    let about = rig.description().clone();
    assert_eq!(about.speed_max, MmPerS(1.0), "the file's is less than the sidecar's");
    assert_eq!(about.sensors.channels[0].name, "temperature");
    let to = MoveTo { target_pulses: 400, speed: MmPerS(1.0), acceleration: MmPerS2(50.0) };
    rig.send(RigCommand::EnableMotor);
    rig.send(RigCommand::MoveTo(to));
    let (mut acks, mut has_moved, mut sensors, mut faults) = (0, false, Vec::new(), Vec::new());
    let end = time() + Nanos::from_millis(30_000);
    let mut is_there = false;
    while time() < end
        && !(is_there
            && sensors.iter().any(|one| matches!(one, SensorReading::Channel { number: 1, .. })))
    {
        while let Some(event) = rig.next_event(time() + Nanos::from_millis(5)) {
            match event.body {
                RigEventBody::Reading(reading) => {
                    has_moved |= reading.status.has(AxisStatus::MOVING);
                    is_there = has_moved
                        && reading.pulses == 400
                        && !reading.status.has(AxisStatus::MOVING);
                }
                RigEventBody::Ack(_) => acks += 1,
                RigEventBody::Fault(fault) => faults.push(fault.to_string()),
            }
        }
        sensors.extend(rig.take_sensors());
    }
    if !faults.is_empty() {
        return Err(faults.join(", "));
    }
    assert!(is_there && acks == 2, "{is_there} {acks}");
    let raw: Vec<u8> = rig.take_raw().into_iter().flat_map(|piece| piece.bytes).collect();
    let raw = String::from_utf8_lossy(&raw);
    assert!(raw.contains(r#""do":"hello""#) && raw.contains(r#""do":"move","to":400"#));
    Ok(())
}

/// Runs a script of this folder, with words behind it; what fails there fails here.
fn run_script(script: &str, words: &[&str], folder: &Path) {
    if skip::lacks_program("python3") {
        return;
    }
    let output = Command::new("python3")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/suite").join(script))
        .args(words)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn the_python_skeleton_brakes_and_ends_well_when_only_its_output_is_closed() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), SkeletonLanguage::Python);
    run_script("closed_output.py", &["python3", "stage.py"], folder.path());
}

#[test]
fn a_python_sidecar_on_tcp_is_not_kept_by_a_peer_that_vanished() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), SkeletonLanguage::Python);
    run_script("tcp_sidecar.py", &["."], folder.path());
}

/// With a motor of the test's own: neither ophyd-async nor its packages are needed.
#[test]
fn the_ophyd_example_never_moves_after_a_stop() {
    run_script("ophyd_axis.py", &["sidecar/python"], Path::new(env!("CARGO_MANIFEST_DIR")));
}

/// The sketch on this computer, behind a pseudo-terminal.
struct EmulatedBoard(std::process::Child);

impl Drop for EmulatedBoard {
    fn drop(&mut self) {
        // It ends with its standard input.
        drop(self.0.stdin.take());
        self.0.wait().expect("it ends");
    }
}

/// Compiles the sketch, with some texts of it replaced, and switches the board on.
#[cfg(unix)]
fn switch_on(folder: &Path, edits: &[(&str, &str)]) -> (EmulatedBoard, DeviceAddress) {
    write(folder, SkeletonLanguage::Arduino);
    let file = folder.join("stage.ino");
    let mut text = std::fs::read_to_string(&file).unwrap();
    for (from, to) in edits {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text = text.replace(from, to);
    }
    std::fs::write(&file, text).unwrap();
    let host = Path::new(env!("CARGO_MANIFEST_DIR")).join("sidecar/arduino/host");
    let program = folder.join("board");
    let sketch = format!("-DSKETCH=\"{}\"", file.display());
    let compiled = Command::new("g++")
        .args(["-std=c++11", "-O1", "-Wall", "-Wextra", "-Wno-unused-function", &sketch, "-I"])
        .arg(&host)
        .arg(host.join("main.cpp"))
        .arg("-o")
        .arg(&program)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success() && errors.is_empty(), "{errors}");
    let port = folder.join("port");
    let child =
        Command::new(&program).arg(&port).stdin(Stdio::piped()).stderr(Stdio::null()).spawn();
    let board = EmulatedBoard(child.unwrap());
    until(|| port.exists().then_some(()), || "no port".into());
    let port = port.display().to_string();
    (board, DeviceAddress::Serial { port, baud: 115_200, has_handshake: false })
}

#[test]
#[cfg(unix)]
fn the_arduino_skeleton_keeps_to_the_protocol() {
    if skip::lacks_program("g++") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (_board, place) = switch_on(folder.path(), &[]);
    check_all(&place);
}

#[test]
#[cfg(unix)]
fn the_arduino_skeleton_says_the_pulse_with_which_it_moves_and_null_for_no_number() {
    if skip::lacks_program("g++") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let edits = [
        ("MM_PER_PULSE = 0.0025f", "MM_PER_PULSE = 0.0003125f"),
        ("return 21.5f;", "static int n = 0; return n++ % 2 ? -INFINITY : NAN;"),
    ];
    let (_board, place) = switch_on(folder.path(), &edits);
    let mut link = place.open().unwrap();
    let connected = connect(link.as_mut(), &clock(), &"board".into(), None).unwrap();
    let pulse = connected.description.axis.unwrap().mm_per_pulse;
    // A float of 24 bits is right to 6e-8.
    assert!((pulse / 0.000_312_5 - 1.0).abs() < 6e-8, "{pulse}");
    link.write(&HostMessage::Start { is_binary: false }.line(connected.number + 1, true)).unwrap();
    let mut parser = SidecarParser::new(true, false);
    let mut values = Vec::new();
    let mut buffer = [0_u8; 256];
    until(
        || {
            let count = link.read(&mut buffer, Duration::from_millis(10)).unwrap();
            for item in buffer[..count].iter().filter_map(|byte| parser.take(*byte)) {
                match item {
                    ReceivedItem::Message(SidecarMessage::Sample(sample)) => {
                        values.extend(sample.values);
                    }
                    ReceivedItem::Message(_) => {}
                    ReceivedItem::Garbled => panic!("a garbled line"),
                }
            }
            (values.len() >= 2).then_some(())
        },
        || "no values".into(),
    );
    assert_eq!(values[..2], [None, None]);
}
