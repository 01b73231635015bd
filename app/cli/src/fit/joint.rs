//! Several sources fitted together, with some parameters the same in all.

use super::super::{Failure, output::Output};
use super::sources::{self, Recording};
use super::{FitArgs, Recipe, intervals};
use palpate_analysis::fit::Intervals;
use palpate_analysis::report::fit_json::{Beside, JointObject, Overlay};
use palpate_analysis::report::{family, text};
use palpate_rheology::fit::{
    FitError, FitSample, Fitted, JointReport, NamedReport, Parameter, Traced, systematic_joint,
};
use palpate_runner::Stopwatch;

/// Stands for all parameters of the specimen.
const BODY: &str = "body";

/// Fits all sources together; `shared` is a list of names with commas, the whole body without it.
pub(super) fn run(
    args: &FitArgs,
    shared: Option<&str>,
    recipe: &Recipe,
    output: &Output,
) -> Result<(), Failure> {
    let found = sources::find(&args.sources, output)?;
    if shared.is_some() && found.len() < 2 {
        return Err(Failure::usage(
            "--share needs at least two recordings; name them all, or a folder of them",
        ));
    }
    let options = &recipe.options;
    let body = options.body_names();
    let shared = names(shared, &body);
    let records = sources::read(
        &found,
        recipe.columns.as_ref(),
        recipe.wanted,
        &recipe.corrections,
        output,
    )?;
    let borrowed: Vec<(&str, &[FitSample])> = records.iter().map(Recording::borrowed).collect();
    let watch = Stopwatch::start();
    let fitted = Fitted::joint(&borrowed, options, &shared).map_err(|err| match err {
        FitError::NotShareable { .. } | FitError::UnknownParameter { .. } => Failure::usage(err),
        _ => Failure::failed(err),
    })?;
    let mut report = fitted.joint_report();
    let seconds = watch.seconds();
    let find = |records: &[Traced<'_>]| systematic_joint(records, options, &shared);
    let systematic = match recipe.is_systematic {
        true => sources::systematic(&records, find, output),
        false => None,
    };
    if let Some(found) = &systematic {
        report = report.with_systematic(found);
    }
    let reports = report.records.iter().map(|one| &one.report);
    let overlays: Vec<Overlay> = reports
        .zip(&borrowed)
        .map(|(report, (_, samples))| Overlay::of(report, samples))
        .collect();
    let each = (0..borrowed.len()).map(|record| match intervals::wanted(args) {
        true => intervals::find(args, &fitted, record, output),
        false => Ok(Intervals::default()),
    });
    let intervals: Vec<Intervals> = each.collect::<Result<_, Failure>>()?;
    let beside: Vec<Beside<'_>> = overlays
        .iter()
        .zip(&intervals)
        .zip(&records)
        .map(|((overlay, intervals), record)| Beside {
            overlay,
            intervals,
            systematic: None,
            compliance: record.compliance.as_ref(),
        })
        .collect();
    let family = options.family();
    let object = JointObject::of(family, &report, &beside, systematic.as_deref(), seconds);
    output.result(&object, || {
        let first = systematic.iter().flatten().next();
        let mut lines = vec![whole(&report, &beside, recipe.is_named)];
        if recipe.is_named {
            lines[0] = family::with_equation(family, &lines[0]);
            lines.extend(family::limits(family).map(|sentence| format!("- {sentence}")));
        }
        lines.extend(first.map(|one| format!("- {}", one.sentence())));
        lines.join("\n")
    });
    Ok(())
}

/// Names in a list with commas, the whole body without one.
fn names<'a>(shared: Option<&'a str>, body: &[&'a str]) -> Vec<&'a str> {
    let names = shared.unwrap_or(BODY).split(',').map(str::trim);
    names
        .flat_map(|name| match name {
            BODY => body.to_vec(),
            name => vec![name],
        })
        .collect()
}

/// What is shared once, then every record with what is its own.
fn whole(report: &JointReport, beside: &[Beside<'_>], with_energy: bool) -> String {
    let is_shared = |parameter: &Parameter| report.shared.contains(&parameter.name);
    let part = |named: &NamedReport, wanted: bool| -> Vec<String> {
        let chosen: Vec<Parameter> = named
            .report
            .parameters
            .iter()
            .filter(|parameter| is_shared(parameter) == wanted)
            .cloned()
            .collect();
        text::parameter_lines(&chosen)
    };
    let mut lines = Vec::new();
    if let Some(first) = report.records.first() {
        lines.push(format!(
            "{}, {} records together",
            first.report.model,
            report.records.len()
        ));
        lines.extend(part(first, true));
    }
    for (named, beside) in report.records.iter().zip(beside) {
        lines.push(named.record.clone());
        lines.extend(part(named, false));
        lines.push(format!("  {}", text::quality(&named.report)));
        if with_energy {
            lines.push(format!("  {}", family::energy(beside.overlay)));
        }
        let found = intervals::lines(beside.intervals, &named.report);
        lines.extend(found.into_iter().map(|line| format!("  {line}")));
        lines.extend(
            named
                .report
                .sentences()
                .map(|sentence| format!("  - {sentence}")),
        );
    }
    lines.join("\n")
}
