//! `palpate run FILE` for a programme: every task on one rig, a journal to continue from, a summary page.

mod preflight;

pub(super) use preflight::check;

use super::Failure;
use super::notices::Notices;
use super::output::{Output, merged};
use super::prompts::OperatorPrompts;
use super::run::SessionArgs;
use palpate_analysis::report::programme::ProgrammePage;
use palpate_protocols::file::ProtocolProblem;
use palpate_protocols::plans::Plan;
use palpate_runner::programme::{
    Programme, ProgrammeEvent, ProgrammeResult, ProgrammeRunError, ProgrammeSetup,
    run_programme as carry_out,
};
use palpate_runner::{PromptResponder, RunView, Runner, wall_now};
use palpate_sessions::text::{checksum, read};
use palpate_sessions::{library_folder, new_programme_folder};
use preflight::{
    apply_labels, parse, parse_failure, preview_object, preview_programme, preview_table,
    problem_failure, require_labels, with_settings,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::sync_channel;

/// Name of the page in the programme's folder.
const PAGE_FILE: &str = "summary.html";

/// Name of the calibration in force at the end.
const CALIBRATION_FILE: &str = "calibration.json";

/// Whether a name is the file of a programme.
pub(super) fn is_programme(name: &str) -> bool {
    read(Path::new(name)).is_ok_and(|text| Programme::is_programme_text(&text))
}

/// The folder that is named, or a new one in the library.
fn folder_of(programme: &Programme, options: &SessionArgs) -> Result<PathBuf, Failure> {
    if let Some(folder) = &options.out {
        return Ok(folder.clone());
    }
    let library = library_folder().map_err(Failure::usage)?;
    Ok(new_programme_folder(&library, &programme.name, wall_now().into()))
}

pub(super) fn run(
    file: &Path,
    options: &SessionArgs,
    values: &BTreeMap<String, String>,
    output: &Output,
) -> Result<(), Failure> {
    if !values.is_empty() {
        return Err(Failure::usage(
            "--set does not apply to a programme; change the values in its file",
        ));
    }
    let text = read(file).map_err(Failure::usage)?;
    let mut programme = parse(file, &text).map_err(|err| parse_failure(file, &err))?;
    programme.is_acknowledged |= options.acknowledge;
    apply_labels(&mut programme, options)?;
    let rig_args = options.rig.with_specimen(&options.specimen)?;
    let rig_args = with_settings(&rig_args, &programme.simulated)?;
    let bench = super::rig::open(&rig_args)?;
    let planned =
        preview_programme(&programme, &bench)?.map_err(|err| parse_failure(file, &err))?;
    for note in &planned.notes {
        output.note(&format!("{}, {note}", file.display()));
    }
    if let Some(first) = planned.to_acknowledge.first() {
        let Failure::Usage(sentence) = problem_failure(file, first) else {
            return Err(problem_failure(file, first));
        };
        return Err(Failure::Usage(format!("{sentence}, or add --acknowledge")));
    }
    if options.preview {
        let object = preview_object(&programme, &planned);
        output.answer("run", &object, || preview_table(&programme, &planned));
        return Ok(());
    }
    require_labels(file, &programme)?;
    let description = bench.rig.description().clone();
    let is_virtual = bench.rig.is_virtual();
    let gate = |plan: &Plan| {
        let gate = super::run::gate_of(plan, &description.name, is_virtual)?;
        match gate.to_acknowledge() {
            // The file accepts forces, not a rig that failed its check.
            reasons if options.acknowledge => Ok(reasons),
            reasons => match reasons.first() {
                Some(reason) => Err(format!(
                    "{reason}, or add --acknowledge to run anyway; the session records the acknowledgement"
                )),
                None => Ok(reasons),
            },
        }
    };
    check_gates(file, &programme, &gate)?;
    let folder = folder_of(&programme, options)?;
    bench.from_library.iter().chain(&bench.doubts).for_each(|words| output.note(words));
    let answers = if is_virtual { PromptResponder::Confirm } else { PromptResponder::Operator };
    #[cfg(feature = "station")]
    let bound = options.serve.bind()?;
    let notices = Notices::open(&bench.calibration, output);
    let (wake, woken) = sync_channel(1);
    let runner = Runner::start(bench.rig, rig_args.time_scale, None, move || {
        // A full channel holds a wake-up already.
        let _ = wake.try_send(());
    })
    .map_err(Failure::failed)?;
    #[cfg(feature = "station")]
    let _station = super::station::serve_run(bound, &runner, output)?;
    let is_question_open = super::run::stop_on_signals(&runner)?;
    let prompts = (answers == PromptResponder::Operator)
        .then(|| OperatorPrompts::start(runner.requests(), is_question_open));
    let laboratory = ProgrammeSetup {
        runner: &runner,
        woken: &woken,
        rig: &description,
        limits: bench.limits,
        calibration: bench.calibration,
        folder: &folder,
        answers,
        gate: &gate,
    };
    let prompts = prompts.transpose()?;
    let watching = (&notices, prompts);
    let done = run_and_watch(&programme, &checksum(&text), laboratory, watching, output);
    drop(runner);
    notices.finish(output);
    let done = done?;
    write_results(&programme, &folder, &done, output)
}

/// Refuses before anything moves what the daily check of the rig blocks.
fn check_gates(
    file: &Path,
    programme: &Programme,
    gate: &dyn Fn(&Plan) -> Result<Vec<String>, String>,
) -> Result<(), Failure> {
    for task in &programme.tasks {
        if let Some(plan) = task.plan(1, None) {
            gate(&plan).map_err(|reason| {
                let message = format!("task '{}': {reason}", task.name);
                problem_failure(file, &ProtocolProblem::error(task.line, message))
            })?;
        }
    }
    Ok(())
}

fn run_and_watch(
    programme: &Programme,
    crc32: &str,
    laboratory: ProgrammeSetup<'_>,
    (notices, mut prompts): (&Notices, Option<OperatorPrompts>),
    output: &Output,
) -> Result<ProgrammeResult, Failure> {
    let bar = output.bar(1000);
    let runner = laboratory.runner;
    let mut task_text = String::new();
    let result = carry_out(programme, crc32, laboratory, &mut |event| match event {
        ProgrammeEvent::Begun { place, count } => {
            let task = &programme.tasks[place.task].name;
            task_text = format!("{} of {}: {task} {}", count.0 + 1, count.1, place.repeat);
            bar.set_position(1000 * u64::from(count.0) / u64::from(count.1.max(1)));
        }
        ProgrammeEvent::Running(view, left) => {
            notices.see(&runner.snapshot());
            bar.set_message(format!("{task_text}  {}", progress_text(view, left.0)));
            if let Some(prompts) = &mut prompts {
                bar.suspend(|| prompts.update(view, output));
            }
        }
        ProgrammeEvent::Calibrated(calibration) => notices.use_calibration(calibration),
        ProgrammeEvent::Finished(..) => {}
    });
    drop(bar);
    result.map_err(|err| match err {
        ProgrammeRunError::Folder(_)
        | ProgrammeRunError::Progress(_)
        | ProgrammeRunError::Refused { .. } => Failure::usage(err),
        err => Failure::failed(err),
    })
}

fn progress_text(view: &RunView, left: f64) -> String {
    let left = left.round() as u64;
    format!(
        "{}  {}:{:02}:{:02} of session time left",
        view.phase,
        left / 3600,
        left / 60 % 60,
        left % 60
    )
}

/// Writes the page and the calibration and prints their paths.
fn write_results(
    programme: &Programme,
    folder: &Path,
    done: &ProgrammeResult,
    output: &Output,
) -> Result<(), Failure> {
    let bar = output.count_bar(programme.tasks.len() as u64);
    let page = ProgrammePage::of(programme, folder, &done.progress, &mut |task| {
        bar.inc(1);
        bar.set_message(task.to_owned());
    });
    drop(bar);
    let path = folder.join(PAGE_FILE);
    palpate_sessions::text::write(&path, &page.html()).map_err(Failure::failed)?;
    let has_calibrated = programme.tasks.iter().any(|task| task.calibrates);
    let calibration = has_calibrated.then(|| folder.join(CALIBRATION_FILE));
    if let Some(path) = &calibration {
        let text = serde_json::to_string_pretty(&done.calibration).map_err(Failure::failed)?;
        palpate_sessions::text::write(path, &text).map_err(Failure::failed)?;
    }
    let display = |path: &Path| path.display().to_string();
    let object = serde_json::json!({
        "programme": programme.name, "folder": display(folder), "was_continued": done.was_continued,
        "page": display(&path), "calibration": calibration.as_deref().map(display),
    });
    output.answer("run", &merged(object, &page), || {
        let mut lines = vec![page.table(), format!("page: {}", path.display())];
        lines.extend(calibration.map(|path| format!("calibration: {}", path.display())));
        lines.join("\n")
    });
    page.loss_sentence().map_or(Ok(()), |loss| Err(Failure::failed(loss)))
}
