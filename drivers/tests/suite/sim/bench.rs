//! What stands before the probe, what a person does there, and how far the rig gives way.

use super::host::{answer_to, move_to, next_reading, run_move};
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimProfile, SimRig, SimSettings};
use palpate_model::rig::{HandAction, RigCommand};
use palpate_model::viscoelastic::KelvinState;
use palpate_model::{Depth, Newtons, Position, Seconds, Volts};

fn rig_with(thickness: &str, compliance: &str) -> SimRig {
    SimRig::new(SimSettings {
        profile: SimProfile::Ideal,
        seed: 5,
        thickness: thickness.parse().expect("a thickness"),
        compliance: compliance.parse().expect("a compliance"),
        ..SimSettings::default()
    })
}

fn pulses_at(rig: &SimRig, position: Position) -> i64 {
    (position.distance_from(rig.truth().counter_zero) / 0.015).round() as i64
}

/// Force read through the calibration, mean of a second.
fn read(rig: &mut SimRig) -> f64 {
    let sum: f64 = (0..1000).map(|_| next_reading(rig).1.volts.0).sum();
    let curve = rig.calibration().curve().expect("a curve");
    curve.newtons_from_volts(Volts(sum / 1000.0)).0
}

#[test]
fn weights_rest_on_the_cell_until_they_are_taken_off() {
    // As a trait object, as a runner holds its rig.
    let mut boxed: Box<dyn Rig> = Box::new(rig_with("100", "0"));
    boxed.apply_hand_action(HandAction::LoadCell { mass_g: 1000.0 });
    let volts = next_reading(boxed.as_mut()).1.volts.0;
    // 0.15 V/N and six times 0.02 N of noise.
    assert!((volts - 1.28 - 0.15 * 9.80665).abs() < 0.018, "{volts}");
    let mut rig = rig_with("100", "0");
    for (mass_g, newtons) in [
        (140.0, 1.372_931),
        (640.0, 6.276_256),
        (f64::NAN, 6.276_256),
        (-3.0, 6.276_256),
        (0.0, 0.0),
    ] {
        rig.apply_hand_action(HandAction::LoadCell { mass_g });
        // Four standard errors of 0.02 N over 1000 samples.
        let force = read(&mut rig);
        assert!((force - newtons).abs() < 2.6e-3, "{mass_g} g: {force}");
        assert_eq!(rig.truth().force, Newtons(0.0));
    }
}

#[test]
fn specimens_are_numbered_and_number_zero_is_the_first() {
    let mut rig = rig_with("100", "0");
    let first = rig.truth();
    rig.apply_hand_action(HandAction::Mount { specimen: 3 });
    let third = rig.truth();
    assert!(third.surface != first.surface && third.body != first.body);
    assert_eq!(third.base, first.base);
    rig.apply_hand_action(HandAction::Unmount);
    assert_eq!(rig.truth().surface, first.base);
    for (specimen, as_before) in [(0, first), (3, third)] {
        rig.apply_hand_action(HandAction::Mount { specimen });
        assert_eq!((rig.truth().surface, rig.truth().body), (as_before.surface, as_before.body));
    }
}

#[test]
fn a_fresh_specimen_has_forgotten_the_last_one() {
    let mut rig = rig_with("100", "0");
    let target = pulses_at(&rig, rig.truth().surface) + 600;
    run_move(&mut rig, target, 6.0);
    assert!(rig.truth().force.0 > 0.1);
    run_move(&mut rig, 0, 6.0);
    rig.apply_hand_action(HandAction::Mount { specimen: 0 });
    let again = run_move(&mut rig, target, 6.0).len();
    let (deep, mut fresh) = (rig.truth(), rig_with("100", "0"));
    run_move(&mut fresh, target, 6.0);
    assert!(again > 1000);
    assert_eq!(deep.force, fresh.truth().force);
}

#[test]
fn without_a_specimen_the_probe_meets_the_base_or_nothing() {
    for (thickness, meets) in [("12.5", true), ("200", false)] {
        let mut rig = rig_with(thickness, "0");
        let base = rig.truth().base;
        let first = rig.truth().surface;
        assert!((base.distance_from(first) - thickness.parse::<f64>().unwrap()).abs() < 1e-12);
        rig.apply_hand_action(HandAction::Unmount);
        let end = if meets { base.moved_by(0.02) } else { Position(150.0) };
        let target = pulses_at(&rig, end);
        run_move(&mut rig, target, 12.0);
        let truth = rig.truth();
        let into = truth.position.distance_from(base).max(0.0);
        assert_eq!(truth.force.0 > 0.0, meets);
        assert!((truth.force.0 - 1000.0 * into).abs() < 1e-9, "{truth:?}");
    }
}

#[test]
fn a_rig_that_gives_way_loses_compliance_times_force() {
    let mut rig = rig_with("100", "500");
    let (surface, body) = (rig.truth().surface, rig.truth().body);
    answer_to(&mut rig, RigCommand::EnableMotor).unwrap();
    let target = pulses_at(&rig, surface) + 1500;
    rig.send(move_to(target, 6.0));
    let mut state = KelvinState::at_rest_from(Depth(-20.0));
    let mut largest: f64 = 0.0;
    for _ in 0..12_000 {
        let (_, reading) = next_reading(&mut rig);
        let truth = rig.truth();
        // The tissue was moved by what the truth says, and by nothing else.
        let force = state.step(&body, truth.position.depth_from(surface), Seconds(0.001));
        assert!((force.0.max(0.0) - truth.force.0).abs() < 1e-9);
        // The axis is within a pulse of what it reports.
        let axis = truth.position_counted().0 + 0.5 * truth.force.0;
        let pulse = axis / 0.015 - reading.pulses as f64;
        assert!((-1e-5..1.0 + 1e-5).contains(&pulse), "{pulse}");
        largest = largest.max(truth.force.0);
    }
    assert!(largest > 1.0, "{largest}");
    let truth = rig.truth();
    let axis = Position(target as f64 * 0.015).0 + truth.counter_zero.0;
    assert!((truth.position.0 + 0.5 * truth.force.0 - axis).abs() < 1e-9);
}

#[test]
fn stiffness_scales_force_and_leaves_time_alone() {
    let settings = |stiffness: &str| SimSettings {
        seed: 5,
        stiffness: stiffness.parse().unwrap(),
        ..SimSettings::default()
    };
    let [usual, soft] = ["100", "50"].map(|percent| SimRig::new(settings(percent)).truth());
    assert_eq!(soft.surface, usual.surface);
    assert_eq!(soft.body.tau_eps, usual.body.tau_eps);
    for (one, other) in soft.body.mu.iter().zip(usual.body.mu) {
        assert!((one / other - 0.5).abs() < 1e-15);
    }
    assert!((soft.body.tau_sig / usual.body.tau_sig - 0.5).abs() < 1e-15);
}

#[test]
fn noise_of_the_ideal_cell_is_what_was_set() {
    let mut rig = SimRig::new(SimSettings {
        profile: SimProfile::Ideal,
        noise: "5".parse().unwrap(),
        ..SimSettings::default()
    });
    let expected = rig.description().noise_expected.0;
    assert!((expected - 0.15 * 0.005).abs() < 1e-15);
    let volts: Vec<f64> = (0..10_000).map(|_| next_reading(&mut rig).1.volts.0).collect();
    let mean = volts.iter().sum::<f64>() / 1e4;
    let rms = (volts.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 1e4).sqrt();
    assert!((rms / expected - 1.0).abs() < 0.04, "{rms} V");
}
