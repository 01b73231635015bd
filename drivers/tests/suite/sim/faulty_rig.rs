//! The faulty stand-in fails as configured, at the configured time, and otherwise behaves like the rig inside.

use super::host::{self, FOREVER, answer_to, events_with, move_to, settings};
use palpate_doubles::{FaultKind, FaultyRig, Rail, ScriptedFault};
use palpate_drivers::sim::{SimClock, SimProfile, SimRig};
use palpate_drivers::{Rig, RigEvent, RigEventBody};
use palpate_model::rig::{AxisStatus, Fault, PathTracker, Reading, RigCommand};
use palpate_model::{Nanos, Volts};

const START: Nanos = Nanos::from_millis(100);
const SPAN: Nanos = Nanos::from_millis(50);
const END: Nanos = Nanos::from_millis(300);

fn sim(profile: SimProfile) -> SimRig {
    SimRig::new(settings(profile, 41, SimClock::Nominal))
}

fn script() -> Vec<(usize, RigCommand)> {
    vec![(3, RigCommand::EnableMotor), (10, move_to(2000, 6.0))]
}

fn sound(profile: SimProfile) -> Vec<RigEvent> {
    events_with(&mut sim(profile), &script(), END)
}

fn faulty(profile: SimProfile, fault: ScriptedFault) -> Vec<RigEvent> {
    let mut rig = FaultyRig::new(sim(profile), vec![fault], 1);
    let events = events_with(&mut rig, &script(), END);
    assert!(events.is_sorted_by(|a, b| a.at < b.at));
    events
}

fn readings(events: &[RigEvent]) -> Vec<(Nanos, Reading)> {
    events
        .iter()
        .filter_map(|event| match event.body {
            RigEventBody::Reading(reading) => Some((event.at, reading)),
            RigEventBody::Ack(_) | RigEventBody::Fault(_) => None,
        })
        .collect()
}

fn is_inside(at: Nanos) -> bool {
    at >= START && at.since(START) < SPAN
}

/// Checks that a fault about samples changes those in its time and no others.
fn check(profile: SimProfile, kind: FaultKind, is_right: impl Fn(Reading, Reading) -> bool) {
    let events = faulty(profile, ScriptedFault::during(START, SPAN, kind));
    let (sound, faulty) = (readings(&sound(profile)), readings(&events));
    assert_eq!(sound.len(), faulty.len(), "{kind:?}");
    let mut inside = 0;
    for ((at, good), (at_faulty, bad)) in sound.into_iter().zip(faulty) {
        assert_eq!(at, at_faulty);
        if is_inside(at) {
            inside += 1;
            assert!(is_right(good, bad), "{kind:?}: {good:?} {bad:?}");
        } else {
            assert_eq!(good, bad, "{kind:?} outside its time");
        }
    }
    assert!((49..=51).contains(&inside));
}

#[test]
fn without_a_script_it_is_the_rig_inside() {
    let mut rig = FaultyRig::new(sim(SimProfile::Lab), Vec::new(), 1);
    assert_eq!(events_with(&mut rig, &script(), END), sound(SimProfile::Lab));
}

#[test]
fn signal_faults_change_the_signal_in_their_time() {
    let same_axis = |good: Reading, bad: Reading| {
        (good.tick, good.pulses, good.status) == (bad.tick, bad.pulses, bad.status)
    };
    let adc = sim(SimProfile::Lab).description().adc.unwrap();
    for profile in [SimProfile::Lab, SimProfile::Ideal] {
        check(profile, FaultKind::NotANumber, |good, bad| {
            same_axis(good, bad) && bad.volts.0.is_nan()
        });
        for (rail, sign) in [(Rail::High, 1.0), (Rail::Low, -1.0)] {
            check(profile, FaultKind::Saturated(rail), |good, bad| {
                let is_railed = (bad.volts.0 * sign - 10.0).abs() < 0.001;
                let counts = [None, Some(adc.counts_max), Some(adc.counts_min)];
                same_axis(good, bad) && is_railed && counts.contains(&bad.counts)
            });
        }
        check(profile, FaultKind::SignalJump(Volts(0.5)), |good, bad| {
            let is_counted =
                bad.counts.is_none_or(|c| Volts(f64::from(c) * adc.volts_per_count) == bad.volts);
            // Rounded twice to half a count.
            same_axis(good, bad) && is_counted && (bad.volts.0 - good.volts.0 - 0.5).abs() < 4e-4
        });
        check(profile, FaultKind::LostSteps(-40), |good, bad| {
            good.volts == bad.volts && bad.pulses == good.pulses - 40
        });
    }
}

#[test]
fn a_stuck_signal_stays_at_its_first_value() {
    let events = faulty(SimProfile::Lab, ScriptedFault::during(START, SPAN, FaultKind::Stuck));
    let stuck: Vec<Reading> = readings(&events)
        .into_iter()
        .filter(|(at, _)| is_inside(*at))
        .map(|(_, reading)| reading)
        .collect();
    let first = stuck[0];
    assert!(stuck.iter().all(|r| (r.counts, r.volts) == (first.counts, first.volts)));
    assert!(stuck.last().unwrap().pulses > first.pulses + 10);
    let good = readings(&sound(SimProfile::Lab));
    assert!(good.iter().any(|(_, r)| *r == first));
}

#[test]
fn added_noise_has_the_configured_size() {
    let fault = ScriptedFault::from(Nanos::ZERO, FaultKind::Noisy(Volts(0.1)));
    let pairs = readings(&sound(SimProfile::Ideal))
        .into_iter()
        .zip(readings(&faulty(SimProfile::Ideal, fault)));
    let added: Vec<f64> = pairs.map(|((_, good), (_, bad))| bad.volts.0 - good.volts.0).collect();
    let rms = (added.iter().map(|v| v * v).sum::<f64>() / added.len() as f64).sqrt();
    // Four standard errors with about 300 samples.
    assert!((rms - 0.1).abs() < 0.017, "{rms}");
}

#[test]
fn silence_loses_samples_but_not_answers() {
    let fault = ScriptedFault::during(START, SPAN, FaultKind::Silent);
    let mut rig = FaultyRig::new(sim(SimProfile::Lab), vec![fault], 1);
    let mut events = events_with(&mut rig, &script(), START + Nanos::from_millis(10));
    rig.send(RigCommand::Stop);
    events.extend(events_with(&mut rig, &[], END));
    let inside: Vec<&RigEvent> = events.iter().filter(|e| is_inside(e.at)).collect();
    assert_eq!(inside.len(), 1, "{inside:?}");
    assert!(matches!(&inside[0].body, RigEventBody::Ack(ack) if ack.command == RigCommand::Stop));
    assert!(inside[0].at < START + Nanos::from_millis(14));
    assert!(readings(&events).iter().any(|(at, _)| *at >= START + SPAN));
}

#[test]
fn late_reports_come_later_in_order_and_none_is_lost() {
    let delay = Nanos::from_millis(20);
    let fault = ScriptedFault::during(START, SPAN, FaultKind::Late(delay));
    let (good, bad) = (sound(SimProfile::Lab), faulty(SimProfile::Lab, fault));
    assert_eq!(good.len(), bad.len());
    for (good, bad) in good.iter().zip(&bad) {
        assert_eq!(good.body, bad.body);
        if is_inside(good.at) {
            assert_eq!(bad.at, good.at + delay);
        } else if good.at >= START + SPAN + delay {
            assert_eq!(bad.at, good.at);
        } else {
            assert!(bad.at >= good.at);
        }
    }
}

#[test]
fn an_answer_to_a_late_report_does_not_act_in_the_past() {
    let delay = Nanos::from_millis(20);
    let fault = ScriptedFault::from(START, FaultKind::Late(delay));
    let mut rig = FaultyRig::new(sim(SimProfile::Ideal), vec![fault], 1);
    events_with(&mut rig, &script(), START + Nanos::from_millis(30));
    let event = rig.next_event(FOREVER).unwrap();
    rig.send(RigCommand::Halt);
    let halted = rig.inner().truth().tick;
    let RigEventBody::Reading(seen) = event.body else {
        panic!("{event:?}");
    };
    // The axis has gone on for the delay before it hears the answer.
    assert!(halted - seen.tick >= 19, "{halted} {}", seen.tick);
    let halted_at = loop {
        if let RigEventBody::Reading(reading) = rig.next_event(FOREVER).unwrap().body
            && !reading.status.has(AxisStatus::MOVING)
        {
            break reading.tick;
        }
    };
    assert!((halted..=halted + 3).contains(&halted_at));
}

#[test]
fn lost_link_is_reported_once_and_then_nothing_comes() {
    let events = faulty(SimProfile::Lab, ScriptedFault::from(START, FaultKind::Disconnect));
    let last = events.last().unwrap();
    assert_eq!(last.at, START);
    assert!(matches!(last.body, RigEventBody::Fault(Fault::LinkLost { .. })));
    let fault = ScriptedFault::from(START, FaultKind::Disconnect);
    let mut rig = FaultyRig::new(sim(SimProfile::Lab), vec![fault], 1);
    events_with(&mut rig, &script(), START);
    rig.send(RigCommand::Halt);
    let before = rig.inner().truth().position;
    assert_eq!(rig.next_event(END), None);
    // No stop could reach it.
    assert!(rig.inner().truth().position.distance_from(before) > 1.0);
}

#[test]
fn a_restarted_controller_has_lost_everything() {
    for (kind, is_announced) in [(FaultKind::Reset, true), (FaultKind::UnannouncedReset, false)] {
        let fault = ScriptedFault::from(START, kind);
        let mut rig = FaultyRig::new(sim(SimProfile::Lab), vec![fault], 1);
        let events = events_with(&mut rig, &script(), END);
        let is_reset = |e: &RigEvent| e.body == RigEventBody::Fault(Fault::ControllerReset);
        let resets: Vec<Nanos> = events.iter().filter(|e| is_reset(e)).map(|e| e.at).collect();
        assert_eq!(resets, if is_announced { vec![START] } else { vec![] });
        // Two commands, two answers: the double's own do not show.
        let acks = events.iter().filter(|e| matches!(e.body, RigEventBody::Ack(_))).count();
        assert_eq!(acks, 2);
        let after: Vec<(Nanos, Reading)> =
            readings(&events).into_iter().filter(|(at, _)| *at >= START).collect();
        assert_eq!((after[0].1.tick, after[0].1.pulses), (0, 0));
        assert!(after[0].0 < START + Nanos::from_millis(6));
        for (_, reading) in &after {
            assert_eq!(reading.pulses, 0);
            assert!(!reading.status.has(AxisStatus::MOTOR_ON));
            assert!(!reading.status.has(AxisStatus::MOVING));
        }
        // It can be used again like one just powered up.
        assert!(answer_to(&mut rig, move_to(100, 3.0)).is_err());
        let mut tracker = PathTracker::new(rig.description());
        for reading in host::run_move(&mut rig, 100, 3.0) {
            if reading.status.has(AxisStatus::MOVING) && tracker.is_at_rest() {
                let RigCommand::MoveTo(command) = move_to(100, 3.0) else {
                    panic!("not a move");
                };
                tracker.on_move(command);
            }
            tracker.on_reading(&reading).unwrap();
        }
        let RigCommand::MoveTo(_) = answer_to(&mut rig, move_to(0, 3.0)).unwrap() else {
            panic!("not a move");
        };
    }
}

#[test]
fn lost_steps_break_the_path() {
    let fault = ScriptedFault::from(START, FaultKind::LostSteps(3));
    let mut rig = FaultyRig::new(sim(SimProfile::Lab), vec![fault], 1);
    let mut tracker = PathTracker::new(rig.description());
    let mut seen = 0;
    let broken_at = loop {
        let event = rig.next_event(END).unwrap();
        seen += 1;
        for (index, command) in script() {
            if index == seen {
                rig.send(command);
            }
        }
        match event.body {
            RigEventBody::Ack(ack) => {
                if let RigCommand::MoveTo(made) = ack.command {
                    tracker.on_move(made);
                }
            }
            RigEventBody::Reading(reading) => {
                if tracker.on_reading(&reading).is_err() {
                    break event.at;
                }
            }
            RigEventBody::Fault(fault) => panic!("{fault}"),
        }
    };
    assert!(broken_at >= START && broken_at < START + Nanos::from_millis(2));
}

#[test]
fn refused_commands_have_no_effect() {
    let fault = ScriptedFault::during(Nanos::ZERO, START, FaultKind::RefuseCommands);
    let mut rig = FaultyRig::new(sim(SimProfile::Lab), vec![fault], 1);
    let events = events_with(&mut rig, &script(), START + SPAN);
    let refusals = events
        .iter()
        .filter(|e| matches!(e.body, RigEventBody::Fault(Fault::CommandRefused { .. })))
        .count();
    assert_eq!(refusals, 2);
    for (_, reading) in readings(&events) {
        assert_eq!((reading.pulses, reading.status), (0, AxisStatus::default()));
    }
    // When it is over, commands work.
    assert!(answer_to(&mut rig, RigCommand::EnableMotor).is_ok());
}

#[test]
fn faults_add_up_and_repeat_exactly() {
    let faults = vec![
        ScriptedFault::from(START, FaultKind::Noisy(Volts(0.05))),
        ScriptedFault::from(START, FaultKind::Late(Nanos::from_millis(3))),
        ScriptedFault::from(Nanos::from_millis(200), FaultKind::Disconnect),
    ];
    let run = || {
        let mut rig = FaultyRig::new(sim(SimProfile::Lab), faults.clone(), 7);
        events_with(&mut rig, &script(), END)
    };
    let events = run();
    assert_eq!(events, run());
    // Late reports still on their way are lost with the link.
    assert_eq!(events.last().unwrap().at, Nanos::from_millis(200));
    let newest = readings(&events).last().unwrap().1.tick;
    let sound = readings(&sound(SimProfile::Lab));
    let sent = sound.iter().find(|(_, r)| r.tick == newest).unwrap().0;
    assert!(Nanos::from_millis(200).since(sent) >= Nanos::from_millis(3));
}
