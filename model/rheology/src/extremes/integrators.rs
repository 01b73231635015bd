//! Every integrator of the modified Kelvin body, in double and single precision.

use super::judge::{ExtremesRow, PathCase};
use super::subjects::SchemeBody;
use super::tau_step::decades;
use super::{ExtremesExtent, ExtremesPart};
use crate::integrators::{Precision, Scheme, SeriesBody};
use palpate_model::viscoelastic::ModifiedKelvin;

/// Name of the group of relaxation times against steps.
const GROUP: &str = "integrators, relaxation time and time step";
/// Name of the group of all else.
const OTHER: &str = "integrators, depth and force";
const SAMPLES: u32 = 20;

pub(super) fn parts(extent: ExtremesExtent) -> Vec<ExtremesPart> {
    let mut parts = Vec::new();
    for scheme in Scheme::ALL {
        for precision in Precision::ALL {
            let subject = move |tau: f64, force: f64| SchemeBody {
                scheme,
                precision,
                body: body(tau, force),
            };
            let name = format!("{}, {}", scheme.name(), precision.name());
            parts.push(ExtremesPart::new(GROUP, name.clone(), move |progress| {
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
            parts.push(ExtremesPart::new(OTHER, name, move |_| others(subject)));
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
    let steps = down.chain(hold).chain(back).map(|share| (dt, share * depth)).collect();
    PathCase::new(group, case, 0.0, steps)
}

fn others(subject: impl Fn(f64, f64) -> SchemeBody) -> Vec<ExtremesRow> {
    let path = |depth: f64, dt: f64| poke(OTHER, String::new(), depth, dt);
    let usual = || path(20.0, 0.01);
    let from = |start: f64| PathCase { start, ..usual() };
    let through = |depth: f64| {
        let mut path = usual();
        path.steps[5].1 = depth;
        path
    };
    let body = subject(1.0, 1.0);
    let cases = [
        ("depths of 1e-6 mm", path(1e-6, 0.01), body),
        ("depths of 1e-3 mm", path(1e-3, 0.01), body),
        ("depths of 1e3 mm", path(1e3, 0.01), body),
        ("depth 0", path(0.0, 0.01), body),
        ("out of contact", path(-1e3, 0.01), body),
        ("forces of 1e-6 N", usual(), subject(1.0, 1e-6)),
        ("forces of 1e6 N", usual(), subject(1.0, 1e6)),
        ("forces of zero", usual(), subject(1.0, 0.0)),
        ("NaN depth at the start", from(f64::NAN), body),
        ("infinite depth at the start", from(f64::INFINITY), body),
        ("NaN depth in a step", through(f64::NAN), body),
        ("infinite depth in a step", through(f64::INFINITY), body),
        ("NaN step", path(20.0, f64::NAN), body),
        ("infinite step", path(20.0, f64::INFINITY), body),
        ("negative step", path(20.0, -0.01), body),
        ("NaN relaxation time", usual(), subject(f64::NAN, 1.0)),
        ("infinite relaxation time", usual(), subject(f64::INFINITY, 1.0)),
        ("relaxation time of zero", usual(), subject(0.0, 1.0)),
        ("negative relaxation time", usual(), subject(-1.0, 1.0)),
        ("NaN coefficients", usual(), subject(1.0, f64::NAN)),
    ];
    let rows = cases
        .into_iter()
        .map(|(case, path, body)| PathCase { case: case.to_owned(), ..path }.run_on(&body));
    rows.collect()
}
