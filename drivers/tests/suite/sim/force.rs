//! What the load cell says about the specimen, read through the laboratory's calibration.

use super::host::{self, move_to, next_reading, settings};
use palpate_drivers::Rig;
use palpate_drivers::sim::{SimClock, SimProfile, SimRig};
use palpate_model::rig::RigCommand;
use palpate_model::viscoelastic::KelvinState;
use palpate_model::{MmPerS, Newtons, Position, Seconds};

/// Moves to a depth at a speed and returns the rig there, with the pulse it stands on.
fn indented(rig: &mut SimRig, depth_mm: f64, speed: f64) -> i64 {
    let target = ((rig.truth().surface_counted().0 + depth_mm) / 0.015).round() as i64;
    assert!(rig.description().check_speed(MmPerS(speed)).is_ok());
    host::run_move(rig, target, speed);
    target
}

#[test]
fn force_settles_at_the_elastic_force_of_the_depth() {
    for (profile, clock) in [
        (SimProfile::Ideal, SimClock::Nominal),
        (SimProfile::Ideal, SimClock::Galil),
        (SimProfile::Lab, SimClock::Nominal),
    ] {
        let mut rig = SimRig::new(settings(profile, 31, clock));
        indented(&mut rig, 30.0, 0.75);
        // 50 s of hold are 49 relaxation times.
        for _ in 0..50_000 {
            next_reading(&mut rig);
        }
        let truth = rig.truth();
        let depth = truth.position.depth_from(truth.surface);
        let settled = truth.body.elastic(depth).0;
        assert!((truth.force.0 - settled).abs() < 1e-9 * settled);
        let curve = rig.calibration().curve().unwrap();
        let mean_volts = (0..4000).map(|_| next_reading(&mut rig).1.volts.0).sum::<f64>() / 4000.0;
        let read = curve.newtons_from_volts(palpate_model::Volts(mean_volts)).0;
        let tolerance = match profile {
            // Four standard errors of 0.02 N over 4000 samples.
            SimProfile::Ideal => 1.3e-3,
            // Up to 0.2 mV of drift per minute over two minutes and its wander.
            SimProfile::Lab => 0.7e-3 / curve.sensitivity_at(Newtons(settled)),
        };
        assert!((read - settled).abs() < tolerance, "{read} for {settled}");
    }
}

#[test]
fn force_is_that_of_the_body_along_the_true_path() {
    for clock in [SimClock::Nominal, SimClock::Galil] {
        let mut rig = SimRig::new(settings(SimProfile::Lab, 32, clock));
        let (surface, body) = (rig.truth().surface, rig.truth().body);
        let tick = Seconds(clock.tick_nanos() as f64 * 1e-9);
        let mut state = KelvinState::at_rest_from(Position(0.0).depth_from(surface));
        host::answer_to(&mut rig, RigCommand::EnableMotor).unwrap();
        // Ahead of the tissue by a margin, then into it, slowly, and out of it, fast.
        let target = ((rig.truth().surface_counted().0 + 8.0) / 0.015) as i64;
        let mut largest: f64 = 0.0;
        let mut lifted_off = 0;
        rig.send(move_to(target, 6.0));
        for count in 0..12_000 {
            if count == 9000 {
                rig.send(move_to(0, 15.0));
            }
            next_reading(&mut rig);
            let truth = rig.truth();
            let body_force = state.step(&body, truth.position.depth_from(surface), tick).0;
            assert!((truth.force.0 - body_force.max(0.0)).abs() < 1e-12);
            lifted_off += u32::from(body_force < 0.0);
            largest = largest.max(truth.force.0);
        }
        assert!(largest > 0.3 && lifted_off > 0, "{largest} N, {lifted_off}");
    }
}

#[test]
fn noise_at_rest_is_what_the_description_says() {
    for profile in [SimProfile::Lab, SimProfile::Ideal] {
        let mut rig = SimRig::new(settings(profile, 33, SimClock::Nominal));
        let volts: Vec<f64> = (0..10_000).map(|_| next_reading(&mut rig).1.volts.0).collect();
        let mean = volts.iter().sum::<f64>() / 1e4;
        let rms = (volts.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 1e4).sqrt();
        let expected = rig.description().noise_expected.0;
        // Four standard errors of a deviation from 10 000 samples, 1 % for rounding to counts.
        assert!((rms / expected - 1.0).abs() < 0.04, "{rms} V");
        assert!((mean - 1.28).abs() < 1e-3);
        assert_eq!(rig.description().adc.is_some(), profile == SimProfile::Lab);
    }
}
