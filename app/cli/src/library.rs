//! `palpate library`: a library in an object store, which many rigs share.

use super::output::Output;
use super::{Failure, output::merged};
use clap::{Args, Subcommand};
use palpate_analysis::report::text::{counted, megabytes};
use palpate_analysis::shared_library::{
    SharedLibrary, SharedLibraryError, StoreVerification, push_words,
};
use serde_json::json;
use std::path::PathBuf;

/// Share a library in an object store: push finished sessions, pull them, look after the store
#[derive(Debug, Subcommand)]
pub enum LibraryCommand {
    /// Push finished sessions; what the store has already is not sent again
    Push(PushArgs),
    /// Pull sessions into folders of their names
    Pull(PullArgs),
    /// Look whether everything that the table names is in the store
    Verify(VerifyArgs),
    /// Join small files of the table, so that other programs read it faster; nothing is deleted
    Compact(CompactArgs),
}

#[derive(Debug, Args)]
pub struct PushArgs {
    /// The store, as in s3://bucket/folder or file:///folder; credentials of S3 come from AWS_ACCESS_KEY_ID,
    /// AWS_SECRET_ACCESS_KEY, AWS_REGION and AWS_ENDPOINT
    store: String,
    /// Session folders, which are sent again where the store has lost a part of them; without any, all new sessions of the library
    #[arg(value_name = "SESSION")]
    sessions: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub struct PullArgs {
    /// The store
    store: String,
    /// Identifiers of sessions, as 'palpate find --store' lists them; without any, all sessions
    #[arg(value_name = "ID")]
    ids: Vec<String>,
    /// The folder for the sessions
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// The store
    store: String,
    /// Read every byte and compare its checksum, instead of the sizes alone
    #[arg(long)]
    deep: bool,
}

#[derive(Debug, Args)]
pub struct CompactArgs {
    /// The store
    store: String,
}

pub(super) fn run(command: &LibraryCommand, output: &Output) -> Result<(), Failure> {
    match command {
        LibraryCommand::Push(args) => push(args, output),
        LibraryCommand::Pull(args) => pull(args, output),
        LibraryCommand::Verify(args) => verify(args, output),
        LibraryCommand::Compact(args) => compact(args, output),
    }
}

fn push(args: &PushArgs, output: &Output) -> Result<(), Failure> {
    let mut library = SharedLibrary::create(&args.store).map_err(failure)?;
    let bar = output.count_bar(0);
    let outcome = library.push(&args.sessions, &bar).map_err(failure)?;
    drop(bar);
    let object = merged(json!({ "store": library.address() }), &outcome);
    output.answer("library push", &object, || push_words(&outcome));
    match outcome.refused.len() {
        0 => Ok(()),
        count => Err(Failure::failed(format!("{} not pushed", counted(count, "session")))),
    }
}

fn pull(args: &PullArgs, output: &Output) -> Result<(), Failure> {
    let mut library = SharedLibrary::open(&args.store).map_err(failure)?;
    let bar = output.count_bar(0);
    let pulled = library.pull(&args.ids, &args.out, &bar).map_err(failure)?;
    drop(bar);
    let object = json!({ "store": library.address(), "sessions": pulled });
    output.answer("library pull", &object, || {
        let new = pulled.iter().filter(|one| !one.was_there);
        let bytes = new.clone().map(|one| one.bytes).sum();
        let there = pulled.iter().filter(|one| one.was_there).count();
        let mut text = format!("{} pulled, {}", counted(new.count(), "session"), megabytes(bytes));
        if there > 0 {
            text += &format!("; {} were there", counted(there, "session"));
        }
        text
    });
    Ok(())
}

fn verify(args: &VerifyArgs, output: &Output) -> Result<(), Failure> {
    let library = SharedLibrary::open(&args.store).map_err(failure)?;
    let bar = output.count_bar(0);
    let found = library.verify(args.deep, &bar).map_err(failure)?;
    drop(bar);
    let object = merged(json!({ "store": library.address() }), &found);
    let StoreVerification { versions, results, faults } = found;
    output.answer("library verify", &object, || {
        let lines = faults.iter().map(|one| format!("{}: {}", one.place, one.sentence));
        let mut looked_at = counted(versions, "session version");
        if results > 0 {
            looked_at += &format!(" and {}", counted(results, "result"));
        }
        let head = match faults.len() {
            0 => format!("all {looked_at} in the store are whole"),
            count => format!("{} in {looked_at}", counted(count, "fault")),
        };
        [head].into_iter().chain(lines).collect::<Vec<_>>().join("\n")
    });
    match faults.len() {
        0 => Ok(()),
        count => Err(Failure::failed(format!(
            "the store has {}; remove objects with wrong bytes, and push these sessions by their folders from a computer that has them",
            counted(count, "fault")
        ))),
    }
}

fn compact(args: &CompactArgs, output: &Output) -> Result<(), Failure> {
    let library = SharedLibrary::open(&args.store).map_err(failure)?;
    let done = library.compact().map_err(failure)?;
    let object = merged(json!({ "store": library.address() }), &done);
    output.answer("library compact", &object, || {
        format!(
            "{} in {} instead of {}",
            counted(done.rows, "row"),
            counted(done.after, "file"),
            done.before
        )
    });
    Ok(())
}

pub(super) fn failure(err: SharedLibraryError) -> Failure {
    match err.is_wrong_use() {
        true => Failure::usage(err),
        false => Failure::failed(err),
    }
}
