//! Every family through everything that a fit can do, on records whose forces have a closed form.

use palpate_test_support::record as support;

use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::families::{self, Model};
use palpate_rheology::fit::{
    Bootstrap, FitError, FitOptions, FitSample, FitSolution, TracedRecord, estimate_systematic,
    fit, fit_joint,
};
use support::Noise;

/// Standard deviation of the noise in N, where there is any.
const NOISE: f64 = 0.002;

/// A body of each family whose force over 20 mm is a few newtons.
fn bodies() -> Vec<Model> {
    let model = |key: &str, outer: &[f64], linear: &[f64]| {
        let family = families::find_family(key).unwrap();
        family.model(outer, linear).unwrap()
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
        model("unloading-3", &[1.023], &[0.05333, -0.0086, 0.0004345, 0.06, -0.02, 0.003, -2e-4]),
        model("exponential", &[1.5, 0.15], &[0.3, 0.9]),
        model("prony-2", &[0.5, 9.0], &[0.1, 0.15, 0.1]),
        model("fractional", &[2.0, 0.5], &[0.1, 0.3]),
        model("stretched", &[2.0, 0.45], &[0.1, 0.3]),
        model("fung", &[0.1, 300.0, 0.15], &[0.15, 0.06]),
    ]
}

/// The same, of the costly families their coarser members: they are fitted many times.
fn quick_bodies() -> impl Iterator<Item = Model> {
    bodies().into_iter().map(|model| Model {
        family: match model.family.as_str() {
            "fung" => "fung-6".to_owned(),
            "fractional" => "fractional-2".to_owned(),
            "stretched" => "stretched-3".to_owned(),
            _ => model.family,
        },
        ..model
    })
}

/// From 2 mm before contact to 20 mm behind it, a hold, half the way back, and again in: 0.1 s apart.
fn path(speed: f64) -> Vec<(Seconds, Depth)> {
    let corners = [
        (0.0, -2.0),
        (22.0 / speed, 20.0),
        (22.0 / speed + 12.0, 20.0),
        (22.0 / speed + 15.0, 10.0),
        (22.0 / speed + 20.0, 14.0),
    ];
    let end = corners[4].0;
    let count = (end / 0.1) as usize;
    let depth = |t: f64| {
        let k = corners.iter().rposition(|corner| corner.0 <= t).unwrap();
        let Some(next) = corners.get(k + 1) else {
            return corners[k].1;
        };
        let (from, to) = (corners[k], next);
        from.1 + (to.1 - from.1) * (t - from.0) / (to.0 - from.0)
    };
    let at = |i: usize| 0.1 * i as f64;
    (0..=count).map(|i| (Seconds(at(i)), Depth(depth(at(i))))).collect()
}

/// A record of a body, its contact `contact` mm behind where depth is counted from, an offset of 0.03 N.
fn record(model: &Model, speed: f64, contact: f64, noise: f64, seed: u64) -> Vec<FitSample> {
    let path = path(speed);
    let forces = model.along(path.iter().copied()).unwrap();
    let mut random = Noise::seeded(seed);
    let pairs = path.iter().zip(forces);
    pairs
        .map(|(&(t, depth), force)| FitSample {
            t,
            depth: Depth(depth.0 + contact),
            force: Newtons(force + 0.03 + noise * random.normal()),
            sigma: Newtons(NOISE),
        })
        .collect()
}

fn options(model: &Model) -> FitOptions {
    FitOptions::by_key(&model.family).unwrap()
}

/// Names and true values of the body.
fn truth(model: &Model) -> Vec<(String, f64)> {
    let values = model.outer.iter().chain(&model.linear);
    let options = options(model);
    let names = options.body_names().into_iter().map(str::to_owned);
    names.zip(values.copied()).collect()
}

#[track_caller]
fn check(what: &str, found: Option<f64>, exact: f64, relative: f64) {
    let found = found.unwrap();
    let miss = (found - exact).abs() / exact.abs().max(1e-3);
    assert!(miss < relative, "{what}: {found} is not {exact}");
}

#[test]
fn every_family_keeps_fixed_parameters_and_finds_the_others() {
    for model in bodies() {
        let samples = record(&model, 2.0, 0.0, 0.0, 1);
        for (fixed, value) in truth(&model) {
            let mut options = options(&model);
            options.fix(&fixed, value).unwrap();
            let report = fit(&samples, &options)
                .unwrap_or_else(|err| panic!("{} {fixed}: {err}", model.family));
            for (name, exact) in truth(&model) {
                let what = format!("{} {name} with {fixed}", model.family);
                check(&what, report.value(&name), exact, 1e-7);
                let one = report.parameter(&name).unwrap();
                assert_eq!(one.is_fixed, name == fixed, "{what}");
            }
            check(&model.family, report.value("f_offset"), 0.03, 1e-6);
        }
        let mut wrong = options(&model);
        let (first, value) = truth(&model).remove(0);
        wrong.fix(&first, 1.3 * value).unwrap();
        let report = fit(&samples, &wrong).unwrap();
        assert_eq!(report.value(&first), Some(1.3 * value), "{}", model.family);
        assert!(report.rmse_n > 1e-4, "{}", model.family);
    }
}

#[test]
fn every_family_finds_where_contact_is() {
    for model in bodies() {
        let samples = record(&model, 2.0, 0.7, 0.0, 1);
        let mut options = options(&model);
        options.free("x_contact").unwrap();
        let report = fit(&samples, &options).unwrap();
        // The force of a dashpot alone jumps at contact, so that the sum of squares has a corner there.
        let allowed = if model.family == "voigt" { 100.0 } else { 1.0 };
        check(&model.family, report.value("x_contact"), 0.7, 1e-5 * allowed);
        for (name, exact) in truth(&model) {
            let what = format!("{} {name}", model.family);
            check(&what, report.value(&name), exact, 1e-4 * allowed);
        }
        // The force along the path comes back, approach and contact included.
        for (sample, force) in samples.iter().zip(report.predict(&samples)) {
            let miss = (sample.force.0 - force.0).abs();
            assert!(miss < 1e-6 * allowed, "{} {miss:e}", model.family);
        }
    }
}

#[test]
fn every_family_shares_what_is_to_be_shared() {
    for model in bodies() {
        // A second specimen whose first coefficient is half as large again.
        let own = model.outer.len();
        let mut other = model.clone();
        other.linear[0] *= 1.5;
        let records = [record(&model, 2.0, 0.0, 0.0, 1), record(&other, 5.0, 0.0, 0.0, 2)];
        let both = [("one", records[0].as_slice()), ("other", records[1].as_slice())];
        let options = options(&model);
        let names = options.body_names();
        let shared: Vec<&str> = names.iter().copied().filter(|name| *name != names[own]).collect();
        for shared in [shared.as_slice(), &[]] {
            let joint = fit_joint(&both, &options, shared)
                .unwrap_or_else(|err| panic!("{}: {err}", model.family));
            for (named, model) in joint.records.iter().zip([&model, &other]) {
                for (name, exact) in truth(model) {
                    let what = format!("{} {name} of {}", model.family, named.record);
                    check(&what, named.report.value(&name), exact, 1e-6);
                }
            }
        }
        let refused = fit_joint(&both, &options, &["x_contact"]);
        assert!(matches!(refused, Err(FitError::NotShareable { .. })));
    }
}

#[test]
fn every_family_states_what_it_does_not_know() {
    for model in bodies() {
        let samples = record(&model, 2.0, 0.0, NOISE, 7);
        let fitted = FitSolution::of(&samples, &options(&model)).unwrap();
        let report = fitted.report();
        for (name, exact) in truth(&model) {
            let one = report.parameter(&name).unwrap();
            let error = one.std_error.unwrap_or_else(|| panic!("{} {name}", model.family));
            // One record in a thousand is as far off by its noise.
            let off = (one.value - exact).abs() / error;
            assert!(off < 4.5, "{} {name}: {off}", model.family);
        }
        for derived in model.parameters().unwrap() {
            let one = report.parameter(&derived.name).unwrap();
            let off = (one.value - derived.value).abs() / one.std_error.unwrap();
            assert!(off < 4.5, "{} {}: {off}", model.family, derived.name);
        }
        assert!(report.noise.unwrap().correlation_time_s.is_none());
        assert!((report.rmse_n / NOISE - 1.0).abs() < 0.2);
    }
}

#[test]
fn profiles_of_every_family_are_the_symmetric_intervals_where_noise_is_small() {
    for model in quick_bodies() {
        let samples = record(&model, 2.0, 0.0, NOISE, 7);
        let fitted = FitSolution::of(&samples, &options(&model)).unwrap();
        let report = fitted.report();
        let profile = fitted.profile(0).unwrap();
        assert_eq!(profile.len(), options(&model).free_count());
        for one in profile {
            let known = report.parameter(&one.name).unwrap();
            let (Some(low), Some(high)) = (one.low, one.high) else {
                panic!("{}: {one:?}", model.family);
            };
            let ends = known.ci95.unwrap();
            let width = ends[1] - ends[0];
            assert!(low < known.value && known.value < high, "{one:?}");
            let ratio = (high - low) / width;
            assert!((ratio - 1.0).abs() < 0.1, "{} {}: {ratio}", model.family, one.name);
        }
    }
}

#[test]
fn bootstraps_of_every_family_spread_like_their_standard_errors() {
    let choice = Bootstrap { seed: 3, repeats: 60 };
    for model in quick_bodies() {
        let samples = record(&model, 2.0, 0.0, NOISE, 7);
        let fitted = FitSolution::of(&samples, &options(&model)).unwrap();
        let report = fitted.report();
        for one in fitted.bootstrap(0, choice, |_| ()).unwrap() {
            let error = report.parameter(&one.name).unwrap().std_error.unwrap();
            // Sixty repeats tell a standard deviation to 9 %.
            let ratio = one.std_dev / error;
            assert!((0.6..1.6).contains(&ratio), "{} {}: {ratio}", model.family, one.name);
        }
    }
}

#[test]
fn every_family_reports_the_systematic_error_of_the_compliance() {
    for model in bodies() {
        let samples = record(&model, 2.0, 0.0, 0.0, 1);
        let traced = |error| TracedRecord {
            name: "record",
            samples: &samples,
            calibration: None,
            compliance: Some(("stand", error)),
        };
        let [one, two] =
            [1e-3, 2e-3].map(|error| estimate_systematic(traced(error), &options(&model)).unwrap());
        let moved = one.parameters.iter().zip(&two.parameters);
        let ratios: Vec<f64> = moved
            .filter(|(one, _)| one.error > 0.0)
            .map(|(one, two)| two.error / one.error)
            .collect();
        assert!(!ratios.is_empty(), "{}", model.family);
        // Twice the error moves twice as far, but for what a fit bends.
        let middle = ratios.iter().filter(|ratio| (**ratio - 2.0).abs() < 0.2).count();
        assert!(2 * middle > ratios.len(), "{}: {ratios:?}", model.family);
    }
}

#[test]
fn every_family_warns_of_lack_of_fit() {
    for model in bodies() {
        let mut samples = record(&model, 2.0, 0.0, NOISE, 7);
        let clean = fit(&samples, &options(&model)).unwrap();
        for sample in &mut samples {
            // Breathing, which no tissue parameter is.
            sample.force.0 += 0.1 * (sample.t.0 * 1.1).sin();
        }
        let report = fit(&samples, &options(&model)).unwrap();
        let noise = report.noise.unwrap();
        assert!(noise.correlation_time_s.is_some(), "{}", model.family);
        assert!(noise.effective_samples < 0.2 * samples.len() as f64);
        assert!(report.warnings.len() > clean.warnings.len(), "{}", model.family);
        let name = options(&model).body_names()[0].to_owned();
        let error = |report: &palpate_rheology::fit::FitReport| {
            report.parameter(&name).and_then(|one| one.std_error)
        };
        if let (Some(before), Some(after)) = (error(&clean), error(&report)) {
            assert!(after > 10.0 * before, "{}", model.family);
        }
    }
}

#[test]
fn what_a_path_cannot_separate_is_refused_by_name() {
    // One speed and no hold: the viscous term is the first elastic one.
    for model in bodies().iter().filter(|one| one.family.starts_with("series")) {
        let path: Vec<_> =
            (0..200).map(|i| 0.1 * f64::from(i)).map(|t| (Seconds(t), Depth(t))).collect();
        let forces = model.along(path.iter().copied()).unwrap();
        let samples: Vec<FitSample> = path
            .iter()
            .zip(forces)
            .map(|(&(t, depth), force)| FitSample {
                t,
                depth,
                force: Newtons(force),
                sigma: Newtons(NOISE),
            })
            .collect();
        match fit(&samples, &options(model)) {
            Err(FitError::Inseparable { names, .. }) => {
                assert_eq!(names, ["mu1", "tau_sig"], "{}", model.family);
            }
            other => panic!("{}: {other:?}", model.family),
        }
        let mut known = options(model);
        known.fix("tau_sig", model.linear[model.linear.len() - 1]).unwrap();
        let report = fit(&samples, &known).unwrap();
        check(&model.family, report.value("mu1"), model.linear[0], 1e-5);
    }
}
