//! `palpate emulate`.

use crate::support::{palpate, stderr};
use palpate_test_support::wait::{PATIENCE, until};
use serde_json::Value;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

/// Ends with the test, whatever happens.
pub(super) struct Emulator(pub Child);

impl Drop for Emulator {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// An emulated Galil controller on a port of this computer, and where.
pub(super) fn emulate_galil(more: &[&str]) -> (Emulator, String) {
    let (emulator, ready) = start(more);
    let at = ready["at"].as_str().expect("a place").to_owned();
    (emulator, at)
}

fn start(more: &[&str]) -> (Emulator, Value) {
    start_device("galil", more)
}

pub(super) fn start_device(device: &str, more: &[&str]) -> (Emulator, Value) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["emulate", device, "--tcp", "127.0.0.1:0", "--json"])
        .args(more)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("palpate starts");
    let mut line = String::new();
    let out = child.stdout.take().expect("it is piped");
    BufReader::new(out).read_line(&mut line).expect("a line");
    let ready = serde_json::from_str(&line).expect("an object");
    (Emulator(child), ready)
}

#[test]
fn a_controller_answers_on_a_port_and_weights_are_put_on_its_cell() {
    let (mut emulator, ready) = start(&[]);
    assert_eq!((&ready["device"], &ready["model"]), (&"galil".into(), &"dmc4143".into()));
    assert_eq!(ready["is_serial"], false);
    let mut port = TcpStream::connect(ready["at"].as_str().unwrap()).unwrap();
    port.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut ask = |text: &str| {
        port.write_all(text.as_bytes()).unwrap();
        let mut answer = String::new();
        let mut byte = [0_u8];
        while !answer.ends_with(':') {
            port.read_exact(&mut byte).unwrap();
            answer.push(char::from(byte[0]));
        }
        answer.trim_end_matches(':').trim().to_owned()
    };
    assert_eq!(ask("QZ\r"), "4, 52, 26, 36");
    let free: f64 = ask("MG @AN[1]\r").parse().unwrap();
    let mut notes = BufReader::new(emulator.0.stderr.take().unwrap());
    let mut order = |text: &str| {
        let stdin = emulator.0.stdin.as_mut().unwrap();
        stdin.write_all(text.as_bytes()).unwrap();
        let mut note = String::new();
        notes.read_line(&mut note).unwrap();
        note
    };
    assert_eq!(order("load 840\n"), "note: a mass of 840 g is on the load cell\n");
    assert!(order("load much\n").contains("mass in g"));
    // A sample later the cell feels it.
    let is_felt = || {
        let loaded: f64 = ask("MG @AN[1]\r").parse().ok()?;
        (loaded > free + 0.1).then_some(())
    };
    until(is_felt, || format!("more than {free} V"));
}

#[test]
fn a_board_answers_on_a_port_and_its_cell_on_a_line_of_its_own() {
    let (_emulator, ready) = start_device("grbl", &[]);
    assert_eq!(ready["is_serial"], false);
    let mut port = TcpStream::connect(ready["at"].as_str().unwrap()).unwrap();
    port.set_read_timeout(Some(PATIENCE)).unwrap();
    port.write_all(b"$N\n").unwrap();
    let mut lines = BufReader::new(port).lines().map(Result::unwrap);
    assert_eq!(lines.find(|line| line == "$N0="), Some("$N0=".to_owned()));
    let cell = File::open(ready["cell_at"].as_str().unwrap()).unwrap();
    let mut values = BufReader::new(cell).lines().map(Result::unwrap);
    assert!(values.any(|line| line.starts_with("D,")));
}

#[test]
fn wrong_use_is_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    for (args, code, part) in [
        (&["--model", "dmc1820"][..], 2, "choose dmc4143"),
        (&["--fault", "melt@1"], 2, "garbage, drop"),
        (&["--pty", "a", "--tcp", "127.0.0.1:0"], 2, "used with"),
        (&["--adc", "8"], 2, "12, 16 or none"),
        // An address of documentation, which no computer has.
        (&["--tcp", "192.0.2.1:5023"], 1, "--pty or --tcp"),
        (&["--pty", "no/such/folder"], 1, "--pty or --tcp"),
    ] {
        let output = palpate(folder.path(), &[&["emulate", "galil"], args].concat());
        assert_eq!(output.status.code(), Some(code), "{args:?}");
        let printed = stderr(&output);
        assert!(printed.contains(part) && printed.lines().count() == 1, "{printed}");
    }
}
