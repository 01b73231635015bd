//! Families by terms: the cost of a step, and the error of the force with fewer terms.

use super::paths::{ReferencePaths, difference, peak};
use super::timing::Job;
use super::{TradeExtent, UNMEASURED};
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_rheology::families::{Model, find_family};
use palpate_rheology::fit::{FitOptions, FitSample, fit};
use palpate_rheology::trade::FamilyRow;
use std::hint::black_box;

/// Steps of a timed run.
const RUN: usize = 256;

/// Speed of the thesis protocol in mm/s.
const THESIS_SPEED: f64 = 0.75;

/// Name of the first target.
pub(super) const THESIS: &str = "thesis body";

/// A body that the families of one table approximate.
struct Target {
    name: &'static str,
    /// The body: family, outer parameters, coefficients.
    body: (&'static str, &'static [f64], &'static [f64]),
    /// Whether each family is fitted to it or is the same body with fewer terms.
    is_fitted: bool,
    /// Whether the probe comes back after the hold.
    comes_back: bool,
    /// Keys of families; a quick measurement takes the first `quick` of them.
    families: &'static str,
    quick: usize,
}

/// Pig stomach, equation 3.5 of the thesis; a fractional body of like stiffness that relaxes over
/// decades; a Fung spectrum of two and a half decades.
const TARGETS: [Target; 5] = [
    Target {
        name: THESIS,
        body: ("series-3", &[1.023], &[0.05333, -0.0086, 0.000_434_5, 0.06]),
        is_fitted: true,
        comes_back: false,
        families: "series-1 series-2 series-3 series-4 series-5 voigt maxwell kelvin exponential",
        quick: 3,
    },
    Target {
        name: "softening body that is left again",
        body: (
            "unloading-3",
            &[1.023],
            &[0.05333, -0.0086, 0.000_434_5, 0.06, -0.02, 0.003, -2e-4],
        ),
        is_fitted: true,
        comes_back: true,
        families: "series-3 unloading-3",
        quick: 2,
    },
    Target {
        name: "fractional body",
        body: ("fractional-12", &[2.0, 0.5], &[0.1, 0.3]),
        is_fitted: true,
        comes_back: false,
        families: "prony-1 prony-2 prony-3 prony-4 prony-5 prony-6",
        quick: 2,
    },
    Target {
        name: "fractional body, digits",
        body: ("fractional-14", &[2.0, 0.5], &[0.1, 0.3]),
        is_fitted: false,
        comes_back: false,
        families: "fractional-1 fractional-2 fractional-4 fractional-6 fractional-8 fractional-10 fractional-12",
        quick: 2,
    },
    Target {
        name: "Fung spectrum, nodes",
        body: ("fung-64", &[0.1, 300.0, 0.15], &[0.15, 0.06]),
        is_fitted: false,
        comes_back: false,
        families: "fung-2 fung-4 fung-8 fung-16 fung fung-32",
        quick: 2,
    },
];

/// Adds the way back to a path, as fast as the thesis went in.
fn come_back(path: &mut Vec<(Seconds, Depth)>) {
    let Some(&(start, deepest)) = path.last() else {
        return;
    };
    let interval = 0.1;
    let moved = |i: u32| THESIS_SPEED * interval * f64::from(i);
    path.extend(
        (1..)
            .map(|i| (Seconds(start.0 + interval * f64::from(i)), Depth(deepest.0 - moved(i))))
            .take_while(|(_, depth)| depth.0 >= 0.0),
    );
}

fn model(key: &str, outer: &[f64], linear: &[f64]) -> Result<Model, String> {
    find_family(key)
        .map_err(|err| err.to_string())?
        .model(outer, linear)
        .map_err(|err| err.to_string())
}

pub(super) fn rows(extent: TradeExtent, paths: &ReferencePaths) -> Result<Vec<FamilyRow>, String> {
    let mut rows = Vec::new();
    for target in &TARGETS {
        let mut path: Vec<(Seconds, Depth)> = paths.ramp_hold.checkpoints().collect();
        if target.comes_back {
            come_back(&mut path);
        }
        let (key, outer, linear) = target.body;
        let exact = along(&model(key, outer, linear)?, &path)?;
        let count = extent.choose(usize::MAX, target.quick);
        for key in target.families.split(' ').take(count) {
            let found = match target.is_fitted {
                true => fitted(key, &path, &exact)?,
                false => model(key, outer, linear)?,
            };
            rows.push(FamilyRow {
                family: key.to_owned(),
                target: target.name.to_owned(),
                peak_n: peak(&exact),
                error_n: difference(&along(&found, &path)?, &exact),
                cost: UNMEASURED,
                front: false,
            });
        }
    }
    Ok(rows)
}

fn along(model: &Model, path: &[(Seconds, Depth)]) -> Result<Vec<f64>, String> {
    model.along(path.iter().copied()).map_err(|err| err.to_string())
}

/// The member of a family nearest to forces along a path, by least squares.
fn fitted(key: &str, path: &[(Seconds, Depth)], forces: &[f64]) -> Result<Model, String> {
    let samples: Vec<FitSample> = path
        .iter()
        .zip(forces)
        .map(|(&(t, depth), &force)| FitSample {
            t,
            depth,
            force: Newtons(force),
            // Equal weights: the same for all and of no other consequence.
            sigma: Newtons(0.02),
        })
        .collect();
    let mut options = FitOptions::by_key(key).map_err(|err| err.to_string())?.at_rest();
    let found = options.fix("f_offset", 0.0).and_then(|()| fit(&samples, &options));
    found.map(|report| report.body).map_err(|err| format!("{key}: {err}"))
}

/// One job a row: the steps of a body of that family at 1 kHz, its numbers of no consequence.
pub(super) fn jobs<'a>(rows: &[FamilyRow]) -> Result<Vec<Job<'a>>, String> {
    rows.iter().map(|row| job(&row.family)).collect()
}

fn job<'a>(key: &str) -> Result<Job<'a>, String> {
    let family = find_family(key).map_err(|err| err.to_string())?;
    // A decade between relaxation times, a few newtons over 30 mm.
    let outer = family.outer();
    let outer = outer.iter().enumerate().map(|(i, one)| match one.unit {
        "s" => 0.1 * 10f64.powi(i as i32),
        "1/mm" => 0.15,
        _ if one.name == "alpha" => 0.5,
        _ => 300.0,
    });
    let outer: Vec<f64> = outer.collect();
    let linear = vec![0.01; family.linear().len()];
    let start = family
        .model(&outer, &linear)
        .map_err(|err| err.to_string())?
        .at_rest_from(Depth(0.0))
        .map_err(|err| err.to_string())?;
    let depths: Vec<Depth> = (0..RUN).map(|i| Depth(30.0 * i as f64 / RUN as f64)).collect();
    let mut body = start;
    Ok(Job {
        per_call: RUN as f64,
        call: Box::new(move || {
            for &depth in black_box(&depths) {
                black_box(body.step(depth, Seconds(1e-3)).is_ok());
            }
        }),
    })
}
