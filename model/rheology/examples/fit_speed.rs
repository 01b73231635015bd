//! Seconds of the fit of the thesis body: one long record, its profile intervals, and a batch of short records.
//!
//! `cargo run --release -p palpate-rheology --example fit_speed`. Of two versions to be compared, build this in both and run
//! them in turn. With `values` it prints what was found instead, in all digits, so that the versions can be
//! compared in that too.

#![expect(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a measurement prints, reads a clock and may fail"
)]

use palpate_model::random::SplitMix;
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::fit::{Bootstrap, FitOptions, FitReport, FitSample, Fitted, fit, fit_joint};
use std::hint::black_box;
use std::time::Instant;

/// A ramp of `speed` mm/s to 30 mm and a hold, `count` samples in `duration` s with noise.
fn record(seed: u64, speed: f64, duration: f64, count: u32) -> Vec<FitSample> {
    record_from(0.0, seed, speed, duration, count)
}

/// The same from so many mm.
fn record_from(start: f64, seed: u64, speed: f64, duration: f64, count: u32) -> Vec<FitSample> {
    let mut random = SplitMix::seeded(seed);
    let mut state = KelvinState::at_rest();
    let dt = duration / f64::from(count - 1);
    (0..count)
        .map(|i| {
            let t = f64::from(i) * dt;
            let depth = Depth((start + speed * t).min(30.0));
            let step = Seconds(if i == 0 { 0.0 } else { dt });
            let force = state.step(&ModifiedKelvin::THESIS, depth, step).0;
            FitSample {
                t: Seconds(t),
                depth,
                force: Newtons(force + 0.02 * random.normal()),
                sigma: Newtons(0.02),
            }
        })
        .collect()
}

/// Least of `rounds` times in ms.
fn least(rounds: usize, mut work: impl FnMut()) -> f64 {
    let times = (0..rounds).map(|_| {
        let start = Instant::now();
        work();
        1e3 * start.elapsed().as_secs_f64()
    });
    times.fold(f64::INFINITY, f64::min)
}

fn times() {
    let options = FitOptions::default();
    let long = record(1, 0.75, 90.0, 90_001);
    let batch: Vec<Vec<FitSample>> = (0..50).map(|k| record(k, 0.75, 90.0, 901)).collect();
    let cold = least(15, || {
        black_box(fit(black_box(&long), &options).unwrap());
    });
    let fitted = Fitted::of(&long, &options).unwrap();
    let profile = least(15, || {
        black_box(fitted.profile(0).unwrap());
    });
    let batch = least(10, || {
        for one in &batch {
            black_box(fit(black_box(one), &options).unwrap());
        }
    });
    println!("cold fit of 90 001 samples {cold:8.3} ms");
    println!("profile intervals of it    {profile:8.3} ms");
    println!("50 fits of 901 samples     {batch:8.3} ms");
}

fn tell(what: &str, report: &FitReport) {
    println!("{what} r2 {:.17e} rmse {:.17e}", report.r2, report.rmse_n);
    for one in &report.parameters {
        println!(
            "{what} {} {:.17e} {:?} {:?}",
            one.name, one.value, one.std_error, one.ci95
        );
    }
    for sentence in report.sentences() {
        println!("{what} {sentence}");
    }
}

fn values() {
    let record = |seed, speed| record(seed, speed, 90.0, 4001);
    let (slow, fast) = (record(1, 0.75), record(2, 4.0));
    tell("plain", &fit(&slow, &FitOptions::default()).unwrap());
    let mut fixed = FitOptions::default();
    fixed.fix("f_offset", 0.0).unwrap();
    fixed.fix("mu1", 0.053).unwrap();
    tell("fixed", &fit(&slow, &fixed).unwrap());
    let mut contact = FitOptions::default();
    contact.free("x_contact").unwrap();
    let mut late = record_from(-2.0, 5, 0.75, 90.0, 4001);
    late.iter_mut().for_each(|sample| sample.depth.0 += 0.4);
    tell("contact", &fit(&late, &contact).unwrap());
    let mut tau = FitOptions::default();
    tau.fix("tau_eps", 1.0).unwrap();
    tell("tau fixed", &fit(&slow, &tau).unwrap());
    for shared in [
        &["tau_eps", "mu1", "mu2", "mu3", "tau_sig"][..],
        &["tau_eps", "mu1"],
        &["mu2"],
    ] {
        let both = [("slow", slow.as_slice()), ("fast", fast.as_slice())];
        let joint = fit_joint(&both, &FitOptions::default(), shared).unwrap();
        for one in &joint.records {
            tell(&format!("{shared:?} {}", one.record), &one.report);
        }
    }
    let fitted = Fitted::of(&slow, &FitOptions::default()).unwrap();
    for one in fitted.profile(0).unwrap() {
        println!("profile {} {:?} {:?}", one.name, one.low, one.high);
    }
    let choice = Bootstrap {
        seed: 1,
        repeats: 40,
    };
    for one in fitted.bootstrap(0, choice, |_| ()).unwrap() {
        println!("bootstrap {} {:?} {:?}", one.name, one.std_dev, one.ci95);
    }
}

fn main() {
    match std::env::args().nth(1).as_deref() {
        Some("values") => values(),
        _ => times(),
    }
}
