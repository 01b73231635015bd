//! Wires and controllers that fail.

use super::bench::{Host, thesis, to};
use palpate_drivers::galil::{GalilSettings, Sampling};
use palpate_drivers::wire::Dialogue;
use palpate_emulators::EmulatedDevice;
use palpate_emulators::faults::DeviceFault;
use palpate_model::Nanos;
use palpate_model::random::SplitMix;
use palpate_model::rig::{AxisStatus, Fault, RigCommand};

fn moving() -> Host {
    let mut host = Host::new(&thesis());
    host.tell(RigCommand::EnableMotor);
    host.tell(to(6000, 20.0));
    host.pass(0.6);
    assert!(!host.is_at_rest());
    host
}

#[test]
fn silence_of_the_host_stops_the_axis_within_the_worst_case() {
    let host = moving();
    let worst = host.connected.worst_case_mm;
    let from = host.newest().pulses;
    let mut wire = host.wire.lock();
    let mut now = wire.now;
    for _ in 0..3_000 {
        now = now + Nanos::from_millis(1);
        wire.emulator.advance(now);
    }
    assert!(!wire.emulator.is_running(0));
    wire.emulator.transmit(0);
    wire.emulator.receive(now, 0, b"MG _TDA\r");
    let printed = String::from_utf8(wire.emulator.transmit(0)).unwrap();
    let rest: f64 = printed.split("\r\n").next().unwrap().trim().parse().unwrap();
    let way = (rest - from as f64) * 0.015;
    assert!(way > 5.0 && way < worst, "{way} mm of {worst} mm");
}

#[test]
fn who_does_not_look_at_samples_is_silent_too() {
    let mut host = moving();
    host.is_attended = false;
    host.pass(2.0);
    assert!(host.is_at_rest());
    assert!(host.newest().pulses < 6000 - 1000);
}

#[test]
fn a_reset_is_noticed_and_nothing_moves_after_it() {
    let mut host = moving();
    {
        let mut wire = host.wire.lock();
        let now = wire.now;
        wire.emulator.apply_fault(now, DeviceFault::Reset, true);
    }
    host.until("noticed", |host| host.faults.contains(&Fault::ControllerReset));
    let before = host.faults.len();
    let now = host.now();
    host.session.command(now, RigCommand::EnableMotor);
    host.until("refused", |host| host.faults.len() > before);
    assert!(matches!(host.faults[before], Fault::CommandRefused { .. }));
    let ticks: Vec<u64> = host.readings.iter().map(|reading| reading.tick).collect();
    assert!(ticks.windows(2).all(|pair| pair[0] < pair[1]));
    // A stop is always passed on.
    host.tell(RigCommand::Stop);
}

#[test]
fn a_cut_wire_is_an_error_of_the_link() {
    let mut host = moving();
    host.wire.lock().is_cut = true;
    assert!(host.turn().is_err());
}

#[test]
fn a_controller_that_falls_silent_is_dead_after_some_questions() {
    let mut host = moving();
    host.wire.lock().spoil = Box::new(|_| Vec::new());
    let start = host.now();
    loop {
        host.turn().unwrap();
        let now = host.now();
        if let Some(why) = host.session.is_dead(now) {
            assert!(why.contains("no valid answer"), "{why}");
            break;
        }
        assert!(now.since(start).seconds().0 < 10.0);
    }
}

/// Bytes lost, doubled or changed on the way here: in the end samples come again, at the right places, and the axis can be
/// stopped.
#[test]
fn spoilt_bytes_are_got_over() {
    for seed in 0..40 {
        let mut host = moving();
        let mut random = SplitMix::seeded(seed);
        let mut left = 5 + random.below(40);
        let kind = random.below(3);
        host.wire.lock().spoil = Box::new(move |byte| {
            if left == 0 || random.below(50) > 0 {
                return vec![byte];
            }
            left -= 1;
            match kind {
                0 => Vec::new(),
                1 => vec![byte, byte],
                _ => vec![random.below(256) as u8],
            }
        });
        let now = host.now();
        host.session.command(now, RigCommand::Stop);
        host.pass(3.0);
        let before = host.readings.len();
        host.pass(0.5);
        assert!(host.readings.len() > before + 100, "seed {seed}: {:?}", host.faults);
        assert!(host.is_at_rest(), "seed {seed}");
        assert!(host.acks.contains(&RigCommand::Stop), "seed {seed}");
        assert!(host.newest().status.has(AxisStatus::MOTOR_ON));
        let now = host.now();
        assert_eq!(host.session.is_dead(now), None);
    }
}

/// Whatever comes, in any form of answers: no panic, and nothing piles up.
#[test]
fn random_bytes_never_break_the_dialogue() {
    const PIECES: [&[u8]; 14] = [
        b":",
        b"?",
        b"::",
        b" 0.3050 120 120 15 1 9000\r\n:",
        b" 0.3050 120 120 15 1 17 9000\r\n:",
        b" 9.9999 120 -120 143 0 999999999 4294967295\r\n:",
        b" 1, 2, 3\r\n\x1a:",
        b" 1\r\n\x1a:",
        b"22 Begin not possible due to Limit Switch\r\n:",
        b" 27181\r\n:",
        b"\xbf\xb5\xb5\x8d\x8a",
        b"nan 1e999 - 5\r\n:",
        b"\x00\xff\r\n",
        b" 666 4096 4096 6000\r\n: 6000\r\n:",
    ];
    let streams = std::env::var("PALPATE_STREAMS").ok();
    let streams = streams.and_then(|text| text.parse().ok());
    let streams: usize = streams.unwrap_or(2_000);
    for sampling in [Sampling::Poll, Sampling::Record] {
        let mut host = Host::new(&GalilSettings { sampling, ..thesis() });
        host.pass(0.1);
        let start = host.now();
        let mut random = SplitMix::seeded(11);
        for _ in 0..streams / 2 {
            let mut session = host.session.clone();
            let mut now = start;
            for _ in 0..1 + random.below(30) {
                now = now + Nanos::from_millis(random.below(40) as u64);
                session.note_attendance(now);
                if random.below(4) == 0 {
                    let command = match random.below(4) {
                        0 => RigCommand::Stop,
                        1 => RigCommand::EnableMotor,
                        2 => RigCommand::DefinePosition { pulses: 5 },
                        _ => to(random.below(5000) as i64, 4.98),
                    };
                    session.command(now, command);
                }
                let mut lines = 0;
                while let Some(line) = session.take_line(now) {
                    assert!(line.len() <= 80);
                    lines += 1;
                    assert!(lines < 200, "it never has enough");
                }
                let mut bytes = PIECES[random.below(PIECES.len())].to_vec();
                if random.below(3) == 0 {
                    let at = random.below(bytes.len());
                    bytes[at] = random.below(256) as u8;
                }
                session.handle_bytes(now, &bytes);
                let mut events = 0;
                while session.take_event().is_some() {
                    events += 1;
                    assert!(events < 2_000);
                }
                assert!(session.next_at(now) >= now);
                let _ = (session.is_dead(now), session.stats());
            }
        }
    }
}

/// On the way to a place, on a controller that has no watchdog.
fn unwatched() -> Host {
    let mut host = Host::new(&GalilSettings { has_watchdog: false, ..thesis() });
    host.tell(RigCommand::EnableMotor);
    host.tell(to(6000, 20.0));
    host.pass(0.6);
    assert!(!host.is_at_rest());
    host
}

/// Lines from now on that begin with a stop.
fn stops_after(host: &Host, from: usize) -> Vec<String> {
    let lines = host.wire.lock().lines[from..].to_vec();
    let lines = String::from_utf8(lines).expect("lines are text");
    let lines = lines.split('\r');
    let stops = lines.filter(|line| line.starts_with("STA") || line.starts_with("AB"));
    stops.map(|line| line[..3].to_owned()).collect()
}

#[test]
fn a_stop_that_seems_refused_is_sent_again() {
    for (spoilt, lines) in [
        (1, &["STA", "STA"][..]),
        (3, &["STA", "STA", "STA", "AB "]),
        (9, &["STA", "STA", "STA", "AB "]),
    ] {
        let mut host = unwatched();
        let (mut last, mut left) = (b':', spoilt);
        // Without a watchdog only the prompt of a stop follows another prompt.
        host.wire.lock().spoil = Box::new(move |byte| {
            let is_stop = byte == b':' && matches!(last, b':' | b'?') && left > 0;
            last = byte;
            left -= usize::from(is_stop);
            vec![if is_stop { b'?' } else { byte }]
        });
        let start = host.now();
        let from = host.wire.lock().lines.len();
        host.session.command(start, RigCommand::Stop);
        host.until("answered", |host| {
            host.acks.contains(&RigCommand::Stop) || !host.faults.is_empty()
        });
        assert!(host.now().since(start).seconds().0 < 0.1);
        assert_eq!(host.faults.is_empty(), spoilt < 4, "{:?}", host.faults);
        assert_eq!(stops_after(&host, from), lines);
    }
}

#[test]
fn a_stop_of_its_own_is_confirmed_when_answers_fit_again() {
    let mut host = unwatched();
    host.tell(RigCommand::Stop);
    host.settle();
    let from = host.wire.lock().lines.len();
    let now = host.now();
    host.session.command(now, to(0, 20.0));
    // The answers to what a move sets are lost for a while.
    let mut left = 40;
    host.wire.lock().spoil = Box::new(move |byte| {
        left = i32::max(left - 1, 0);
        if left > 0 { Vec::new() } else { vec![byte] }
    });
    host.until("refused", |host| !host.faults.is_empty());
    host.pass(1.5);
    assert!(host.faults[0].to_string().contains("garbled"));
    assert_eq!(stops_after(&host, from), ["STA", "STA"]);
}

#[test]
fn an_axis_that_nobody_looks_after_is_stopped_without_a_watchdog_too() {
    let mut host = unwatched();
    host.is_attended = false;
    host.pass(2.0);
    assert!(host.is_at_rest());
    let rest = host.newest().pulses;
    assert!(rest > 0 && rest < 6000 - 1000, "{rest}");
    let from = host.wire.lock().lines.len();
    host.pass(2.0);
    assert_eq!(stops_after(&host, from), [""; 0]);
    host.is_attended = true;
    host.pass(0.1);
    host.tell(to(0, 20.0));
    host.until("moving", |host| !host.is_at_rest());
    host.settle();
    assert_eq!(host.newest().pulses, 0);
}

#[test]
fn a_reset_while_recording_is_reported_as_one() {
    let mut host = Host::new(&GalilSettings { sampling: Sampling::Record, ..thesis() });
    host.pass(0.5);
    {
        let mut wire = host.wire.lock();
        let now = wire.now;
        wire.emulator.apply_fault(now, DeviceFault::Reset, true);
    }
    host.until("noticed", |host| !host.faults.is_empty());
    host.pass(1.0);
    assert_eq!(host.faults, [Fault::ControllerReset]);
}
