//! What a fit of volts costs beside one of forces: `signal_fit_time [REPEATS]`, medians of turns taken one after the other.
#![expect(clippy::print_stdout, reason = "a program that prints")]
use palpate_analysis::source::{self, RecordStretch};
use palpate_drivers::sim::{SimRig, SimSettings};
use palpate_model::calibration::ForceUncertainty;
use palpate_protocols::plans::RampHold;
use palpate_rheology::fit::{FitOptions, FitSolution, SignalRecord, TracedRecord};
use palpate_runner::Stopwatch;
use palpate_tests::recorded_runs::record_ramp_hold;

fn main() {
    let repeats = std::env::args().nth(1).map_or(21, |text| text.parse().expect("a number"));
    let rig = SimRig::new(SimSettings::default());
    let calibration = rig.calibration();
    let session = record_ramp_hold(Box::new(rig), calibration.clone(), RampHold::default());
    let read = source::of_session(session, RecordStretch::RampHold, &[]).expect("a session");
    let known = ForceUncertainty::of(&calibration).expect("an uncertainty");
    let (samples, options) = (&read.samples, FitOptions::default());
    let record = SignalRecord { name: "lab", samples, signal: read.signal.as_ref() };
    let calibration = Some(("lab", &known));
    let traced = TracedRecord { name: "lab", samples, calibration, compliance: None };
    let mut times = [const { Vec::new() }; 3];
    for _ in 0..repeats {
        let start = Stopwatch::start();
        FitSolution::of(samples, &options).expect("a fit").report();
        times[0].push(start.seconds());
        let start = Stopwatch::start();
        let fitted = FitSolution::fit_signals(&[record], &options, &[]).expect("a fit");
        fitted.report();
        times[1].push(start.seconds());
        let start = Stopwatch::start();
        fitted.systematic(&[traced]).expect("its uncertainty");
        times[2].push(start.seconds());
    }
    let [forces, volts, errors] = times.map(|mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        1e3 * times[times.len() / 2]
    });
    println!("{} samples, median of {repeats}", samples.len());
    println!("fit of forces {forces:.1} ms");
    println!("fit of volts {volts:.1} ms, {:.1} times as long", volts / forces);
    println!(
        "errors of the calibration besides {errors:.1} ms, {:.1} times as long",
        errors / forces
    );
}
