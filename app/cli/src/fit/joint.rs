//! Several sources fitted together, with some parameters the same in all.

use super::super::{Failure, output::Output, sources_failure};
use super::{FitArgs, intervals};
use palpate_analysis::fit::{Recipe, TogetherRequest, fit_together};
use palpate_analysis::report::fit_json::Beside;
use palpate_analysis::report::{family, text};
use palpate_analysis::sources::{self, Naming, Reading};
use palpate_rheology::fit::{FitError, JointReport, NamedReport, Parameter};

/// Fits all sources together; `shared` is a list of names with commas, the whole body without it.
pub(super) fn run(
    args: &FitArgs,
    shared: Option<&str>,
    recipe: &Recipe,
    output: &Output,
) -> Result<(), Failure> {
    let found = sources::find(&args.sources).map_err(sources_failure)?;
    found.note().iter().for_each(|note| output.note(note));
    if shared.is_some() && found.paths.len() < 2 {
        return Err(Failure::usage(
            "--share needs at least two recordings; name them all, or a folder of them",
        ));
    }
    let how = Reading {
        columns: recipe.columns.as_ref(),
        wanted: recipe.wanted,
        corrections: &recipe.corrections,
        naming: Naming::Path,
    };
    let records = sources::read(&found.paths, how).map_err(sources_failure)?;
    records.notes.iter().for_each(|note| output.note(note));
    let request = TogetherRequest {
        options: &recipe.options,
        shared: shared.unwrap_or("body").split(',').map(str::trim).collect(),
        is_systematic: recipe.is_systematic,
        intervals: intervals::wanted(args),
    };
    let bar = intervals::bar(args, output);
    let fitted = fit_together(&records, &request, |_, done| intervals::show(&bar, done));
    drop(bar);
    let fitted = fitted.map_err(|err| match err {
        FitError::NotShareable { .. } | FitError::UnknownParameter { .. } => Failure::usage(err),
        _ => Failure::failed(err),
    })?;
    fitted.notes.iter().for_each(|note| output.note(note));
    let beside = fitted.beside(&records);
    let (family, is_named) = (recipe.options.family(), args.family.is_some());
    let object = fitted.object(&recipe.options, &beside);
    output.result(&object, || {
        let mut lines = vec![whole(&fitted.report, &beside, is_named)];
        if is_named {
            lines[0] = family::with_equation(family, &lines[0]);
            lines.extend(family::limits(family).map(|sentence| format!("- {sentence}")));
        }
        let first = fitted.systematic.iter().flatten().next();
        lines.extend(first.map(|one| format!("- {}", one.sentence())));
        lines.join("\n")
    });
    Ok(())
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
        lines.push(format!("{}, {} records together", first.report.model, report.records.len()));
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
        lines.extend(named.report.sentences().map(|sentence| format!("  - {sentence}")));
    }
    lines.join("\n")
}
