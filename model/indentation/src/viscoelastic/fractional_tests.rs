use super::*;
use crate::quadrature::gauss_legendre;
use crate::shape::IndenterShape;

fn body(exponent: f64) -> RelaxationModulus {
    let terms = vec![RelaxationMode { modulus_mpa: 0.05, time_secs: 0.7 }];
    RelaxationModulus { equilibrium_mpa: 0.01, terms, exponent }
}

/// The integral of `G(x) (t - x)^power` up to an age, graded towards zero, where `G` falls like `x^alpha`.
fn integral(body: &RelaxationModulus, t: f64, age: f64, power: i32) -> f64 {
    let grade = 2.0 / body.exponent;
    let part = |(y, weight): (f64, f64)| {
        let x = age * y.powf(grade);
        weight * grade * age * y.powf(grade - 1.0) * body.modulus(x) * (t - x).powi(power)
    };
    gauss_legendre(400, 1.0).into_iter().map(part).sum()
}

/// A ramp of constant speed and a hold, by Lee and Radok's integral over the age, with the Mittag-Leffler function itself.
#[test]
fn force_of_a_fractional_model_is_that_of_its_integral() {
    let shapes = [
        (IndenterShape::FlatPunch { radius_mm: 2.0 }, 0),
        (IndenterShape::Cone { half_angle_rad: 1.2 }, 1),
    ];
    let (ramp, speed) = (0.5, 0.6);
    for (shape, power) in shapes {
        let law = PowerLaw::new(shape, 0.5).unwrap();
        for exponent in [0.05, 0.3, 0.6, 0.95, 0.999] {
            let times = [0.0, 0.01, 0.2, ramp, 0.51, 0.7, 2.0, 40.0];
            let depths = times.map(|t| speed * f64::min(t, ramp));
            let history = DepthHistory::new(&times, &depths).unwrap();
            let forces = lee_radok_force(law, &body(exponent), &history).unwrap();
            for (t, force) in times.into_iter().zip(forces).skip(1) {
                let all = integral(&body(exponent), t, t, power);
                let before = integral(&body(exponent), t, (t - ramp).max(0.0), power);
                let exact =
                    law.coefficient() * law.exponent() * speed.powi(power + 1) * (all - before);
                let off = (force / exact - 1.0).abs();
                assert!(off < 1e-6, "{shape:?} {exponent} {t}: {off:e}");
            }
        }
    }
}

/// A step, and both samples at one time.
#[test]
fn step_relaxes_as_the_modulus() {
    let law = PowerLaw::new(IndenterShape::FlatPunch { radius_mm: 2.0 }, 0.5).unwrap();
    let times = [0.0, 0.0, 1e-3, 0.1, 1.0, 100.0];
    let history = DepthHistory::new(&times, &[0.0, 0.3, 0.3, 0.3, 0.3, 0.3]).unwrap();
    for exponent in [0.1, 0.5, 0.99] {
        let forces = lee_radok_force(law, &body(exponent), &history).unwrap();
        for (t, force) in times.into_iter().zip(forces).skip(1) {
            let exact = law.coefficient() * 0.3 * body(exponent).modulus(t);
            assert!((force / exact - 1.0).abs() < 1e-6, "{exponent} {t}: {force} {exact}");
        }
        let once = DepthHistory::new(&[0.0], &[0.3]).unwrap();
        let force = lee_radok_force(law, &body(exponent), &once).unwrap()[0];
        assert!((force / (law.coefficient() * 0.3 * 0.06) - 1.0).abs() < 1e-6, "{force}");
    }
}
