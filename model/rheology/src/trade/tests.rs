use super::*;
use crate::tolerance::Tolerance;

fn cost(ns: f64) -> MeasuredCost {
    MeasuredCost { ns, spread: 0.02, halves: 0.01 }
}

fn integrator(scheme: Scheme, step_s: f64, error: f64, ns: f64) -> IntegratorRow {
    IntegratorRow {
        scheme,
        precision: Precision::F64,
        step_s,
        error: Some(ForceError { ramp_hold_n: 6.0 * error, poke_n: 3.0 * error }),
        refused: None,
        cost: cost(ns),
        second_ns: ns / step_s,
        front: false,
    }
}

fn family(family: &str, target: &str, error_n: f64, ns: f64) -> FamilyRow {
    FamilyRow {
        family: family.into(),
        target: target.into(),
        peak_n: 5.0,
        error_n,
        cost: cost(ns),
        front: false,
    }
}

fn here() -> Machine {
    Machine {
        cpu: "Example(R) CPU @ 3 GHz".into(),
        os: "linux".into(),
        cores: 8,
        profile: "release".into(),
    }
}

fn curves() -> TradeCurves {
    let unstable = IntegratorRow {
        error: None,
        refused: Some("unstable".into()),
        ..integrator(Scheme::RungeKutta, 5.0, 0.0, 8.0)
    };
    let fit = |rate_hz: f64, error_n: f64, ns: f64| FitRow {
        rate_hz,
        samples: (90.0 * rate_hz) as usize + 1,
        tau_error: error_n / 5.0,
        error_n,
        cost: cost(ns),
        front: false,
    };
    let mut curves = TradeCurves {
        format: TRADE_FORMAT,
        version: "1.2.3".into(),
        machine: here(),
        measured_at: "2026-11-21T00:00:00Z".into(),
        quick: false,
        peak: ForceError { ramp_hold_n: 6.0, poke_n: 3.0 },
        seeds: [1, 8],
        integrators: vec![
            integrator(Scheme::ExplicitEuler, 1e-3, 1e-3, 4.0),
            integrator(Scheme::Trapezoid, 1e-3, 1e-6, 5.0),
            integrator(Scheme::Trapezoid, 1e-2, 1e-4, 5.0),
            integrator(Scheme::Exact, 1e-2, 1e-15, 6.0),
            integrator(Scheme::Exact, 1e-3, 1e-14, 6.0),
            unstable,
        ],
        families: vec![
            family("series-1", "a body", 1.0, 40.0),
            family("series-2", "a body", 0.4, 45.0),
            family("series-3", "a body", 1e-9, 50.0),
            family("series-4", "a body", 1e-9, 60.0),
            family("fung-4", "a spectrum", 0.03, 300.0),
        ],
        fit: vec![fit(1000.0, 1e-3, 2e7), fit(10.0, 9e-3, 4e5)],
        live: vec![LiveRow { nodes: 64, tau_error: Some(1e-9), cost: cost(300.0), front: false }],
    };
    curves.mark_fronts();
    curves
}

#[test]
fn the_front_is_what_nothing_beats() {
    let points = [
        (Some(1.0), 1.0),
        (Some(0.5), 2.0),
        (Some(0.5), 3.0),
        (Some(0.1), 2.5),
        (None, 0.1),
        (Some(1.0), 1.0),
    ];
    assert_eq!(mark_pareto_optimal(&points), [true, true, false, true, false, true]);
    let curves = curves();
    let fronts: Vec<bool> = curves.integrators.iter().map(|row| row.front).collect();
    // A second of the exact step at 10 ms costs 600 ns and errs by nothing; only the trapezoid there
    // is cheaper.
    assert_eq!(fronts, [false, false, true, true, false, false]);
    let fronts: Vec<bool> = curves.families.iter().map(|row| row.front).collect();
    assert_eq!(fronts, [true, true, true, false, true], "by target");
}

/// Whether a setting is advised that has all these facts.
fn is_use(advice: &Advice, facts: &[&str]) -> bool {
    matches!(advice, Advice::Use(choice) if facts.iter().all(|fact| choice.setting.contains(fact)))
}

/// Whether nothing is advised, for a reason that has all these facts.
fn is_none(advice: &Advice, facts: &[&str]) -> bool {
    matches!(advice, Advice::None(why) if facts.iter().all(|fact| why.contains(fact)))
}

#[test]
fn the_cheapest_that_does_is_recommended() {
    let curves = curves();
    let percent = |percent: f64| Tolerance::PercentOfPeak(percent);
    let at_1_khz = curves.recommend(percent(0.01), 1000.0, 0.1);
    // At 1 kHz a step is at most 1 ms.
    assert!(is_use(&at_1_khz.integrator, &["trapezoid", "f64", "1 ms"]));
    assert!(is_use(&at_1_khz.families[0].1, &["series-3"]));
    assert!(is_none(&at_1_khz.families[1].1, &["fung-4"]));
    let at_100_hz = curves.recommend(percent(0.02), 100.0, 0.1);
    assert!(is_use(&at_100_hz.integrator, &["trapezoid", "10 ms"]));
    let loose = curves.recommend(percent(10.0), 1000.0, 0.1);
    assert!(is_use(&loose.integrator, &["explicit Euler", "1 ms"]));
    assert!(is_use(&loose.families[0].1, &["series-2"]));
    assert!(is_use(&loose.fit, &["10 samples", "901"]));
    let strict = curves.recommend(Tolerance::PercentOfPeak(0.1), 1000.0, 0.1);
    assert!(is_use(&strict.fit, &["1000 samples", "90001"]));
    // series-4 is as exact and costs more; at a like cost the more exact one would be taken.
    let mut alike = curves.clone();
    alike.families[3] = family("series-4", "a body", 1e-12, 52.0);
    let alike = alike.recommend(percent(0.01), 1000.0, 0.1);
    assert!(is_use(&alike.families[0].1, &["series-4"]));
    // The more exact one is no use where only the cheaper keeps pace.
    let mut tight = curves.clone();
    tight.families[3] = family("series-4", "a body", 1e-12, 52.0);
    let share = 51.0e-9 * 1e6;
    let tight = tight.recommend(percent(0.01), 1e6, share);
    assert!(is_use(&tight.families[0].1, &["series-3"]));
    let Advice::Use(choice) = &loose.integrator else {
        panic!("{loose:?}");
    };
    assert!((choice.share_of_period.unwrap() - 4e-6).abs() < 1e-18);
    assert!((choice.cost_ns - 4.0).abs() < 1e-12);
}

#[test]
fn missing_advice_states_its_reason() {
    let curves = curves();
    let one = Tolerance::PercentOfPeak(1.0);
    let fast = curves.recommend(one, 1e6, 0.1);
    assert!(is_none(&fast.integrator, &["1000000"]));
    assert!(is_none(&fast.families[1].1, &["30.000 %"]));
    let exact = Tolerance::Newtons(palpate_model::units::Newtons(1e-20));
    let exact = curves.recommend(exact, 1000.0, 0.1);
    assert!(is_none(&exact.integrator, &[Scheme::Exact.name()]));
    assert!(is_none(&exact.fit, &["1000 samples"]));
}

#[test]
fn stale_and_foreign_curves_are_noticed() {
    let curves = curves();
    assert_eq!(curves.doubts(&here(), "1.2.3", 10.0), Vec::<String>::new());
    let doubt = |machine: &Machine, version: &str, age: f64| {
        let doubts = curves.doubts(machine, version, age);
        assert_eq!(doubts.len(), 1, "{doubts:?}");
        doubts.concat()
    };
    assert!(doubt(&here(), "1.2.3", 91.0).contains("91 days"));
    assert!(doubt(&here(), "1.3.0", 1.0).contains("palpate 1.2.3"));
    assert!(doubt(&here(), "1.2.3", -2.0).contains("future"));
    let other = Machine { cores: 4, ..here() };
    assert!(doubt(&other, "1.2.3", 1.0).contains("another computer"));
    let debug = Machine { profile: "debug".into(), ..here() };
    assert!(doubt(&debug, "1.2.3", 1.0).contains("debug"));
    assert_eq!(here().file_stem(), "example-r-cpu-3-ghz-8-logical-cores-linux-release-build");
}

#[test]
fn curves_that_were_changed_are_noticed() {
    let good = curves();
    assert_eq!(good.clone().checked(), Ok(good.clone()));
    type Change = fn(&mut TradeCurves);
    let contradicted: [Change; 4] = [
        |curves| curves.integrators[0].cost.ns *= 1.001,
        |curves| curves.integrators[0].second_ns *= 1.001,
        |curves| curves.integrators[5].refused = None,
        |curves| curves.integrators[1].front = true,
    ];
    let checked = |change: Change| {
        let mut changed = good.clone();
        change(&mut changed);
        changed.checked().unwrap_err()
    };
    for change in contradicted {
        let refusal = checked(change);
        assert!(matches!(refusal, CurveError::Contradiction(_)), "{refusal:?}");
    }
    let impossible: [(Change, f64); 4] = [
        (|curves| curves.integrators[0].cost.ns = -1.0, -1.0),
        (|curves| curves.families[0].error_n = f64::NAN, f64::NAN),
        (|curves| curves.fit[0].tau_error = f64::INFINITY, f64::INFINITY),
        (|curves| curves.peak.poke_n = 0.0, 0.0),
    ];
    for (change, number) in impossible {
        match checked(change) {
            CurveError::Number { value, .. } => assert_eq!(value.to_bits(), number.to_bits()),
            other => panic!("{number}: {other:?}"),
        }
    }
    assert_eq!(checked(|curves| curves.format = 2), CurveError::Format(2));
    let changes: [(Change, &str); 6] = [
        (
            |curves| curves.integrators[1].error.iter_mut().for_each(|e| e.poke_n *= 1.00001),
            "trapezoid at 0.001 s",
        ),
        (|curves| curves.families[1].error_n *= 0.999, "series-2"),
        (|curves| curves.fit[1].tau_error *= 1.001, "10 Hz"),
        (|curves| curves.peak.ramp_hold_n *= 1.00001, "ramp and hold"),
        (|curves| curves.live.clear(), "live"),
        (|curves| curves.integrators.truncate(3), Scheme::Exact.name()),
    ];
    assert_eq!(good.agrees_with(&good), Ok(()));
    for (change, row) in changes {
        let mut changed = good.clone();
        change(&mut changed);
        let refusal = changed.agrees_with(&good).unwrap_err();
        let is_it = match &refusal {
            CurveError::Error { what, .. } => what.contains(row),
            CurveError::Missing(what) => what.contains(row),
            _ => false,
        };
        assert!(is_it, "{row}: {refusal:?}");
    }
}
