//! The force law against closed forms: rows M1 to M7. Orders of convergence, limits of stability, the textbook step and
//! the step across the surface are tested with the integrators (`model/rheology/src/integrators/tests.rs`), extremes of every
//! number in `model/rheology/src/extremes/`; here is what the law adds and what only it can show.

use palpate_haptics::{Flags, ForceLaw, LawError, LawSettings, PassivityObserver, Period};
use palpate_model::random::SplitMix;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{Depth, MmPerS, Newtons};
use palpate_rheology::integrators::{
    ExactIntegrator, ExplicitEuler, ExponentialFirstOrder, ExponentialLeft, ImplicitEuler,
    Integrator, IntegratorStart, RuleIntegrator, RungeKutta, Scheme, SeriesBody, Trapezoid,
};

const THESIS: ModifiedKelvin = ModifiedKelvin::THESIS;

fn settings(period_ns: u64) -> LawSettings {
    LawSettings {
        force_max: Newtons(1e6),
        speed_max: MmPerS(1e9),
        depth_max: Depth(1e3),
        ..LawSettings::of::<3>(THESIS, Period::of_nanos(period_ns).expect("a period"))
    }
}

fn law(settings: LawSettings) -> ForceLaw {
    ForceLaw::new(settings, Depth(0.0)).expect("a law")
}

/// M1: what a force alone is multiplied by in a step.
#[test]
fn amplification_of_every_scheme() {
    fn alone<I: Integrator<f64, 3>>(dt: f64, steps: u32) -> f64 {
        let start = IntegratorStart { depth: 0.0, force: Some(1.0) };
        let mut one = I::at_any_step(&SeriesBody::from(THESIS), dt, start);
        (0..steps).fold(1.0, |_, _| one.step(0.0).expect("a force"))
    }
    fn of(scheme: Scheme, dt: f64, steps: u32) -> f64 {
        match scheme {
            Scheme::ExplicitEuler => alone::<RuleIntegrator<f64, 3, ExplicitEuler>>(dt, steps),
            Scheme::ImplicitEuler => alone::<RuleIntegrator<f64, 3, ImplicitEuler>>(dt, steps),
            Scheme::Trapezoid => alone::<RuleIntegrator<f64, 3, Trapezoid>>(dt, steps),
            Scheme::ExponentialLeft => alone::<RuleIntegrator<f64, 3, ExponentialLeft>>(dt, steps),
            Scheme::ExponentialFirstOrder => {
                alone::<RuleIntegrator<f64, 3, ExponentialFirstOrder>>(dt, steps)
            }
            Scheme::Exact => alone::<ExactIntegrator<f64, 3>>(dt, steps),
            Scheme::RungeKutta => alone::<RuleIntegrator<f64, 3, RungeKutta>>(dt, steps),
        }
    }
    for h in [0.01, 0.1, 0.5, 1.0, 1.9, 2.0, 2.1, 2.785, 5.0, 100.0f64] {
        let dt = h * THESIS.tau_eps;
        for scheme in Scheme::ALL {
            let expected = match scheme {
                Scheme::ExplicitEuler => 1.0 - h,
                Scheme::ImplicitEuler => 1.0 / (1.0 + h),
                Scheme::Trapezoid => (2.0 - h) / (2.0 + h),
                Scheme::RungeKutta => 1.0 - h + h * h / 2.0 - h.powi(3) / 6.0 + h.powi(4) / 24.0,
                _ => (-h).exp(),
            };
            let found = of(scheme, dt, 1);
            let miss = (found - expected).abs();
            assert!(miss < 1e-12 * expected.abs().max(1.0), "{scheme:?} {h}: {found}");
        }
        // Explicit Euler alternates between 1 and 2 relaxation times, and grows beyond.
        let (one, ten) = (of(Scheme::ExplicitEuler, dt, 1), of(Scheme::ExplicitEuler, dt, 10));
        assert_eq!(one < 0.0, h > 1.0);
        assert_eq!(ten.abs() > 1.0 + 1e-9, h > 2.0, "{h}: {ten}");
    }
}

/// The force of a ramp from rest: `sum_k a_k sum_j (-tau)^j k!/(k-j)! t^(k-j)` less its start, fading.
fn ramp_force(speed: f64, t: f64) -> f64 {
    let [mu1, mu2, mu3] = THESIS.mu;
    let tau = THESIS.tau_eps;
    let rates =
        [mu1 * speed + THESIS.tau_sig * speed * speed, mu2 * speed * speed, mu3 * speed.powi(3)];
    let particular = |t: f64| -> f64 {
        let term = |k: i32, a: f64| -> f64 {
            let mut falling = 1.0;
            (0..=k)
                .map(|j| {
                    let one = a * (-tau).powi(j) * falling * t.powi(k - j);
                    falling *= f64::from(k - j);
                    one
                })
                .sum()
        };
        (1..).zip(rates).map(|(k, a)| term(k, a)).sum()
    };
    particular(t) - particular(0.0) * (-t / tau).exp()
}

/// M2: ramps at any speed are the closed form, at any tick; the pull policy never acts on them.
#[test]
fn ramps_are_the_closed_form() {
    for speed in [0.1, 1.0, 10.0, 100.0] {
        for period_ns in [100_000, 1_000_000, 4_000_000] {
            let mut law = law(settings(period_ns));
            let dt = period_ns as f64 * 1e-9;
            let ticks = (10.0 / speed / dt).round() as u32;
            for i in 1..=ticks.min(100_000) {
                let t = f64::from(i) * dt;
                let one = law.tick(Depth(speed * t));
                let expected = ramp_force(speed, t);
                // The closed form itself loses digits to its cancellation near zero: of terms up to
                // a3 tau^3 6 it keeps 1e-16 of the largest.
                let size = 6.0 * THESIS.mu[2] * (speed * THESIS.tau_eps).powi(3) + 0.1 * speed;
                let miss = (one.force.0 - expected).abs();
                assert!(
                    miss < 1e-13 * (size + expected.abs()) + 1e-15 * f64::from(i) * size,
                    "{speed} mm/s, {period_ns} ns, tick {i}: {} {expected}",
                    one.force
                );
                assert_eq!(one.flags, Flags::NONE);
            }
        }
    }
}

/// The mutant: the exponential with the forcing held at the left edge misses a ramp by half a tick of it.
#[test]
fn the_left_edge_exponential_misses_a_ramp() {
    for scheme in [Scheme::Exact, Scheme::ExponentialLeft] {
        let mut law = law(LawSettings { scheme, ..settings(4_000_000) });
        let mut worst = 0.0f64;
        for i in 1..=250 {
            let t = f64::from(i) * 0.004;
            let (force, expected) = (law.tick(Depth(10.0 * t)).force.0, ramp_force(10.0, t));
            // Beyond the first tenth of a second, where the closed form has its digits.
            if t > 0.1 {
                worst = worst.max((force / expected - 1.0).abs());
            }
        }
        println!("{}: off by {worst:.1e}", scheme.name());
        assert_eq!(worst < 1e-11, scheme == Scheme::Exact, "{worst:e}");
        assert!(scheme == Scheme::Exact || worst > 1e-3);
    }
}

/// M3: a step in one tick and a hold, towards `F(0+) = tau_sig X^2 / (2 tau_eps)` as the tick gets short.
#[test]
fn a_step_and_a_hold() {
    let (depth, tau) = (10.0, THESIS.tau_eps);
    let settled = THESIS.elastic(Depth(depth)).0;
    let jump = THESIS.tau_sig * depth * depth / (2.0 * tau);
    let misses = [1000, 100, 10].map(|us: u64| {
        let mut law = law(settings(us * 1000));
        let first = law.tick(Depth(depth)).force.0;
        let mut last = first;
        let dt = us as f64 * 1e-6;
        let ticks = (1.5 / dt).round() as u32;
        for i in 1..=ticks {
            last = law.tick(Depth(depth)).force.0;
            let faded = (-f64::from(i) * dt / tau).exp();
            let expected = settled + (first - settled) * faded;
            assert!((last - expected).abs() < 1e-12, "{us} us, tick {i}");
        }
        assert!((last - settled).abs() < 0.3 * (jump - settled));
        (first / jump - 1.0).abs()
    });
    // The jump takes a tick, in which the force relaxes by a part of T / tau.
    assert!(misses[0] < 1e-3);
    for pair in misses.windows(2) {
        assert!((pair[0] / pair[1] - 10.0).abs() < 0.1, "{misses:?}");
    }
}

/// M4: a small sine about a depth loses `pi A^2 w (c0 - k0 tau) / (1 + w^2 tau^2)` a cycle.
#[test]
fn a_small_sine_loses_what_its_formula_says() {
    let tau = THESIS.tau_eps;
    for depth in [0.4, 2.0, 10.0, 25.0] {
        for hz in [0.5, 2.0, 10.0] {
            let [mu1, mu2, mu3] = THESIS.mu;
            let stiffness = mu1 + 2.0 * mu2 * depth + 3.0 * mu3 * depth * depth;
            let damping = THESIS.tau_sig * depth;
            let w = std::f64::consts::TAU * hz;
            let amplitude = 1e-4 * depth;
            let expected =
                std::f64::consts::PI * amplitude * amplitude * w * (damping - stiffness * tau)
                    / (1.0 + (w * tau).powi(2));
            // 20 000 ticks a cycle: the work of a chord is that of the arc but for (2 pi / 20000)^2 / 12.
            let per_cycle = 20_000u32;
            let period = Period::of_nanos((1e9 / hz / f64::from(per_cycle)).round() as u64);
            let mut settings = settings(1000);
            settings.period = period.expect("a period");
            settings.is_pull_allowed = true;
            let mut law = ForceLaw::new(settings, Depth(depth)).expect("a law");
            let cycles = (12.0 * tau * hz).ceil() as u32 + 1;
            let (mut work, mut x, mut force) = (0.0, depth, THESIS.elastic(Depth(depth)).0);
            for i in 1..=cycles * per_cycle {
                let turn = f64::from(i % per_cycle) / f64::from(per_cycle);
                let to = depth + amplitude * (std::f64::consts::TAU * turn).sin();
                let next = law.tick(Depth(to)).force.0;
                if i > (cycles - 1) * per_cycle {
                    work += 0.5 * (force + next) * (to - x);
                }
                (x, force) = (to, next);
            }
            let miss = (work / expected - 1.0).abs();
            // The amplitude squared over the depth squared, 1e-8, and what is left of the start, e^-12.
            assert!(miss < 2e-5, "{depth} mm {hz} Hz: {work:e} {expected:e} {miss:e}");
        }
    }
}

/// M5: a slow poke returns energy where `tau_sig X^2 / 2 < tau_eps g(X)`, and the observer sees it.
#[test]
fn slow_pokes_and_the_observer_agree() {
    let mut signs = Vec::new();
    for depth in [0.5f64, 1.0, 1.35, 1.5, 2.0, 5.0] {
        let speed = 2e-3f64;
        let mut settings = settings(1_000_000);
        // Slow ones take hours of ticks at 1 kHz; 50 ms are as exact.
        settings.period = Period::of_nanos(50_000_000).expect("a period");
        let mut law = law(settings);
        let mut observer = PassivityObserver::default();
        let each = speed * 0.05;
        let ticks = (depth / each).round() as i64;
        let (mut work, mut last) = (0.0, 0.0);
        for i in 1..=2 * ticks {
            let moved = if i <= ticks { each } else { -each };
            let x = each * (i.min(2 * ticks - i)) as f64;
            let force = law.tick(Depth(x)).force.0;
            work += 0.5 * (force + last) * moved;
            last = force;
            observer.record_move(moved);
            observer.hold(force);
        }
        let predicted =
            0.5 * THESIS.tau_sig * depth * depth - THESIS.tau_eps * THESIS.elastic(Depth(depth)).0;
        // 2 v times that, to first order in v.
        let share = work / (2.0 * speed * predicted);
        assert!((share - 1.0).abs() < 0.1, "{depth}: {share}");
        // The observer counts a held force, less by half a move's force change: k dx^2 / 2 each.
        assert_eq!(observer.energy() < 0.0, predicted < 0.0, "{depth}: {}", observer.energy());
        signs.push(predicted < 0.0);
    }
    assert_eq!(signs, [true, true, true, false, false, false]);
}

/// M6: without a relaxation time the force is the forcing.
#[test]
fn without_memory_the_force_is_the_forcing() {
    let dt = 1e-3;
    let path = [0.0, 0.5, 1.5, 1.5, 4.0, 3.9, 8.0];
    let forcing =
        |from: f64, to: f64| THESIS.elastic(Depth(to)).0 + THESIS.tau_sig * to * (to - from) / dt;
    // Below 1e-311 s the quotient of tick and relaxation time is beyond the numbers: no memory, exactly.
    for (tau_eps, tolerance) in [(1e-9, 2e-6), (1e-300, 1e-15), (1e-320, 1e-15), (0.0, 1e-15)] {
        let body = ModifiedKelvin { tau_eps, ..THESIS };
        let mut law = law(LawSettings {
            is_pull_allowed: true,
            body: SeriesBody::from(body).padded(),
            ..settings(1_000_000)
        });
        for pair in path.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let force = law.tick(Depth(to)).force.0;
            let expected = forcing(from, to);
            let miss = (force - expected).abs();
            // Forces are up to 2 kN; at 1e-9 s the force is that of 1e-9 s before.
            assert!(miss <= tolerance * 2000.0, "{tau_eps:e}: {force} {expected}");
        }
    }
    let negative = LawSettings {
        body: SeriesBody { tau_eps: -1.0, ..SeriesBody::from(THESIS).padded() },
        ..settings(1_000_000)
    };
    assert!(matches!(ForceLaw::new(negative, Depth(0.0)), Err(LawError::Integrator(_))));
}

/// M7: whatever the body and whatever comes, a force that is finite, bounded and never pulls.
#[test]
fn wild_bodies_and_wild_depths_give_a_bounded_force() {
    let numbers = [
        0.0,
        1e-320,
        f64::MIN_POSITIVE,
        1e-12,
        1.0,
        1e12,
        1e300,
        f64::MAX,
        -1.0,
        -1e300,
        -f64::MAX,
    ];
    let depths = [
        0.1,
        f64::NAN,
        1.0,
        f64::INFINITY,
        -1.0,
        f64::NEG_INFINITY,
        f64::MAX,
        5.0,
        -0.0,
        f64::MIN_POSITIVE,
        1000.0,
        -f64::MAX,
        3.0,
        1e-310,
    ];
    let mut random = SplitMix::seeded(5);
    let (mut laws, mut faults) = (0, 0);
    for scheme in Scheme::ALL {
        for _ in 0..800 {
            let mut number = || numbers[random.below(numbers.len())];
            let body = SeriesBody {
                tau_eps: number().abs(),
                mu: [(); 5].map(|()| number()),
                tau_sig: number(),
            };
            let wild =
                LawSettings { body, scheme, ..LawSettings::of::<3>(THESIS, Period::MILLISECOND) };
            let Ok(mut law) = ForceLaw::new(wild, Depth(0.0)) else {
                continue;
            };
            laws += 1;
            for depth in depths.iter().cycle().take(40) {
                let one = law.tick(Depth(*depth));
                assert!((0.0..=10.0).contains(&one.force.0), "{wild:?} {one:?}");
                assert!(one.depth.0.abs() <= 30.0 && one.model.is_finite());
                assert_eq!(one.flags.has(Flags::DEPTH_NAN), depth.is_nan());
                faults += u32::from(one.flags.has(Flags::NO_FORCE));
            }
        }
    }
    println!("{laws} laws, {faults} ticks without a force");
    assert!(laws > 1000 && faults > 100);
}

/// M7: a jump of a metre in a tick is followed at the fastest speed allowed, and said.
#[test]
fn a_jump_is_followed_as_fast_as_allowed() {
    let settings = LawSettings::of::<3>(THESIS, Period::MILLISECOND);
    let mut law = law(settings);
    let one = law.tick(Depth(1000.0));
    assert!(one.flags.has(Flags::JUMP | Flags::DEPTH_RANGE));
    assert_eq!(one.depth, Depth(1.0));
    let depths: Vec<f64> = (0..40).map(|_| law.tick(Depth(30.0)).depth.0).collect();
    assert_eq!((depths[28], depths[39]), (30.0, 30.0));
    // Relaxed and then withdrawn as fast: the model pulls, the law does not.
    for _ in 0..5000 {
        let _ = law.tick(Depth(30.0));
    }
    let pulls = (0..25).map(|_| law.tick(Depth(1.0))).filter(|one| one.flags.has(Flags::PULL));
    assert!(pulls.inspect(|one| assert!(one.model.0 < 0.0 && one.force.0 == 0.0)).count() > 5);
    let above = (0..40).map(|_| law.tick(Depth(-5.0))).last().expect("ticks");
    assert!(above.flags == Flags::ABOVE_SURFACE && above.force.0 == 0.0);
    for (name, wrong) in [
        ("deepest", LawSettings { depth_max: Depth(0.0), ..settings }),
        ("speed", LawSettings { speed_max: MmPerS(f64::NAN), ..settings }),
        ("largest force", LawSettings { force_max: Newtons(f64::INFINITY), ..settings }),
    ] {
        let message = ForceLaw::new(wrong, Depth(0.0)).expect_err("a bound").to_string();
        assert!(message.contains(name), "{message}");
    }
    assert!(ForceLaw::new(settings, Depth(f64::NAN)).is_err());
}
