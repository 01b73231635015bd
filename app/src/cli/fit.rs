//! `palpate fit`: the force model fitted to a session or a table.

use super::Failure;
use super::output::Output;
use clap::Args;
use palpate_model::fit::{FitOptions, FitReport, Parameter, fit};
use palpate_protocols::analysis::{self, FitSource};
use palpate_protocols::runner::Stopwatch;
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `palpate fit`.
#[derive(Debug, Args)]
pub struct FitArgs {
    /// Session folder, or a delimited table with columns for time, depth and force
    source: PathBuf,
    /// Hold a parameter, as NAME=VALUE; may be repeated
    #[arg(long = "fixed", value_name = "NAME=VALUE")]
    fixed: Vec<String>,
    /// Free a parameter that is held by default, such as x_contact; may be repeated
    #[arg(long = "free", value_name = "NAME")]
    free: Vec<String>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Serialize)]
struct FitOutput<'a> {
    #[serde(flatten)]
    report: &'a FitReport,
    /// The fit alone, without reading.
    seconds: f64,
}

pub(super) fn run(args: &FitArgs, output: &Output) -> Result<(), Failure> {
    let options = options(args)?;
    let FitSource { samples, notes } =
        analysis::read(&args.source).map_err(super::source_failure)?;
    notes.iter().for_each(|note| output.note(note));
    let watch = Stopwatch::start();
    let report = fit(&samples, &options)
        .map_err(|err| Failure::failed(format!("{err}, in {}", args.source.display())))?;
    let seconds = watch.seconds();
    super::last_fit::remember(&report, &args.source, output);
    report
        .warnings
        .iter()
        .for_each(|warning| output.note(warning));
    output.result(
        &FitOutput {
            report: &report,
            seconds,
        },
        || text(&report, seconds),
    );
    Ok(())
}

fn options(args: &FitArgs) -> Result<FitOptions, Failure> {
    let mut options = FitOptions::default();
    let names = args.free.iter().map(|name| name.trim());
    let held = args
        .fixed
        .iter()
        .filter_map(|pair| pair.split('=').next().map(str::trim));
    let mut names: Vec<&str> = names.chain(held).collect();
    names.sort_unstable();
    if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(Failure::usage(format!(
            "{} is given twice; say once what it shall be",
            pair[0]
        )));
    }
    for name in &args.free {
        options.free(name).map_err(Failure::usage)?;
    }
    for pair in &args.fixed {
        let parsed = pair.split_once('=').and_then(|(name, value)| {
            value
                .trim()
                .parse::<f64>()
                .ok()
                .filter(|value| value.is_finite())
                .map(|value| (name.trim(), value))
        });
        let Some((name, value)) = parsed else {
            return Err(Failure::usage(format!(
                "--fixed {pair} is not NAME=VALUE, as in --fixed f_offset=0"
            )));
        };
        options.fix(name, value).map_err(Failure::usage)?;
    }
    Ok(options)
}

fn text(report: &FitReport, seconds: f64) -> String {
    let mut lines = vec![report.model.clone()];
    lines.extend(report.parameters.iter().map(parameter_line));
    lines.push(format!(
        "R2 {:.6}, rmse {:.3} mN over {} samples, {:.3} s",
        report.r2,
        report.rmse_n * 1e3,
        report.samples,
        seconds
    ));
    lines.join("\n")
}

/// One parameter as people read it.
pub(super) fn parameter_line(parameter: &Parameter) -> String {
    let uncertainty = match parameter.std_error {
        Some(error) => format!("± {error:.2e}"),
        None if parameter.is_fixed => "fixed".into(),
        None => "not identified".into(),
    };
    format!(
        "  {:<10} {:>14.7e} {:<9} {uncertainty}",
        parameter.name, parameter.value, parameter.unit
    )
}
