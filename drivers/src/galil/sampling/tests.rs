use super::*;
use crate::galil::settings::tests::thesis;

fn sampler() -> Sampler {
    Sampler::new(thesis())
}

fn reading(sampler: &mut Sampler, numbers: [f64; 6]) -> Reading {
    match sampler.take(&numbers, false) {
        Some(SampleOutcome::Reading(reading)) => reading,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_poll_is_a_sample() {
    let mut sampler = sampler();
    // Open switches, motor on, at rest.
    let rest = reading(&mut sampler, [0.305, 120.0, 120.0, 15.0, 1.0, 5000.0]);
    assert_eq!((rest.tick, rest.pulses), (5000, 120));
    // 20 V in 65536 counts: 999.4 of them.
    assert_eq!(rest.counts, Some(999));
    assert_eq!(rest.status, AxisStatus::MOTOR_ON);
    // The profile has ended, pulses are still on their way.
    let tail = reading(&mut sampler, [0.3, 120.0, 121.0, 15.0, 1.0, 5001.0]);
    assert_eq!(tail.status, AxisStatus::MOTOR_ON | AxisStatus::MOVING);
    // A closed home switch, reverse limit and motor off.
    let closed = reading(&mut sampler, [0.3, 121.0, 121.0, 41.0, 1.0, 5002.0]);
    assert_eq!(closed.status, AxisStatus::HOME | AxisStatus::REVERSE_LIMIT);
}

#[test]
fn a_stop_is_seen_on_the_way_and_at_its_end() {
    let mut sampler = sampler();
    let moving = AxisStatus::MOTOR_ON | AxisStatus::MOVING;
    let seen = [
        ([0.3, 5.0, 6.0, 143.0, 0.0, 1.0], moving),
        ([0.3, 6.0, 7.0, 143.0, 4.0, 2.0], moving | AxisStatus::STOPPING),
        ([0.3, 7.0, 7.0, 15.0, 4.0, 3.0], AxisStatus::MOTOR_ON | AxisStatus::STOPPING),
        ([0.3, 7.0, 7.0, 15.0, 4.0, 4.0], AxisStatus::MOTOR_ON),
    ];
    for (numbers, status) in seen {
        assert_eq!(reading(&mut sampler, numbers).status, status, "{numbers:?}");
    }
}

#[test]
fn the_clock_wraps_and_a_reset_is_noticed() {
    let mut sampler = sampler();
    let at = |time: f64| [0.3, 0.0, 0.0, 15.0, 1.0, time];
    let newest = 2_147_483_646.0;
    assert_eq!(reading(&mut sampler, at(newest)).tick, 2_147_483_646);
    assert_eq!(sampler.take(&at(newest), false), Some(SampleOutcome::Same));
    assert_eq!(reading(&mut sampler, at(3.0)).tick, (1 << 31) + 3);
    reading(&mut sampler, at(90_000.0));
    assert_eq!(sampler.take(&at(12.0), false), Some(SampleOutcome::Doubtful));
    assert_eq!(sampler.take(&at(13.0), false), Some(SampleOutcome::Reset));
    // Ticks go on all the same.
    assert!(reading(&mut sampler, at(14.0)).tick > (1 << 31) + 90_000);
}

#[test]
fn a_reset_after_many_days_is_no_wrap() {
    for newest in [1.5e9, 2_147_000_000.0] {
        let mut sampler = sampler();
        let at = |time: f64| [0.3, 0.0, 0.0, 15.0, 1.0, time];
        reading(&mut sampler, at(newest));
        assert_eq!(sampler.take(&at(400.0), false), Some(SampleOutcome::Doubtful));
        assert_eq!(sampler.take(&at(401.0), false), Some(SampleOutcome::Reset));
    }
}

#[test]
fn a_clock_that_lost_a_digit_once_is_no_reset() {
    let mut sampler = sampler();
    let at = |time: f64| [0.3, 0.0, 0.0, 15.0, 1.0, time];
    for time in (90_000..90_040).map(f64::from) {
        assert_eq!(reading(&mut sampler, at(time)).tick, time as u64);
        assert_eq!(sampler.take(&at(9_000.0), false), Some(SampleOutcome::Doubtful));
    }
}

#[test]
fn a_motion_just_begun_counts_as_one() {
    let mut sampler = sampler();
    let numbers = [0.3, 0.0, 0.0, 15.0, 1.0, 9.0];
    let Some(SampleOutcome::Reading(reading)) = sampler.take(&numbers, true) else {
        panic!("no sample");
    };
    assert!(reading.status.has(AxisStatus::MOVING));
}

#[test]
fn reversed_counts_and_limits_are_swapped() {
    let mut sampler = Sampler::new(GalilSettings { is_reversed: true, ..thesis() });
    let turned = reading(&mut sampler, [0.3, -50.0, -50.0, 11.0, 1.0, 9.0]);
    assert_eq!(turned.pulses, 50);
    // Bit 2 is the reverse limit of the controller, bit 3 the forward one, of which 11 has it high.
    assert_eq!(turned.status, AxisStatus::MOTOR_ON | AxisStatus::FORWARD_LIMIT);
}

#[test]
fn answers_without_the_expected_numbers_are_refused() {
    let mut sampler = sampler();
    for wrong in [
        &[0.3, 0.0, 0.0, 15.0, 1.0][..],
        &[0.3, 0.5, 0.0, 15.0, 1.0, 9.0],
        &[0.3, 0.0, 0.0, 256.0, 1.0, 9.0],
        &[0.3, 0.0, 0.0, 15.0, 1.0, -9.0],
        &[900.0, 0.0, 0.0, 15.0, 1.0, 9.0],
        &[0.3, 0.0, 1e12, 15.0, 1.0, 9.0],
    ] {
        assert_eq!(sampler.take(wrong, false), None, "{wrong:?}");
    }
}
