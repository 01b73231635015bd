//! Simulated time: equal seeds and commands give equal events, nothing acts before it could, and
//! it is fast.

use super::host::{self, answer_to, events_with, ideal, move_to, next_reading, settings};
use palpate_drivers::sim::{SimClock, SimProfile, SimRig, SimSettings};
use palpate_drivers::{Rig, RigEvent, RigEventBody};
use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, RigCommand};

const SCRIPT: [(usize, RigCommand); 4] = [
    (3, RigCommand::EnableMotor),
    (900, RigCommand::Stop),
    (1500, RigCommand::Halt),
    (1600, RigCommand::DefinePosition { pulses: 5 }),
];

fn run(seed: u64, profile: SimProfile, clock: SimClock) -> Vec<RigEvent> {
    let mut script = SCRIPT.to_vec();
    script.extend([(10, move_to(4000, 9.0)), (1200, move_to(-300, 3.0))]);
    let mut rig = SimRig::new(settings(profile, seed, clock));
    events_with(&mut rig, &script, Nanos::from_millis(3000))
}

/// Bit for bit: equality of floats would take -0.0 for 0.0.
fn bits(events: &[RigEvent]) -> Vec<(u64, u64, String)> {
    events
        .iter()
        .map(|event| {
            let volts = match &event.body {
                RigEventBody::Reading(reading) => reading.volts.0.to_bits(),
                RigEventBody::Ack(_) | RigEventBody::Fault(_) => 0,
            };
            (event.at.0, volts, format!("{:?}", event.body))
        })
        .collect()
}

#[test]
fn equal_seeds_give_equal_events_and_others_differ() {
    for profile in [SimProfile::Lab, SimProfile::Ideal] {
        for clock in [SimClock::Nominal, SimClock::Galil] {
            let one = run(21, profile, clock);
            assert!(one.len() > 2900, "{}", one.len());
            assert_eq!(bits(&one), bits(&run(21, profile, clock)));
            let other = run(22, profile, clock);
            let differing = one.iter().zip(&other).filter(|(a, b)| a != b).count();
            assert!(differing > 2900, "{differing}");
        }
    }
}

#[test]
fn events_do_not_depend_on_how_often_the_host_looks() {
    let mut eager = SimRig::new(settings(SimProfile::Lab, 23, SimClock::Galil));
    let mut patient = eager.clone();
    let mut seen = 0;
    let mut until = Nanos::ZERO;
    while seen < 2000 {
        until = until + Nanos(137_000);
        while let Some(event) = eager.next_event(until) {
            assert!(event.at <= until);
            assert_eq!(Some(&event), patient.next_event(host::FOREVER).as_ref());
            seen += 1;
            let command = match seen {
                5 => RigCommand::EnableMotor,
                20 => move_to(2000, 6.0),
                700 => RigCommand::Stop,
                _ => continue,
            };
            eager.send(command);
            patient.send(command);
        }
    }
}

#[test]
fn the_specimen_is_the_seed_s_whatever_the_clock_and_profile() {
    let one = ideal(24).truth();
    let other = SimRig::new(settings(SimProfile::Lab, 24, SimClock::Galil)).truth();
    assert_eq!((one.surface, one.body), (other.surface, other.body));
    assert_eq!(one.position, other.position);
}

#[test]
fn ticks_are_one_apart_and_as_long_as_the_clock_says() {
    for (clock, rate, nanos) in [
        (SimClock::Nominal, "1000", 1_000_000),
        (SimClock::Galil, "1000", 976_000),
        (SimClock::Nominal, "16000", 62_500),
        (SimClock::Galil, "20000", 48_800),
    ] {
        let settings =
            SimSettings { rate: rate.parse().unwrap(), ..settings(SimProfile::Ideal, 25, clock) };
        let mut rig = SimRig::new(settings);
        let tick_nanos = rig.description().tick_nanos;
        assert_eq!(tick_nanos, nanos);
        let (first_at, first) = next_reading(&mut rig);
        let mut before = first_at;
        for count in 1..=20_000 {
            let (at, reading) = next_reading(&mut rig);
            assert_eq!(reading.tick, first.tick + count);
            assert!(at > before);
            before = at;
            let late = at.0 as i64 - first_at.0 as i64 - (count * tick_nanos) as i64;
            assert!(late.abs() <= 500_000, "{late} ns");
        }
    }
}

#[test]
fn a_command_acts_after_it_was_sent_and_soon() {
    let mut ticks_seen = [0; 4];
    for seed in 0..50 {
        let mut rig = SimRig::new(settings(SimProfile::Lab, seed, SimClock::Galil));
        answer_to(&mut rig, RigCommand::EnableMotor).unwrap();
        answer_to(&mut rig, move_to(5000, 6.0)).unwrap();
        let mut newest = next_reading(&mut rig);
        for _ in 0..100 + seed {
            newest = next_reading(&mut rig);
        }
        rig.send(RigCommand::Stop);
        let (sent_at, last_tick) = (newest.0, newest.1.tick);
        let mut is_acknowledged = false;
        loop {
            let event = rig.next_event(host::FOREVER).unwrap();
            match event.body {
                RigEventBody::Ack(ack) => {
                    assert_eq!(ack.command, RigCommand::Stop);
                    is_acknowledged = true;
                }
                RigEventBody::Reading(reading) => {
                    let is_stopping = reading.status.has(AxisStatus::STOPPING);
                    // The answer comes before the first sample that shows the effect.
                    assert_eq!(is_stopping, is_acknowledged, "seed {seed}");
                    if is_stopping {
                        // 1.0 to 1.5 ms since that tick, 0.5 ms of way, then the next tick.
                        let ticks = reading.tick - last_tick;
                        assert!((2..=3).contains(&ticks), "seed {seed}: {ticks}");
                        ticks_seen[ticks as usize] += 1;
                        // And 1.0 to 1.5 ms back.
                        let round_trip = event.at.since(sent_at).0;
                        assert!((1_500_000..=2_976_002).contains(&round_trip));
                        break;
                    }
                }
                RigEventBody::Fault(fault) => panic!("{fault}"),
            }
        }
    }
    // By the way there, some just miss the next tick.
    assert!(ticks_seen[2] > 30 && ticks_seen[3] > 0, "{ticks_seen:?}");
}

#[test]
fn nothing_comes_before_its_time() {
    let mut rig = ideal(26);
    assert_eq!(rig.next_event(Nanos(999_999)), None);
    let first = rig.next_event(Nanos(1_500_000)).unwrap();
    assert!((1_000_000..=1_500_000).contains(&first.at.0));
    assert_eq!(rig.next_event(first.at), None);
}

#[test]
fn a_repeat_has_the_specimen_of_the_first_run_and_noise_of_its_own() {
    let readings = |repeat| {
        let mut rig = SimRig::new(SimSettings { seed: 7, repeat, ..SimSettings::default() });
        let volts: Vec<f64> = (0..4000).map(|_| next_reading(&mut rig).1.volts.0).collect();
        let mean = volts.iter().sum::<f64>() / volts.len() as f64;
        (rig.truth().body, volts.into_iter().map(|one| one - mean).collect::<Vec<f64>>())
    };
    let (body, first) = readings(0);
    assert_eq!(readings(0).1, first);
    let square = |one: &[f64]| one.iter().map(|value| value * value).sum::<f64>();
    for repeat in [1, 2] {
        let (same, other) = readings(repeat);
        assert_eq!(same, body);
        let product: f64 = first.iter().zip(&other).map(|(a, b)| a * b).sum();
        let correlation = product / (square(&first) * square(&other)).sqrt();
        // Five standard errors of 1 / sqrt(4000).
        assert!(correlation.abs() < 0.08, "{correlation}");
    }
}
