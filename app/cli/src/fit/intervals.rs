//! Intervals that need more than one pass: profile likelihood and block bootstrap.

use super::super::Failure;
use super::super::output::{Bar, Output};
use super::FitArgs;
use palpate_analysis::fit::{BOOTSTRAP_REPEATS_MIN, IntervalRequest};
use palpate_rheology::fit::Bootstrap;

pub(super) fn check(args: &FitArgs) -> Result<(), Failure> {
    match args.bootstrap {
        Some(repeats) if repeats < BOOTSTRAP_REPEATS_MIN => Err(Failure::usage(format!(
            "--bootstrap {repeats} is too few for a 95 % interval; give at least {BOOTSTRAP_REPEATS_MIN} repeats"
        ))),
        None if args.seed.is_some() => {
            Err(Failure::usage("--seed needs --bootstrap; add --bootstrap, or leave out --seed"))
        }
        _ => Ok(()),
    }
}

pub(super) fn wanted(args: &FitArgs) -> IntervalRequest {
    let seed = args.seed.unwrap_or(1);
    IntervalRequest {
        with_profile: args.profile,
        bootstrap: args.bootstrap.map(|repeats| Bootstrap { seed, repeats }),
    }
}

/// A bar over the fits of a bootstrap, if there is one.
pub(super) fn bar(args: &FitArgs, output: &Output) -> Option<Bar> {
    let bar = output.count_bar(args.bootstrap? as u64);
    bar.set_message("bootstrap");
    Some(bar)
}

pub(super) fn show(bar: &Option<Bar>, done: usize) {
    bar.iter().for_each(|bar| bar.set_position(done as u64));
}
