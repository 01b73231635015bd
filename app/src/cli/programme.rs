//! `palpate run FILE` for a programme: every task on one rig, a journal to continue from, a page of what it told.

use super::Failure;
use super::output::Output;
use super::protocol::FileReport;
use super::rig::{OpenRig, RigArgs};
use super::run::{HowArgs, USUAL_INDENTER};
use crate::report::programme::Page;
use crate::report::text::in_columns;
use palpate_protocols::file::Problem;
use palpate_protocols::plans::Plan;
use palpate_protocols::programme::{
    Done, Event, Foreseen, Laboratory, Programme, ProgrammeError, RunError, foresee,
    run as carry_out,
};
use palpate_protocols::runner::{Answers, RunView, Runner, wall_now};
use palpate_sessions::about::pair_of;
use palpate_sessions::text::{checksum, read};
use palpate_sessions::{library_folder, new_programme_folder};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;

/// Name of the page in the programme's folder.
const PAGE_FILE: &str = "summary.html";

/// Name of the calibration in force at the end.
const CALIBRATION_FILE: &str = "calibration.json";

/// How what is asked for is told.
const TELL: &str = "write it into [about] of the file, or into [specimen.N] for one specimen, or add --operator, --specimen or --about KEY=VALUE";

/// Whether a name is the file of a programme.
pub(super) fn is_one(name: &str) -> bool {
    read(Path::new(name)).is_ok_and(|text| Programme::is_meant(&text))
}

#[derive(Serialize)]
struct Report<'a> {
    command: &'static str,
    programme: &'a str,
    folder: PathBuf,
    was_continued: bool,
    page: PathBuf,
    calibration: Option<PathBuf>,
    #[serde(flatten)]
    told: &'a Page,
}

pub(super) fn run(
    file: &Path,
    how: &HowArgs,
    values: &BTreeMap<String, String>,
    output: &Output,
) -> Result<(), Failure> {
    if !values.is_empty() {
        return Err(Failure::usage(
            "a programme sets its values itself; change them in its file",
        ));
    }
    let text = read(file).map_err(Failure::usage)?;
    let mut programme = parse(file, &text).map_err(|err| refusal(file, &err))?;
    programme.is_acknowledged |= how.acknowledge;
    tell(&mut programme, how)?;
    let rig_args = with_settings(&how.rig, &programme.simulated)?;
    let bench = super::rig::open(&rig_args)?;
    let planned = look_ahead(&programme, &bench)?.map_err(|err| refusal(file, &err))?;
    for note in &planned.notes {
        output.note(&format!("{}, {note}", file.display()));
    }
    if let Some(first) = planned.to_acknowledge.first() {
        return Err(refuse(file, first));
    }
    if how.preview {
        let report = Ahead::of(&programme, &planned);
        output.result(&report, || contents(&programme, &report));
        return Ok(());
    }
    ask(file, &programme)?;
    let description = bench.rig.description().clone();
    let is_virtual = bench.rig.is_virtual();
    let gate = |plan: &Plan| {
        let gate = super::run::gate_of(plan, &description.name, is_virtual)?;
        match gate.to_acknowledge() {
            // What the file accepts are forces, not a rig that failed.
            reasons if how.acknowledge => Ok(reasons),
            reasons => match reasons.first() {
                Some(reason) => Err(format!(
                    "{reason}; or add --acknowledge to run all the same, which is recorded"
                )),
                None => Ok(reasons),
            },
        }
    };
    for task in &programme.tasks {
        if let Some(plan) = task.plan(1, None) {
            gate(&plan).map_err(|reason| {
                let message = format!("task '{}': {reason}", task.name);
                refuse(file, &Problem::error(task.line, message))
            })?;
        }
    }
    let folder = match &how.out {
        Some(folder) => folder.clone(),
        None => {
            let library = library_folder().map_err(Failure::usage)?;
            new_programme_folder(&library, &programme.name, wall_now().into())
        }
    };
    bench.doubts.iter().for_each(|doubt| output.note(doubt));
    let answers = if is_virtual {
        Answers::Confirm
    } else {
        Answers::Operator
    };
    let (wake, woken) = sync_channel(1);
    let runner = Runner::start(bench.rig, rig_args.time_scale, None, move || {
        // A full channel already says what this would say.
        let _ = wake.try_send(());
    })
    .map_err(Failure::failed)?;
    super::run::stop_on_signals(&runner)?;
    let laboratory = Laboratory {
        runner: &runner,
        woken: &woken,
        rig: &description,
        limits: bench.limits,
        calibration: bench.calibration,
        folder: &folder,
        answers,
        gate: &gate,
    };
    let done = watch(&programme, &checksum(&text), laboratory, output)?;
    drop(runner);
    leave(&programme, &folder, &done, output)
}

/// Carries the programme out with a line of progress.
fn watch(
    programme: &Programme,
    crc32: &str,
    laboratory: Laboratory<'_>,
    output: &Output,
) -> Result<Done, Failure> {
    let bar = output.bar(1000);
    let mut so_far = String::new();
    let result = carry_out(programme, crc32, laboratory, &mut |event| match event {
        Event::Begun { place, count } => {
            let task = &programme.tasks[place.task].name;
            so_far = format!("{} of {}: {task} {}", count.0 + 1, count.1, place.repeat);
            bar.set_position(1000 * u64::from(count.0) / u64::from(count.1.max(1)));
        }
        Event::Running(view, left) => bar.set_message(format!("{so_far}  {}", going(view, left.0))),
        Event::Finished(..) | Event::Calibrated(_) => {}
    });
    bar.finish_and_clear();
    result.map_err(|err| match err {
        RunError::Folder(_) | RunError::Progress(_) | RunError::Refused { .. } => {
            Failure::usage(err)
        }
        err => Failure::failed(err),
    })
}

fn going(view: &RunView, left: f64) -> String {
    let left = left.round() as u64;
    format!(
        "{}  {}:{:02}:{:02} of session time left",
        view.phase,
        left / 3600,
        left / 60 % 60,
        left % 60
    )
}

/// Writes the page and the calibration and tells where they are.
fn leave(
    programme: &Programme,
    folder: &Path,
    done: &Done,
    output: &Output,
) -> Result<(), Failure> {
    let bar = output.count_bar(programme.tasks.len() as u64);
    let page = Page::of(programme, folder, &done.progress, &mut |task| {
        bar.inc(1);
        bar.set_message(task.to_owned());
    });
    bar.finish_and_clear();
    let path = folder.join(PAGE_FILE);
    palpate_sessions::text::write(&path, &page.html()).map_err(Failure::failed)?;
    let has_calibrated = programme.tasks.iter().any(|task| task.calibrates);
    let calibration = has_calibrated.then(|| folder.join(CALIBRATION_FILE));
    if let Some(path) = &calibration {
        let text = serde_json::to_string_pretty(&done.calibration).map_err(Failure::failed)?;
        palpate_sessions::text::write(path, &text).map_err(Failure::failed)?;
    }
    let report = Report {
        command: "run",
        programme: &programme.name,
        folder: folder.to_path_buf(),
        was_continued: done.was_continued,
        page: path.clone(),
        calibration: calibration.clone(),
        told: &page,
    };
    output.result(&report, || {
        let mut lines = vec![page.table(), format!("page: {}", path.display())];
        lines.extend(calibration.map(|path| format!("calibration: {}", path.display())));
        lines.join("\n")
    });
    Ok(())
}

/// The programme of a file; protocols that are not built in lie beside it.
fn parse(file: &Path, text: &str) -> Result<Programme, ProgrammeError> {
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
fn refusal(file: &Path, err: &ProgrammeError) -> Failure {
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
fn refuse(file: &Path, problem: &Problem) -> Failure {
    let error = Problem::error(problem.line, problem.message.clone());
    Failure::usage(format!("{}, {error}", file.display()))
}

/// What the command line says of every session holds over the file.
fn tell(programme: &mut Programme, how: &HowArgs) -> Result<(), Failure> {
    programme.usual.indenter = USUAL_INDENTER.to_owned();
    let indenter = how.indenter.as_deref().unwrap_or_default();
    let labels = [
        ("operator", how.operator.as_str()),
        ("specimen", how.specimen.as_str()),
        ("indenter", indenter),
    ];
    for (key, value) in labels.into_iter().filter(|(_, value)| !value.is_empty()) {
        programme
            .tell(key, value)
            .map_err(|err| Failure::usage(format!("--{key}: {err}")))?;
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
fn ask(file: &Path, programme: &Programme) -> Result<(), Failure> {
    let questions = programme.questions();
    if questions.is_empty() {
        return Ok(());
    }
    let told: Vec<String> = questions
        .iter()
        .map(|question| format!("line {}: {}", question.line, question.message))
        .collect();
    Err(Failure::usage(format!(
        "{}: nothing has begun, for {}; {TELL}",
        file.display(),
        told.join("; ")
    )))
}

/// Everything that can be said of a programme file before it runs, in order of lines.
pub(super) fn check(file: &str, bench: &OpenRig) -> Result<FileReport, Failure> {
    let text = read(Path::new(file)).map_err(Failure::usage)?;
    let mut report = FileReport {
        file: file.to_owned(),
        name: None,
        problems: Vec::new(),
        expected_s: None,
    };
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

fn look_ahead(
    programme: &Programme,
    bench: &OpenRig,
) -> Result<Result<Foreseen, ProgrammeError>, Failure> {
    let curve = bench.calibration.curve().map_err(Failure::usage)?;
    let rig = bench.rig.description();
    Ok(foresee(programme, rig, &bench.limits, &curve))
}

/// What the programme says of a simulated rig, where the command line says nothing else.
fn with_settings(args: &RigArgs, simulated: &BTreeMap<String, String>) -> Result<RigArgs, Failure> {
    let mut args = args.clone();
    let usual = RigArgs::default();
    for (name, value) in simulated {
        let wrong =
            |err: &dyn std::fmt::Display| Failure::usage(format!("[simulated] {name}: {err}"));
        match name.as_str() {
            "preconditioning" if args.preconditioning == usual.preconditioning => {
                args.preconditioning = value.parse().map_err(|err| wrong(&err))?;
            }
            "softening" if args.softening == usual.softening => {
                args.softening = value.parse().map_err(|err| wrong(&err))?;
            }
            "preconditioning" | "softening" => {}
            _ => {
                return Err(Failure::usage(format!(
                    "[simulated] has no setting '{name}'; it has preconditioning and softening"
                )));
            }
        }
    }
    Ok(args)
}

/// What a programme will do, as `--preview` tells it.
#[derive(Serialize)]
struct Ahead<'a> {
    command: &'static str,
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
    fn of(programme: &'a Programme, foreseen: &Foreseen) -> Self {
        let pairs = programme.tasks.iter().zip(&foreseen.tasks);
        Self {
            command: "run",
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

fn contents(programme: &Programme, foreseen: &Ahead<'_>) -> String {
    let mut lines = vec![
        ["task", "times", "min", "at most", "peak N", "protocol"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for (task, ahead) in programme.tasks.iter().zip(&foreseen.tasks) {
        lines.push(vec![
            task.name.clone(),
            task.repeats.to_string(),
            format!("{:.1}", ahead.expected_s / 60.0),
            format!("{:.1}", ahead.longest_s / 60.0),
            format!(
                "{:.1} to {:.1}",
                ahead.force_band_n[0], ahead.force_band_n[1]
            ),
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
