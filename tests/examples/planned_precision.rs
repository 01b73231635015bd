//! How often runs of a planned protocol reach the planned interval: `planned_precision RUNS [PERCENT OF TAU]`
//!
//! Each run is on a specimen of its own: a first run as the thesis makes it, the plan like that run, and a run of what it
//! proposes.
#![expect(clippy::print_stdout, reason = "a program that prints")]
use palpate_tests::interval_coverage::CoverageCase;
use palpate_tests::planned_runs::{PlannedRun, planned_press, planned_runs};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let runs: u64 = arguments.next().map_or(60, |text| text.parse().expect("a number of runs"));
    let percent: f64 = arguments.next().map_or(0.5, |text| text.parse().expect("a percentage"));
    let found = planned_runs(CoverageCase::named("lab"), percent, 1..runs + 1, 2);
    let count = |is: &dyn Fn(&PlannedRun) -> bool| {
        let count = found.iter().filter(|one| is(one)).count();
        format!("{count} of {runs} ({:.1} %)", 100.0 * count as f64 / runs as f64)
    };
    let mean = |of: &dyn Fn(&PlannedRun) -> f64| found.iter().map(of).sum::<f64>() / runs as f64;
    println!(
        "tau_eps within {percent} %, ramp and hold of {:.1} s in tissue on average:",
        mean(&|one| one.secs)
    );
    println!("  error within {percent} %: {}", count(&|one| one.error.abs() <= percent));
    println!(
        "  error within the interval of its fit: {}",
        count(&|one| one.error.abs() <= one.stated)
    );
    println!(
        "  interval of the fit {:.3} % on average, {:.3} root mean square; 1.96 root mean squares of the error {:.3} %",
        mean(&|one| one.stated),
        mean(&|one| one.stated.powi(2)).sqrt(),
        1.96 * mean(&|one| one.error.powi(2)).sqrt()
    );
    // Plans that had known how runs scatter.
    let known = percent * percent / (1.96 * mean(&|one| one.error.powi(2)).sqrt());
    let needed = mean(&|one| planned_press(one.assumed.clone(), known).2);
    println!("  {:.3} times as long as needed", mean(&|one| one.secs) / needed);
}
