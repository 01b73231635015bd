//! Several sources fitted together, with some parameters the same in all.

use super::super::{Failure, output::Output};
use super::Recipe;
use super::sources::{self, Recording};
use crate::report::text;
use palpate_model::fit::{
    FitSample, JointReport, NamedReport, Parameter, Systematic, Traced, fit_joint, systematic_joint,
};
use palpate_protocols::compliance::Correction;
use palpate_protocols::runner::Stopwatch;
use serde::Serialize;
use std::path::PathBuf;

/// The five parameters of the tissue, which `--share body` stands for.
const BODY: [&str; 5] = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig"];

#[derive(Serialize)]
struct JointOutput<'a> {
    #[serde(flatten)]
    report: &'a JointReport,
    /// What the rig's compliance did to the depths of each record, or would; null where none is known.
    compliances: Vec<Option<&'a Correction>>,
    /// What calibrations and compliances add, for each record; absent for tables and with `--no-systematic`.
    #[serde(skip_serializing_if = "Option::is_none")]
    systematic: Option<&'a [Systematic]>,
    /// The fit alone, without reading.
    seconds: f64,
}

/// Fits all sources together; `shared` is a list of names with commas.
pub(super) fn run(
    given: &[PathBuf],
    shared: &str,
    recipe: &Recipe,
    output: &Output,
) -> Result<(), Failure> {
    let found = sources::find(given, output)?;
    if found.len() < 2 {
        return Err(Failure::usage(
            "--share needs at least two recordings; name them all, or a folder of them",
        ));
    }
    let shared = names(shared);
    let records = sources::read(
        &found,
        recipe.columns.as_ref(),
        recipe.wanted,
        &recipe.corrections,
        output,
    )?;
    let borrowed: Vec<(&str, &[FitSample])> = records.iter().map(Recording::borrowed).collect();
    let watch = Stopwatch::start();
    let mut report = fit_joint(&borrowed, &recipe.options, &shared).map_err(|err| {
        use palpate_model::fit::FitError::{NotShareable, UnknownParameter};
        match err {
            NotShareable { .. } | UnknownParameter { .. } => Failure::usage(err),
            _ => Failure::failed(err),
        }
    })?;
    let seconds = watch.seconds();
    let find = |records: &[Traced<'_>]| systematic_joint(records, &recipe.options, &shared);
    let systematic = match recipe.is_systematic {
        true => sources::systematic(&records, find, output),
        false => None,
    };
    if let Some(found) = &systematic {
        report = report.with_systematic(found);
    }
    let object = JointOutput {
        systematic: systematic.as_deref(),
        report: &report,
        compliances: records.iter().map(|one| one.compliance.as_ref()).collect(),
        seconds,
    };
    output.result(&object, || {
        let first = systematic.iter().flatten().next();
        let sentence = first.map(|one| format!("- {}", one.sentence()));
        let lines: Vec<String> = [whole(&report)].into_iter().chain(sentence).collect();
        lines.join("\n")
    });
    Ok(())
}

fn names(shared: &str) -> Vec<&str> {
    shared
        .split(',')
        .map(str::trim)
        .flat_map(|name| match name {
            "body" => BODY.to_vec(),
            name => vec![name],
        })
        .collect()
}

/// What is shared once, then every record with what is its own.
fn whole(report: &JointReport) -> String {
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
    for named in &report.records {
        lines.push(named.record.clone());
        lines.extend(part(named, false));
        lines.push(format!("  {}", text::quality(&named.report)));
        lines.extend(
            named
                .report
                .sentences()
                .map(|sentence| format!("  - {sentence}")),
        );
    }
    lines.join("\n")
}
