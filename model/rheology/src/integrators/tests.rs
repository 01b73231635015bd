//! Every integrator against its textbook step, its order and its limit of stability.

use super::*;
use crate::reference::Reference;
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;

const THESIS: ModifiedKelvin = ModifiedKelvin::THESIS;
const FIFTH: SeriesBody<5> =
    SeriesBody { tau_eps: 0.9, mu: [0.08, -0.02, 0.003, -2e-4, 5e-6], tau_sig: 0.05 };

/// One step of a scheme, from a force and a depth, to a depth.
fn one_step<R: Real, const N: usize>(
    scheme: Scheme,
    body: &SeriesBody<N>,
    dt: f64,
    (force, from, to): (R, R, R),
) -> R {
    fn step<R: Real, const N: usize, I: Integrator<R, N>>(
        body: &SeriesBody<N>,
        dt: f64,
        (force, depth, to): (R, R, R),
    ) -> R {
        let force = Some(force);
        I::at_any_step(body, dt, IntegratorStart { depth, force }).step(to).unwrap()
    }
    let ends = (force, from, to);
    match scheme {
        Scheme::ExplicitEuler => step::<R, N, RuleIntegrator<R, N, ExplicitEuler>>(body, dt, ends),
        Scheme::ImplicitEuler => step::<R, N, RuleIntegrator<R, N, ImplicitEuler>>(body, dt, ends),
        Scheme::Trapezoid => step::<R, N, RuleIntegrator<R, N, Trapezoid>>(body, dt, ends),
        Scheme::ExponentialLeft => {
            step::<R, N, RuleIntegrator<R, N, ExponentialLeft>>(body, dt, ends)
        }
        Scheme::ExponentialFirstOrder => {
            step::<R, N, RuleIntegrator<R, N, ExponentialFirstOrder>>(body, dt, ends)
        }
        Scheme::Exact => step::<R, N, ExactIntegrator<R, N>>(body, dt, ends),
        Scheme::RungeKutta => step::<R, N, RuleIntegrator<R, N, RungeKutta>>(body, dt, ends),
    }
}

/// The step as its textbook writes it, stages and all, in the form `F' = (u(t) - F) / tau`.
fn textbook<const N: usize>(
    scheme: Scheme,
    body: &SeriesBody<N>,
    dt: f64,
    (force, from, to): (f64, f64, f64),
) -> f64 {
    let (tau, speed) = (body.tau_eps, (to - from) / dt);
    let u = |share: f64| {
        let x = from + (to - from) * share;
        let elastic: f64 = (1..).zip(body.mu).map(|(k, mu)| mu * x.powi(k)).sum();
        elastic + body.tau_sig * x * speed
    };
    let slope = |share: f64, force: f64| (u(share) - force) / tau;
    let h = dt / tau;
    let decay = (-h).exp();
    match scheme {
        Scheme::ExplicitEuler => force + dt * slope(0.0, force),
        // Solved for F(+).
        Scheme::ImplicitEuler => (force + h * u(1.0)) / (1.0 + h),
        Scheme::Trapezoid => ((2.0 - h) * force + h * (u(0.0) + u(1.0))) / (2.0 + h),
        Scheme::ExponentialLeft => decay * force + (1.0 - decay) * u(0.0),
        Scheme::ExponentialFirstOrder => {
            let psi_1 = 1.0 - (1.0 - decay) / h;
            decay * force + (1.0 - decay) * u(0.0) + psi_1 * (u(1.0) - u(0.0))
        }
        Scheme::RungeKutta => {
            let k1 = slope(0.0, force);
            let k2 = slope(0.5, force + 0.5 * dt * k1);
            let k3 = slope(0.5, force + 0.5 * dt * k2);
            let k4 = slope(1.0, force + dt * k3);
            force + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        }
        Scheme::Exact => {
            // The closed form by quadrature: e^-h F + int_0^1 h e^(-h (1 - s)) u(s) ds, exact to rounding
            // with Simpson's rule on so many parts.
            let parts = 2000;
            let at = |i: u32| {
                let s = f64::from(i) / f64::from(parts);
                h * (-h * (1.0 - s)).exp() * u(s)
            };
            let inner: f64 = (1..parts).map(|i| if i % 2 == 1 { 4.0 } else { 2.0 } * at(i)).sum();
            decay * force + (at(0) + inner + at(parts)) / (3.0 * f64::from(parts))
        }
    }
}

#[test]
fn each_takes_its_textbook_step() {
    fn check<const N: usize>(body: &SeriesBody<N>) {
        for scheme in Scheme::ALL {
            for (force, from, to) in
                [(0.0, 0.0, 1.5), (2.0, 3.0, 8.0), (1.0, 12.0, 4.0), (1.0, 0.0, 0.0)]
            {
                for h in [0.1, 0.7, 1.6, 2.5] {
                    let dt = h * body.tau_eps;
                    let step = one_step(scheme, body, dt, (force, from, to));
                    let exact = textbook(scheme, body, dt, (force, from, to));
                    let size = exact.abs().max(force).max(0.01);
                    // Rounding of some ten operations of a few newtons; a coefficient off by 1e-3
                    // is off by ten orders more.
                    assert!(
                        (step - exact).abs() < 1e-13 * size,
                        "{scheme:?} {N} {h}: {step} {exact}"
                    );
                    let narrow = one_step(scheme, body, dt, (force as f32, from as f32, to as f32));
                    let miss = (f64::from(narrow) - exact).abs();
                    assert!(miss < 2e-5 * size, "{scheme:?} {N} {h} in f32: {narrow} {exact}");
                }
            }
        }
    }
    let SeriesBody { tau_eps, tau_sig, .. } = FIFTH;
    check(&SeriesBody { tau_eps, mu: [0.08], tau_sig });
    check(&SeriesBody { tau_eps, mu: [0.08, -0.01], tau_sig });
    check(&SeriesBody::from(THESIS));
    check(&SeriesBody { tau_eps, mu: [0.08, -0.02, 0.003, -2e-4], tau_sig });
    check(&FIFTH);
}

/// Largest error beside the exact force along a ramp of 4 s, in steps of `h` relaxation times.
fn error_on_a_ramp(scheme: Scheme, h: f64) -> f64 {
    let body = SeriesBody::from(THESIS);
    let dt = h * body.tau_eps;
    let count = (4.0 / h).round() as u32;
    let depths: Vec<f64> = (0..=count).map(|i| 2.0 * dt * f64::from(i)).collect();
    let mut forces = Vec::new();
    scheme.respond(&body, dt, &depths, &mut forces).unwrap();
    let mut reference = Reference::new(&[body.term()], Depth(0.0)).unwrap();
    let end = depths.len() - 1;
    reference.step(Depth(depths[end]), Seconds(dt * end as f64)).unwrap();
    reference.error_of(Newtons(forces[end])) / reference.force().0
}

#[test]
fn each_has_its_order() {
    for scheme in Scheme::ALL {
        let Some(order) = scheme.order() else {
            continue;
        };
        // Small enough for the leading term, large enough for the last digits not to show.
        let h = match order {
            1 => 1.0 / 512.0,
            2 => 1.0 / 64.0,
            _ => 1.0 / 32.0,
        };
        let (coarse, fine) = (error_on_a_ramp(scheme, h), error_on_a_ramp(scheme, h / 2.0));
        let measured = (coarse / fine).log2();
        let share = measured / f64::from(order) - 1.0;
        println!("{}: order {measured:.4}, {fine:.1e} at {:.1e}", scheme.name(), h / 2.0);
        assert!(share.abs() < 0.01, "{scheme:?}: order {measured}");
    }
    for h in [1.0 / 512.0, 0.25, 1.0, 4.0] {
        let error = error_on_a_ramp(Scheme::Exact, h);
        assert!(error.abs() < 1e-14, "exact at {h}: {error:e}");
    }
}

#[test]
fn each_is_stable_as_far_as_it_says() {
    let body = SeriesBody::from(THESIS);
    for scheme in Scheme::ALL {
        let amplification =
            |h: f64| one_step(scheme, &body, h * body.tau_eps, (1.0, 0.0, 0.0)).abs();
        let measured = if amplification(1e6) <= 1.0 {
            // Never unstable between, either.
            for i in -90..=90 {
                let h = 10f64.powf(f64::from(i) / 15.0);
                assert!(amplification(h) < 1.0, "{scheme:?} at {h}");
            }
            None
        } else {
            let (mut low, mut high) = (0.1, 1e6);
            while high / low > 1.0 + 1e-12 {
                let middle = f64::sqrt(low * high);
                if amplification(middle) <= 1.0 { low = middle } else { high = middle }
            }
            Some(low)
        };
        println!("{}: stable below {measured:?}", scheme.name());
        match (measured, scheme.stability_limit()) {
            (Some(measured), Some(stated)) => {
                assert!((measured / stated - 1.0).abs() < 1e-10, "{scheme:?}: {measured} {stated}");
            }
            (measured, stated) => assert_eq!(measured, stated, "{scheme:?}"),
        }
    }
}

#[test]
fn the_exact_step_is_the_reference_across_the_surface_too() {
    let path = [0.0, 1.0, 7.5, 7.5, 3.0, -2.0, -3.0, 2.0, 20.0, 20.0, 12.0];
    for dt in [1e-6, 1e-3, 0.4, 30.0, 1e5] {
        for tau_eps in [1e-9, 1e-2, 1.023, 1e4, 1e9] {
            let body = SeriesBody { tau_eps, ..SeriesBody::from(THESIS) };
            let mut forces = Vec::new();
            Scheme::Exact.respond(&body, dt, &path, &mut forces).unwrap();
            let mut reference = Reference::new(&[body.term()], Depth(0.0)).unwrap();
            for (i, &depth) in path.iter().enumerate().skip(1) {
                let exact = reference.step(Depth(depth), Seconds(dt)).unwrap().0;
                let miss = reference.error_of(Newtons(forces[i])).abs();
                let peak = forces[..=i].iter().fold(0.0, |peak: f64, force| peak.max(force.abs()));
                assert!(miss < 1e-14 * peak, "{dt} {tau_eps} at {depth}: {exact} off by {miss:e}");
            }
        }
    }
}

#[test]
fn small_steps_do_not_wear_single_precision_out() {
    // A hold in steps so small that each increment is below the last digit of the force.
    let body = SeriesBody::from(THESIS);
    let mut depths = vec![0f32];
    depths.resize(200_000, 10.0);
    let mut forces = Vec::new();
    Scheme::Exact.respond(&body, 5e-5, &depths, &mut forces).unwrap();
    let mut reference = Reference::new(&[body.term()], Depth(0.0)).unwrap();
    reference.step(Depth(10.0), Seconds(5e-5)).unwrap();
    let exact = reference.step(Depth(10.0), Seconds(5e-5 * 199_998.0)).unwrap().0;
    let miss = f64::from(forces[forces.len() - 1]) / exact - 1.0;
    // Coefficients have 24 digits of two; without compensation the force stops 1e-3 too high.
    assert!(miss.abs() < 2e-6, "{miss:e}");
}

#[test]
fn impossible_steps_are_refused() {
    let body = SeriesBody::from(THESIS);
    let mut forces = vec![1.0];
    let mut refusal = |scheme: Scheme, body: &SeriesBody<3>, dt: f64, depths: &[f64]| {
        scheme.respond(body, dt, depths, &mut forces).unwrap_err()
    };
    let path = [0.0, 1.0];
    for (scheme, dt, most) in
        [(Scheme::ExplicitEuler, 2.1, 2.0), (Scheme::RungeKutta, 3.0, 2.785_293_563_405_282)]
    {
        match refusal(scheme, &body, dt, &path) {
            IntegratorError::Unstable { name, limit, .. } => {
                assert_eq!((name, limit), (scheme.name(), most));
            }
            other => panic!("{scheme:?}: {other:?}"),
        }
    }
    for dt in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-310] {
        let refused = refusal(Scheme::Exact, &body, dt, &path);
        assert!(matches!(refused, IntegratorError::Time(_)), "{refused:?}");
    }
    let bad = SeriesBody { tau_eps: 0.0, ..body };
    let refused = refusal(Scheme::Exact, &bad, 0.1, &path);
    assert!(matches!(refused, IntegratorError::Body(_)), "{refused:?}");
    for scheme in Scheme::ALL {
        for depth in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for path in [[0.0, depth], [depth, 0.0]] {
                let refused = refusal(scheme, &body, 0.1, &path);
                assert!(
                    matches!(refused, IntegratorError::Step(StepError::Depth(_))),
                    "{scheme:?}: {refused:?}"
                );
            }
        }
        let refused = refusal(scheme, &body, 0.1, &[0.0, 1e200, 2e200]);
        assert!(
            matches!(
                refused,
                IntegratorError::Step(StepError::Overflow { .. } | StepError::Rest { .. })
            ),
            "{scheme:?}: {refused:?}"
        );
        let mut out: Vec<f64> = Vec::new();
        scheme.respond(&body, 0.1, &[], &mut out).unwrap();
        assert!(out.is_empty());
    }
}

#[test]
fn a_held_forcing_is_worse_than_explicit_euler_on_a_ramp() {
    // Both are of first order, but the exponential rule lags by half a step of the forcing, and
    // explicit Euler's own lag cancels that.
    let euler = error_on_a_ramp(Scheme::ExplicitEuler, 0.02).abs();
    let held = error_on_a_ramp(Scheme::ExponentialLeft, 0.02).abs();
    assert!(held > 10.0 * euler, "{held:e} {euler:e}");
}
