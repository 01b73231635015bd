//! Every family recovers its own parameters, and its response is what its equation says.

use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::families::{self, Model, PowerSeries};
use palpate_rheology::families::{Family, OuterParameter, RelaxationTerm};
use palpate_rheology::fit::fit_joint;
use palpate_rheology::fit::{FitOptions, FitSample, fit};
use std::sync::Arc;

/// Depth over time: a ramp at `speed` to `depth` and a hold, `dt` apart.
fn ramp_hold(speed: f64, depth: f64, hold: f64, dt: f64) -> Vec<(Seconds, Depth)> {
    let count = ((depth / speed + hold) / dt).round() as u32;
    (0..=count)
        .map(|i| {
            let t = f64::from(i) * dt;
            (Seconds(t), Depth((speed * t).min(depth)))
        })
        .collect()
}

/// A ramp at `speed` to `depth`, a hold, and back to the surface at the same speed, `dt` apart.
fn ramp_hold_unload(speed: f64, depth: f64, hold: f64, dt: f64) -> Vec<(Seconds, Depth)> {
    let back = depth / speed + hold;
    let count = ((back + depth / speed) / dt).round() as u32;
    let path = (0..=count).map(|i| {
        let t = f64::from(i) * dt;
        let x = (speed * t).min(depth) - speed * (t - back).max(0.0);
        (Seconds(t), Depth(x.max(0.0)))
    });
    path.collect()
}

fn record(model: &Model, path: &[(Seconds, Depth)]) -> Vec<FitSample> {
    let forces = model.along(path.iter().copied()).expect("a force");
    path.iter()
        .zip(forces)
        .map(|(&(t, depth), force)| FitSample {
            t,
            depth,
            force: Newtons(force),
            sigma: Newtons(0.02),
        })
        .collect()
}

/// A body of each family whose force over 20 mm is a few newtons.
fn bodies() -> Vec<Model> {
    let model = |key: &str, outer: &[f64], linear: &[f64]| {
        let family = families::find_family(key).expect("a family");
        family.model(outer, linear).expect("a model")
    };
    vec![
        model("voigt", &[], &[0.2, 0.15]),
        model("maxwell", &[8.0], &[0.3]),
        model("kelvin", &[1.7], &[0.15, 0.6]),
        model("series-1", &[1.3], &[0.12, 0.05]),
        model("series-2", &[1.3], &[0.05, 0.01, 0.05]),
        model("series-3", &[1.023], &[0.05333, -0.0086, 0.0004345, 0.06]),
        model("series-4", &[1.2], &[0.08, -0.012, 0.0004, 3e-5, 0.05]),
        model("series-5", &[1.2], &[0.08, -0.02, 0.003, -2e-4, 5e-6, 0.05]),
        model("unloading-1", &[1.3], &[0.12, 0.05, -0.04, 2e-3, -1e-4]),
        model("unloading-3", &[1.023], &[0.05333, -0.0086, 0.0004345, 0.06, -0.02, 0.003, -2e-4]),
        model("exponential", &[1.5, 0.15], &[0.3, 0.9]),
        model("prony-2", &[0.5, 9.0], &[0.1, 0.15, 0.1]),
        model("prony-3", &[0.2, 2.0, 20.0], &[0.1, 0.1, 0.08, 0.06]),
        model("fractional", &[2.0, 0.5], &[0.1, 0.3]),
        model("stretched", &[2.0, 0.5], &[0.1, 0.3]),
        model("fung", &[0.1, 300.0, 0.15], &[0.15, 0.06]),
    ]
}

#[test]
fn families_recover_themselves() {
    for model in bodies() {
        let family = families::find_family(&model.family).unwrap();
        let path = match model.family.starts_with("unloading") {
            true => ramp_hold_unload,
            false => ramp_hold,
        };
        let slow = record(&model, &path(0.8, 20.0, 40.0, 0.02));
        let fast = record(&model, &path(4.0, 20.0, 40.0, 0.02));
        let options = FitOptions::of(family);
        let both = [("slow", slow.as_slice()), ("fast", fast.as_slice())];
        let fit = fit_joint(&both, &options, &options.body_names())
            .unwrap_or_else(|err| panic!("{}: {err}", model.family));
        let first = &fit.records[0].report;
        // Without noise what is left is rounding, times the condition of each design.
        let found = first.body.outer.iter().chain(&first.body.linear);
        let exact = model.outer.iter().chain(&model.linear);
        for (found, exact) in found.zip(exact) {
            let miss = (found / exact - 1.0).abs();
            assert!(miss < 1e-10, "{}: {found} is not {exact}", model.family);
        }
        assert_eq!(fit.warnings(), Vec::<String>::new(), "{}", model.family);
        assert!(fit.rmse_n < 1e-12);
        for exact in model.parameters().unwrap() {
            let found = first.parameter(&exact.name).unwrap();
            assert!((found.value / exact.value - 1.0).abs() < 1e-9, "{exact:?}");
            assert_eq!(found.unit, exact.unit);
        }
    }
}

#[test]
fn unloading_is_not_fitted_where_nothing_unloads() {
    let series = families::find_family("series-3").unwrap();
    let body = [0.05333, -0.0086, 0.0004345, 0.06];
    let model = series.model(&[1.023], &body).unwrap();
    let options = FitOptions::by_key("unloading-3").unwrap();
    let fit = |samples: &[FitSample]| fit(samples, &options);
    let held = record(&model, &ramp_hold(0.8, 20.0, 20.0, 0.05));
    let refusal = fit(&held).unwrap_err().to_string();
    assert!(refusal.contains("retracts by 0 %"), "{refusal}");
    // A way back whose force is not known says nothing either.
    let mut whole = record(&model, &ramp_hold_unload(0.8, 20.0, 20.0, 0.05));
    let loops = fit(&whole).unwrap();
    for sample in whole.iter_mut().filter(|sample| sample.t.0 > 45.5) {
        sample.sigma = Newtons(f64::INFINITY);
    }
    let refusal = fit(&whole).unwrap_err().to_string();
    assert!(refusal.contains("retracts by 2 %"), "{refusal}");
    // What was not lost is found to be nothing.
    for (name, found) in ["s1", "s2", "s3"].iter().zip(&loops.body.linear[4..]) {
        assert!(found.abs() < 1e-10, "{name} {found}");
    }
}

#[test]
fn kernel_and_terms_of_the_third_order_find_the_same() {
    let mut state = KelvinState::at_rest();
    let samples: Vec<FitSample> = ramp_hold(0.75, 30.0, 50.0, 0.05)
        .into_iter()
        .enumerate()
        .map(|(i, (t, depth))| {
            let dt = Seconds(if i == 0 { 0.0 } else { 0.05 });
            let error = 0.02 * f64::from((i * i * 37 % 101) as u32) / 29.0;
            let force = state.step(&ModifiedKelvin::THESIS, depth, dt).0 + error;
            FitSample { t, depth, force: Newtons(force), sigma: Newtons(0.02) }
        })
        .collect();
    let own = fit(&samples, &FitOptions::default()).unwrap();
    let terms = FitOptions::of(Arc::new(WithoutKernel(PowerSeries::THESIS)));
    let other = fit(&samples, &terms).unwrap();
    for (one, other) in own.parameters.iter().zip(&other.parameters) {
        assert_eq!(one.name, other.name);
        let (Some(error), Some(known)) = (one.std_error, other.std_error) else {
            assert!(one.is_fixed && other.is_fixed);
            continue;
        };
        // Both stop within a small share of a standard error.
        let miss = (one.value - other.value).abs();
        assert!(miss < 1e-3 * error, "{}: {miss} of {error}", one.name);
        assert!((known / error - 1.0).abs() < 1e-4, "{}", one.name);
    }
    assert_eq!(own.noise.is_some(), other.noise.is_some());
    assert_eq!(own.warnings, other.warnings);
    assert_eq!(own.findings, other.findings);
}

/// A family whose columns come from its terms, whatever is made for it.
#[derive(Debug)]
struct WithoutKernel(PowerSeries);

impl Family for WithoutKernel {
    fn key(&self) -> String {
        self.0.key()
    }
    fn name(&self) -> String {
        self.0.name()
    }
    fn equation(&self) -> &'static str {
        self.0.equation()
    }
    fn cannot_represent(&self) -> &'static str {
        self.0.cannot_represent()
    }
    fn outer(&self) -> Vec<OuterParameter> {
        self.0.outer()
    }
    fn linear(&self) -> Vec<(String, &'static str)> {
        self.0.linear()
    }
    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        self.0.columns(outer)
    }
    fn fading(&self, outer: &[f64]) -> Option<f64> {
        self.0.fading(outer)
    }
}

/// Corners of the path of `scripts/family_reference.py`, in s and mm.
const PATH: [(f64, f64); 9] = [
    (0.0, 0.0),
    (2.5, 10.0),
    (6.0, 10.0),
    (8.0, 4.0),
    (9.0, -2.0),
    (9.5, -2.0),
    (12.0, 8.0),
    (13.0, 13.0),
    (14.0, 6.0),
];

/// That path from corner to corner, each piece cut into `parts` steps and at `until`.
fn corners(parts: u32, until: f64) -> Vec<(Seconds, Depth)> {
    let mut path = vec![(Seconds(0.0), Depth(0.0))];
    for pair in PATH.windows(2) {
        let ((t0, x0), (t1, x1)) = (pair[0], pair[1]);
        if t0 >= until {
            break;
        }
        let end = t1.min(until);
        for part in 1..=parts {
            let t = t0 + (end - t0) * f64::from(part) / f64::from(parts);
            path.push((Seconds(t), Depth(x0 + (x1 - x0) * (t - t0) / (t1 - t0))));
        }
    }
    path
}

#[test]
fn responses_agree_with_quadrature_in_many_digits() {
    let numbers = |text: &str| -> Vec<f64> {
        let fields = text.split(',').filter(|field| !field.is_empty());
        fields.map(|field| field.parse().unwrap()).collect()
    };
    let mut seen = std::collections::BTreeSet::new();
    for line in include_str!("../data/family_reference.txt").lines() {
        if line.starts_with('#') {
            continue;
        }
        let fields: Vec<&str> = line.split('/').map(str::trim).collect();
        let (t, exact): (f64, f64) = (fields[3].parse().unwrap(), fields[4].parse().unwrap());
        let mut check = |key: &str, tolerance: f64| {
            let family = families::find_family(key).unwrap();
            let model = family.model(&numbers(fields[1]), &numbers(fields[2])).unwrap();
            for parts in [1, 100] {
                let force = model.along(corners(parts, t)).unwrap();
                let miss = (force[force.len() - 1] - exact).abs();
                assert!(miss < tolerance, "{key} at {t} s in {parts}: {miss:e}");
            }
            seen.insert(key.to_owned());
        };
        match fields[0] {
            // A few newtons, rounded some ten times.
            exact @ ("voigt" | "maxwell" | "kelvin" | "exponential") => check(exact, 1e-14),
            exact
                if ["series", "prony", "unloading"].iter().any(|kind| exact.starts_with(kind)) =>
            {
                check(exact, 1e-14);
            }
            // As many digits as asked for, of what the relaxing spring of 0.3 N/mm would hold after
            // all the 26 mm it was moved.
            "fractional" => {
                check("fractional", 8e-4);
                check("fractional-6", 8e-6);
                check("fractional-12", 8e-12);
            }
            // The same; by the mean of a random number in place of its function.
            "stretched" => {
                check("stretched", 8e-4);
                check("stretched-6", 8e-6);
                check("stretched-10", 8e-10);
            }
            // Over its 2.5 decades of relaxation times: the quadrature converges geometrically until
            // only rounding is left.
            "fung" => {
                check("fung-8", 1e-4);
                check("fung", 1e-12);
                check("fung-36", 1e-14);
            }
            other => panic!("no family {other}"),
        }
    }
    assert_eq!(seen.len(), 21, "{seen:?}");
}
