//! Intervals that take more than one pass: profile likelihood and block bootstrap.

use super::super::{Failure, output::Output};
use super::FitArgs;
use crate::widgets::uncertain::{interval, plain};
use palpate_model::fit::{
    Bootstrap, BootstrapInterval, FitOptions, FitReport, FitSample, Fitted, ProfileInterval,
};
use serde::Serialize;

/// Repeats below this say nothing of the ends of a 95 % interval.
const REPEATS_MIN: usize = 40;

/// What was asked for and found.
#[derive(Default, Serialize)]
pub(super) struct Intervals {
    /// Ends are null where they are open.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    profile: Vec<ProfileInterval>,
    #[serde(skip_serializing_if = "Option::is_none")]
    bootstrap_seed: Option<u64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    bootstrap: Vec<BootstrapInterval>,
}

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

impl Intervals {
    /// Finds what `args` ask for.
    pub fn of(
        args: &FitArgs,
        samples: &[FitSample],
        options: &FitOptions,
        output: &Output,
    ) -> Result<Self, Failure> {
        let mut found = Self::default();
        if !args.profile && args.bootstrap.is_none() {
            return Ok(found);
        }
        let fitted = Fitted::of(samples, options).map_err(Failure::failed)?;
        if args.profile {
            found.profile = fitted.profile(0).map_err(Failure::failed)?;
        }
        if let Some(repeats) = args.bootstrap {
            let seed = args.seed.unwrap_or(1);
            let bar = output.count_bar(repeats as u64);
            bar.set_message("bootstrap");
            let choice = Bootstrap { seed, repeats };
            found.bootstrap = fitted
                .bootstrap(0, choice, |done| bar.set_position(done as u64))
                .map_err(Failure::failed)?;
            bar.finish_and_clear();
            found.bootstrap_seed = Some(seed);
        }
        Ok(found)
    }

    /// Lines for people, in the digits of the report.
    pub fn lines(&self, report: &FitReport) -> Vec<String> {
        let line = |name: &str, ends: [Option<f64>; 2]| {
            let known = report
                .parameter(name)
                .and_then(|known| Some((known.value, known.std_error?)));
            let text = match (ends, known) {
                ([Some(low), Some(high)], Some((value, error))) => {
                    interval([low, high], value, error)
                }
                _ => {
                    let [low, high] = ends.map(|end| end.map_or("open".to_owned(), plain));
                    format!("[{low}, {high}]")
                }
            };
            format!("  {name:<10} {text}")
        };
        let mut lines = Vec::new();
        if !self.profile.is_empty() {
            lines.push("95 % from the profile likelihood".to_owned());
        }
        for found in &self.profile {
            lines.push(line(&found.name, [found.low, found.high]));
        }
        if let Some(seed) = self.bootstrap_seed {
            lines.push(format!("95 % from the bootstrap, seed {seed}"));
        }
        for found in &self.bootstrap {
            lines.push(line(&found.name, found.ci95.map(Some)));
        }
        lines
    }
}
