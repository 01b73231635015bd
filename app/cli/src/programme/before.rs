//! What is said of a programme before it runs: its mistakes, what is asked and told, what it will do.

use crate::Failure;
use crate::protocol::FileReport;
use crate::rig::{OpenRig, RigArgs};
use crate::run::{HowArgs, USUAL_INDENTER};
use palpate_analysis::report::text::in_columns;
use palpate_model::about::pair_of;
use palpate_protocols::file::Problem;
use palpate_runner::programme::{Foreseen, Programme, ProgrammeError, foresee};
use palpate_sessions::text::read;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// How what is asked for is told.
const TELL: &str = "write it into [about] of the file, or into [specimen.N] for one specimen, or add --operator, --specimen or --about KEY=VALUE";

/// The programme of a file; protocols that are not built in lie beside it.
pub(super) fn parse(file: &Path, text: &str) -> Result<Programme, ProgrammeError> {
    let beside = |name: &str| {
        let path = file.parent().unwrap_or(Path::new(".")).join(name);
        read(&path).map_err(|err| {
            format!(
                "'{name}' is neither a built-in protocol nor a file beside the programme ({err})"
            )
        })
    };
    Programme::read(text, &beside)
}

/// The first problem, as a protocol's is told.
pub(super) fn refusal(file: &Path, err: &ProgrammeError) -> Failure {
    let (first, rest) = match err.0.split_first() {
        Some((first, rest)) => (first.to_string(), rest.len()),
        None => (String::new(), 0),
    };
    let name = file.display();
    let more = match rest {
        0 => String::new(),
        count => format!("; and {count} more: see 'palpate protocol check {name}'"),
    };
    Failure::usage(format!("{name}, {first}{more}"))
}

/// What would only be looked at before a check keeps a run from starting.
pub(super) fn refuse(file: &Path, problem: &Problem) -> Failure {
    let error = Problem::error(problem.line, problem.message.clone());
    Failure::usage(format!("{}, {error}", file.display()))
}

/// What the command line says of every session holds over the file.
pub(super) fn tell(programme: &mut Programme, how: &HowArgs) -> Result<(), Failure> {
    programme.usual.indenter = USUAL_INDENTER.to_owned();
    let indenter = how.indenter.as_deref().unwrap_or_default();
    let labels = [
        ("operator", how.operator.as_str()),
        ("specimen", how.specimen.as_str()),
        ("indenter", indenter),
    ];
    for (key, value) in labels.into_iter().filter(|(_, value)| !value.is_empty()) {
        programme.tell(key, value).map_err(|err| Failure::usage(format!("--{key}: {err}")))?;
    }
    for text in &how.about {
        pair_of(text)
            .map_err(|err| err.to_string())
            .and_then(|(key, value)| programme.tell(key, value))
            .map_err(|err| Failure::usage(format!("--about: {err}")))?;
    }
    Ok(())
}

/// Refuses while something that protocols ask for is not told.
pub(super) fn ask(file: &Path, programme: &Programme) -> Result<(), Failure> {
    let questions = programme.questions();
    if questions.is_empty() {
        return Ok(());
    }
    let told: Vec<String> = questions
        .iter()
        .map(|question| format!("line {}: {}", question.line, question.message))
        .collect();
    Err(Failure::usage(format!(
        "{}: before it begins, something must be told: {}; {TELL}",
        file.display(),
        told.join("; ")
    )))
}

/// Everything that can be said of a programme file before it runs, in order of lines.
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
    // What cannot be a setting of the simulated rig is a mistake of the file.
    if let Err(err) = with_settings(&RigArgs::default(), &programme.simulated) {
        report.problems.push(Problem::error(0, err.sentence()));
    }
    let questions = programme.questions().into_iter();
    report.problems.extend(
        questions.map(|question| {
            Problem::warning(question.line, format!("{}; {TELL}", question.message))
        }),
    );
    match look_ahead(&programme, bench)? {
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

pub(super) fn look_ahead(
    programme: &Programme,
    bench: &OpenRig,
) -> Result<Result<Foreseen, ProgrammeError>, Failure> {
    let curve = bench.calibration.curve().map_err(Failure::usage)?;
    let rig = bench.rig.description();
    Ok(foresee(programme, rig, &bench.limits, &curve))
}

/// What the programme says of a simulated rig, where the command line says nothing else.
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
            // The command line says something else; and what there is not was told when the file was read.
            _ => {}
        }
    }
    Ok(args)
}

/// What a programme will do, as `--preview` tells it.
#[derive(Serialize)]
pub(super) struct Ahead<'a> {
    programme: &'a str,
    sessions: u32,
    expected_s: f64,
    tasks: Vec<AheadTask<'a>>,
}

/// One task of it.
#[derive(Serialize)]
struct AheadTask<'a> {
    task: &'a str,
    repeats: u32,
    expected_s: f64,
    longest_s: f64,
    force_band_n: [f64; 2],
}

impl<'a> Ahead<'a> {
    pub(super) fn of(programme: &'a Programme, foreseen: &Foreseen) -> Self {
        let pairs = programme.tasks.iter().zip(&foreseen.tasks);
        Self {
            programme: &programme.name,
            sessions: programme.session_count(),
            expected_s: foreseen.expected().0,
            tasks: pairs
                .map(|(task, ahead)| AheadTask {
                    task: &task.name,
                    repeats: task.repeats,
                    expected_s: ahead.expected.0,
                    longest_s: ahead.longest.0,
                    force_band_n: ahead.force_band.map(|force| force.0),
                })
                .collect(),
        }
    }
}

pub(super) fn contents(programme: &Programme, foreseen: &Ahead<'_>) -> String {
    let mut lines =
        vec![["task", "times", "min", "at most", "peak N", "protocol"].map(str::to_owned).to_vec()];
    for (task, ahead) in programme.tasks.iter().zip(&foreseen.tasks) {
        lines.push(vec![
            task.name.clone(),
            task.repeats.to_string(),
            format!("{:.1}", ahead.expected_s / 60.0),
            format!("{:.1}", ahead.longest_s / 60.0),
            format!("{:.1} to {:.1}", ahead.force_band_n[0], ahead.force_band_n[1]),
            task.protocol.title.clone(),
        ]);
    }
    format!(
        "{}\n{}\n{} sessions, about {:.0} min of session time",
        programme.title,
        in_columns(&lines),
        foreseen.sessions,
        foreseen.expected_s / 60.0
    )
}
