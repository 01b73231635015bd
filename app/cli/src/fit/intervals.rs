//! Intervals that take more than one pass: profile likelihood and block bootstrap.

use super::super::{Failure, output::Output};
use super::FitArgs;
use palpate_analysis::fit::Intervals;
use palpate_figures::uncertain::{interval, plain};
use palpate_rheology::fit::{Bootstrap, FitReport, Fitted};

/// Repeats below this say nothing of the ends of a 95 % interval.
const REPEATS_MIN: usize = 40;

/// Refuses what cannot be asked.
pub(super) fn check(args: &FitArgs) -> Result<(), Failure> {
    match args.bootstrap {
        Some(repeats) if repeats < REPEATS_MIN => Err(Failure::usage(format!(
            "--bootstrap {repeats} is too few for a 95 % interval; ask for at least {REPEATS_MIN}"
        ))),
        None if args.seed.is_some() => Err(Failure::usage(
            "--seed is for --bootstrap; ask for that too, or leave it out",
        )),
        _ => Ok(()),
    }
}

/// Whether any are asked for.
pub(super) fn wanted(args: &FitArgs) -> bool {
    args.profile || args.bootstrap.is_some()
}

/// Finds what `args` ask for of one record of a fit.
pub(super) fn find(
    args: &FitArgs,
    fitted: &Fitted<'_>,
    record: usize,
    output: &Output,
) -> Result<Intervals, Failure> {
    let seed = args.seed.unwrap_or(1);
    let bootstrap = args.bootstrap.map(|repeats| Bootstrap { seed, repeats });
    let bar = bootstrap.map(|choice| {
        let bar = output.count_bar(choice.repeats as u64);
        bar.set_message("bootstrap");
        bar
    });
    let found = Intervals::of(fitted, record, args.profile, bootstrap, |done| {
        if let Some(bar) = &bar {
            bar.set_position(done as u64);
        }
    });
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    found.map_err(Failure::failed)
}

/// Lines for people, in the digits of the report.
pub(super) fn lines(found: &Intervals, report: &FitReport) -> Vec<String> {
    let line = |name: &str, ends: [Option<f64>; 2]| {
        let known = report
            .parameter(name)
            .and_then(|known| Some((known.value, known.std_error?)));
        let text = match (ends, known) {
            ([Some(low), Some(high)], Some((value, error))) => interval([low, high], value, error),
            _ => {
                let [low, high] = ends.map(|end| end.map_or("open".to_owned(), plain));
                format!("[{low}, {high}]")
            }
        };
        format!("  {name:<10} {text}")
    };
    let mut lines = Vec::new();
    if !found.profile.is_empty() {
        lines.push("95 % from the profile likelihood".to_owned());
    }
    for one in &found.profile {
        lines.push(line(&one.name, [one.low, one.high]));
    }
    if let Some(seed) = found.bootstrap_seed {
        lines.push(format!("95 % from the bootstrap, seed {seed}"));
    }
    for one in &found.bootstrap {
        lines.push(line(&one.name, one.ci95.map(Some)));
    }
    lines
}
