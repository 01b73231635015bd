//! Random bytes to both sides: no panic, bounded memory, equal events however they are cut.

use super::bench::{Host, Shared, to, usual};
use palpate_drivers::mark10::stand::protocol::{ForceTravelPair, StandStatus, number, travel};
use palpate_drivers::text::{Lines, ReceivedLine};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::mark10::{EmulatedStand, EmulatedStandSettings};
use palpate_model::Nanos;
use rand_distr::{Distribution, StandardUniform};
use rand_pcg::Pcg64;

const PIECES: &[&str] = &[
    "n",
    "p",
    "x",
    "u",
    "d",
    "s",
    "l",
    "m",
    "c",
    "i",
    "b",
    "z",
    "e0045.0",
    "e02.85",
    "g-007.52",
    "h010.70",
    "h-",
    "f0500",
    "/",
    "\\",
    "/AOUT250\r\\",
    "/LIST\r\\",
    "/N\r",
    "v",
    "w",
    "a",
    "j",
    "k",
    "o",
    "q",
    "r",
    "X",
    "?",
    "\r\n",
    "4.285 N\r\n",
    "-7.52 mm\r\n",
    "S L\r\n",
    "D L DL\r\n",
    "45.0 mm/min\r\n",
    "OVER\r\n",
    "0.125 in",
    "99999999 mm\r\n",
    "-",
    ".",
    " ",
];

struct Dice(Pcg64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        let unit: f64 = StandardUniform.sample(&mut self.0);
        (unit * end as f64) as usize
    }

    fn stream(&mut self) -> Vec<u8> {
        let mut bytes = Vec::new();
        for _ in 0..self.below(30) {
            if self.below(4) == 0 {
                bytes.push(self.below(256) as u8);
            } else {
                bytes.extend_from_slice(PIECES[self.below(PIECES.len())].as_bytes());
            }
        }
        bytes
    }
}

fn streams(usual: u64) -> u64 {
    let streams = std::env::var("PALPATE_STREAMS");
    streams.map_or(usual, |count| count.parse().expect("a number of streams"))
}

#[test]
fn the_emulated_stand_takes_anything() {
    let count = streams(20_000);
    let mut stand = EmulatedStand::new(EmulatedStandSettings::default());
    let mut now = Nanos::ZERO;
    for stream in 0..count {
        let mut dice = Dice(Pcg64::new(u128::from(stream), 13));
        for part in dice.stream().chunks(7) {
            stand.receive(now, 0, part);
        }
        now = now + Nanos::from_millis(3);
        stand.advance(now);
        assert!(stand.travel().is_finite());
        if stream % 64 == 0 {
            assert!(stand.transmit(0).len() <= 4096);
        }
    }
    stand.receive(now, 0, b"\\999999\\si/AOUT0\rFULL\rN\r\\");
    stand.transmit(0);
    stand.receive(now, 0, b"x");
    let message = String::from_utf8(stand.transmit(0)).expect("text");
    assert!(travel(message.trim()).is_some(), "{message}");
    println!("{count} streams of random bytes");
}

/// Everything that a stream could mean, line by line.
fn meant(bytes: &[u8], piece: usize) -> Vec<String> {
    let (mut lines, mut pair) = (Lines::default(), ForceTravelPair::default());
    let mut all = Vec::new();
    for part in bytes.chunks(piece) {
        for byte in part {
            if let Some(ReceivedLine::Line(line)) = lines.take(*byte) {
                let read =
                    (StandStatus::parse(&line), travel(&line), number(&line).map(f64::to_bits));
                all.push(format!("{read:?} {:?}", pair.take(&line)));
            }
        }
        assert!(lines.pending() <= 160);
    }
    all
}

#[test]
fn lines_mean_the_same_however_they_are_cut() {
    for stream in 0..streams(20_000) {
        let mut dice = Dice(Pcg64::new(u128::from(stream), 17));
        let bytes = dice.stream();
        let piece = 1 + dice.below(9);
        assert_eq!(meant(&bytes, piece), meant(&bytes, 4096), "{stream}");
    }
}

#[test]
fn a_session_takes_anything_and_the_stand_stays_in_its_travel() {
    // As many as take a second; the soak script draws more.
    for seed in 0..streams(2_000) / 200 {
        let mut host = Host::new();
        let mut dice = Dice(Pcg64::new(u128::from(seed), 19));
        let rate = 20 + dice.below(400);
        let mut spoiler = Dice(Pcg64::new(u128::from(seed), 23));
        host.wire.lock().spoil = Box::new(move |byte| match spoiler.below(rate) {
            0 => vec![spoiler.below(256) as u8],
            1 => Vec::new(),
            2 => vec![byte, byte],
            _ => vec![byte],
        });
        host.send(to(1_500, 5.0));
        for _ in 0..2_000 {
            host.turn().expect("the wire is whole");
            assert!(host.readings.len() < 100_000);
        }
        host.wire.lock().is_deaf = true;
        host.pass(8.0);
        assert!(!host.wire.lock().emulator.is_moving());
        let travel = host.travel();
        assert!(travel > -15.01 && travel < 0.01, "seed {seed}: {travel}");
    }
}

#[test]
fn opening_comes_to_an_end_whoever_answers() {
    for seed in 0..60 {
        let wire = Shared::new(EmulatedStandSettings::default());
        let mut babbler = Dice(Pcg64::new(seed, 31));
        wire.lock().spoil = Box::new(move |byte| match babbler.below(12) {
            0 => babbler.stream(),
            _ => vec![byte],
        });
        let opened = wire.connect(&usual());
        let passed = wire.lock().now;
        assert!(passed < Nanos::from_millis(30_000), "seed {seed}: {passed:?}");
        match opened {
            Ok(connected) => {
                let found = connected.description;
                assert!(found.ticks_per_sample.is_finite() && found.ticks_per_sample >= 1.0);
            }
            Err(err) => assert!(err.to_string().len() > 20, "seed {seed}: {err}"),
        }
        assert!(!wire.lock().emulator.is_moving());
    }
}
