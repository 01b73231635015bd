//! Cycles whose shift, energy and decay are known beforehand.

use palpate_model::random::SplitMix;
use palpate_model::rig::Phase;
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::cycles::{CycleSample, SteadyRule, analyse_cycles, split_by_depth};

/// Thesis body behind a surface that has receded by so much in each cycle: in at 3 mm/s to 30 mm, `hold` seconds, back;
/// two hundred samples a second.
fn cycles(sets: &[f64], hold: f64, noise: f64) -> Vec<CycleSample> {
    let (body, mut random) = (ModifiedKelvin::THESIS, SplitMix::seeded(7));
    let mut all = Vec::new();
    let (way, held) = (2000, (hold * 200.0) as usize);
    for (k, set) in sets.iter().enumerate() {
        // The rest between cycles is long: each starts relaxed.
        let mut state = KelvinState::at_rest_from(Depth(-set));
        for i in 0..=2 * way + held {
            let (phase, x) = match i {
                _ if i <= way => (Phase::Ramp, 0.015 * i as f64),
                _ if i <= way + held => (Phase::Hold, 30.0),
                _ => (Phase::Unload, 0.015 * (2 * way + held - i) as f64),
            };
            let dt = if i == 0 { 0.0 } else { 0.005 };
            let force = state.step(&body, Depth(x - set), Seconds(dt)).0.max(0.0);
            all.push(CycleSample {
                t: Seconds(100.0 * k as f64 + 0.005 * i as f64),
                depth: Depth(x),
                force: Newtons(force + noise * random.normal()),
                phase,
                cycle: k as u32 + 1,
                step: 0,
            });
        }
    }
    all
}

/// As a preconditioned specimen: nine tenths of a millimetre, half of what is missing in each cycle.
fn receding(count: i32) -> Vec<f64> {
    (0..count).map(|k| 0.9 * (1.0 - 0.5f64.powi(k))).collect()
}

#[test]
fn shifts_peaks_and_the_steady_cycle_are_found() {
    for noise in [0.0, 0.02] {
        let sets = receding(10);
        let found = analyse_cycles(&cycles(&sets, 0.0, noise), None, None);
        assert_eq!(found.len(), 10);
        let steady = SteadyRule::default().judge(&found);
        for (k, change) in steady.changes.iter().enumerate() {
            let (shift, true_shift) = (change.shift.unwrap().0, sets[k + 1] - sets[k]);
            let error = |k: usize| found[k].levels[2].unwrap().depth.std_error.0;
            // Half a micrometre for the curvature, four standard errors for noise, which is up to 60 um here.
            let at_most = 5e-4 + 4.0 * error(k).hypot(error(k + 1));
            assert!(at_most < 0.06, "{at_most}");
            let miss = (shift - true_shift).abs();
            assert!(miss < at_most, "{noise} {k}: {miss} {at_most}");
            if noise == 0.0 {
                assert!(change.peak_percent < 0.0 && shift > 0.0, "{change:?}");
            }
        }
        // Peaks change by 3.7, 1.9, 0.94 and 0.47 %: from the third cycle on by less than one. Noise of 0.3 % of the
        // change is not enough to blur that.
        assert_eq!(steady.steady_from, Some(3), "{:?}", steady.changes);
        let strict = SteadyRule { percent: 1e-3, ..SteadyRule::default() };
        assert_eq!(strict.judge(&found).steady_from, None);
        assert_eq!(SteadyRule::default().judge(&found[..2]).steady_from, None);
        for one in &found {
            assert!((one.speed.0 - 3.0).abs() < 1e-9 && (one.depth_peak.0 - 30.0).abs() < 1e-9);
            let start = one.force_start.unwrap();
            assert!(start.value.0.abs() < 0.03, "{start:?}");
        }
    }
}

#[test]
fn peak_and_stiffness_are_those_of_the_body() {
    // The exact answer to a ramp by the body's own step, and its slope by a small difference.
    let body = ModifiedKelvin::THESIS;
    let exact = |x: f64| {
        let mut state = KelvinState::at_rest();
        let mut force = Newtons(0.0);
        for i in 1..=1000 {
            force = state.step(&body, Depth(x * f64::from(i) / 1000.0), Seconds(x / 3000.0));
        }
        force.0
    };
    let slope = (exact(24.01) - exact(23.99)) / 0.02;
    for (noise, at_most) in [(0.0, 1e-3), (0.02, 4.0)] {
        let one = &analyse_cycles(&cycles(&[0.0], 0.0, noise), None, None)[0];
        let stiffness = one.stiffness.unwrap();
        assert!((stiffness.depth.0 - 24.0).abs() < 1e-9);
        let misses = [
            (one.force_peak.value.0 - exact(30.0), one.force_peak.std_error.0),
            (stiffness.slope.value - slope, stiffness.slope.std_error),
        ];
        for (miss, error) in misses {
            // Without noise within a thousandth; with it within four standard errors.
            let unit = if noise == 0.0 { 1.0 } else { error };
            assert!(miss.abs() < at_most * unit, "{noise}: {miss} {error}");
        }
    }
    let at = analyse_cycles(&cycles(&[0.0], 0.0, 0.0), Some(Depth(12.0)), None)[0].stiffness;
    let slope = (exact(12.01) - exact(11.99)) / 0.02;
    assert!((at.unwrap().slope.value - slope).abs() < 1e-3);
    assert_eq!(
        analyse_cycles(&cycles(&[0.0], 0.0, 0.0), Some(Depth(31.0)), None)[0].stiffness,
        None
    );
}

#[test]
fn energies_are_those_of_straight_lines() {
    // In along 0.5 N/mm to 10 mm, back along 0.4 N/mm after the force fell to 4 N: 25 and 25 - 20 N*mm.
    let line =
        |count: u32, phase, x: &dyn Fn(f64) -> f64, slope: f64, cycle: u32| -> Vec<CycleSample> {
            (0..=count)
                .map(|i| f64::from(i) / f64::from(count))
                .map(|share| CycleSample {
                    t: Seconds(share),
                    depth: Depth(x(share)),
                    force: Newtons(slope * x(share)),
                    phase,
                    cycle,
                    step: 0,
                })
                .collect()
        };
    let mut all = line(500, Phase::Ramp, &|s| 10.0 * s, 0.5, 1);
    all.extend(line(500, Phase::Unload, &|s| 10.0 * (1.0 - s), 0.4, 1));
    all.extend(line(500, Phase::Ramp, &|s| 10.0 * s, 0.5, 2));
    // Moves between cycles are no part of one.
    all.extend(line(500, Phase::Retract, &|s| 10.0 * (1.0 - s), 0.1, 2));
    let found = analyse_cycles(&all, None, None);
    assert!((found[0].work_loading - 25.0).abs() < 1e-12);
    assert!((found[0].work_loop.unwrap() - 5.0).abs() < 1e-12);
    assert!((found[0].loss_share().unwrap() - 0.2).abs() < 1e-12);
    assert_eq!((found[1].work_loop, found[1].loss_share()), (None, None));
    let levels = found[0].levels.map(|level| level.unwrap().depth.value.0);
    for (depth, share) in levels.iter().zip([0.02, 0.1, 0.5]) {
        // The levels are counted from the force over the first hundredth, which is 0.025 N.
        assert!((depth - 10.0 * share).abs() < 0.06, "{levels:?}");
    }
}

#[test]
fn a_hold_relaxes_or_creeps() {
    let found = &analyse_cycles(&cycles(&[0.0], 12.0, 0.0), None, None)[0];
    let relaxation = found.relaxation.unwrap();
    let settled = ModifiedKelvin::THESIS.elastic(Depth(30.0)).0;
    let equilibrium = relaxation.equilibrium.unwrap();
    assert!((equilibrium.value.0 - settled).abs() < 1e-3);
    assert!(found.creep.is_empty());
    let percent = 100.0 * (1.0 - settled / found.force_peak.value.0);
    assert!((relaxation.percent.value - percent).abs() < 0.01);
    // One time constant of 1.023 s: half of it has gone after 0.709 s.
    assert!((relaxation.half_time.unwrap().0 - 1.023 * 2f64.ln()).abs() < 0.01);
    let mut creeping = cycles(&[0.0], 12.0, 0.0);
    for one in creeping.iter_mut().filter(|one| one.phase == Phase::Hold) {
        one.phase = Phase::Creep;
        one.depth = Depth(30.0 + 0.1 * (one.t.0 - 10.0));
        one.force = Newtons(5.0);
    }
    let found = &analyse_cycles(&creeping, None, None)[0];
    assert!(found.relaxation.is_none());
    let creep = found.creep[0];
    assert!((creep.rate_end.value - 0.1).abs() < 1e-9);
    assert!((creep.depth_end.value.0 - 31.2).abs() < 1e-6);
}

/// In to 20 mm, 30 s at 1 N and at 2 N, each step adding half a millimetre, and back.
fn two_forces(extra: Phase) -> Vec<CycleSample> {
    let part = |phase, step: u32, from: f64, to: f64, force: f64, t: f64, secs: f64| {
        (0..3000).map(move |i| {
            let share = f64::from(i) / 3000.0;
            CycleSample {
                t: Seconds(t + secs * share),
                depth: Depth(from + (to - from) * share),
                force: Newtons(force),
                phase,
                cycle: 1,
                step,
            }
        })
    };
    let mut all: Vec<CycleSample> = part(Phase::Ramp, 4, 0.0, 20.0, 1.0, 0.0, 10.0).collect();
    all.extend(part(extra, 5, 20.0, 20.5, 1.0, 10.0, 30.0));
    all.extend(part(extra, 6, 20.5, 21.0, 2.0, 40.0, 30.0));
    all.extend(part(Phase::Unload, 7, 21.0, 0.0, 0.5, 70.0, 10.0));
    all
}

#[test]
fn each_hold_of_a_force_has_its_own_row() {
    let found = &analyse_cycles(&two_forces(Phase::Creep), None, Some(Depth(0.015)))[0];
    let rows: Vec<[f64; 4]> = found
        .creep
        .iter()
        .map(|one| [one.duration.0.round(), one.force.0, one.force_sd.0, one.depth_start.0])
        .collect();
    assert_eq!(rows, [[30.0, 1.0, 0.0, 20.0], [30.0, 2.0, 0.0, 20.5]]);
    assert!(found.creep.iter().all(|one| (2.4..2.6).contains(&one.percent)));
}

#[test]
fn a_cycle_with_more_than_a_hold_in_it_is_no_loop() {
    for (extra, is_loop) in [(Phase::Hold, true), (Phase::Creep, false), (Phase::Sine, false)] {
        let found = &analyse_cycles(&two_forces(extra), None, None)[0];
        assert_eq!(
            (found.work_loop.is_some(), found.loss_share().is_some()),
            (is_loop, is_loop),
            "{extra}"
        );
        assert_eq!(found.relaxation.is_some(), extra == Phase::Hold);
        // The way back counts to the cycle, whatever came before.
        assert!((found.duration.0 - 80.0).abs() < 0.01, "{}", found.duration);
    }
    // A hold behind a sine does not begin at the peak.
    let mut all = two_forces(Phase::Hold);
    for one in all.iter_mut().filter(|one| one.step == 5) {
        one.phase = Phase::Sine;
    }
    assert!(analyse_cycles(&all, None, None)[0].relaxation.is_none());
}

#[test]
fn a_record_without_phases_has_the_same_cycles() {
    let named = cycles(&receding(4), 5.0, 0.0);
    let column = |value: fn(&CycleSample) -> f64| -> Vec<f64> { named.iter().map(value).collect() };
    let split = split_by_depth(
        &column(|one| one.t.0),
        &column(|one| one.depth.0),
        &column(|one| one.force.0),
    );
    let (one, other) = (analyse_cycles(&named, None, None), analyse_cycles(&split, None, None));
    assert_eq!(one.len(), other.len());
    for (a, b) in one.iter().zip(&other) {
        assert!((a.force_peak.value.0 - b.force_peak.value.0).abs() < 1e-9);
        assert!((a.work_loop.unwrap() - b.work_loop.unwrap()).abs() < 1e-9);
        assert!(
            (a.depth_at_half_peak().unwrap().0 - b.depth_at_half_peak().unwrap().0).abs() < 1e-9
        );
        let percent =
            |one: &palpate_rheology::cycles::CycleAnalysis| one.relaxation.unwrap().percent.value;
        assert!((percent(a) - percent(b)).abs() < 1e-6);
    }
}
