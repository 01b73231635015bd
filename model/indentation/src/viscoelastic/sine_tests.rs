//! Sines against the contact that grows and shrinks.

use super::*;
use crate::shape::IndenterShape;

const PUNCH: IndenterShape = IndenterShape::FlatPunch { radius_mm: 2.0 };
const SPHERE: IndenterShape = IndenterShape::Sphere { radius_mm: 5.0 };
const CONE: IndenterShape = IndenterShape::Cone { half_angle_rad: 1.2 };

/// What a sine about a depth feels is the slope of the law times the dynamic moduli, less up to three quarters of the amplitude over
/// the depth, times the exponent less one: on the way back the contact shrinks, and what it leaves no longer pulls.
#[test]
fn small_sine_about_a_depth_feels_the_slope_of_the_law() {
    let terms = vec![RelaxationMode { modulus_mpa: 0.02, time_secs: 0.5 }];
    let body = RelaxationModulus { equilibrium_mpa: 0.01, terms, exponent: 1.0 };
    for (shape, share) in [(CONE, 0.05), (CONE, 0.02), (SPHERE, 0.05), (PUNCH, 0.05)] {
        let law = PowerLaw::new(shape, 0.5).unwrap();
        let low_by = 0.75 * (law.exponent() - 1.0) * share;
        let mut lowest: f64 = 0.0;
        for frequency in [0.03, 0.1, 0.3, 1.0, 3.0, 10.0] {
            let found = stiffness_of_sine(shape, &body, (0.3, share), frequency);
            let slope = law.coefficient() * law.exponent() * 0.3f64.powf(law.exponent() - 1.0);
            let exact = body.dynamic_moduli(frequency).map(|modulus| slope * modulus);
            let off = (found[0] - exact[0]).hypot(found[1] - exact[1]) / exact[0].hypot(exact[1]);
            // Four cycles have not settled to better than this.
            assert!(off < low_by + 2e-3, "{shape:?} {share} {frequency}: {off}");
            assert!(found[0] < 1.001 * exact[0], "{shape:?} {share} {frequency}");
            lowest = lowest.max(off);
        }
        assert!(lowest > 0.85 * low_by, "{shape:?} {share}: {lowest}");
    }
}

/// Storage and loss in N/mm of the last of four cycles about a depth, long after the ramp to it; the amplitude is a share of it.
fn stiffness_of_sine(
    shape: IndenterShape,
    body: &RelaxationModulus,
    (depth, share): (f64, f64),
    frequency: f64,
) -> [f64; 2] {
    let steps = 200;
    let phase = |k: usize| std::f64::consts::TAU * k as f64 / f64::from(steps);
    let mut knots = vec![(0.0, 0.0), (0.5, depth)];
    knots.extend((1..=40).map(|k| (0.5 + 0.2 * f64::from(k), depth)));
    let sine = |k: usize| {
        let time = 8.5 + k as f64 / f64::from(steps) / frequency;
        (time, depth * (1.0 + share * phase(k).sin()))
    };
    knots.extend((1..=4 * steps as usize).map(sine));
    let (times, depths): (Vec<f64>, Vec<f64>) = knots.into_iter().unzip();
    let law = PowerLaw::new(shape, 0.5).unwrap();
    let forces =
        repeated_contact_force(law, body, &DepthHistory::new(&times, &depths).unwrap()).unwrap();
    let last = &forces[forces.len() - steps as usize..];
    let part = |of: fn(f64) -> f64| {
        let sum: f64 = last.iter().enumerate().map(|(k, force)| force * of(phase(k + 1))).sum();
        2.0 * sum / f64::from(steps) / (depth * share)
    };
    [part(f64::sin), part(f64::cos)]
}
