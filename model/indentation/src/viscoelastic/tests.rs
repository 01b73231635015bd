//! Closed forms, limits, and quadrature by brute force.

use super::*;
use crate::shape::IndenterShape;

const PUNCH: IndenterShape = IndenterShape::FlatPunch { radius_mm: 2.0 };
const SPHERE: IndenterShape = IndenterShape::Sphere { radius_mm: 5.0 };
const CONE: IndenterShape = IndenterShape::Cone { half_angle_rad: 1.2 };

fn law(shape: IndenterShape) -> PowerLaw {
    PowerLaw::new(shape, 0.5).unwrap()
}

fn series(equilibrium_mpa: f64, terms: &[(f64, f64)]) -> RelaxationModulus {
    let term = |&(modulus_mpa, time_secs)| RelaxationMode { modulus_mpa, time_secs };
    RelaxationModulus { equilibrium_mpa, terms: terms.iter().map(term).collect(), exponent: 1.0 }
}

fn three_terms() -> RelaxationModulus {
    series(0.01, &[(0.03, 0.1), (0.02, 1.0), (0.015, 8.0)])
}

/// Straight from knot to knot, with `steps` samples between them.
fn history(knots: &[(f64, f64)], steps: usize) -> (Vec<f64>, Vec<f64>) {
    let mut samples = vec![knots[0]];
    for pair in knots.windows(2) {
        let [(t0, h0), (t1, h1)] = [pair[0], pair[1]];
        samples.extend((1..=steps).map(|step| {
            let share = step as f64 / steps as f64;
            (t0 + share * (t1 - t0), h0 + share * (h1 - h0))
        }));
    }
    samples.into_iter().unzip()
}

fn forces_of(
    run: impl Fn(PowerLaw, &RelaxationModulus, &DepthHistory) -> Result<Vec<f64>, HistoryError>,
    shape: IndenterShape,
    modulus: &RelaxationModulus,
    (times, depths): &(Vec<f64>, Vec<f64>),
) -> Vec<f64> {
    run(law(shape), modulus, &DepthHistory::new(times, depths).unwrap()).unwrap()
}

/// A body that never relaxes has the force of the elastic law at each depth, on both ways.
#[test]
fn elastic_body_loads_and_unloads_along_one_curve() {
    let path = history(&[(0.0, 0.0), (1.0, 0.4), (1.5, 0.4), (3.0, 0.0)], 40);
    for shape in [PUNCH, SPHERE, CONE] {
        let forces = forces_of(ting_force, shape, &series(0.02, &[]), &path);
        for (force, depth) in forces.iter().zip(&path.1) {
            let shape = match shape {
                IndenterShape::Sphere { radius_mm } => IndenterShape::Parabola { radius_mm },
                other => other,
            };
            // Young's modulus is three times the shear modulus.
            let elastic = shape.on_half_space(*depth, 0.5).map_or(0.0, |c| c.force_over_modulus);
            assert!((force - 0.06 * elastic).abs() < 1e-12, "{shape:?} {depth}: {force}");
        }
    }
}

/// A ramp at the speed `v` on one Maxwell term: `v tau (1 - e)` for a punch and `2 v^2 tau (t - tau (1 - e))` for a cone, with
/// `e = exp(-t / tau)`; for a sphere `3/2 v^(3/2) times the integral of exp(-(t - s) / tau) sqrt(s)`, as the series
/// `sqrt(t) t times the sum of 2/3 (-t / tau)^k / ((5/2) (7/2) ... (k + 3/2))`.
#[test]
fn ramp_on_a_maxwell_term_has_its_closed_form() {
    let (speed, modulus) = (0.3, 0.05);
    for time in [0.02, 0.7, 5.0] {
        for steps in [1, 7, 400] {
            let path = history(&[(0.0, 0.0), (2.0, 2.0 * speed)], steps);
            let gone = |t: f64| -(-t / time).exp_m1();
            for (shape, exact) in [
                (PUNCH, &(|t: f64| speed * time * gone(t)) as &dyn Fn(f64) -> f64),
                (CONE, &|t: f64| 2.0 * speed * speed * time * (t - time * gone(t))),
                (SPHERE, &|t: f64| {
                    let (mut term, mut sum) = (2.0 / 3.0, 0.0);
                    for k in 0..200 {
                        sum += term;
                        term *= -(t / time) / (f64::from(k) + 2.5);
                    }
                    1.5 * speed.powf(1.5) * t.sqrt() * t * sum
                }),
            ] {
                // The series of the sphere loses its digits where many terms cancel.
                if shape == SPHERE && time < 0.5 {
                    continue;
                }
                let forces =
                    forces_of(lee_radok_force, shape, &series(0.0, &[(modulus, time)]), &path);
                for (force, t) in forces.iter().zip(&path.0).skip(1) {
                    let exact = law(shape).coefficient() * modulus * exact(*t);
                    let off = (force / exact - 1.0).abs();
                    assert!(off < 1e-11, "{shape:?} {time} {steps} {t}: {off:e}");
                }
            }
        }
    }
}

#[test]
fn step_has_the_force_of_the_relaxation_modulus() {
    let times: Vec<f64> = (0..200).map(|k| 0.05 * f64::from(k)).collect();
    let path = (times, vec![0.3; 200]);
    for shape in [PUNCH, SPHERE, CONE] {
        let law = law(shape);
        for run in [lee_radok_force, ting_force] {
            let forces = forces_of(run, shape, &three_terms(), &path);
            for (force, t) in forces.iter().zip(&path.0) {
                let scale = law.coefficient() * 0.3f64.powf(law.exponent());
                let exact = scale * three_terms().modulus(*t);
                assert!((force / exact - 1.0).abs() < 1e-12, "{t}: {force} {exact}");
            }
        }
    }
}

/// A triangle on one Maxwell term: `t1 = t + tau ln(2 exp(-(t - peak) / tau) - 1)`.
#[test]
fn triangle_on_a_maxwell_term_has_its_closed_form() {
    let (speed, modulus, time, peak) = (0.2, 0.05, 0.8, 1.0);
    for steps in [1, 50] {
        let path = history(&[(0.0, 0.0), (peak, speed * peak), (2.0, 0.0)], steps);
        let forces = forces_of(ting_force, CONE, &series(0.0, &[(modulus, time)]), &path);
        for (force, t) in forces.iter().zip(&path.0).skip(steps) {
            let inner = 2.0 * (-(t - peak) / time).exp() - 1.0;
            let start = if inner > 0.0 { t + time * inner.ln() } else { 0.0 };
            let exact = if start <= 0.0 {
                0.0
            } else {
                let gone = -(-start / time).exp_m1();
                let integral = 2.0 * speed * speed * time * (start - time * gone);
                law(CONE).coefficient() * modulus * (-(t - start) / time).exp() * integral
            };
            assert!((force - exact).abs() < 1e-12, "{steps} {t}: {force} {exact}");
        }
        assert_eq!(forces.last(), Some(&0.0));
    }
}

/// The force by brute force, independent of `t1`: an axisymmetric contact is a row of springs of the specimen's modulus that
/// touch where the indenter is deeper than its profile, and let go where their force ends (Popov and Hess, Method of
/// Dimensionality Reduction in Contact Mechanics and Friction, 2015, chapter 7). Their forces are sums over small steps.
fn by_springs(shape: IndenterShape, knots: &[(f64, f64)], t: f64) -> f64 {
    let law = law(shape);
    let depth = |s: f64| {
        let pair = knots.windows(2).find(|pair| s <= pair[1].0).unwrap();
        let [(t0, h0), (t1, h1)] = [pair[0], pair[1]];
        h0 + (s - t0) / (t1 - t0) * (h1 - h0)
    };
    let (springs, steps) = (1500, 4000);
    let deepest = knots.iter().map(|knot| knot.1).fold(0.0, f64::max);
    let power = 1.0 / (law.exponent() - 1.0);
    // What a spring would hold if it touched from a step on, from the last step to the first.
    let step = t / f64::from(steps);
    let mut held = vec![0.0];
    for number in (0..steps).rev() {
        let (from, to) = (step * f64::from(number), step * f64::from(number + 1));
        let change = depth(to) - depth(from);
        held.push(held[held.len() - 1] + three_terms().modulus(t - 0.5 * (from + to)) * change);
    }
    held.reverse();
    let width = deepest.powf(1.0 / power) / f64::from(springs);
    let force = |number: i32| {
        let profile = (width * (f64::from(number) + 0.5)).powf(power);
        // The first time at which the indenter is as deep, between two steps.
        let first = (1..=steps).find(|number| depth(step * f64::from(*number)) >= profile)?;
        let (low, high) = (depth(step * f64::from(first - 1)), depth(step * f64::from(first)));
        let share = (profile - low) / (high - low);
        let (early, late) = (held[first as usize - 1], held[first as usize]);
        Some((early + share * (late - early)).max(0.0))
    };
    let sum: f64 = (0..springs).filter_map(force).sum();
    law.coefficient() * law.exponent() * width * sum
}

#[test]
fn loading_hold_and_unloading_are_those_of_a_row_of_springs() {
    let knots = [(0.0, 0.0), (0.5, 0.1), (1.0, 0.3), (1.6, 0.3), (2.6, 0.0)];
    let path = history(&knots, 20);
    let mut worst: f64 = 0.0;
    for shape in [SPHERE, CONE] {
        let forces = forces_of(ting_force, shape, &three_terms(), &path);
        let largest = forces.iter().copied().fold(0.0, f64::max);
        for index in [5, 20, 33, 40, 55, 60, 61, 63, 66, 70, 75] {
            let brute = by_springs(shape, &knots, path.0[index]);
            worst = worst.max((forces[index] - brute).abs() / largest);
        }
    }
    println!("springs: {worst:e}");
    assert!(worst < 2e-6, "{worst:e}");
}

#[test]
fn force_ends_before_the_depth_and_stays_at_zero() {
    let path = history(&[(0.0, 0.0), (1.0, 0.3), (2.0, 0.0)], 100);
    for shape in [PUNCH, SPHERE, CONE] {
        let forces = forces_of(ting_force, shape, &three_terms(), &path);
        let lost = forces.iter().skip(1).position(|force| *force == 0.0).unwrap() + 1;
        assert!(path.1[lost] > 0.02, "{shape:?}: {}", path.1[lost]);
        assert!(forces[lost..].iter().all(|force| *force == 0.0), "{shape:?}");
        let falling = forces[100..lost].windows(2).all(|pair| pair[1] < pair[0]);
        assert!(falling && forces[1..lost].iter().all(|force| *force > 0.0), "{shape:?}");
        // Lee and Radok pull where Ting lets go.
        let pulled = forces_of(lee_radok_force, shape, &three_terms(), &path);
        assert!(pulled[200] < 0.0, "{shape:?}");
    }
}

/// A punch keeps its contact on a smaller depth: Lee and Radok hold, and may grow again.
#[test]
fn punch_may_move_as_it_likes_while_it_touches() {
    let path = history(&[(0.0, 0.0), (1.0, 0.3), (1.1, 0.25), (2.0, 0.25), (3.0, 0.4)], 10);
    let forces = forces_of(ting_force, PUNCH, &three_terms(), &path);
    assert_eq!(forces, forces_of(lee_radok_force, PUNCH, &three_terms(), &path));
}

#[test]
fn contact_that_grows_again_is_refused_in_words() {
    let refusal = |shape: IndenterShape, knots: &[(f64, f64)]| {
        let (times, depths) = history(knots, 10);
        let history = DepthHistory::new(&times, &depths).unwrap();
        ting_force(law(shape), &three_terms(), &history).unwrap_err().to_string()
    };
    let again = refusal(CONE, &[(0.0, 0.0), (1.0, 0.3), (2.0, 0.2), (3.0, 0.4)]);
    assert!(again.starts_with("the contact grows again at 2.1 s after it shrank"), "{again}");
    // The specimen creeps back to an indenter that waits, and to a punch that it has let go.
    let waits = [(0.0, 0.0), (1.0, 0.3), (2.0, 0.25), (12.0, 0.25)];
    assert!(refusal(SPHERE, &waits).starts_with("the contact grows again"));
    let lets_go = [(0.0, 0.0), (1.0, 0.3), (1.2, 0.03), (12.0, 0.03)];
    assert!(refusal(PUNCH, &lets_go).starts_with("the contact grows again"));
}

#[test]
fn bad_histories_and_moduli_are_refused_in_words() {
    let message = |times: &[f64], depths: &[f64]| {
        DepthHistory::new(times, depths).map_or_else(|err| err.to_string(), |_| String::new())
    };
    assert!(message(&[], &[]).starts_with("there are 0 times and 0 depths"));
    assert!(message(&[0.0, 1.0], &[0.0]).starts_with("there are 2 times and 1 depths"));
    assert_eq!(
        message(&[0.0, 1.0], &[0.0, -0.1]),
        "the depth of sample 1 is -0.1; give mm from the contact on, not below 0"
    );
    assert!(message(&[0.0, -1.0], &[0.0, 0.1]).starts_with("the time of sample 1 is -1"));
    assert!(message(&[f64::NAN], &[0.0]).starts_with("the time of sample 0 is NaN"));
    let history = DepthHistory::new(&[0.0, 1.0], &[0.0, 0.1]).unwrap();
    for bad in [
        series(-0.1, &[]),
        series(0.0, &[]),
        series(0.1, &[(0.1, 0.0)]),
        series(0.1, &[(f64::NAN, 1.0)]),
        series(0.1, &[(0.1, f64::INFINITY)]),
    ] {
        assert!(lee_radok_force(law(CONE), &bad, &history).is_err(), "{bad:?}");
        assert!(ting_force(law(CONE), &bad, &history).is_err(), "{bad:?}");
    }
    assert!(PowerLaw::new(IndenterShape::FlatPunch { radius_mm: -1.0 }, 0.5).is_err());
    assert!(PowerLaw::new(CONE, 0.7).is_err());
}

/// The recursion is the integral over the whole past, taken again at each sample.
#[test]
fn any_modulus_is_integrated_as_the_recursion_does() {
    let path = history(&[(0.0, 0.0), (1.0, 0.3), (1.5, 0.3), (2.0, 0.1)], 60);
    let past = DepthHistory::new(&path.0, &path.1).unwrap();
    for shape in [PUNCH, SPHERE, CONE] {
        let forces = forces_of(lee_radok_force, shape, &three_terms(), &path);
        let direct = lee_radok_force_of(law(shape), |t| three_terms().modulus(t), &past);
        for (force, direct) in forces.iter().zip(&direct) {
            assert!((force - direct).abs() < 1e-12, "{shape:?}: {force} {direct}");
        }
    }
}

#[test]
fn slope_over_the_time_is_that_of_the_memory() {
    use super::history::{Knot, Mode};
    let knots: Vec<Knot> = [(0.0, 0.0), (1.0, 0.2), (1.0, 0.3), (3.0, 0.3), (4.0, 0.1)]
        .map(|(time, depth)| Knot { time, depth })
        .to_vec();
    for exponent in [1.0, 1.5, 2.0] {
        for time in [0.01, 0.4, 30.0, f64::INFINITY] {
            let memories = Mode::new(time, exponent).memories(&knots);
            let step: f64 = 1e-5;
            let at = |sign: f64| Mode::new(time * (sign * step).exp(), exponent).memories(&knots);
            for (index, (above, below)) in at(1.0).iter().zip(&at(-1.0)).enumerate() {
                let slope = (above.value - below.value) / (2.0 * step);
                let off = (memories[index].slope - slope).abs();
                assert!(off < 1e-9, "{exponent} {time} {index}: {off:e}");
            }
        }
    }
}

/// Where Ting's law holds the springs are as he says, the nearer the closer the samples.
#[test]
fn springs_follow_ting_where_the_contact_grows_once() {
    let knots = [(0.0, 0.0), (1.0, 0.3), (1.6, 0.3), (2.6, 0.0)];
    for shape in [PUNCH, SPHERE, CONE] {
        let off = |steps: usize| {
            let path = history(&knots, steps);
            let ting = forces_of(ting_force, shape, &three_terms(), &path);
            let springs = forces_of(repeated_contact_force, shape, &three_terms(), &path);
            let largest = ting.iter().copied().fold(0.0, f64::max);
            let off = ting.iter().zip(&springs).map(|(a, b)| (a - b).abs() / largest);
            off.fold(0.0, f64::max)
        };
        let [coarse, fine] = [off(25), off(100)];
        println!("{shape:?}: {coarse:e} {fine:e}");
        // One spring is a punch; for the others four times the samples leave a sixteenth.
        let is_second_order = shape == PUNCH || (14.0..18.0).contains(&(coarse / fine));
        assert!(is_second_order && fine < 2e-5, "{shape:?}: {coarse:e} {fine:e}");
    }
}

#[test]
fn elastic_body_repeats_its_curve() {
    let path =
        history(&[(0.0, 0.0), (1.0, 0.3), (1.5, 0.1), (2.0, 0.4), (3.0, 0.0), (4.0, 0.2)], 9);
    for shape in [PUNCH, SPHERE, CONE] {
        let law = law(shape);
        let forces = forces_of(repeated_contact_force, shape, &series(0.02, &[]), &path);
        for (force, depth) in forces.iter().zip(&path.1) {
            let elastic = 0.02 * law.coefficient() * depth.powf(law.exponent());
            assert!((force - elastic).abs() < 1e-7, "{shape:?} {depth}: {force} {elastic}");
        }
    }
}

/// A Zener body (moduli `E` and `G`, time `tau`) beneath a punch that steps in to `h` at 0 s, out at 1 s and in again at 3 s:
/// out of contact the surface stands at `u = h G (1 - exp(-1 s / tau)) / (E + G)` and creeps back with the time
/// `tau (E + G) / E`, and the second step finds `(E + G) (depth - u)`.
#[test]
fn surface_that_creeps_back_is_met_by_a_second_step() {
    let (equilibrium, modulus, time, depth) = (0.02, 0.05, 0.7, 0.3);
    let sum = equilibrium + modulus;
    let jump = depth * modulus * -(-1.0f64 / time).exp_m1() / sum;
    let surface = jump * (-2.0 / (time * sum / equilibrium)).exp();
    for second in [0.3, 1.1 * surface, 0.9 * surface] {
        let knots =
            [(0.0, depth), (1.0, depth), (1.0, 0.0), (3.0, 0.0), (3.0, second), (3.1, second)];
        let path = history(&knots, 400);
        let body = series(equilibrium, &[(modulus, time)]);
        let forces = forces_of(repeated_contact_force, PUNCH, &body, &path);
        let exact = law(PUNCH).coefficient() * sum * (second - surface).max(0.0);
        let found = forces[1600];
        assert!((found - exact).abs() < 1e-6, "{second}: {found} {exact}");
        assert!(forces[800..=1200].iter().all(|force| *force == 0.0));
    }
}

/// Cycles, and a wait on the way back.
#[test]
fn contact_that_grows_again_converges_with_the_samples() {
    let knots = [
        (0.0, 0.0),
        (1.0, 0.3),
        (2.0, 0.12),
        (6.0, 0.12),
        (7.0, 0.35),
        (8.0, 0.0),
        (9.0, 0.0),
        (10.0, 0.3),
    ];
    for shape in [SPHERE, CONE] {
        let forces = |steps: usize| {
            let path = history(&knots, steps);
            let all = forces_of(repeated_contact_force, shape, &three_terms(), &path);
            all.into_iter().step_by(steps).collect::<Vec<f64>>()
        };
        let [coarse, fine, finest] = [25, 100, 400].map(forces);
        let largest = finest.iter().copied().fold(0.0, f64::max);
        for ((coarse, fine), finest) in coarse.iter().zip(&fine).zip(&finest) {
            let off = [(coarse - finest).abs() / largest, (fine - finest).abs() / largest];
            assert!(off[0] < 1e-3 && off[1] < 1e-4, "{shape:?}: {off:?}");
        }
        // The wait lets the specimen rise, and the force with it.
        assert!(finest[3] > 1.1 * finest[2], "{finest:?}");
        assert!(finest[5] == 0.0 && finest[6] == 0.0 && finest[7] > 0.0, "{finest:?}");
    }
}

/// Samples far apart against a relaxation time, and a depth that rests at zero.
#[test]
fn coarse_samples_change_nothing() {
    let modulus = series(0.01, &[(0.03, 0.001), (0.02, 3.0)]);
    for shape in [PUNCH, SPHERE, CONE] {
        let knots = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.3), (4.0, 0.3), (5.0, 0.0)];
        let (coarse, fine) = (history(&knots, 1), history(&knots, 997));
        let coarse = forces_of(ting_force, shape, &modulus, &coarse);
        let fine = forces_of(ting_force, shape, &modulus, &fine);
        for (knot, force) in coarse.iter().enumerate() {
            assert!((force - fine[997 * knot]).abs() < 1e-12, "{shape:?} {knot}: {force}");
        }
    }
}
