//! Random bytes: no panic, bounded memory, equal events however they are cut.

use super::bench::CellBench;
use palpate_drivers::cell::{CellDevice, CellDialogue, CellSample};
use palpate_drivers::hx711::protocol::{Header, Message, line};
use palpate_drivers::hx711::{Hx711Dialogue, Hx711Settings};
use palpate_drivers::mark10::gauge::{GaugeDialogue, GaugeScale, GaugeSettings};
use palpate_drivers::mark10::protocol::ForceUnit;
use palpate_drivers::text::{DeviceError, OpenedCell};
use palpate_emulators::DeviceFault;
use palpate_emulators::cell::{CellLoad, EmulatedCell};
use palpate_emulators::hx711::{EmulatedHx711, EmulatedHx711Settings};
use palpate_emulators::mark10::{EmulatedGauge, EmulatedGaugeSettings};
use palpate_model::Nanos;
use palpate_model::units::{Newtons, Volts};
use rand_distr::{Distribution, StandardUniform};
use rand_pcg::Pcg64;

/// Pieces that reach further than bytes alone do: of gauges, boards, and what they are asked.
const PIECES: &[&str] = &[
    "4.285 N",
    "-18.78 lbF",
    "0.000 N\r\n",
    "OVER",
    "*10",
    "*22\r\n",
    "\r\n",
    "\r",
    "\n",
    "V1.00;N;CUR;FULL;AOUT00",
    ";",
    "V",
    "999999999 N",
    "-",
    ".",
    "N",
    " ",
    "AOUT",
    "AOUT250\r",
    "AOUT0\r",
    "LIST\r",
    "?\r",
    "?C\r",
    "FLTC",
    "FLTP10\r",
    "IPOL1\r",
    "OPOL1\r",
    "NUM\r",
    "LB\r",
    "PT\r",
    "Z\r",
    "RS\r",
    "?",
    "D,",
    "D,1,2*",
    "H,",
    "B,",
    "E,9,missing*6E28",
    "D,48332680,-152034*4E04\r\n",
    "E,48832680,missing*6E28\r\n",
    "*",
    ",",
    "4294967295",
    "-8388608",
    "palpate-hx711",
];

struct Dice(Pcg64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        let unit: f64 = StandardUniform.sample(&mut self.0);
        (unit * end as f64) as usize
    }

    fn stream(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for _ in 0..self.below(40) {
            match self.below(8) {
                0 | 1 => bytes.push(self.below(256) as u8),
                2 => {
                    let micros = self.below(1 << 32) as u32;
                    let count = self.below(1 << 24) as i32 - (1 << 23);
                    bytes.extend_from_slice(line(&Message::Value { micros, count }).as_bytes());
                }
                _ => bytes.extend_from_slice(PIECES[self.below(PIECES.len())].as_bytes()),
            }
        }
        bytes
    }
}

fn gauge() -> GaugeDialogue {
    let scale = GaugeScale { unit: ForceUnit::Newton, decimals: 3, counts_max: 27_500 };
    GaugeDialogue::new(scale, 250.0, Nanos::ZERO)
}

fn board() -> Hx711Dialogue {
    let header = Header { rate: 80, gain: 128, board: "a".into() };
    Hx711Dialogue::new(header, 1e-6, Nanos::ZERO)
}

type StreamOutcome = (Vec<CellSample>, Vec<String>, u64, Option<String>);

/// All that a dialogue makes of a stream in pieces of a length, all of it arriving at one time.
fn printed(mut dialogue: impl CellDialogue, bytes: &[u8], piece: usize) -> StreamOutcome {
    let at = Nanos::from_millis(20);
    for part in bytes.chunks(piece) {
        dialogue.handle_bytes(at, part);
    }
    let samples: Vec<CellSample> = std::iter::from_fn(|| dialogue.take_sample()).collect();
    let troubles = std::iter::from_fn(|| dialogue.take_trouble()).collect();
    assert!(samples.windows(2).all(|w| w[0].device_time <= w[1].device_time));
    assert!(samples.iter().all(|s| s.volts.0.is_finite()));
    (samples, troubles, dialogue.garbled(), dialogue.is_dead(at))
}

/// `PALPATE_STREAMS` asks for another number of streams than twenty thousand.
#[test]
fn streams_of_random_bytes_do_no_harm_however_they_are_cut() {
    let streams = std::env::var("PALPATE_STREAMS");
    let streams = streams.map_or(20_000, |count| count.parse().expect("a number of streams"));
    let felt = CellLoad { volts: Volts(1.0), force: Newtons(1.0) };
    let mut emulators: [Box<dyn EmulatedCell>; 2] = [
        Box::new(EmulatedHx711::new(EmulatedHx711Settings::default())),
        Box::new(EmulatedGauge::new(EmulatedGaugeSettings::default())),
    ];
    for stream in 0..streams {
        let mut dice = Dice(Pcg64::new(u128::from(stream), 11));
        let bytes = dice.stream();
        let piece = 1 + dice.below(9);
        assert_eq!(printed(gauge(), &bytes, piece), printed(gauge(), &bytes, 4096), "{stream}");
        assert_eq!(printed(board(), &bytes, piece), printed(board(), &bytes, 4096), "{stream}");
        let now = Nanos::from_millis(stream);
        for emulator in &mut emulators {
            emulator.receive(now, &bytes);
            emulator.advance(now, felt);
            // Unread bytes are dropped after 4 kB.
            if stream % 100 == 0 {
                assert!(emulator.transmit().len() <= 4096);
            }
        }
    }
    // They still answer.
    let now = Nanos::from_millis(streams + 1);
    for (emulator, ask, answer) in
        [(0, "?", "palpate-hx711"), (1, "\rAOUT0\rFULL\rN\rLIST\r", "V1.00;N;")]
    {
        emulators[emulator].transmit();
        emulators[emulator].receive(now, ask.as_bytes());
        let message = String::from_utf8_lossy(&emulators[emulator].transmit()).into_owned();
        assert!(message.contains(answer), "{message}");
    }
    println!("{streams} streams of random bytes");
}

/// Says whatever comes to its mind, at any time.
struct Babbler(Dice);

impl EmulatedCell for Babbler {
    fn receive(&mut self, _now: Nanos, _bytes: &[u8]) {}
    fn advance(&mut self, _now: Nanos, _felt: CellLoad) {}
    fn transmit(&mut self) -> Vec<u8> {
        if self.0.below(20) == 0 { self.0.stream() } else { Vec::new() }
    }
    fn apply_fault(&mut self, _now: Nanos, _fault: DeviceFault, _is_on: bool) {}
}

#[test]
fn opening_comes_to_an_end_whoever_answers() {
    for seed in 0..60 {
        let babbler = || CellBench::new(Babbler(Dice(Pcg64::new(seed, 29))));
        let name = "cell".into();
        let bench = babbler();
        let settings = Hx711Settings::default();
        let opened = settings.open(&mut bench.clone(), &bench.clock(), &name);
        check(&bench, opened, seed);
        let bench = babbler();
        let settings = GaugeSettings::default();
        let opened = settings.open(&mut bench.clone(), &bench.clock(), &name);
        check(&bench, opened, seed);
    }
}

/// Half a minute is the limit; what was opened is sensible, what was not is reported.
fn check(bench: &CellBench<Babbler>, opened: Result<OpenedCell, DeviceError>, seed: u128) {
    let passed = bench.clock()().since(Nanos::from_millis(1_000));
    assert!(passed < Nanos::from_millis(30_000), "seed {seed}: {passed:?}");
    match opened {
        Ok(cell) => {
            let found = cell.description;
            assert!(found.rate > 0.0 && found.rate.is_finite(), "seed {seed}: {found:?}");
            assert!(found.adc.volts_per_count > 0.0);
        }
        Err(err) => assert!(err.to_string().len() > 20, "seed {seed}: {err}"),
    }
}

#[test]
fn what_nobody_takes_is_bounded() {
    let mut gauge = gauge();
    for _ in 0..100_000 {
        gauge.handle_bytes(Nanos(1), b"4.285 N\r\n");
    }
    let count = std::iter::from_fn(|| gauge.take_sample()).count();
    assert_eq!(count, 4_800);
    let mut board = board();
    for micros in 1..100_000_u32 {
        board.handle_bytes(Nanos(1), line(&Message::Value { micros, count: 1 }).as_bytes());
    }
    assert_eq!(std::iter::from_fn(|| board.take_sample()).count(), 4_800);
}
