//! Checks and preview of a programme before it runs.

use crate::Failure;
use crate::protocol::FileReport;
use crate::rig::{OpenRig, RigArgs};
use crate::run::{SessionArgs, USUAL_INDENTER};
use palpate_analysis::report::text::in_columns;
use palpate_model::metadata::split_pair;
use palpate_protocols::file::ProtocolProblem;
use palpate_runner::programme::{Programme, ProgrammeError, ProgrammeForecast, forecast_programme};
use palpate_runner::study::Study;
use palpate_sessions::library_folder;
use palpate_sessions::text::read;
use std::collections::BTreeMap;
use std::path::Path;

/// How to supply missing labels.
const SUPPLY_HINT: &str = "write each label into [about] of the file, or into [specimen.N] for one specimen, or add --operator, --specimen or --about KEY=VALUE";

/// The programme of a file; protocols that are not built in are files in its folder.
pub(super) fn parse(file: &Path, text: &str) -> Result<Programme, ProgrammeError> {
    let read_protocol = |name: &str| {
        let path = file.parent().unwrap_or(Path::new(".")).join(name);
        read(&path).map_err(|err| {
            format!(
                "'{name}' is neither a built-in protocol nor a file in the programme's folder ({err})"
            )
        })
    };
    Programme::read(text, &read_protocol)
}

/// The first problem, in the form of a protocol's.
pub(super) fn parse_failure(file: &Path, err: &ProgrammeError) -> Failure {
    let (first, rest) = match err.0.split_first() {
        Some((first, rest)) => (first.to_string(), rest.len()),
        None => (String::new(), 0),
    };
    let name = file.display();
    let more = match rest {
        0 => String::new(),
        count => format!("; 'palpate protocol check {name}' lists {count} more"),
    };
    Failure::usage(format!("{name}, {first}{more}"))
}

/// A problem that a check only reports stops a run.
pub(super) fn problem_failure(file: &Path, problem: &ProtocolProblem) -> Failure {
    let error = ProtocolProblem::error(problem.line, problem.message.clone());
    Failure::usage(format!("{}, {error}", file.display()))
}

/// Labels of the command line take precedence over the file.
pub(super) fn apply_labels(
    programme: &mut Programme,
    options: &SessionArgs,
) -> Result<(), Failure> {
    programme.default_labels.indenter = USUAL_INDENTER.to_owned();
    let indenter = options.indenter.as_deref().unwrap_or_default();
    let labels = [
        ("operator", options.operator.as_str()),
        ("specimen", options.specimen.as_str()),
        ("indenter", indenter),
    ];
    for (key, value) in labels.into_iter().filter(|(_, value)| !value.is_empty()) {
        programme.set_label(key, value).map_err(|err| Failure::usage(format!("--{key}: {err}")))?;
    }
    for text in &options.about {
        split_pair(text)
            .map_err(|err| err.to_string())
            .and_then(|(key, value)| programme.set_label(key, value))
            .map_err(|err| Failure::usage(format!("--about: {err}")))?;
    }
    Ok(())
}

/// Labels that neither the programme nor the study of the library sets.
fn open_questions(programme: &Programme) -> Result<Vec<ProtocolProblem>, Failure> {
    let study = library_folder().map_or(Ok(Study::default()), |at| Study::of_library(&at));
    study.and_then(|study| programme.open_questions(&study)).map_err(Failure::usage)
}

/// Refuses while labels that protocols ask for are missing.
pub(super) fn require_labels(file: &Path, programme: &Programme) -> Result<(), Failure> {
    let questions = open_questions(programme)?;
    if questions.is_empty() {
        return Ok(());
    }
    let missing: Vec<String> = questions
        .iter()
        .map(|question| format!("line {}: {}", question.line, question.message))
        .collect();
    Err(Failure::usage(format!(
        "{}: labels are missing: {}; {SUPPLY_HINT}",
        file.display(),
        missing.join("; ")
    )))
}

/// Checks a programme file; problems are in order of lines.
pub(crate) fn check(file: &str, bench: &OpenRig) -> Result<FileReport, Failure> {
    let text = read(Path::new(file)).map_err(Failure::usage)?;
    let mut report =
        FileReport { file: file.to_owned(), name: None, problems: Vec::new(), expected_s: None };
    let programme = match parse(Path::new(file), &text) {
        Ok(programme) => programme,
        Err(err) => {
            report.problems = err.0;
            return Ok(report);
        }
    };
    // A wrong setting of the simulated rig is a mistake of the file.
    if let Err(err) = with_settings(&RigArgs::default(), &programme.simulated) {
        report.problems.push(ProtocolProblem::error(0, err.sentence()));
    }
    let questions = open_questions(&programme)?.into_iter();
    report.problems.extend(questions.map(|question| {
        ProtocolProblem::warning(question.line, format!("{}; {SUPPLY_HINT}", question.message))
    }));
    match preview_programme(&programme, bench)? {
        Ok(ahead) => {
            report.expected_s = Some(ahead.expected().0);
            report.problems.extend(ahead.notes);
            report.problems.extend(ahead.to_acknowledge);
        }
        Err(err) => report.problems.extend(err.0),
    }
    report.problems.sort_by_key(|problem| problem.line);
    report.name = Some(programme.name);
    Ok(report)
}

pub(super) fn preview_programme(
    programme: &Programme,
    bench: &OpenRig,
) -> Result<Result<ProgrammeForecast, ProgrammeError>, Failure> {
    let curve = bench.calibration.curve().map_err(Failure::usage)?;
    let rig = bench.rig.description();
    Ok(forecast_programme(programme, rig, &bench.limits, &curve))
}

/// Settings of the programme for a simulated rig; the command line takes precedence.
pub(super) fn with_settings(
    args: &RigArgs,
    simulated: &BTreeMap<String, String>,
) -> Result<RigArgs, Failure> {
    let mut args = args.clone();
    let usual = RigArgs::default();
    for (name, value) in simulated {
        let wrong =
            |err: &dyn std::fmt::Display| Failure::usage(format!("[simulated] {name}: {err}"));
        match name.as_str() {
            "preconditioning" if args.bench.preconditioning == usual.bench.preconditioning => {
                args.bench.preconditioning = value.parse().map_err(|err| wrong(&err))?;
            }
            "softening" if args.bench.softening == usual.bench.softening => {
                args.bench.softening = value.parse().map_err(|err| wrong(&err))?;
            }
            "rate" if args.rate == usual.rate => {
                args.rate = value.parse().map_err(|err| wrong(&err))?;
            }
            // The command line sets another value; an unknown name was refused when the file was read.
            _ => {}
        }
    }
    Ok(args)
}

/// The object of `--preview`.
pub(super) fn preview_object(
    programme: &Programme,
    foreseen: &ProgrammeForecast,
) -> serde_json::Value {
    let tasks = programme.tasks.iter().zip(&foreseen.tasks).map(|(task, ahead)| {
        serde_json::json!({
            "task": task.name, "repeats": task.repeats, "expected_s": ahead.expected.0,
            "longest_s": ahead.longest.0, "force_band_n": ahead.force_band.map(|force| force.0),
        })
    });
    serde_json::json!({
        "programme": programme.name, "sessions": programme.session_count(),
        "expected_s": foreseen.expected().0, "tasks": tasks.collect::<Vec<_>>(),
    })
}

pub(super) fn preview_table(programme: &Programme, foreseen: &ProgrammeForecast) -> String {
    let mut lines = vec![
        ["task", "times", "min", "at most", "peak (N)", "protocol"].map(str::to_owned).to_vec(),
    ];
    for (task, ahead) in programme.tasks.iter().zip(&foreseen.tasks) {
        let [low, high] = ahead.force_band.map(|force| force.0);
        lines.push(vec![
            task.name.clone(),
            task.repeats.to_string(),
            format!("{:.1}", ahead.expected.0 / 60.0),
            format!("{:.1}", ahead.longest.0 / 60.0),
            format!("{low:.1} to {high:.1}"),
            task.protocol.title.clone(),
        ]);
    }
    format!(
        "{}\n{}\n{} sessions, about {:.0} min of session time",
        programme.title,
        in_columns(&lines),
        programme.session_count(),
        foreseen.expected().0 / 60.0
    )
}
