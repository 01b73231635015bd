//! Motion: what is set is what is acknowledged, and samples show it as it was.

use super::bench::{Host, thesis, to};
use palpate_drivers::galil::GalilSettings;
use palpate_drivers::wire::Dialogue;
use palpate_model::rig::{AxisStatus, Fault, PathTracker, RigCommand};

fn enabled(settings: &GalilSettings) -> Host {
    let mut host = Host::new(settings);
    host.until("a sample", |host| !host.readings.is_empty());
    assert_eq!(host.tell(RigCommand::EnableMotor), RigCommand::EnableMotor);
    host
}

#[test]
fn samples_come_at_the_controllers_clock() {
    let mut host = enabled(&thesis());
    host.pass(1.0);
    let ticks: Vec<u64> = host.readings.iter().map(|reading| reading.tick).collect();
    assert!(ticks.windows(2).all(|pair| pair[0] < pair[1]));
    // Nearly all of 1024 a second: the questions are asked a little faster.
    assert!(ticks.len() > 900, "{}", ticks.len());
    let newest = host.newest();
    assert!(newest.volts.0 > 0.0 && newest.status.has(AxisStatus::MOTOR_ON));
    let counts = f64::from(newest.counts.unwrap());
    assert!((counts * 20.0 / 65_536.0 - newest.volts.0).abs() < 1e-4);
}

#[test]
fn a_move_is_acknowledged_as_set_and_followed_within_the_lag() {
    for speed in [0.75, 4.98, 19.98] {
        let mut host = enabled(&thesis());
        let mut tracker = PathTracker::new(&host.connected.description);
        for reading in host.readings.drain(..) {
            tracker.on_reading(&reading).unwrap();
        }
        let target = (speed * 100.0) as i64;
        let command = to(target, speed);
        let RigCommand::MoveTo(wanted) = command else {
            panic!("no move");
        };
        tracker.on_move(wanted);
        let set = host.tell(command);
        assert!(command.is_answered_by(&set), "{set:?}");
        host.until("moving", |host| !host.is_at_rest());
        host.settle();
        host.pass(0.1);
        for reading in &host.readings {
            tracker.on_reading(reading).unwrap();
        }
        assert!(tracker.is_at_rest());
        assert_eq!(host.newest().pulses, target);
        assert_eq!(host.faults, []);
    }
}

#[test]
fn a_stop_is_followed_too() {
    let mut host = enabled(&thesis());
    let mut tracker = PathTracker::new(&host.connected.description);
    let command = to(3000, 19.98);
    let RigCommand::MoveTo(wanted) = command else {
        panic!("no move");
    };
    for reading in host.readings.drain(..) {
        tracker.on_reading(&reading).unwrap();
    }
    tracker.on_move(wanted);
    host.tell(command);
    host.pass(1.0);
    assert_eq!(host.tell(RigCommand::Stop), RigCommand::Stop);
    host.settle();
    host.pass(0.1);
    for reading in &host.readings {
        tracker.on_reading(reading).unwrap();
    }
    assert!(host.newest().pulses < 2000);
    assert!(host.readings.iter().any(|r| r.status.has(AxisStatus::STOPPING | AxisStatus::MOVING)));
}

#[test]
fn a_halt_is_at_rest_within_samples() {
    let mut host = enabled(&thesis());
    host.tell(to(3000, 19.98));
    host.pass(1.0);
    let before = host.newest().pulses;
    host.tell(RigCommand::Halt);
    host.settle();
    assert!((host.newest().pulses - before).abs() < 30);
    // The watchdog's program still runs: nothing stops a new move.
    host.tell(to(3000, 19.98));
    host.pass(1.5);
    assert!(!host.is_at_rest());
}

#[test]
fn a_place_gets_a_new_count_and_limits_go_with_it() {
    let mut host = enabled(&thesis());
    host.tell(to(200, 5.0));
    host.settle();
    let define = RigCommand::DefinePosition { pulses: 10 };
    assert_eq!(host.tell(define), define);
    host.pass(0.05);
    assert_eq!(host.newest().pulses, 10);
    let lines = String::from_utf8(host.wire.lock().lines.clone()).unwrap();
    // 155 mm and -5 mm of 0.015 mm.
    assert!(lines.contains("FLA=10333;BLA=-333;"), "{lines}");
}

#[test]
fn a_reversed_axis_moves_the_other_way() {
    let settings = GalilSettings { is_reversed: true, ..thesis() };
    let mut host = enabled(&settings);
    host.tell(to(200, 5.0));
    host.settle();
    assert_eq!(host.newest().pulses, 200);
    let lines = String::from_utf8(host.wire.lock().lines.clone()).unwrap();
    assert!(lines.contains("PAA=-200;"));
    let define = RigCommand::DefinePosition { pulses: -3 };
    host.tell(define);
    host.pass(0.05);
    assert_eq!(host.newest().pulses, -3);
}

#[test]
fn a_limit_switch_ends_a_move_and_is_shown() {
    let mut host = enabled(&thesis());
    host.tell(to(-3000, 20.0));
    host.until("the limit", |host| host.newest().status.has(AxisStatus::REVERSE_LIMIT));
    host.settle();
    let before = host.faults.len();
    let now = host.now();
    host.session.command(now, to(-3000, 20.0));
    host.until("a refusal", |host| host.faults.len() > before);
    let Some(Fault::CommandRefused { detail }) = host.faults.last() else {
        panic!("{:?}", host.faults);
    };
    assert!(detail.contains("TC 22"), "{detail}");
    // The way out is free.
    host.tell(to(0, 5.0));
    host.settle();
    assert_eq!(host.newest().pulses, 0);
}

#[test]
fn what_cannot_be_done_is_refused_in_words() {
    let mut host = Host::new(&thesis());
    host.until("a sample", |host| !host.readings.is_empty());
    for (command, words) in
        [(to(10, 5.0), "TC 20"), (to(10, 30.0), "rig file"), (to(1 << 40, 5.0), "a target other")]
    {
        let before = host.faults.len();
        let now = host.now();
        host.session.command(now, command);
        host.until("a refusal", |host| host.faults.len() > before);
        let message = host.faults[before].to_string();
        assert!(message.contains(words), "{message}");
    }
    host.tell(RigCommand::EnableMotor);
    host.tell(to(10, 5.0));
}

#[test]
fn a_stop_overtakes_what_waits() {
    let mut host = enabled(&thesis());
    let now = host.now();
    host.session.command(now, to(1000, 5.0));
    host.session.command(now, to(2000, 5.0));
    host.session.command(now, RigCommand::Stop);
    host.until("stopped", |host| host.acks.contains(&RigCommand::Stop));
    host.pass(0.5);
    assert_eq!(host.newest().pulses, 0);
    assert!(host.is_at_rest());
    assert_eq!(host.faults.len(), 2);
}
