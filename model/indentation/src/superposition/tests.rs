//! Sweeps of bodies with known shift factors.

use super::*;
use crate::viscoelastic::{RelaxationMode, RelaxationModulus};
use palpate_model::random::SplitMix;
use std::f64::consts::{LN_10, PI, TAU};

/// Relative standard uncertainties of the tests: of each modulus, and of all moduli of a sweep in common, as from its contact.
const OWN: f64 = 0.01;
const COMMON: f64 = 0.02;

/// Six frequencies in a decade.
fn frequencies() -> Vec<f64> {
    (0..13).map(|step| 0.05 * 10f64.powf(f64::from(step) / 6.0)).collect()
}

fn prony(frequency: f64) -> [f64; 2] {
    let terms = [(0.02, 30.0), (0.03, 3.0), (0.03, 0.3), (0.03, 0.03), (0.04, 0.003)];
    let terms = terms.map(|(modulus_mpa, time_secs)| RelaxationMode { modulus_mpa, time_secs });
    RelaxationModulus { equilibrium_mpa: 0.01, terms: terms.to_vec(), exponent: 1.0 }
        .dynamic_moduli(frequency)
}

/// A fractional Zener body `G + (G0 - G) z / (1 + z)`, where `z = (i w tau)^0.4`.
fn fractional(frequency: f64) -> [f64; 2] {
    let size = (TAU * frequency * 0.2).powf(0.4);
    let (real, imaginary) = ((0.2 * PI).cos() * size, (0.2 * PI).sin() * size);
    let square = (1.0 + real).powi(2) + imaginary.powi(2);
    let share = [(real * (1.0 + real) + imaginary.powi(2)) / square, imaginary / square];
    [0.01 + 0.09 * share[0], 0.09 * share[1]]
}

/// Activation energies in kJ/mol.
fn arrhenius(energy: f64, temperature_c: f64, reference_c: f64) -> f64 {
    energy / 8.314_462_618e-3 * (1.0 / (temperature_c + 273.15) - 1.0 / (reference_c + 273.15))
}

/// A body whose times shrink with the temperature.
fn sweep(body: impl Fn(f64) -> [f64; 2], temperature_c: f64, ln_shift: f64) -> Sweep {
    let sine = |frequency_hz: f64| {
        let [storage_mpa, loss_mpa] = body(frequency_hz * ln_shift.exp());
        SweepSine { frequency_hz, storage_mpa, loss_mpa }
    };
    Sweep { temperature_c, sines: frequencies().into_iter().map(sine).collect() }
}

/// Every modulus by itself, and the moduli of each sweep in common.
fn errors(sweeps: &[Sweep], [own, common]: [f64; 2]) -> Vec<ModulusError> {
    let none: ModulusError = sweeps.iter().map(|sweep| vec![[0.0; 2]; sweep.sines.len()]).collect();
    let mut errors = Vec::new();
    for (place, sweep) in sweeps.iter().enumerate() {
        let mut error = none.clone();
        error[place].fill([common; 2]);
        errors.push(error);
        for sine in 0..sweep.sines.len() {
            for modulus in 0..2 {
                let mut error = none.clone();
                error[place][sine][modulus] = own;
                errors.push(error);
            }
        }
    }
    errors
}

/// The sweeps with a drawn size of every error.
fn drawn(sweeps: &[Sweep], errors: &[ModulusError], random: &mut SplitMix) -> Vec<Sweep> {
    let mut drawn = sweeps.to_vec();
    for error in errors {
        let size = random.normal();
        for (sweep, changes) in drawn.iter_mut().zip(error) {
            for (sine, change) in sweep.sines.iter_mut().zip(changes) {
                sine.storage_mpa *= (size * change[0]).exp();
                sine.loss_mpa *= (size * change[1]).exp();
            }
        }
    }
    drawn
}

fn at_four_temperatures(body: fn(f64) -> [f64; 2], energy: f64) -> Vec<Sweep> {
    let one = |temperature: f64| sweep(body, temperature, arrhenius(energy, temperature, 20.0));
    [5.0, 20.0, 30.0, 37.0].map(one).to_vec()
}

#[test]
fn shift_factors_of_exact_sweeps_come_back() {
    for (body, energy) in [(prony as fn(f64) -> [f64; 2], 60.0), (fractional, -40.0), (prony, 0.0)]
    {
        let sweeps = at_four_temperatures(body, energy);
        let found = master_curve(&sweeps, &errors(&sweeps, [1e-3, 0.0]), 1).unwrap();
        for (sweep, ln_shift) in sweeps.iter().zip(&found.ln_shifts) {
            let exact = arrhenius(energy, sweep.temperature_c, 20.0);
            assert!((ln_shift - exact).abs() < 0.01, "{energy}: {ln_shift} {exact}");
        }
        assert!(found.overlaps.iter().all(|overlap| overlap.lack_of_fit.is_none()), "{found:?}");
        let energy_found = found.arrhenius.unwrap().activation_energy;
        assert!((energy_found - energy).abs() < 0.2, "{energy}: {energy_found}");
    }
}

/// Of drawn records, 95 % intervals of shift factors and activation energy hold the truth as often as they say, and hardly one is refused.
#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    let mut random = SplitMix::seeded(11);
    for (body, energy) in [(prony as fn(f64) -> [f64; 2], 60.0), (fractional, 80.0)] {
        let sweeps = at_four_temperatures(body, energy);
        let errors = errors(&sweeps, [OWN, COMMON]);
        let (mut held, mut refused, records) = ([0; 4], 0, 300);
        for _ in 0..records {
            let Ok(found) = master_curve(&drawn(&sweeps, &errors, &mut random), &errors, 1) else {
                refused += 1;
                continue;
            };
            for (count, sweep) in held.iter_mut().zip([0, 2, 3]) {
                let exact = arrhenius(energy, sweeps[sweep].temperature_c, 20.0);
                let off = (found.ln_shifts[sweep] - exact).abs();
                *count += i32::from(off < 1.96 * found.covariance[sweep][sweep].sqrt());
            }
            let within = |law: Arrhenius| {
                (law.activation_energy - energy).abs() < 1.96 * law.standard_uncertainty
            };
            held[3] += i32::from(found.arrhenius.is_ok_and(within));
        }
        println!("held {held:?}, refused {refused} of {records}");
        assert!(refused <= 3, "{refused}");
        for count in held {
            // Three standard deviations of a count about 95 %.
            assert!((274..=296).contains(&(count + refused)), "{held:?}");
        }
    }
}

#[test]
fn constants_of_williams_landel_and_ferry_come_back() {
    let (c1, c2) = (3.0, 80.0);
    let shift = |difference: f64| -LN_10 * c1 * difference / (c2 + difference);
    let one = |temperature: f64| sweep(fractional, temperature, shift(temperature - 40.0));
    let sweeps: Vec<Sweep> = (0..9).map(|step| one(10.0 * f64::from(step))).collect();
    let errors = errors(&sweeps, [OWN, 0.0]);
    let mut random = SplitMix::seeded(5);
    let (mut held, records) = ([0, 0], 150);
    for _ in 0..records {
        let found = master_curve(&drawn(&sweeps, &errors, &mut random), &errors, 4).unwrap();
        // One of a thousand departs from the law by chance.
        let Ok(law) = found.williams_landel_ferry else { continue };
        let holds = |[low, high]: [f64; 2], exact: f64| i32::from((low..=high).contains(&exact));
        held[0] += holds(law.c1_total95, c1);
        held[1] += holds(law.c2_total95, c2);
        assert!(law.c1_total95[0] < law.c1 && law.c1 < law.c1_total95[1], "{law:?}");
    }
    println!("held {held:?} of {records}");
    assert!(held.iter().all(|count| (135..=150).contains(count)), "{held:?}");
}

/// Arrhenius' law is that of Williams, Landel and Ferry with `C2` the reference temperature in kelvins.
#[test]
fn laws_refuse_what_shift_factors_do_not_tell() {
    let temperatures: Vec<f64> = (0..9).map(|step| 10.0 * f64::from(step)).collect();
    let of = |shift: &dyn Fn(f64) -> f64, count: usize| {
        let one = |temperature: &f64| sweep(prony, *temperature, shift(*temperature));
        let sweeps: Vec<Sweep> = temperatures[..count].iter().map(one).collect();
        master_curve(&sweeps, &errors(&sweeps, [1e-3, 0.0]), 0).unwrap()
    };
    let exact = of(&|temperature| arrhenius(60.0, temperature, 0.0), 9);
    let [low, high] = exact.williams_landel_ferry.unwrap().c2_total95;
    assert!((low..high).contains(&273.15), "{low} {high}");
    let two = of(&|temperature| arrhenius(60.0, temperature, 0.0), 2);
    assert!(two.arrhenius.is_ok());
    assert_eq!(two.williams_landel_ferry, Err(LawRefusal::TooFewTemperatures));
    let straight = of(&|temperature| -0.05 * temperature, 3);
    assert_eq!(straight.williams_landel_ferry, Err(LawRefusal::Straight));
    let unmoved = of(&|_| 0.0, 3);
    assert_eq!(unmoved.williams_landel_ferry, Err(LawRefusal::Straight));
    let jump = of(&|temperature| if temperature < 45.0 { 0.0 } else { -2.0 }, 9);
    assert!(matches!(jump.arrhenius, Err(LawRefusal::Departs { .. })), "{jump:?}");
    let inverse = of(&|temperature| -0.03 * temperature / (1.0 - 0.005 * temperature), 9);
    assert_eq!(inverse.williams_landel_ferry, Err(LawRefusal::Inverse));
}

#[test]
fn sweeps_that_are_not_one_curve_are_refused() {
    let refusal = |upper: Sweep| {
        let sweeps = [sweep(prony, 20.0, 0.0), upper];
        master_curve(&sweeps, &errors(&sweeps, [OWN, COMMON]), 0).unwrap_err()
    };
    // A part that stays beside one that moves, and a tissue that stiffens.
    let [stays, moves] = [prony, fractional];
    let mixed = |ln_shift: f64| {
        sweep(
            move |frequency| {
                let (one, other) = (stays(frequency), moves(frequency * f64::exp(ln_shift)));
                [one[0] + other[0], one[1] + other[1]]
            },
            37.0,
            0.0,
        )
    };
    let stiffer = sweep(|frequency| prony(frequency).map(|modulus| 1.5 * modulus), 37.0, 0.0);
    // With one relaxation time, no shift is found at all.
    let one_term = |frequency: f64| {
        let terms = vec![RelaxationMode { modulus_mpa: 0.01, time_secs: 1.0 }];
        RelaxationModulus { equilibrium_mpa: 1e-4, terms, exponent: 1.0 }
            .dynamic_moduli(0.5 * frequency)
    };
    let larger = |frequency: f64| one_term(frequency).map(|modulus| 1.5 * modulus);
    let sweeps = [sweep(one_term, 20.0, 0.0), sweep(larger, 37.0, 0.0)];
    let single = master_curve(&sweeps, &errors(&sweeps, [OWN, COMMON]), 0).unwrap_err();
    let sweeps = [Sweep { temperature_c: 20.0, ..mixed(0.0) }, mixed(-3.0)];
    let parts = master_curve(&sweeps, &errors(&sweeps, [OWN, COMMON]), 0).unwrap_err();
    for refused in [parts, refusal(stiffer), single] {
        assert!(matches!(refused, SuperpositionError::NotOneCurve { .. }), "{refused:?}");
        assert!(refused.to_string().contains("20 and 37 °C are not one curve"), "{refused}");
    }
    let far = refusal(sweep(prony, 37.0, 6.0));
    assert_eq!(far, SuperpositionError::NoOverlap { lower_c: 20.0, upper_c: 37.0 });
    let same = refusal(sweep(prony, 20.0, 0.0));
    assert_eq!(same, SuperpositionError::OneTemperature { temperature_c: 20.0 });
    let mut short = sweep(prony, 37.0, 0.0);
    short.sines.truncate(2);
    assert!(matches!(refusal(short), SuperpositionError::TooFewSines { count: 2, .. }));
    let mut repeated = sweep(prony, 37.0, 0.0);
    repeated.sines[4] = repeated.sines[3];
    assert!(matches!(refusal(repeated), SuperpositionError::RepeatedFrequency { .. }));
    let mut elastic = sweep(prony, 37.0, 0.0);
    elastic.sines[4].loss_mpa = 0.0;
    assert!(refusal(elastic).to_string().contains("a loss modulus is 0"));
    let sweeps = [sweep(prony, 20.0, 0.0), sweep(prony, 37.0, 0.0)];
    assert!(matches!(master_curve(&sweeps, &[], 0), Err(SuperpositionError::Value(_))));
}
