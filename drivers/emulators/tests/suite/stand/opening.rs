//! Opening a stand, and one whole rig on a thread, in real time. Waits are generous: nothing here is about speed.
#![expect(clippy::disallowed_methods, reason = "the clock of a test stands for the runner's")]

use super::bench::{Shared, to, usual};
use palpate_drivers::device::{DeviceRig, OpenError, OpenedDevices, RigDevice};
use palpate_drivers::mark10::stand;
use palpate_drivers::wire::{HostClock, Link, memory_link_pair};
use palpate_drivers::{Rig, RigEventBody};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::mark10::{EmulatedStand, EmulatedStandSettings};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, RigCommand};
use palpate_test_support::wait::PATIENCE;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

fn stand() -> Shared {
    Shared::new(EmulatedStandSettings::default())
}

#[test]
fn the_emulator_answers_as_the_guides_say() {
    let mut emulator = EmulatedStand::new(EmulatedStandSettings::default());
    let mut ask = |text: &str| {
        emulator.receive(Nanos::ZERO, 0, text.as_bytes());
        String::from_utf8(emulator.transmit(0)).expect("text")
    };
    // ESM301 user's guide, page 24, the examples of its table.
    assert_eq!(ask("e0200.3a"), "200.3 mm/min\r\n");
    assert_eq!(ask("g-007.52w"), "-7.52 mm\r\n");
    assert_eq!(ask("h010.70v"), "10.70 mm\r\n");
    assert_eq!(ask("f0500r"), "500\r\n");
    assert_eq!(ask("be02.85a"), "2.85 in/min\r\n");
    assert_eq!(ask("h01.258v"), "1.258 in\r\n");
    assert_eq!(ask("ix"), "0.00 mm\r\n");
    assert_eq!(ask("lp"), "S L\r\n");
    assert_eq!(ask("mp"), "S M\r\n");
    // The gauge behind the slashes (ESM303 user's guide, page 32).
    assert_eq!(
        ask("/N\rLIST\r\\"),
        "V1.00;N;CUR;FLTC8;FLTP1;AOUT00;AOFF5;FULL;MIT;POL;IPOL0;OPOL0;B0\r\n"
    );
    assert_eq!(ask("n"), "0.000 N\r\n0.00 mm\r\n");
    assert_eq!(ask("Xyq"), "0.000 N\r\n0\r\n");
}

#[test]
fn opening_stops_sets_and_reads_back() {
    let wire = stand();
    let connected = wire.connect(&usual()).expect("a stand");
    let sent = String::from_utf8(wire.lock().sent.clone()).expect("text");
    let expected = concat!(
        "\\s/AOUT0\r\\iln/N\r\\/CUR\r\\/FULL\r\\/IPOL0\r\\/OPOL0\r\\/AOFF0\r\\/LIST\r\\/RS\r\\",
        "png-110.00wh010.00v"
    );
    assert!(sent.starts_with(expected), "{sent}");
    let found = &connected.description;
    for part in ["3519042", "target of its move", "100 mm", "0.05 mm"] {
        assert!(found.identity.contains(part), "{part} in {}", found.identity);
    }
    assert_eq!((found.mm_per_pulse, found.tick_nanos), (0.01, 1_000_000));
    assert!((found.speed_quantum.0 * 600.0 - 1.0).abs() < 1e-12);
    assert!(found.check_speed(palpate_model::units::MmPerS(0.75)).is_ok());
    assert_eq!(found.adc.expect("a gauge").volts_per_count, 1e-3);
    assert!(connected.pace.has_status);
}

#[test]
fn who_does_not_fit_is_reported_in_words() {
    let refused = |wire: &Shared, settings: &palpate_drivers::mark10::StandSettings| {
        wire.connect(settings).expect_err("a refusal").to_string()
    };
    let mut other = usual();
    other.gauge.serial_number = Some("7".into());
    let err = refused(&stand(), &other);
    assert!(err.contains("3519042") && err.contains("expects 7"), "{err}");

    let without = Shared::new(EmulatedStandSettings {
        is_without_control: true,
        ..EmulatedStandSettings::default()
    });
    let err = refused(&without, &usual());
    assert!(err.contains("PC control"), "{err}");

    let mut far = usual();
    far.travel = palpate_model::units::Position(995.0);
    let err = refused(&stand(), &far);
    assert!(err.contains("999.99"), "{err}");

    // One that sets another limit than the -110.00 commanded.
    let clipped = stand();
    let mut before = 0;
    clipped.lock().spoil = Box::new(move |byte| {
        let is_changed = before == b'-' && byte == b'1';
        before = byte;
        vec![if is_changed { b'0' } else { byte }]
    });
    let err = refused(&clipped, &usual());
    assert!(err.contains("reports -10"), "{err}");

    let silent = stand();
    silent.lock().is_deaf = true;
    let err = refused(&silent, &usual());
    assert!(err.contains("does not answer"), "{err}");

    for (says, name) in [("error:1\r\n", "Grbl"), ("?", "Galil"), ("4.285 N\r\n", "together")] {
        let wire = stand();
        wire.lock().spoil = Box::new(move |_| says.into());
        let err = refused(&wire, &usual());
        assert!(err.contains(name), "{says}: {err}");
    }
}

/// A stand on a link that is there once.
struct OnLink(Option<Box<dyn Link>>);

impl RigDevice for OnLink {
    fn open(&mut self, clock: &HostClock) -> Result<OpenedDevices, OpenError> {
        let gone = || OpenError::Thread("the link was used".into());
        stand::open(self.0.take().ok_or_else(gone)?, &usual(), clock)
    }
}

/// The whole of it: a thread, a wire, the host's clock.
#[test]
fn a_rig_moves_stops_and_says_farewell() {
    let (ours, mut theirs) = memory_link_pair();
    let start = Instant::now();
    let clock: HostClock = Arc::new(move || Nanos(start.elapsed().as_nanos() as u64));
    let is_over = Arc::new(AtomicBool::new(false));
    let stopping = Arc::clone(&is_over);
    let device_clock = Arc::clone(&clock);
    let work = move || {
        let mut stand = EmulatedStand::new(EmulatedStandSettings::default());
        let mut last = Vec::new();
        let mut buffer = [0_u8; 256];
        while !stopping.load(Ordering::SeqCst) {
            let Ok(count) = theirs.read(&mut buffer, Duration::from_millis(1)) else {
                break;
            };
            last.extend_from_slice(&buffer[..count]);
            stand.receive(device_clock(), 0, &buffer[..count]);
            stand.advance(device_clock());
            let bytes = stand.transmit(0);
            if !bytes.is_empty() && theirs.write(&bytes).is_err() {
                break;
            }
        }
        last
    };
    let device = std::thread::Builder::new().name("stand".into()).spawn(work).expect("a thread");
    let mut rig =
        DeviceRig::open(OnLink(Some(Box::new(ours))), Arc::clone(&clock)).expect("a stand");
    let begin = Instant::now();
    rig.send(to(50, 1.0));
    let (mut readings, mut is_acknowledged) = (0, false);
    loop {
        let until = Nanos(begin.elapsed().as_nanos() as u64) + Nanos::from_millis(20);
        match rig.next_event(until).map(|event| event.body) {
            Some(RigEventBody::Reading(reading)) => {
                readings += 1;
                if reading.pulses == 50 && !reading.status.has(AxisStatus::MOVING) {
                    break;
                }
            }
            Some(RigEventBody::Ack(ack)) => is_acknowledged = ack.command == to(50, 1.0),
            Some(RigEventBody::Fault(fault)) => panic!("{fault}"),
            None => {}
        }
        assert!(begin.elapsed() < PATIENCE, "it never came to rest after {readings} samples");
    }
    assert!(is_acknowledged, "{readings}");
    assert!(rig.links()[0].1.answers > 0);
    let raw = rig.take_raw();
    assert!(raw.iter().any(|piece| piece.is_sent && piece.bytes == b"d"));
    rig.send(RigCommand::Stop);
    // A reconnect sends closing bytes first; its error names a device that no longer answers.
    let Err(err) = rig.reconnect() else {
        panic!("there is no second link");
    };
    assert!(err.to_string().contains("the link was used"), "{err}");
    let raw = rig.take_raw();
    assert!(raw.iter().any(|piece| piece.is_sent && piece.bytes == b"s"), "{raw:?}");
    assert!(rig.links().is_empty());
    rig.send(to(50, 1.0));
    let until = Nanos(begin.elapsed().as_nanos() as u64);
    let event = rig.next_event(until).map(|event| event.body);
    let Some(RigEventBody::Fault(Fault::CommandRefused { detail })) = event else {
        panic!("{event:?}");
    };
    assert!(detail.contains("not connected"), "{detail}");
    assert_eq!(rig.next_event(until), None);
    is_over.store(true, Ordering::SeqCst);
    let heard = device.join().expect("the stand");
    assert_eq!(heard.last(), Some(&b's'));
}
