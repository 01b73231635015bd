//! Every integrator of the modified Kelvin body, in double and single precision.

use super::judge::{PathCase, Row};
use super::subjects::SchemeBody;
use super::tau_step::decades;
use super::{Extent, Part};
use crate::integrators::{Precision, Scheme, SeriesBody};
use palpate_model::viscoelastic::ModifiedKelvin;

/// Name of the group of relaxation times against steps.
const GROUP: &str = "integrators, relaxation time and step";
/// Name of the group of all else.
const OTHER: &str = "integrators, depth and force";
const SAMPLES: u32 = 20;

pub(super) fn parts(extent: Extent) -> Vec<Part> {
    let mut parts = Vec::new();
    for scheme in Scheme::ALL {
        for precision in Precision::ALL {
            let subject = move |tau: f64, force: f64| SchemeBody {
                scheme,
                precision,
                body: body(tau, force),
            };
            let name = format!("{}, {}", scheme.name(), precision.name());
            parts.push(Part::new(GROUP, name.clone(), move |progress| {
                let [taus, steps] = decades(extent);
                let mut rows = Vec::new();
                for (index, tau) in taus.iter().enumerate() {
                    let subject = subject(10f64.powi(*tau), 1.0);
                    for step in &steps {
                        let case = format!("tau 1e{tau} s, step 1e{step} s");
                        rows.push(poke(GROUP, case, 20.0, 10f64.powi(*step)).run_on(&subject));
                    }
                    progress((index + 1) as f64 / taus.len() as f64);
                }
                rows
            }));
            parts.push(Part::new(OTHER, name, move |_| others(subject)));
        }
    }
    parts
}

/// The thesis body at another relaxation time, its viscous part in step, and another force.
fn body(tau: f64, force: f64) -> SeriesBody<3> {
    let known = ModifiedKelvin::THESIS;
    ModifiedKelvin {
        tau_eps: tau,
        mu: known.mu.map(|mu| mu * force),
        tau_sig: known.tau_sig * tau / known.tau_eps * force,
    }
    .into()
}

/// Down to `depth`, a hold, half back, in steps of `dt`.
fn poke(group: &'static str, case: String, depth: f64, dt: f64) -> PathCase {
    let samples = f64::from(SAMPLES);
    let down = (1..=SAMPLES).map(|i| f64::from(i) / samples);
    let hold = (0..SAMPLES).map(|_| 1.0);
    let back = (1..=SAMPLES).map(|i| 1.0 - 0.5 * f64::from(i) / samples);
    PathCase {
        group,
        case,
        start: 0.0,
        steps: down.chain(hold).chain(back).map(|share| (dt, share * depth)).collect(),
    }
}

fn others(subject: impl Fn(f64, f64) -> SchemeBody) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut put = |case: &str, path: PathCase, body: SchemeBody| {
        let case = case.to_owned();
        rows.push(PathCase { case, ..path }.run_on(&body));
    };
    let path = |depth: f64, dt: f64| poke(OTHER, String::new(), depth, dt);
    for (case, depth) in [
        ("depths of 1e-6 mm", 1e-6),
        ("depths of 1e-3 mm", 1e-3),
        ("depths of 1e3 mm", 1e3),
        ("depth 0", 0.0),
        ("out of contact", -1e3),
    ] {
        put(case, path(depth, 0.01), subject(1.0, 1.0));
    }
    for (case, force) in
        [("forces of 1e-6 N", 1e-6), ("forces of 1e6 N", 1e6), ("forces of zero", 0.0)]
    {
        put(case, path(20.0, 0.01), subject(1.0, force));
    }
    for (case, at, value) in [
        ("NaN depth at the start", None, f64::NAN),
        ("infinite depth at the start", None, f64::INFINITY),
        ("NaN depth in a step", Some(5), f64::NAN),
        ("infinite depth in a step", Some(5), f64::INFINITY),
    ] {
        let mut path = path(20.0, 0.01);
        match at {
            Some(at) => path.steps[at].1 = value,
            None => path.start = value,
        }
        put(case, path, subject(1.0, 1.0));
    }
    for (case, dt) in
        [("NaN step", f64::NAN), ("infinite step", f64::INFINITY), ("negative step", -0.01)]
    {
        put(case, path(20.0, dt), subject(1.0, 1.0));
    }
    for (case, tau) in [
        ("NaN relaxation time", f64::NAN),
        ("infinite relaxation time", f64::INFINITY),
        ("relaxation time of zero", 0.0),
        ("negative relaxation time", -1.0),
    ] {
        put(case, path(20.0, 0.01), subject(tau, 1.0));
    }
    put("NaN coefficients", path(20.0, 0.01), subject(1.0, f64::NAN));
    rows
}
