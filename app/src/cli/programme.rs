//! `palpate run FILE` for a programme: every task on one rig, a journal to continue from, a page of what it told.

use super::Failure;
use super::output::Output;
use super::rig::{OpenRig, RigArgs};
use super::run::HowArgs;
use crate::report::programme::Page;
use crate::report::text::in_columns;
use palpate_protocols::preview::preview;
use palpate_protocols::programme::{
    Done, Event, Laboratory, Programme, RunError, run as carry_out,
};
use palpate_protocols::runner::{Answers, RunView, Runner, wall_now};
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
    let mut programme = read_programme(file, &text)?;
    if !how.operator.is_empty() {
        programme.operator.clone_from(&how.operator);
    }
    programme.is_acknowledged |= how.acknowledge;
    let rig_args = with_settings(&how.rig, &programme.simulated)?;
    let bench = super::rig::open(&rig_args)?;
    let planned = foreseen(file, &programme, &bench)?;
    if how.preview {
        output.result(&planned, || contents(&programme, &planned));
        return Ok(());
    }
    let folder = match &how.out {
        Some(folder) => folder.clone(),
        None => {
            let library = library_folder().map_err(Failure::usage)?;
            new_programme_folder(&library, &programme.name, wall_now().into())
        }
    };
    bench.doubts.iter().for_each(|doubt| output.note(doubt));
    let description = bench.rig.description().clone();
    let is_virtual = bench.rig.is_virtual();
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
        indenter: how.indenter.clone(),
        gate: &|plan| {
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
        },
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

fn read_programme(file: &Path, text: &str) -> Result<Programme, Failure> {
    // Protocols that are not built in lie beside the programme.
    let beside = |name: &str| {
        let path = file.parent().unwrap_or(Path::new(".")).join(name);
        read(&path).map_err(|err| {
            format!(
                "'{name}' is neither a built-in protocol nor a file beside the programme ({err})"
            )
        })
    };
    Programme::read(text, &beside)
        .map_err(|err| Failure::usage(format!("{}: {err}", file.display())))
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

/// What a programme will do, session by session, as far as it can be known.
#[derive(Serialize)]
struct Foreseen {
    command: &'static str,
    programme: String,
    sessions: u32,
    expected_s: f64,
    tasks: Vec<ForeseenTask>,
}

/// One task of it.
#[derive(Serialize)]
struct ForeseenTask {
    task: String,
    repeats: u32,
    expected_s: f64,
    longest_s: f64,
    force_band_n: [f64; 2],
}

/// Previews every task before anything moves; the first that cannot run refuses with its line.
fn foreseen(file: &Path, programme: &Programme, bench: &OpenRig) -> Result<Foreseen, Failure> {
    let curve = bench.calibration.curve().map_err(Failure::usage)?;
    let rig = bench.rig.description();
    let mut tasks = Vec::new();
    for task in &programme.tasks {
        let at = format!(
            "{}: line {}: task '{}'",
            file.display(),
            task.line,
            task.name
        );
        let mut total = ForeseenTask {
            task: task.name.clone(),
            repeats: task.repeats,
            expected_s: 0.0,
            longest_s: 0.0,
            force_band_n: [0.0; 2],
        };
        for repeat in 1..=task.repeats {
            let Some(plan) = task.plan(repeat, None) else {
                return Err(Failure::usage(format!(
                    "{at}: its protocol cannot be written out"
                )));
            };
            let preview = preview(&plan, rig, &bench.limits, &curve, false);
            if let Err(reason) = preview.verdict(programme.is_acknowledged) {
                let hint = if preview.refusals.is_empty() {
                    "; write acknowledge = true into the file, or add --acknowledge"
                } else {
                    ""
                };
                return Err(Failure::usage(format!("{at}: {reason}{hint}")));
            }
            total.expected_s += preview.expected.0;
            total.longest_s += preview.longest.0;
            total.force_band_n = preview.force_band.map(|force| force.0);
        }
        tasks.push(total);
    }
    Ok(Foreseen {
        command: "run",
        programme: programme.name.clone(),
        sessions: programme.session_count(),
        expected_s: tasks.iter().map(|task| task.expected_s).sum(),
        tasks,
    })
}

fn contents(programme: &Programme, foreseen: &Foreseen) -> String {
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
