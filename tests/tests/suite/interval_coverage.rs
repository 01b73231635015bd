//! Intervals hold the truth as often as they say: seeds of the simulated rig against its true parameters.
//! `scripts/soak coverage` counts 1000 seeds of more cases, and its table is in `docs/explanation/accuracy.md`.
use palpate_tests::interval_coverage::{CoverageCase, CoverageDraws, NAMES, draws, summarise};

const SEEDS: u64 = 60;
/// Of 60 intervals that each hold the truth with a probability of 95 %, fewer than this do once in 1700 times.
const HELD_MIN: usize = 51;
/// A calibration of its own takes a rig several times as long as the run.
const OWN_SEEDS: u64 = 20;
/// Of 20 intervals that hold with 95 %, fewer than this do once in 3000 times.
const OWN_HELD_MIN: usize = 16;
/// The spread of 60 draws is uncertain by 9 %; three times that, on the 1.3 that an interval may be too wide.
const WIDTH_MAX: f64 = 1.3 * 1.28;
/// The spread of 20 draws is uncertain by 16 %; three times that.
const OWN_WIDTH_MAX: f64 = 1.3 * 1.48;
/// With three weights too few.
const SHORT_SEEDS: u64 = 8;
/// Of 8 intervals that hold with 95 %, fewer than this do once in 2700 times.
const SHORT_HELD_MIN: usize = 5;
/// The same on a spread of which the limit is stated.
const SPREAD_SLACK: f64 = 1.28;

fn signal_draws(case: &str, seeds: u64) -> Vec<CoverageDraws> {
    draws(CoverageCase::named(case), 1..seeds + 1, 1).iter().map(|one| one.signal).collect()
}

#[test]
fn statistical_intervals_on_the_lab_rig_hold_the_truth() {
    // Spreads of the five parameters in percent, of a prototype that knew the sizes of drift.
    let limits = [0.15, 0.09, 0.035, 0.02, 0.1];
    for (k, one) in summarise(&signal_draws("lab", SEEDS)).iter().enumerate() {
        println!("{}: {one:?}", NAMES[k]);
        assert!(one.covered >= HELD_MIN, "{}: {one:?}", NAMES[k]);
        assert!(one.stated < WIDTH_MAX * one.spread, "{}: {one:?}", NAMES[k]);
        if let Some(limit) = limits.get(k) {
            assert!(one.spread < SPREAD_SLACK * limit, "{}: {one:?}", NAMES[k]);
        }
    }
}

#[test]
fn statistical_intervals_on_the_ideal_rig_hold_the_truth() {
    for (k, one) in summarise(&signal_draws("ideal", SEEDS)).iter().enumerate() {
        println!("{}: {one:?}", NAMES[k]);
        assert!(one.covered >= HELD_MIN, "{}: {one:?}", NAMES[k]);
        assert!(one.stated < WIDTH_MAX * one.spread, "{}: {one:?}", NAMES[k]);
    }
}

#[test]
fn total_intervals_hold_the_truth_after_a_calibration_of_the_rigs_own_cell() {
    let found = summarise(&signal_draws("own", OWN_SEEDS));
    for (k, one) in found.iter().enumerate() {
        println!("{}: {one:?}", NAMES[k]);
        assert!(one.covered_in_total >= OWN_HELD_MIN, "{}: {one:?}", NAMES[k]);
        assert!(one.total_stated < OWN_WIDTH_MAX * one.total_spread, "{}: {one:?}", NAMES[k]);
        // What the record says of the curve makes the estimate better, that of the contact position nearly as good.
        let most = if k < 5 { 0.9 } else { 1.1 };
        assert!(one.total_spread < most * one.spread, "{}: {one:?}", NAMES[k]);
    }
    // Without the calibration's part some would not.
    assert!(found.iter().any(|one| one.covered < OWN_HELD_MIN), "{found:?}");
}

#[test]
fn total_intervals_grow_where_the_calibration_lacks_weights() {
    let found = summarise(&signal_draws("few-weights", SHORT_SEEDS));
    for (k, one) in found.iter().enumerate() {
        println!("{}: {one:?}", NAMES[k]);
        assert!(one.covered_in_total >= SHORT_HELD_MIN, "{}: {one:?}", NAMES[k]);
        // With all weights it is 0.5 % at most.
        assert!(k == 5 || one.total_stated > 2.0, "{}: {one:?}", NAMES[k]);
    }
}
