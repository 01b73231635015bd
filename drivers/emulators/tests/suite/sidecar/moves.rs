//! What a sidecar does when nothing goes wrong.

use super::bench::{Host, Shared, to, usual};
use palpate_drivers::text::DeviceError;
use palpate_emulators::EmulatedDevice;
use palpate_emulators::sidecar::EmulatedSidecarSettings as Emulated;
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Oscillation, RigCommand, SensorReading};
use palpate_model::units::{MmPerS2, Position};

/// Checksums and frames, each with and without.
fn ways() -> impl Iterator<Item = Emulated> {
    [(false, false), (true, false), (false, true), (true, true)].into_iter().map(
        |(has_checksum, has_frames)| Emulated { has_checksum, has_frames, ..Emulated::default() },
    )
}

#[test]
fn moves_follow_the_commanded_path_in_every_way_of_writing() {
    for settings in ways() {
        let mut host = Host::on(Shared::new(settings));
        host.tell(RigCommand::EnableMotor);
        host.tell(RigCommand::DefinePosition { pulses: 400 });
        host.go(2_400, 5.0);
        host.go(1_000, 0.5);
        // No way, and a way that is shorter than a sample.
        host.go(1_000, 0.5);
        host.go(1_001, 10.0);
        assert_eq!(host.newest().pulses, 1_001);
        assert!((host.position_mm() - 601.0 * 0.0025).abs() < 1e-9, "{}", host.position_mm());
        host.pass(1.0);
        host.assert_clean();
        let ticks: Vec<u64> = host.readings.iter().map(|reading| reading.tick).collect();
        assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 2_000), "500 a second, none lost");
        // Bytes take 0.7 ms; the clock is good for half of the shortest way there and back.
        let age = host.newest().age.expect("it is known");
        assert!(age.by.0.abs_diff(700_000) <= age.within.0, "{age:?}");
    }
}

#[test]
fn a_sine_is_followed_and_a_stop_ends_it() {
    let mut host = Host::new();
    host.tell(RigCommand::EnableMotor);
    let sine = |cycles| {
        RigCommand::Oscillate(Oscillation {
            amplitude_pulses: 80,
            period_ticks: 500_000,
            cycles,
            acceleration: MmPerS2(50.0),
        })
    };
    host.tell(sine(3));
    host.until("begun", Host::is_moving);
    host.until("at rest", |host| !host.is_moving());
    host.tell(sine(100));
    host.pass(0.6);
    host.tell(RigCommand::Stop);
    host.until("at rest", |host| !host.is_moving());
    host.assert_clean();
}

#[test]
fn a_stop_overtakes_what_waits_and_answers_keep_their_order() {
    let mut host = Host::new();
    host.tell(RigCommand::EnableMotor);
    host.tell(to(8_000, 5.0));
    host.pass(0.5);
    // Both wait behind no answer; the stop is written before the move.
    host.send(to(0, 5.0));
    host.send(RigCommand::Stop);
    host.until("answered", |host| host.acks.last() == Some(&RigCommand::Stop));
    assert_eq!(host.faults.len(), 1, "{:?}", host.faults);
    host.until("at rest", |host| !host.is_moving());
    assert!(!host.sent().contains(r#""to":0"#));
    let from = host.position_mm();
    host.pass(1.0);
    assert_eq!(host.position_mm(), from);
    // 2.5 mm of cruise less the ramp, 0.25 mm of braking: nowhere near the target, 20 mm.
    assert!(from < 3.0, "{from}");
    host.tell(to(8_000, 5.0));
    host.pass(0.5);
    host.tell(RigCommand::Halt);
    host.pass(0.1);
    assert!(!host.is_moving() && host.path_errors.is_empty());
}

#[test]
fn beats_keep_a_long_move_going_and_refusals_are_passed_on() {
    let mut host = Host::new();
    host.send(to(100, 5.0));
    host.until("refused", |host| !host.faults.is_empty());
    assert!(host.faults[0].to_string().contains("motor is off"), "{:?}", host.faults);
    host.faults.clear();
    host.tell(RigCommand::EnableMotor);
    for wrong in [to(100, 10.1), to(1_000_000, 5.0)] {
        host.send(wrong);
        host.until("refused", |host| !host.faults.is_empty());
        host.faults.clear();
    }
    host.go(8_000, 2.0);
    host.assert_clean();
    let beats = host.sent().matches("beat").count();
    // Ten seconds and more, a beat each 50 ms.
    assert!(beats > 200, "{beats}");
}

#[test]
fn sensors_arrive_as_channels_and_inputs() {
    let mut host = Host::new();
    assert_eq!(host.description.sensors.digital_inputs, 1);
    let channels = &host.description.sensors.channels;
    assert_eq!((channels[0].name.as_str(), channels[0].unit.as_str()), ("temperature", "°C"));
    host.pass(3.0);
    let values = host.sensors();
    let temperature = values.iter().find_map(|value| match value {
        SensorReading::Channel { number: 1, value, age } => Some((*value, *age)),
        _ => None,
    });
    let (celsius, age) = temperature.expect("a temperature");
    assert!((celsius - 21.5).abs() < 0.51, "{celsius}");
    assert!(age > Nanos::ZERO && age < Nanos::from_millis(5), "{age:?}");
    let low = SensorReading::DigitalInput { number: 1, is_high: false };
    // Each is repeated once a second while it stays as it is.
    let repeats = values.iter().filter(|value| **value == low).count();
    assert!((3..=4).contains(&repeats), "{repeats}");
}

#[test]
fn the_home_switch_and_the_far_end_are_shown() {
    let mut host = Host::new();
    host.tell(RigCommand::EnableMotor);
    host.tell(to(-8_000, 10.0));
    host.until("home", |host| host.newest().status.has(AxisStatus::HOME));
    host.tell(RigCommand::Stop);
    host.until("at rest", |host| !host.is_moving());
    // Beyond the limit switch it stops by itself.
    host.tell(to(-20_000, 2.0));
    host.until("behind home", |host| host.newest().status.has(AxisStatus::REVERSE_LIMIT));
    host.until("at rest", |host| !host.is_moving());
    assert!(host.position_mm() < -5.0 && host.position_mm() > -20.0);
}

#[test]
fn a_clock_that_drifts_is_followed_and_wraps_unseen() {
    for clock_ppm in [-3_000.0, 50.0, 3_000.0] {
        // It wraps after 4 s.
        let first_tick = u32::MAX - 4_000_000;
        let settings = Emulated { clock_ppm, first_tick, ..Emulated::default() };
        let mut host = Host::on(Shared::new(settings));
        host.pass(30.0);
        host.assert_clean();
        let age = host.newest().age.expect("it is known");
        // 30 s at 3000 ppm are 90 ms; what is left is the way of the bytes, known to a part of it.
        assert!(age.by < Nanos::from_millis(3), "{clock_ppm}: {age:?}");
    }
}

#[test]
fn what_a_sidecar_lacks_is_said_when_it_is_opened() {
    let wire = Shared::new(Emulated::default());
    let connected = wire.connect().unwrap();
    let mut settings = usual();
    settings.travel = Some(Position(1_000.0));
    let why = settings.parts(&connected.description).unwrap_err().to_string();
    assert!(why.contains("travel"), "{why}");
    let mut about = connected.description.clone();
    about.cell = None;
    let why = usual().parts(&about).unwrap_err().to_string();
    assert!(why.contains("no load cell"), "{why}");
    let wire = Shared::new(Emulated::default());
    wire.lock().is_deaf = true;
    // It has said that it started, and then nothing.
    assert!(matches!(wire.connect(), Err(DeviceError::Other { .. })));
    wire.lock().emulator.transmit(0);
    assert!(matches!(wire.connect(), Err(DeviceError::Silent { .. })));
}
