//! Random bytes: no panic, an end to every answer, bounded memory.

use super::bench::Bench;
use palpate_emulators::EmulatedDevice;
use palpate_emulators::galil::GalilModel;
use rand_distr::{Distribution, StandardUniform};
use rand_pcg::Pcg64;

/// Pieces that reach further into the language than bytes alone do.
const PIECES: &[&str] = &[
    "MG ",
    "_TPA",
    "@AN[",
    "1",
    "]",
    "(",
    ")",
    "=",
    "SPA=",
    "PR ",
    ",",
    "-",
    "99999999999",
    "0.5",
    "BGA",
    "ST",
    "AB",
    "SH",
    "MO",
    "JG ",
    "CM",
    "DT 1",
    "CD 9=2",
    "DM a[",
    "a[",
    "RA a[]",
    "RD _AFX",
    "RD TIME",
    "RC 1",
    "RC 1,-3",
    "QU a[]",
    "QD a[]",
    "DL\r",
    "\\",
    "UL",
    "XQ",
    "XQ #A,3",
    "#A",
    "JP #A",
    "JS #A",
    "IF 1",
    "ENDIF",
    "ELSE",
    "EN",
    "WT 1",
    "HX",
    "RS",
    "BN",
    "TM 250",
    "TM 0",
    "TM 1000",
    "{F3.",
    "{",
    "}",
    "\"",
    "#LIMSWI",
    "#CMDERR",
    "#AUTO",
    "BP",
    "QR",
    "DR 2",
    "IHT=>-3",
    "EO 1",
    "EO 0",
    "HM",
    "FE",
    "CN 1",
    "LZ 0",
    "PF 99",
    "VF -4.4",
    "\r",
    "\r",
    "\r",
    "\r",
    ";",
    ";",
    "\n",
    "?",
    "*",
    "$FFFF",
    "\x1a",
    "\x12\x16",
    "v",
    "v=",
    "~",
    "TIME",
    "<>",
    "&",
    "|",
    "%",
];

struct Dice(Pcg64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        let unit: f64 = StandardUniform.sample(&mut self.0);
        (unit * end as f64) as usize
    }
}

/// Runs streams of bytes and pieces through one controller each.
fn run(streams: u64, seed: u64) {
    let mut bench = Bench::serial(GalilModel::Dmc4143);
    for stream in 0..streams {
        let mut dice = Dice(Pcg64::new(u128::from(seed + stream), 7));
        // A fresh controller now and then; what earlier streams left makes the others worse.
        if stream % 64 == 0 {
            let model = [GalilModel::Dmc4143, GalilModel::Dmc2143][dice.below(2)];
            bench = Bench::serial(model);
        }
        let mut bytes = Vec::new();
        for _ in 0..dice.below(40) {
            if dice.below(4) == 0 {
                bytes.push(dice.below(256) as u8);
            } else {
                bytes.extend_from_slice(PIECES[dice.below(PIECES.len())].as_bytes());
            }
        }
        let mut answered = 0;
        for part in bytes.chunks(1 + dice.below(9)) {
            answered += bench.raw(0, part).len();
            bench.wait(dice.below(4) as f64 / 1024.0);
        }
        // An answer is at most a whole array of values or a program: 16000 numbers of 17 bytes.
        assert!(answered < 40 * 16_000 * 17, "{answered} bytes");
        bench.emulator.transmit(0);
    }
    // It still answers, after whatever was open is closed and a burn is over.
    bench.raw(0, b"\"\r\\");
    bench.wait(5.0);
    bench.raw(0, b"\r\rHX\rEO 0\rCW 2\rVF 10.4\rLZ 1\r");
    bench.wait(5.0);
    bench.emulator.transmit(0);
    assert_eq!(bench.ask("MG 1"), " 1.0000\r\n:");
}

/// `PALPATE_STREAMS` asks for another number of streams than a hundred thousand.
#[test]
fn streams_of_random_bytes_do_no_harm() {
    let streams = std::env::var("PALPATE_STREAMS");
    let streams = streams.map_or(100_000, |count| count.parse().expect("a number of streams"));
    run(streams, 1);
    println!("{streams} streams of random bytes");
}
