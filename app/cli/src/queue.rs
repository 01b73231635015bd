//! `palpate queue`: the specimens that are to be measured, in which order, and what became of each.

use super::Failure;
use super::output::{Output, merged};
use super::run::{SessionArgs, run_queued};
use super::verdict::ReasonArgs;
use clap::{Args, Subcommand};
use palpate_analysis::edits::author;
use palpate_analysis::report::queue::queue_text;
use palpate_analysis::session_actions::Attribution;
use palpate_analysis::specimen_queue::{
    change, drawn_seed, judge_run, named_specimens, read_specimens, session_path, visible_items,
};
use palpate_runner::wall_now;
use palpate_sessions::specimen_queue::{QueueChange, QueueVerdict, SpecimenQueue, start};
use palpate_sessions::{library_folder, new_session_folder, new_session_id};
use std::path::{Path, PathBuf};

/// The queue of specimens: fill it, order it, measure the next one
#[derive(Debug, Subcommand)]
pub enum QueueCommand {
    /// Show every specimen and what became of it
    Show,
    /// Begin a new queue once the old one is done; the old one stays in its journal
    New(NewArgs),
    /// Add specimens by name, or from a table
    Add(AddArgs),
    /// Put the specimens that wait in a random order; the seed is recorded
    Shuffle(ShuffleArgs),
    /// Move a specimen to another place among those that wait
    Move(MoveArgs),
    /// Leave a specimen out
    Skip(NumberArgs),
    /// Let a skipped, accepted or rejected specimen wait again
    Restore(NumberArgs),
    /// Measure the next specimen by its protocol
    Run(Box<SessionArgs>),
    /// Judge the last run: accept, reject, or reject and repeat
    Judge(JudgeArgs),
}

/// Arguments of `palpate queue new`.
#[derive(Debug, Args)]
pub struct NewArgs {
    /// Name of the queue, such as pilot-3
    name: String,
    /// Hide labels and order of the specimens to come from whoever measures
    #[arg(long)]
    blinded: bool,
    /// Author; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

/// Arguments of `palpate queue add`.
#[derive(Debug, Args)]
pub struct AddArgs {
    /// Names of specimens
    #[arg(value_name = "SPECIMEN", required_unless_present = "from")]
    names: Vec<String>,
    /// Table with a header: the column 'specimen', and 'protocol' and labels such as specimen.thickness_mm where wanted
    #[arg(long, value_name = "FILE.csv", conflicts_with = "names")]
    from: Option<PathBuf>,
    /// Protocol of the specimens for which the table names none
    #[arg(long, value_name = "NAME|FILE", default_value = "ramp-hold")]
    protocol: String,
    /// Author; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

/// Arguments of `palpate queue shuffle`.
#[derive(Debug, Args)]
pub struct ShuffleArgs {
    /// Seed of the order; without it one is drawn
    #[arg(long)]
    seed: Option<u64>,
    /// Author; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

/// Arguments of `palpate queue move`.
#[derive(Debug, Args)]
pub struct MoveArgs {
    /// Number of the specimen in the queue
    number: u32,
    /// New place among those that wait, from 1
    place: u32,
    #[command(flatten)]
    reason: ReasonArgs,
}

/// Arguments of `palpate queue skip` and `palpate queue restore`.
#[derive(Debug, Args)]
pub struct NumberArgs {
    /// Number of the specimen in the queue
    number: u32,
    #[command(flatten)]
    reason: ReasonArgs,
}

/// Arguments of `palpate queue judge`.
#[derive(Debug, Args)]
pub struct JudgeArgs {
    /// accept, reject or repeat
    #[arg(value_parser = verdict_of)]
    verdict: QueueVerdict,
    /// Reason, in a few words; only an acceptance needs none
    #[arg(long, value_name = "TEXT", default_value = "", hide_default_value = true)]
    reason: String,
    /// Author; without it the login name
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
}

fn verdict_of(text: &str) -> Result<QueueVerdict, String> {
    let found = QueueVerdict::ALL.into_iter().find(|one| one.name() == text);
    found.ok_or_else(|| "give accept, reject or repeat".into())
}

fn by(name: Option<&str>) -> Attribution {
    Attribution { by: author(name), reason: String::new() }
}

pub(super) fn run(command: &QueueCommand, output: &Output) -> Result<(), Failure> {
    let library = library_folder().map_err(Failure::usage)?;
    let done = |name: &str, who: &Attribution, wanted: QueueChange| {
        let queue = change(&library, who, wanted).map_err(Failure::usage)?;
        show(name, &queue, output);
        Ok(())
    };
    match command {
        QueueCommand::Show => {
            show("queue show", &read(&library)?, output);
            Ok(())
        }
        QueueCommand::New(args) => {
            done("queue new", &by(args.by.as_deref()), start(&args.name, args.blinded))
        }
        QueueCommand::Add(args) => {
            let specimens = match &args.from {
                Some(file) => {
                    read_specimens(&library, file, &args.protocol).map_err(Failure::usage)?
                }
                None => named_specimens(&library, &args.names, &args.protocol)
                    .map_err(Failure::usage)?,
            };
            done("queue add", &by(args.by.as_deref()), QueueChange::Added { specimens })
        }
        QueueCommand::Shuffle(args) => {
            let seed = args.seed.unwrap_or_else(drawn_seed);
            let wanted = read(&library)?.shuffle(seed);
            done("queue shuffle", &by(args.by.as_deref()), wanted)
        }
        QueueCommand::Move(args) => {
            let wanted = QueueChange::Moved { number: args.number, place: args.place };
            done("queue move", &args.reason.author(), wanted)
        }
        QueueCommand::Skip(args) => {
            done("queue skip", &args.reason.author(), QueueChange::Skipped { number: args.number })
        }
        QueueCommand::Restore(args) => done(
            "queue restore",
            &args.reason.author(),
            QueueChange::Restored { number: args.number },
        ),
        QueueCommand::Run(args) => measure(args, &library, output),
        QueueCommand::Judge(args) => judge(args, &library, output),
    }
}

fn read(library: &Path) -> Result<SpecimenQueue, Failure> {
    SpecimenQueue::read(library).map_err(Failure::failed)
}

fn show(command: &str, queue: &SpecimenQueue, output: &Output) {
    let object = serde_json::json!({
        "name": queue.name, "is_blinded": queue.is_blinded, "seeds": queue.seeds,
        "specimens": visible_items(queue),
    });
    output.answer(command, &merged(object, &queue.counts()), || queue_text(queue));
}

/// Runs the protocol of the next specimen; its run then waits for a verdict.
fn measure(args: &SessionArgs, library: &Path, output: &Output) -> Result<(), Failure> {
    if !args.specimen.is_empty() {
        return Err(Failure::usage(
            "the queue names the specimen; leave out --specimen, or move the specimen to the front with 'palpate queue move'",
        ));
    }
    let queue = read(library)?;
    if let Some(open) = queue.open_run() {
        return Err(Failure::usage(format!(
            "the run of {} has no verdict yet; 'palpate queue judge' accepts, rejects or repeats it",
            open.wanted.specimen
        )));
    }
    let Some(next) = queue.next() else {
        return Err(Failure::usage("no specimen waits; 'palpate queue add' adds specimens"));
    };
    let new_folder = || new_session_folder(library, &new_session_id(wall_now().into()));
    let folder = args.out.clone().unwrap_or_else(new_folder);
    let session = std::path::absolute(&folder).unwrap_or_else(|_| folder.clone());
    let session = session_path(library, &session);
    let labels = next.wanted.labels.iter().map(|(name, text)| format!("{name}={text}"));
    let options = SessionArgs {
        out: Some(folder),
        specimen: next.wanted.specimen.clone(),
        about: labels.chain(args.about.iter().cloned()).collect(),
        ..args.clone()
    };
    let operator = Some(args.operator.as_str()).filter(|name| !name.is_empty());
    let begun = || {
        let begun = QueueChange::Begun { number: next.number, session: session.clone() };
        if let Err(reason) = change(library, &by(operator), begun) {
            output.note(&format!("the queue does not know of this run: {reason}"));
        }
    };
    run_queued(&next.wanted.protocol, &options, &begun, output)
}

fn judge(args: &JudgeArgs, library: &Path, output: &Output) -> Result<(), Failure> {
    let who = Attribution { by: author(args.by.as_deref()), reason: args.reason.clone() };
    let queue = judge_run(library, args.verdict, &who).map_err(Failure::usage)?;
    show("queue judge", &queue, output);
    Ok(())
}
