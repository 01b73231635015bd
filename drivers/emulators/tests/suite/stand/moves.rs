//! Moves, stops, limits.

use super::bench::{Host, Shared, to};
use palpate_emulators::EmulatedDevice;
use palpate_emulators::mark10::EmulatedStandSettings;
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, Fault, HandAction, Oscillation, RigCommand};
use palpate_model::units::MmPerS2;

#[test]
fn a_move_down_is_a_limit_and_a_letter() {
    let mut host = Host::new();
    host.pass(0.2);
    host.wire.lock().sent.clear();
    host.go(500, 0.75);
    let sent = host.sent();
    let begun = sent.replace(['n', 'p'], "");
    assert_eq!(begun, "e0045.0ag-005.00wd", "{sent}");
    assert!((host.travel() + 5.0).abs() < 0.006, "{}", host.travel());
    assert_eq!(host.newest().pulses, 500);
    assert!(host.path.is_at_rest() && host.path_errors.is_empty(), "{:?}", host.path_errors);
    assert_eq!(host.faults, []);
    host.wire.lock().sent.clear();
    host.go(120, 5.0);
    let begun = host.sent().replace(['n', 'p'], "");
    assert_eq!(begun, "e0300.0ah-001.20vu");
    assert!((host.travel() + 1.2).abs() < 0.006);
    assert!(host.path_errors.is_empty(), "{:?}", host.path_errors);
}

#[test]
fn what_is_reported_is_near_where_it_is() {
    let mut host = Host::new();
    for (target, speed) in [(50, 0.1), (2_000, 10.0), (1_990, 0.01), (1_991, 1.0), (1_000, 2.0)] {
        host.tell(to(target, speed));
        host.until("begun", Host::is_moving);
        while host.is_moving() {
            host.turn().expect("the wire is whole");
            let printed = host.newest().pulses as f64 * 0.01;
            // The sample may be some ms old.
            let off = (printed + host.travel()).abs();
            assert!(off < 0.05 + 0.15 * speed, "{off} at {speed} mm/s");
        }
        assert_eq!(host.newest().pulses, target);
    }
    assert!(host.path_errors.is_empty(), "{:?}", host.path_errors);
    assert!(host.path.is_at_rest());
}

#[test]
fn a_stop_is_written_before_everything_and_repeated() {
    let mut host = Host::new();
    host.tell(to(5_000, 2.0));
    host.pass(1.0);
    assert!(host.is_moving());
    host.wire.lock().sent.clear();
    host.send(RigCommand::Stop);
    host.turn().expect("the wire is whole");
    assert!(host.sent().starts_with('s'), "{}", host.sent());
    host.until("at rest", |host| !host.is_moving());
    assert_eq!(host.acks.last(), Some(&RigCommand::Stop));
    // It braked within v^2/2a of 100 mm/s2 and reported its true rest position.
    assert!((host.newest().pulses as f64 * 0.01 + host.travel()).abs() < 0.006);
    assert!(host.path.is_at_rest() && host.path_errors.is_empty(), "{:?}", host.path_errors);
    assert!(host.readings.iter().any(|r| r.status.has(AxisStatus::STOPPING)));
    // It can go on from there.
    host.go(100, 1.0);
    assert!(host.path_errors.is_empty(), "{:?}", host.path_errors);

    // A stop that does not get through is written again.
    host.tell(to(5_000, 2.0));
    host.pass(0.5);
    host.wire.lock().is_deaf = true;
    host.wire.lock().sent.clear();
    host.send(RigCommand::Halt);
    let stopped_at = host.travel();
    host.pass(0.02);
    host.wire.lock().is_deaf = false;
    host.until("at rest", |host| !host.is_moving());
    assert!(host.sent().matches('s').count() >= 2);
    // A tenth of a second later, at 2 mm/s, and the brake.
    assert!(stopped_at - host.travel() < 0.3, "{} {stopped_at}", host.travel());
}

#[test]
fn a_stop_ends_a_move_before_it_has_begun() {
    let mut host = Host::new();
    host.pass(0.1);
    host.send(to(1_000, 1.0));
    host.turn().expect("the wire is whole");
    host.send(RigCommand::Stop);
    host.pass(1.0);
    assert_eq!(host.acks, [RigCommand::Stop]);
    assert!(
        matches!(&host.faults[..], [Fault::CommandRefused { detail }] if detail.contains("a stop came before"))
    );
    assert_eq!(host.travel(), 0.0);
    // And right behind the letter.
    host.faults.clear();
    host.tell(to(1_000, 1.0));
    host.send(RigCommand::Stop);
    host.pass(1.0);
    assert!(host.path.is_at_rest() && host.path_errors.is_empty(), "{:?}", host.path_errors);
    assert_eq!(host.faults, []);
    assert!(host.travel() > -0.1 && !host.is_moving());
}

#[test]
fn what_the_stand_cannot_do_is_refused_in_words() {
    let mut host = Host::new();
    let oscillation = RigCommand::Oscillate(Oscillation {
        amplitude_pulses: 10,
        period_ticks: 1_000,
        cycles: 1,
        acceleration: MmPerS2(50.0),
    });
    for (command, word) in [
        (oscillation, "cannot follow a sine"),
        (to(500_000, 1.0), "999.99 mm"),
        (to(500, 0.001), "60.0 mm/min"),
    ] {
        host.faults.clear();
        host.send(command);
        host.pass(0.5);
        let printed = host.faults.iter().map(ToString::to_string).collect::<String>();
        assert!(printed.contains(word), "{printed}");
    }
    assert_eq!((host.acks.len(), host.travel()), (0, 0.0));
    host.tell(to(1_000, 1.0));
    host.send(to(2_000, 1.0));
    host.pass(0.2);
    let printed = host.faults.last().expect("a refusal").to_string();
    assert!(printed.contains("still moving"), "{printed}");
}

#[test]
fn home_is_the_stands_own_zero_and_positions_are_defined_here() {
    let mut host = Host::new();
    host.pass(0.1);
    assert!(host.newest().status.has(AxisStatus::HOME | AxisStatus::MOTOR_ON));
    host.go(300, 2.0);
    assert!(!host.newest().status.has(AxisStatus::HOME));
    host.tell(RigCommand::DefinePosition { pulses: 0 });
    host.pass(0.1);
    assert_eq!(host.newest().pulses, 0);
    host.go(100, 2.0);
    assert!((host.travel() + 4.0).abs() < 0.006);
    // Up to home, and a stop there.
    host.tell(to(-1_000, 2.0));
    host.until("home", |host| host.newest().status.has(AxisStatus::HOME));
    host.tell(RigCommand::Stop);
    host.until("at rest", |host| !host.is_moving());
    assert!(host.travel() >= 0.0 && host.travel() < 0.2, "{}", host.travel());
    assert!(host.path_errors.is_empty(), "{:?}", host.path_errors);
    assert_eq!(host.tell(RigCommand::EnableMotor), RigCommand::EnableMotor);
}

#[test]
fn the_limit_switch_ends_a_move_and_is_reported() {
    let mut host = Host::new();
    // Up, beyond the machine's end: it was switched on 5 to 15 mm below it.
    host.tell(to(-4_000, 10.0));
    host.until("begun", Host::is_moving);
    host.until("at rest", |host| !host.is_moving());
    host.pass(0.5);
    assert!(host.newest().status.has(AxisStatus::REVERSE_LIMIT));
    assert!(host.travel() < 18.0);
    assert!((host.newest().pulses as f64 * 0.01 + host.travel()).abs() < 0.006);
    assert!(host.path_errors.is_empty(), "{:?}", host.path_errors);
}

#[test]
fn pressing_is_felt() {
    let mut host = Host::new();
    host.go(4_300, 10.0);
    let pressed = host.newest();
    let force = host.wire.lock().emulator.plant().force().0;
    assert!(force > 0.3, "{force}");
    assert!((pressed.volts.0 - force).abs() < 0.1, "{pressed:?} {force}");
    let now = host.now();
    host.wire.lock().emulator.apply_hand_action(now, HandAction::Unmount);
    host.pass(0.5);
    assert!(host.newest().volts.0.abs() < 0.02);
}

#[test]
fn samples_come_as_the_description_says() {
    for delay in [Nanos(300_000), Nanos(1_500_000), Nanos(16_000_000)] {
        let wire = Shared::new(EmulatedStandSettings::default());
        wire.lock().delay = delay;
        let mut host = Host::on(wire);
        host.go(200, 1.0);
        let ticks: Vec<u64> = host.readings.iter().map(|r| r.tick).collect();
        assert!(ticks.windows(2).all(|w| w[0] < w[1]));
        let span = (ticks[ticks.len() - 1] - ticks[0]) as f64;
        let per_sample = span / (ticks.len() - 1) as f64;
        let printed = host.connected.description.ticks_per_sample;
        assert!(per_sample < 1.5 * printed && per_sample > 0.5 * printed, "{per_sample} {printed}");
        // In motion nothing else is asked: samples stay younger than the interlock allows at any speed, 20 ms, where the
        // link lets them.
        let moving = host.readings.iter().filter(|r| r.status.has(AxisStatus::MOVING));
        let moving: Vec<u64> = moving.map(|r| r.tick).collect();
        let gap = moving.windows(2).map(|w| w[1] - w[0]).max().expect("samples");
        assert!(gap <= 5 + 2 * delay.0 / 1_000_000, "{gap} ms at {delay:?}");
        assert!(host.path_errors.is_empty(), "{:?}", host.path_errors);
        assert_eq!(host.newest().pulses, 200);
    }
}

#[test]
fn a_stand_that_takes_its_time_to_begin_is_no_stand_that_was_stopped() {
    let mut host = Host::on(Shared::new(EmulatedStandSettings {
        reaction: Nanos::from_millis(150),
        ..EmulatedStandSettings::default()
    }));
    host.go(300, 2.0);
    assert_eq!(host.newest().pulses, 300);
    assert!(!host.readings.iter().any(|r| r.status.has(AxisStatus::STOPPING)));
    assert!(host.path_errors.is_empty(), "{:?}", host.path_errors);
}

#[test]
fn before_the_first_sample_nobody_knows_which_way_a_target_is() {
    let wire = Shared::new(EmulatedStandSettings::default());
    {
        // Somebody has moved it at its panel.
        let mut wire = wire.lock();
        wire.emulator.receive(Nanos::ZERO, 0, b"jd");
        wire.now = Nanos::from_millis(1_000);
        wire.emulator.receive(Nanos::from_millis(1_000), 0, b"s");
    }
    let mut host = Host::on(wire);
    assert!(host.travel() < -10.0);
    host.send(to(500, 5.0));
    host.until("begun", Host::is_moving);
    host.until("at rest", |host| !host.is_moving());
    assert!(host.sent().contains("h-005.00vu"), "{}", host.sent());
    assert!((host.travel() + 5.0).abs() < 0.006, "{}", host.travel());
}
