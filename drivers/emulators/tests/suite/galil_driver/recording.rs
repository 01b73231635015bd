//! Samples that the controller records and the driver fetches.

use super::bench::{Host, Shared, thesis, to, wired};
use palpate_drivers::galil::{GalilSettings, Sampling};
use palpate_drivers::wire::Dialogue;
use palpate_emulators::EmulatedDevice;
use palpate_emulators::faults::DeviceFault;
use palpate_emulators::galil::{self, GalilEmulator, GalilModel};
use palpate_model::Nanos;
use palpate_model::random::SplitMix;
use palpate_model::rig::{AxisStatus, Fault, PathTracker, RigCommand};

fn recorded() -> GalilSettings {
    GalilSettings { sampling: Sampling::Record, ..thesis() }
}

/// Sends a command to the controller and ignores the answer.
fn unseen(emulator: &mut GalilEmulator, now: Nanos, line: &[u8]) {
    emulator.transmit(0);
    emulator.receive(now, 0, line);
    assert_eq!(emulator.transmit(0), b":");
}

fn enabled(settings: &GalilSettings) -> Host {
    let mut host = Host::new(settings);
    host.until("a sample", |host| !host.readings.is_empty());
    host.tell(RigCommand::EnableMotor);
    host
}

#[test]
fn every_second_sample_comes_and_none_is_lost() {
    for (sample_us, rate) in [(None, 512.0), (Some(500), 1024.0)] {
        let mut host = enabled(&GalilSettings { sample_us, ..recorded() });
        let identity = host.connected.description.identity.clone();
        assert!(identity.contains(&format!("{rate:.0} samples/s recorded")), "{identity}");
        assert_eq!(host.connected.description.ticks_per_sample, 2.0);
        let before = host.readings.len();
        // The ring of two thousand goes round.
        host.pass(5.0);
        let readings = &host.readings[before..];
        assert!((readings.len() as f64 / 5.0 - rate).abs() < 0.01 * rate, "{}", readings.len());
        assert!(readings.windows(2).all(|pair| pair[1].tick == pair[0].tick + 2));
        assert_eq!(host.session.stats().samples_lost, 0);
        assert_eq!(host.faults, []);
        // The signal is noise around a small positive voltage, as polls give it too.
        let mean = readings.iter().map(|one| one.volts.0).sum::<f64>() / readings.len() as f64;
        let mut polled = Host::new(&thesis());
        polled.pass(1.0);
        let count = polled.readings.len() as f64;
        let expected = polled.readings.iter().map(|one| one.volts.0).sum::<f64>() / count;
        assert!((mean - expected).abs() < 1e-3, "{mean} {expected}");
    }
}

#[test]
fn motions_are_followed_within_the_lag_and_acknowledged_in_order() {
    for speed in [0.75, 4.98, 19.98] {
        let mut host = enabled(&recorded());
        host.pass(0.05);
        let mut tracker = PathTracker::new(&host.connected.description);
        for reading in host.readings.drain(..) {
            tracker.on_reading(&reading).unwrap();
        }
        assert_eq!(
            host.tell(RigCommand::DefinePosition { pulses: 40 }),
            RigCommand::DefinePosition { pulses: 40 }
        );
        // Whatever came before the acknowledgement has the old count, what comes after it the new one.
        let at = host.acked_behind;
        assert!(host.readings[..at].iter().all(|one| one.pulses == 0));
        host.pass(0.05);
        assert!(host.readings[at..].iter().all(|one| one.pulses == 40));
        host.readings.clear();
        tracker.on_define(40);
        let command = to((speed * 100.0) as i64, speed);
        let RigCommand::MoveTo(wanted) = command else {
            panic!("no move");
        };
        tracker.on_move(wanted);
        host.tell(command);
        host.until("moving", |host| !host.is_at_rest());
        host.settle();
        host.pass(0.1);
        // There and back, stopped on the way.
        for reading in host.readings.drain(..) {
            tracker.on_reading(&reading).unwrap();
        }
        assert!(tracker.is_at_rest());
        let command = to(6000, speed);
        let RigCommand::MoveTo(wanted) = command else {
            panic!("no move");
        };
        tracker.on_move(wanted);
        host.tell(command);
        host.pass(0.7);
        host.tell(RigCommand::Stop);
        host.settle();
        host.pass(0.1);
        for reading in &host.readings {
            tracker.on_reading(reading).unwrap();
        }
        assert!(tracker.is_at_rest() && host.newest().pulses < 6000);
        let is_stopping = |status: AxisStatus| status.has(AxisStatus::STOPPING);
        assert!(host.readings.iter().any(|one| is_stopping(one.status)));
        assert!(!is_stopping(host.newest().status));
        assert_eq!(host.faults, []);
    }
}

#[test]
fn a_garbled_fetch_is_done_again() {
    for seed in 0..20 {
        let mut host = enabled(&recorded());
        host.pass(0.2);
        let mut random = SplitMix::seeded(seed);
        let mut left = 1 + random.below(6);
        let kind = random.below(3);
        host.wire.lock().spoil = Box::new(move |byte| {
            if left == 0 || random.below(60) > 0 {
                return vec![byte];
            }
            left -= 1;
            match kind {
                0 => Vec::new(),
                1 => vec![byte, byte],
                _ => vec![random.below(256) as u8],
            }
        });
        host.pass(1.9);
        let stats = host.session.stats();
        // A spoilt number that is still one goes unseen, the order of elements does not.
        let ticks: Vec<u64> = host.readings.iter().map(|one| one.tick).collect();
        let skipped = ticks.windows(2).filter(|pair| pair[1] != pair[0] + 2).count();
        assert!(
            skipped == 0 || stats.samples_lost > 0 || !host.faults.is_empty(),
            "seed {seed}: {stats:?}"
        );
        assert!(ticks.windows(2).all(|pair| pair[0] < pair[1]));
    }
}

/// Three quarters of four seconds are buffered; a later reader finds a gap, reported and counted.
#[test]
fn a_computer_that_is_late_loses_only_what_was_written_over() {
    for (late_ms, is_lost) in [(2_000, false), (5_000, true)] {
        let mut host = enabled(&recorded());
        host.pass(0.2);
        let before = host.readings.len();
        {
            let mut wire = host.wire.lock();
            wire.now = wire.now + Nanos::from_millis(late_ms);
            let now = wire.now;
            wire.emulator.advance(now);
        }
        host.pass(1.0);
        let ticks: Vec<u64> = host.readings[before - 1..].iter().map(|one| one.tick).collect();
        let missing: u64 = ticks.windows(2).map(|pair| (pair[1] - pair[0]) / 2 - 1).sum();
        assert_eq!(missing > 0, is_lost, "{late_ms}");
        assert_eq!(host.session.stats().samples_lost, missing);
        assert!(ticks.len() > 1_000, "{}", ticks.len());
    }
}

#[test]
fn a_recording_that_ends_is_reported() {
    let mut host = enabled(&recorded());
    {
        let mut wire = host.wire.lock();
        let now = wire.now;
        unseen(&mut wire.emulator, now, b"RC 0\r");
    }
    host.until("printed", |host| !host.faults.is_empty());
    assert!(host.faults[0].to_string().contains("stopped recording"));
    // Samples go on, so that the run can be ended in good order.
    let before = host.readings.len();
    host.pass(0.5);
    assert!(host.readings.len() > before + 100);
    host.tell(RigCommand::Stop);
}

#[test]
fn a_reset_ends_the_recording() {
    let mut host = enabled(&recorded());
    host.pass(0.5);
    {
        let mut wire = host.wire.lock();
        let now = wire.now;
        wire.emulator.apply_fault(now, DeviceFault::Reset, true);
    }
    host.until("noticed", |host| host.faults.contains(&Fault::ControllerReset));
    let before = host.readings.len();
    host.pass(0.5);
    assert!(host.readings.len() > before + 100);
}

fn board(model: GalilModel) -> Shared {
    wired(galil::EmulatedGalilSettings { model, ..galil::EmulatedGalilSettings::default() })
}

#[test]
fn all_models_record_and_a_full_memory_is_reported() {
    for model in
        [GalilModel::Dmc4143, GalilModel::Dmc4183, GalilModel::Dmc4040, GalilModel::Dmc2143]
    {
        let host = Host::on(board(model), &recorded());
        assert!(host.connected.plan.is_some(), "{model}");
    }
    let wire = board(GalilModel::Dmc2143);
    unseen(&mut wire.lock().emulator, Nanos::ZERO, b"DM rest[7000]\r");
    let auto = GalilSettings { sampling: Sampling::Auto, ..thesis() };
    let host = Host::on(wire.clone(), &auto);
    let link = &host.connected.link;
    assert!(link.contains("polled") && link.contains("arrays"), "{link}");
    let Err(err) = super::bench::try_connect(&wire, &recorded()) else {
        panic!("it records");
    };
    assert!(err.to_string().contains("arrays"), "{err}");
}
