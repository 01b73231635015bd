//! Random bytes, to the driver and to the emulated board: no panic, equal answers however they are cut, and both still
//! work afterwards.

use super::bench::{Host, slide, wired};
use palpate_drivers::grbl::protocol::{GrblLine, GrblParser};
use palpate_drivers::wire::Dialogue;
use palpate_emulators::DeviceFault;
use palpate_emulators::bench::{EmulatedAxis, SlideSwitches};
use palpate_emulators::grbl::{EmulatedGrblSettings, Grbl};
use palpate_model::Nanos;
use palpate_model::random::SplitMix;
use palpate_model::rig::RigCommand;

/// Pieces that reach further than bytes alone do: of the board, and of whoever talks to it.
const PIECES: &[&[u8]] = &[
    b"ok\r\n",
    b"error:",
    b"error:9\r\n",
    b"ALARM:1\r\n",
    b"<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\n",
    b"<Jog|MPos:1.5,0,0>\r\n",
    b"<Run|MPos:",
    b"|WCO:",
    b"|Pn:XP",
    b">\r\n",
    b"Grbl 1.1h [",
    b"GrblHAL 1.1f [",
    b"$100=400.000\r\n",
    b"[VER:1.1h:]\r\n",
    b"999999999999",
    b"-",
    b".",
    b"\r\n",
    b"\n",
    b"$",
    b"$$\n",
    b"$I\n",
    b"$X\n",
    b"$H\n",
    b"$J=G91X0.5F600\n",
    b"$J=G21G90G53X",
    b"F1.5\n",
    b"G1X1F100\n",
    b"G2X1Y1I1\n",
    b"G54G20",
    b"$100=0\n",
    b"$1=\n",
    b"$RST=*\n",
    b"$I=NAME\n",
    b"$SLP\n",
    b"$C\n",
    b"?",
    b"!",
    b"~",
    b"\x18",
    b"\x84",
    b"\x85",
    b"(",
    b")",
    b";",
    b"M30\n",
    b"T1",
    b"N999999999\n",
];

fn stream(random: &mut SplitMix) -> Vec<u8> {
    let mut bytes = Vec::new();
    for _ in 0..random.below(40) {
        if random.below(3) == 0 {
            bytes.push(random.below(256) as u8);
        } else {
            bytes.extend_from_slice(PIECES[random.below(PIECES.len())]);
        }
    }
    bytes
}

fn parsed(bytes: &[u8], piece: usize) -> Vec<GrblLine> {
    let mut parser = GrblParser::default();
    let mut all = Vec::new();
    for part in bytes.chunks(piece) {
        all.extend(part.iter().filter_map(|byte| parser.take(*byte)));
    }
    all
}

fn streams() -> u64 {
    std::env::var("PALPATE_STREAMS")
        .map_or(4_000, |count| count.parse().expect("a number of streams"))
}

fn switches() -> SlideSwitches {
    SlideSwitches { is_home: false, is_forward: false, is_reverse: false }
}

/// `PALPATE_STREAMS` asks for another number of streams than four thousand.
#[test]
fn streams_to_parser_and_emulator_do_no_harm_however_they_are_cut() {
    let mut board = Grbl::new(EmulatedGrblSettings::default());
    for seed in 0..streams() {
        let mut random = SplitMix::seeded(seed);
        let bytes = stream(&mut random);
        let piece = 1 + random.below(9);
        for incoming in parsed(&bytes, 4_096) {
            if let GrblLine::Status(status) = incoming {
                let places = status.machine.iter().chain(&status.work).flatten();
                assert!(places.into_iter().all(|place| place.is_finite()), "{seed}");
            }
        }
        assert_eq!(parsed(&bytes, piece), parsed(&bytes, 4_096), "{seed}");
        let now = Nanos::from_millis(10 * seed);
        for part in bytes.chunks(piece) {
            board.receive(now, part);
        }
        board.advance(now, switches());
        assert!(board.counter_mm().is_finite(), "{seed}");
        // Unread output is bounded too.
        if seed % 50 == 0 {
            assert!(board.transmit().len() < 1 << 16, "{seed}");
        }
    }
    board.apply_fault(Nanos::from_millis(10 * streams()), DeviceFault::Reset, true);
    let now = Nanos::from_millis(10 * streams() + 10_000);
    board.advance(now, switches());
    board.transmit();
    board.receive(now, b"\x18\n?");
    board.advance(now + Nanos::from_millis(500), switches());
    board.receive(now + Nanos::from_millis(500), b"?");
    board.advance(now + Nanos::from_millis(600), switches());
    let message = String::from_utf8_lossy(&board.transmit()).into_owned();
    assert!(message.contains("MPos:"), "{message}");
}

/// A session in the middle of a motion hears nonsense. Whatever it makes of it, it gives no more way than it states.
#[test]
fn streams_to_the_session_end_at_rest() {
    for seed in 0..streams().div_ceil(40) {
        let mut random = SplitMix::seeded(seed);
        let mut host = Host::on(wired(EmulatedGrblSettings::default()), &slide());
        host.ask(super::bench::to(40_000, 9.0));
        host.pass(0.2);
        for _ in 0..20 {
            let now = host.now();
            host.session.handle_bytes(now, &stream(&mut random));
            if host.session.is_dead(now).is_some() {
                break;
            }
            host.turn().expect("the wire is whole");
        }
        host.ask(RigCommand::Halt);
        host.until("stopped", |host| {
            host.acks.contains(&RigCommand::Halt) || host.session.is_dead(host.now()).is_some()
        });
        host.pass(3.0);
        let there = host.truth();
        host.pass(0.5);
        assert_eq!(host.truth(), there, "seed {seed}: it still moves");
    }
}
