//! What a host reconstructs from commands and samples is where the probe really is.

use super::host::{self, answer_to, ideal, move_to, next_reading, oscillate, run_move, settings};
use palpate_drivers::sim::{SimClock, SimProfile, SimRig};
use palpate_drivers::{Rig, RigEventBody};
use palpate_model::rig::{AxisStatus, Fault, PathTracker, RigCommand};
use palpate_model::{MmPerS, MmPerS2};

/// A small generator of its own, so that the test's commands depend on nothing in the crate:
/// xorshift64 (Marsaglia, J. Stat. Softw. 8 (2003) 14).
struct Choices(u64);

impl Choices {
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % end
    }
}

#[derive(Default)]
struct Seen {
    samples: u64,
    moves: u64,
    oscillations: u64,
    cut_short: u64,
    refusals: u64,
    limits: u64,
}

/// Random moves, oscillations, stops, halts and definitions at random times; the tracker must never err.
fn wander(seed: u64, clock: SimClock) -> Seen {
    let mut rig = SimRig::new(settings(SimProfile::Lab, seed, clock));
    let mut choices = Choices(seed * 2 + 1);
    let mut tracker = PathTracker::new(rig.description());
    let mut seen = Seen::default();
    rig.send(RigCommand::EnableMotor);
    let mut pause = 5;
    while seen.samples < 60_000 {
        let Some(event) = rig.next_event(host::FOREVER) else {
            panic!("the rig fell silent");
        };
        match event.body {
            RigEventBody::Ack(ack) => match ack.command {
                RigCommand::MoveTo(made) => {
                    seen.moves += 1;
                    tracker.on_move(made);
                }
                RigCommand::Track(made) => tracker.on_track(made),
                RigCommand::Oscillate(made) => {
                    seen.oscillations += 1;
                    tracker.on_oscillate(made);
                }
                RigCommand::DefinePosition { pulses } => tracker.on_define(pulses),
                RigCommand::Stop | RigCommand::Halt => seen.cut_short += 1,
                RigCommand::EnableMotor => {}
            },
            RigEventBody::Fault(Fault::CommandRefused { .. }) => seen.refusals += 1,
            RigEventBody::Fault(fault) => panic!("{fault}"),
            RigEventBody::Reading(reading) => {
                seen.samples += 1;
                let truth = rig.truth();
                assert_eq!(truth.tick, reading.tick, "seed {seed}");
                let followed = tracker.on_reading(&reading).unwrap_or_else(|err| {
                    panic!("seed {seed} {clock} tick {}: {err}", reading.tick)
                });
                let miss = followed.distance_from(truth.position_counted()).abs();
                assert!(miss < 1e-9, "seed {seed} tick {}: {miss} mm", reading.tick);
                let is_moving = reading.status.has(AxisStatus::MOVING);
                assert_eq!(tracker.is_at_rest(), !is_moving, "seed {seed}");
                // Whole pulses at or below the position.
                let part = truth.position_counted().0 / 0.015 - reading.pulses as f64;
                assert!((-1e-5..1.0).contains(&part), "seed {seed}: {part}");
                let at_limit = reading.status.has(AxisStatus::FORWARD_LIMIT)
                    || reading.status.has(AxisStatus::REVERSE_LIMIT);
                seen.limits += u64::from(at_limit && is_moving);
                pause -= 1;
                if pause == 0 {
                    let longest = [2, 30, 700][choices.below(3) as usize];
                    pause = 1 + choices.below(longest);
                    // Sometimes several at once, so that they meet in one tick.
                    for _ in 0..=choices.below(4) / 2 {
                        send_one(&mut rig, &mut choices, reading.pulses);
                    }
                }
            }
        }
    }
    seen
}

fn send_one(rig: &mut SimRig, choices: &mut Choices, pulses: i64) {
    let speed = 0.03 * (1 + choices.below(666)) as f64;
    let command = match choices.below(24) {
        0..=7 => move_to(pulses + choices.below(2001) as i64 - 1000, speed),
        8..=10 => move_to(pulses + choices.below(41) as i64 - 20, speed),
        // As far as the switches and back.
        11 => move_to(pulses + 20_000, 19.98),
        12 => move_to(pulses - 20_000, 19.98),
        13..=15 => RigCommand::Stop,
        16..=18 => RigCommand::Halt,
        // Up to 64 pulses and 4 Hz, so some are too fast; either way first.
        19..=22 => oscillate(
            choices.below(129) as i64 - 64,
            250 + choices.below(900) as u32,
            1 + choices.below(3) as u32,
        ),
        _ => RigCommand::DefinePosition { pulses: choices.below(20_001) as i64 - 10_000 },
    };
    rig.send(command);
}

#[test]
fn the_tracker_follows_random_moves_stops_and_halts() {
    let mut all = Seen::default();
    for seed in 1..=6 {
        for clock in [SimClock::Nominal, SimClock::Galil] {
            let seen = wander(seed, clock);
            all.moves += seen.moves;
            all.oscillations += seen.oscillations;
            all.cut_short += seen.cut_short;
            all.refusals += seen.refusals;
            all.limits += seen.limits;
        }
    }
    // The walk has been everywhere it should have been.
    assert!(all.moves > 1000, "{} moves", all.moves);
    assert!(all.oscillations > 200, "{} oscillations", all.oscillations);
    assert!(all.cut_short > 500, "{} stops and halts", all.cut_short);
    assert!(all.refusals > 100, "{} refusals", all.refusals);
    assert!(all.limits > 50, "{} samples moving on a limit switch", all.limits);
}

#[test]
fn a_move_ends_on_its_target_and_reports_whole_pulses() {
    let mut rig = ideal(4);
    let target = 1234;
    let samples = run_move(&mut rig, target, 3.0);
    let last = samples.last().unwrap();
    assert_eq!(last.pulses, target);
    let true_position = rig.truth().position_counted().0;
    assert!((true_position - 1234.0 * 0.015).abs() < 1e-12);
    // Trapezoid: distance / speed + speed / acceleration, in whole ticks.
    let moving =
        samples.iter().filter(|sample| sample.status.has(AxisStatus::MOVING)).count() as f64;
    let expected = 1234.0 * 0.015 / 3.0 + 3.0 / 61.44;
    assert!((moving * 1e-3 - expected).abs() <= 1e-3, "{moving} ms");
    assert!(samples.is_sorted_by_key(|sample| sample.pulses));
}

#[test]
fn a_stop_decelerates_and_rests_on_the_pulse_it_reports() {
    let mut rig = ideal(5);
    answer_to(&mut rig, RigCommand::EnableMotor).unwrap();
    answer_to(&mut rig, move_to(5000, 6.0)).unwrap();
    for _ in 0..500 {
        next_reading(&mut rig);
    }
    let before = rig.truth().position;
    rig.send(RigCommand::Stop);
    let samples = host::samples_to_rest(&mut rig);
    let stopping =
        samples.iter().filter(|sample| sample.status.has(AxisStatus::STOPPING)).count() as f64;
    // v / a.
    assert!((stopping * 1e-3 - 6.0 / 61.44).abs() <= 1e-3);
    let last = samples.last().unwrap();
    assert!(last.status.has(AxisStatus::MOTOR_ON) && !last.status.has(AxisStatus::STOPPING));
    let truth = rig.truth();
    assert!((truth.position_counted().0 - last.pulses as f64 * 0.015).abs() < 1e-12);
    // v^2 / 2a, and the way made while the newest sample and the command were on their ways:
    // 1.0 to 1.5 ms back, 0.5 ms forth, up to one tick of waiting; down to a whole pulse.
    let way = truth.position.distance_from(before);
    let braking = 36.0 / (2.0 * 61.44);
    assert!(way > braking - 0.015 && way < braking + 6.0 * 0.003, "{way}");
}

#[test]
fn a_halt_rests_at_once() {
    let mut rig = ideal(6);
    answer_to(&mut rig, RigCommand::EnableMotor).unwrap();
    answer_to(&mut rig, move_to(5000, 6.0)).unwrap();
    for _ in 0..500 {
        next_reading(&mut rig);
    }
    let before = rig.truth().position;
    answer_to(&mut rig, RigCommand::Halt).unwrap();
    let (_, reading) = next_reading(&mut rig);
    assert!(reading.status.has(AxisStatus::STOPPING) && !reading.status.has(AxisStatus::MOVING));
    let way = rig.truth().position.distance_from(before);
    assert!(way < 6.0 * 0.003, "{way}");
    assert!((rig.truth().position_counted().0 - reading.pulses as f64 * 0.015).abs() < 1e-12);
    let (_, later) = next_reading(&mut rig);
    assert_eq!(later.pulses, reading.pulses);
    assert!(!later.status.has(AxisStatus::STOPPING));
}

#[test]
fn a_sine_is_the_sine_of_its_command_on_either_clock() {
    for clock in [SimClock::Nominal, SimClock::Galil] {
        let mut rig = SimRig::new(settings(SimProfile::Ideal, 14, clock));
        let start = run_move(&mut rig, 700, 3.0).last().unwrap().pulses;
        let command = oscillate(40, 1500, 3);
        assert_eq!(answer_to(&mut rig, command), Ok(command));
        // The command began at the tick of its acknowledgement, whose sample came right after.
        let first = loop {
            let (_, reading) = next_reading(&mut rig);
            if reading.status.has(AxisStatus::MOVING) {
                break reading.tick;
            }
        };
        for i in 1..4500_u32 {
            let (_, reading) = next_reading(&mut rig);
            assert_eq!(reading.tick, first + u64::from(i));
            assert!(reading.status.has(AxisStatus::MOVING));
            let angle = std::f64::consts::TAU * f64::from(i) / 1500.0;
            let exact = (start as f64 + 40.0 * (1.0 - angle.cos())) * 0.015;
            let miss = rig.truth().position_counted().0 - exact;
            assert!(miss.abs() < 1e-9, "{clock} {i}: {miss}");
        }
        let (_, rest) = next_reading(&mut rig);
        assert!(!rest.status.has(AxisStatus::MOVING) && rest.pulses == start);
        assert_eq!(rest.tick, first + 4500);
    }
}

#[test]
fn a_sine_is_stopped_by_braking_and_halted_at_once() {
    for (command, is_braking) in [(RigCommand::Stop, true), (RigCommand::Halt, false)] {
        let mut rig = ideal(15);
        answer_to(&mut rig, RigCommand::EnableMotor).unwrap();
        // 1.5 mm in 2 s: 4.7 mm/s on the way, which a quarter of a period later it has.
        answer_to(&mut rig, oscillate(100, 2000, 50)).unwrap();
        for _ in 0..500 {
            next_reading(&mut rig);
        }
        let (before, speed) = (rig.truth().position, 0.015 * 100.0 * std::f64::consts::PI);
        rig.send(command);
        let last = *host::samples_to_rest(&mut rig).last().unwrap();
        assert!(!last.status.has(AxisStatus::MOVING));
        let truth = rig.truth();
        assert!((truth.position_counted().0 - last.pulses as f64 * 0.015).abs() < 1e-12);
        // v^2 / 2a or nothing, the way made meanwhile, down to a whole pulse.
        let way = truth.position.distance_from(before);
        let braking = if is_braking { speed * speed / (2.0 * 61.44) } else { 0.0 };
        assert!(way > braking - 0.02 && way < braking + speed * 0.003, "{way}");
        // The axis takes the next motion from there.
        answer_to(&mut rig, move_to(0, 3.0)).unwrap();
        assert_eq!(host::samples_to_rest(&mut rig).last().unwrap().pulses, 0);
    }
}

#[test]
fn settings_are_rounded_down_and_read_back() {
    let mut rig = ideal(7);
    answer_to(&mut rig, RigCommand::EnableMotor).unwrap();
    let wanted = palpate_model::rig::MoveTo {
        target_pulses: 10,
        speed: MmPerS(0.77),
        acceleration: MmPerS2(40.0),
    };
    let Ok(RigCommand::MoveTo(made)) = answer_to(&mut rig, RigCommand::MoveTo(wanted)) else {
        panic!("not a move");
    };
    assert!((made.speed.0 - 0.75).abs() < 1e-12);
    assert!((made.acceleration.0 - 30.72).abs() < 1e-12);
    // What the rig offers passes through unchanged but for the last digit.
    host::samples_to_rest(&mut rig);
    for quanta in 1..=666 {
        let speed = f64::from(quanta) * 0.03;
        rig.description().check_speed(MmPerS(speed)).unwrap();
        let target = i64::from(quanta);
        let Ok(RigCommand::MoveTo(made)) = answer_to(&mut rig, move_to(target, speed)) else {
            panic!("not a move");
        };
        assert!(
            (made.speed.0 - speed).abs() < 1e-12 && (made.acceleration.0 - 61.44).abs() < 1e-12
        );
        host::samples_to_rest(&mut rig);
    }
}

#[test]
fn refusals_give_a_reason() {
    let mut rig = ideal(8);
    let why = |rig: &mut SimRig, command| answer_to(rig, command).unwrap_err();
    assert!(why(&mut rig, move_to(100, 1.0)).contains("motor is off"));
    answer_to(&mut rig, RigCommand::EnableMotor).unwrap();
    for speed in [0.0, 0.02, -1.0, 20.1, f64::NAN, f64::INFINITY] {
        assert!(why(&mut rig, move_to(100, speed)).contains("speed"), "{speed}");
    }
    for target in [i64::MAX, i64::MIN, 1 << 32] {
        assert!(why(&mut rig, move_to(target, 1.0)).contains("out of range"));
        let define = RigCommand::DefinePosition { pulses: target };
        assert!(why(&mut rig, define).contains("out of range"));
    }
    for (command, word) in [
        (oscillate(0, 1000, 1), "zero"),
        (oscillate(50, 0, 1), "zero"),
        (oscillate(50, 1000, 0), "zero"),
        (oscillate(1000, 1000, 1), "mm/s, but the axis"),
        (oscillate(20, 100, 1), "mm/s2, but the axis"),
        (oscillate(i64::MIN, 1000, 1), "out of range"),
        (oscillate(-(1 << 30) - 1, u32::MAX, 1), "out of range"),
    ] {
        let message = why(&mut rig, command);
        assert!(message.contains(word), "{command:?}: {message}");
    }
    answer_to(&mut rig, move_to(100, 1.0)).unwrap();
    let define = RigCommand::DefinePosition { pulses: 0 };
    for command in [move_to(200, 1.0), oscillate(20, 1000, 1), define] {
        let message = why(&mut rig, command);
        assert!(message.contains("axis moves") || message.contains("while it moves"), "{message}");
    }
    let last = *host::samples_to_rest(&mut rig).last().unwrap();
    assert_eq!(last.pulses, 100);
}

#[test]
fn a_flood_of_commands_is_refused_not_stored() {
    let mut rig = ideal(9);
    for _ in 0..1000 {
        rig.send(RigCommand::EnableMotor);
    }
    let events = host::events_with(&mut rig, &[], palpate_model::Nanos::from_millis(50));
    let acks = events.iter().filter(|event| matches!(event.body, RigEventBody::Ack(_))).count();
    let faults = events.iter().filter(|event| matches!(event.body, RigEventBody::Fault(_))).count();
    assert_eq!((acks, faults), (64, 1));
}
