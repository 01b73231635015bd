//! A load cell that sends plain numbers: opened, going on, and what goes wrong.

use super::bench::{CellBench, Stranger};
use palpate_drivers::cell::CellDevice;
use palpate_drivers::plain_numbers::PlainNumbers;
use palpate_drivers::rig_file::Fields;
use palpate_drivers::text::{DeviceError, OpenedCell};
use palpate_emulators::DeviceFault;
use palpate_emulators::cell::{CellLoad, EmulatedCell, emulated_cell, emulated_cells};
use palpate_model::Nanos;

/// A board that says the next of some lines every so many ms, and then the last again and again.
struct Script {
    lines: Vec<&'static str>,
    every_ms: u64,
    next: Nanos,
    out: Vec<u8>,
}

impl Script {
    fn new(lines: &[&'static str], every_ms: u64) -> Self {
        Self {
            lines: lines.iter().rev().copied().collect(),
            every_ms,
            next: Nanos::ZERO,
            out: Vec::new(),
        }
    }
}

impl EmulatedCell for Script {
    fn receive(&mut self, _now: Nanos, bytes: &[u8]) {
        panic!("nothing is ever written to it: {bytes:?}");
    }
    fn advance(&mut self, now: Nanos, _felt: CellLoad) {
        if now >= self.next {
            let line = if self.lines.len() > 1 {
                self.lines.pop().expect("one is left")
            } else {
                self.lines[0]
            };
            self.out.extend_from_slice(line.as_bytes());
            self.next = now + Nanos::from_millis(self.every_ms);
        }
    }
    fn transmit(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.out)
    }
    fn apply_fault(&mut self, _now: Nanos, _fault: DeviceFault, _is_on: bool) {}
}

/// What the emulated one is like.
const USUAL: &str = "unit = \"counts\"\nfull_scale = 8388607\n";

fn cell(keys: &str) -> PlainNumbers {
    let mut fields = Fields::read(&format!("[cell]\n{keys}")).expect("keys");
    PlainNumbers::read(&mut fields).expect("a cell")
}

fn opened<E: EmulatedCell>(bench: &CellBench<E>, keys: &str) -> Result<OpenedCell, DeviceError> {
    cell(keys).open(&mut bench.clone(), &bench.clock(), &"cell".into())
}

fn refused(script: Script, keys: &str) -> String {
    let refusal = opened(&CellBench::new(script), keys).err();
    refusal.expect("a refusal").to_string()
}

struct Emulated(Box<dyn EmulatedCell>);

impl EmulatedCell for Emulated {
    fn receive(&mut self, now: Nanos, bytes: &[u8]) {
        self.0.receive(now, bytes);
    }
    fn advance(&mut self, now: Nanos, felt: CellLoad) {
        self.0.advance(now, felt);
    }
    fn transmit(&mut self) -> Vec<u8> {
        self.0.transmit()
    }
    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        self.0.apply_fault(now, fault, is_on);
    }
}

fn emulated() -> CellBench<Emulated> {
    CellBench::new(Emulated(emulated_cell("plain-numbers", 1).expect("it is emulated")))
}

#[test]
fn emulated_cells_are_those_of_the_table() {
    assert_eq!(emulated_cells(), ["hx711", "mark10", "plain-numbers"]);
    assert!(emulated_cell("galil", 1).is_none());
}

#[test]
fn numbers_follow_the_signal() {
    let mut bench = emulated();
    let OpenedCell { description, mut dialogue, raw, closing_bytes } =
        opened(&bench, USUAL).expect("a cell");
    assert!((description.rate - 80.0).abs() < 1.0, "{}", description.rate);
    assert_eq!((description.adc.counts_min, description.adc.counts_max), (-8_388_607, 8_388_607));
    assert_eq!(description.newtons_per_volt, None);
    assert!(raw.iter().all(|piece| !piece.is_sent) && closing_bytes.is_empty());
    bench.feel(1.25, 0.0);
    bench.run(dialogue.as_mut(), 50);
    let samples = bench.run(dialogue.as_mut(), 1_000);
    assert!((79..=81).contains(&samples.len()), "{}", samples.len());
    for sample in samples {
        assert!((sample.volts.0 - 1.25).abs() < 1e-6, "{sample:?}");
    }
    assert_eq!(dialogue.garbled(), 0);
    // Another board in its place says other things.
    bench.apply_fault(DeviceFault::WrongDevice, true);
    assert!(bench.run(dialogue.as_mut(), 1_200).is_empty());
    assert!(dialogue.garbled() > 50);
    assert!(dialogue.is_dead(bench.clock()()).expect("it is gone").contains("no number"));
}

#[test]
fn a_drop_of_the_supply_is_silence_and_then_numbers_again() {
    let mut bench = emulated();
    let mut cell = opened(&bench, USUAL).expect("a cell").dialogue;
    bench.apply_fault(DeviceFault::Reset, true);
    bench.run(cell.as_mut(), 1_500);
    assert!(cell.is_dead(bench.clock()()).is_some());
    assert!(!bench.run(cell.as_mut(), 500).is_empty());
}

#[test]
fn words_at_the_start_and_the_rest_of_a_line_are_passed_over() {
    let mut lines = vec!["345\r\n"];
    lines.extend(["1.20\n"; 17]);
    lines.extend(["HX711 ready\r\n", "1.20\n", "1.21\n"]);
    let script = Script::new(&lines, 20);
    let cell = opened(&CellBench::new(script), "unit = \"N\"\nfull_scale = 25\n").expect("a cell");
    let found = cell.description;
    assert_eq!((found.adc.counts_max, found.newtons_per_volt), (2_500, Some(1.0)));
    assert!((found.rate - 50.0).abs() < 1.0, "{}", found.rate);
    assert!(found.identity.contains("in N, 2 digits after the point"), "{}", found.identity);
}

#[test]
fn a_start_anew_while_it_is_opened_does_not_spoil_the_rate() {
    // 80 a second, and after thirty numbers the boot loader.
    struct Booting(Nanos, u32, Vec<u8>);
    impl EmulatedCell for Booting {
        fn receive(&mut self, _now: Nanos, _bytes: &[u8]) {}
        fn advance(&mut self, now: Nanos, _felt: CellLoad) {
            if now >= self.0 {
                self.1 += 1;
                self.2.extend_from_slice(b"100\r\n");
                let pause = if self.1 == 30 { 1_600_000_000 } else { 12_500_000 };
                self.0 = now + Nanos(pause);
            }
        }
        fn transmit(&mut self) -> Vec<u8> {
            std::mem::take(&mut self.2)
        }
        fn apply_fault(&mut self, _now: Nanos, _fault: DeviceFault, _is_on: bool) {}
    }
    let bench = CellBench::new(Booting(Nanos::ZERO, 0, Vec::new()));
    let rate = opened(&bench, USUAL).expect("a cell").description.rate;
    assert!((rate - 80.0).abs() < 1.5, "{rate}");
}

#[test]
fn what_is_not_as_the_rig_file_says_is_reported() {
    let mut lines = vec!["1.5\n"; 20];
    lines.push("1.25\n");
    let mixed = refused(Script::new(&lines, 20), "unit = \"N\"\nfull_scale = 25\n");
    assert!(mixed.contains("has changed from 1 to 2"), "{mixed}");
    let timed = format!("{USUAL}time_column = \"us\"\n");
    let without = refused(Script::new(&["100\r\n"], 20), &timed);
    assert!(without.contains("a time, a comma and a number"), "{without}");
    let words = refused(Script::new(&["hello\r\n"], 20), USUAL);
    assert!(words.contains("\"hello\"") && words.contains("a number alone"), "{words}");
    let slow = refused(Script::new(&["100\r\n"], 1_500), USUAL);
    assert!(slow.contains("less than one number per second"), "{slow}");
    let fine = refused(Script::new(&["1.00000\r\n"], 20), "unit = \"gF\"\nfull_scale = 100000\n");
    assert!(fine.contains("full_scale"), "{fine}");
    let gauge = refused(Script::new(&["4.285 N\r\n"], 20), USUAL);
    assert!(gauge.contains("a Mark-10 gauge"), "{gauge}");
    let silent = opened(&CellBench::new(Stranger("", Vec::new())), USUAL).err();
    assert!(matches!(silent, Some(DeviceError::Silent { .. })));
    let gone = CellBench::new(Stranger("", Vec::new()));
    gone.unplug();
    assert!(matches!(opened(&gone, USUAL).err(), Some(DeviceError::Lost { .. })));
}
