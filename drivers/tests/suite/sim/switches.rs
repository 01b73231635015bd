//! Home and limit switches, and where the slider stands at power-on.

use super::host::{answer_to, ideal, move_to, next_reading, run_move};
use palpate_drivers::Rig;
use palpate_model::rig::{AxisStatus, RigCommand};

#[test]
fn power_on_is_somewhere_with_motor_off_and_counter_zero() {
    let mut offsets = Vec::new();
    for seed in 0..200 {
        let mut rig = ideal(seed);
        let (_, reading) = next_reading(&mut rig);
        assert_eq!(reading.pulses, 0);
        assert_eq!(reading.status, AxisStatus::default());
        let truth = rig.truth();
        assert!((5.0..15.0).contains(&truth.position.0));
        assert_eq!(truth.position_counted().0, 0.0);
        assert!((39.0..=43.0).contains(&truth.surface.0));
        // The switch's edge falls anywhere between two pulses.
        offsets.push((truth.counter_zero.0 / 0.015).rem_euclid(1.0));
    }
    let spread = |low: f64, high: f64| {
        let inside = offsets.iter().filter(|o| (low..high).contains(*o));
        inside.count()
    };
    for quarter in [0.0, 0.25, 0.5, 0.75] {
        // 50 expected, standard deviation 6.
        assert!((25..=75).contains(&spread(quarter, quarter + 0.25)));
    }
}

#[test]
fn the_home_switch_closes_at_home_and_stops_nothing() {
    let mut rig = ideal(11);
    answer_to(&mut rig, RigCommand::EnableMotor).unwrap();
    let home = (rig.truth().position.0 / 0.015) as i64;
    answer_to(&mut rig, move_to(-home - 60, 3.0)).unwrap();
    loop {
        let (_, reading) = next_reading(&mut rig);
        assert_eq!(reading.status.has(AxisStatus::HOME), rig.truth().position.0 <= 0.0);
        assert!(!reading.status.has(AxisStatus::STOPPING));
        if !reading.status.has(AxisStatus::MOVING) && reading.pulses != 0 {
            assert_eq!(reading.pulses, -home - 60);
            break;
        }
    }
    assert!((-1.0..-0.8).contains(&rig.truth().position.0));
}

#[test]
fn a_limit_switch_stops_the_axis_and_lets_it_go_back() {
    for (target, limit, edge) in
        [(-20_000, AxisStatus::REVERSE_LIMIT, -2.0), (20_000, AxisStatus::FORWARD_LIMIT, 152.0)]
    {
        let mut rig = ideal(12);
        let samples = run_move(&mut rig, target, 18.0);
        let first = samples.iter().find(|sample| sample.status.has(AxisStatus::STOPPING)).unwrap();
        assert!(first.status.has(limit) && first.status.has(AxisStatus::MOVING));
        let beyond = (rig.truth().position.0 - edge) * f64::from((target as i32).signum());
        // v^2 / 2a, at most one tick of travel before the switch is seen, at most a pulse down.
        let braking = 18.0 * 18.0 / (2.0 * 61.44);
        assert!((braking - 0.016..braking + 18.0e-3 + 0.016).contains(&beyond), "{beyond}");
        let err = answer_to(&mut rig, move_to(target, 1.0)).unwrap_err();
        assert!(err.contains("limit switch"), "{err}");
        let back = samples.last().unwrap().pulses - i64::from((target as i32).signum()) * 2000;
        let samples = run_move(&mut rig, back, 18.0);
        let last = samples.last().unwrap();
        assert_eq!(last.pulses, back);
        assert!(!last.status.has(limit));
        assert!(samples.iter().all(|s| !s.status.has(AxisStatus::STOPPING)));
    }
}

#[test]
fn defining_the_position_moves_nothing() {
    let mut rig = ideal(13);
    run_move(&mut rig, -120, 3.0);
    let before = rig.truth();
    answer_to(&mut rig, RigCommand::DefinePosition { pulses: 77 }).unwrap();
    let (_, reading) = next_reading(&mut rig);
    assert_eq!(reading.pulses, 77);
    let after = rig.truth();
    assert!(after.position.distance_from(before.position).abs() < 1e-12);
    assert!((after.position_counted().0 - 77.0 * 0.015).abs() < 1e-12);
    assert!((after.surface_counted().0 - before.surface_counted().0 - 197.0 * 0.015).abs() < 1e-12);
    assert_eq!(rig.description().travel.0, 150.0);
}
