//! The command line: one headless subcommand per file, none with logic of its own.
//!
//! Arguments become requests to [`palpate_analysis`] and the runner; results become text or one JSON
//! object. This crate knows no window: whoever has one hands it to [`main`].

mod analyse;
mod analysis;
mod asking;
mod calibration;
mod catalog;
mod compliance;
mod daily_check;
mod doctor;
#[cfg(feature = "emulators")]
mod emulate;
mod export;
#[cfg(feature = "extremes")]
mod extremes;
mod find;
mod fit;
#[cfg(feature = "haptics")]
mod haptics;
mod history;
mod import;
mod info;
mod lake;
mod last_fit;
mod log;
mod new_file;
mod output;
mod plan;
mod programme;
mod protocol;
mod replay;
mod report;
mod review;
mod rig;
mod run;
#[cfg(feature = "haptics")]
mod scene;
mod select;
mod shell;
#[cfg(feature = "haptics")]
mod slave;
mod support_bundle;
mod trade;
mod verdict;
mod wired;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use output::Output;
use palpate_analysis::opening::Windows;
use palpate_analysis::source::SourceError;
use palpate_model::about::Labels;
use palpate_sessions::log::ReadError;
use protocol::ProtocolCommand;
use std::process::ExitCode;
use std::sync::Arc;

/// Workbench for soft-tissue indentation. Without a command it opens the window on the simulated rig.
#[derive(Debug, Parser)]
#[command(name = "palpate", version, propagate_version = true)]
struct Cli {
    /// Show on standard error what is logged; RUST_LOG says what that is
    #[arg(long, global = true)]
    verbose: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Open the window
    Window(rig::RigArgs),
    /// Run a protocol without a window
    Run(Box<run::RunArgs>),
    /// List, check, show or preview protocols
    #[command(subcommand)]
    Protocol(protocol::ProtocolCommand),
    /// Check zero, one known weight and the way home; the result counts for the day
    DailyCheck(daily_check::DailyCheckArgs),
    /// Fit the force model to a session or a table
    Fit(fit::FitArgs),
    /// Tell what the cycles of a record show: loops, shift, decay, relaxation
    #[command(alias = "analyze")]
    Analyse(analyse::AnalyseArgs),
    /// Compare model families and recommend the cheapest that will do
    Select(select::SelectArgs),
    /// Propose the shortest protocol that will tell what is wanted
    Plan(plan::PlanArgs),
    /// Measure error against time on this machine and recommend what to use
    Trade(trade::TradeArgs),
    /// Feed recorded sessions to the engine again and compare
    Replay(replay::ReplayArgs),
    #[cfg(feature = "extremes")]
    /// Test numerical stability at the extremes, every family, integrator and fit
    Extremes(extremes::ExtremesArgs),
    /// Keep, show and check load-cell calibrations
    #[command(subcommand)]
    Calibration(calibration::CalibrationCommand),
    /// Tell in which state sessions are: whole, interrupted, damaged, newer or something else
    Doctor(doctor::DoctorArgs),
    /// Keep what is whole of interrupted or damaged sessions, beside the originals
    Recover(doctor::RecoverArgs),
    /// Make one file for whoever helps: log, versions, settings, state of the sessions; nothing measured unless asked
    SupportBundle(support_bundle::SupportBundleArgs),
    /// Find how far a rig gives way, from a session of stiff-surface
    Compliance(compliance::ComplianceArgs),
    /// Make sessions of other programs' files: tables, Mach-1, testXpert, rheometers
    Import(Box<import::ImportArgs>),
    /// Write a session's samples as a table, or add sessions to a lake
    Export(export::ExportArgs),
    /// Find sessions of the library
    Find(Box<find::FindArgs>),
    /// Tell what is known of a specimen, a rig or a load cell over time
    History(history::HistoryArgs),
    /// Make the catalog of the library anew, or check it
    #[command(subcommand)]
    Catalog(catalog::CatalogCommand),
    /// Tell what a session contains
    Info(info::InfoArgs),
    /// Tell what happened in a run: targets and what was done, missing samples, use of time
    Report(report::ReportArgs),
    /// Say what a session is worth: valid, suspect or rejected
    Verdict(verdict::VerdictArgs),
    /// Correct where a session found contact; its log stays as it is
    CorrectContact(verdict::CorrectArgs),
    /// Give sessions tags to find them by, or take them away
    Tag(review::TagArgs),
    /// Remark on sessions, beside their logs
    Note(review::NoteArgs),
    /// Say that you looked at a session and what you decided, with hashes of what was seen
    Review(review::ReviewArgs),
    /// Make the forces of sessions anew from the raw signal with another calibration, as an analysis beside them
    Recalibrate(analysis::RecalibrateArgs),
    /// Name stretches of a session whose forces do not count, as an analysis beside it
    Mask(analysis::MaskArgs),
    /// Let an analysis count no more; its record stays
    Withdraw(analysis::WithdrawArgs),
    /// Look at rigs on wires: which are there, whether one is as its file says, what it reports
    #[command(subcommand)]
    Rig(wired::RigCommand),
    #[cfg(feature = "haptics")]
    /// Feel a fitted body through a master-slave device: check it, run it, time its loop
    #[command(subcommand)]
    Haptics(haptics::HapticsCommand),
    #[cfg(feature = "haptics")]
    /// See and feel a piece of tissue: run a scene, record it, compute a recording again
    #[command(subcommand)]
    Scene(scene::SceneCommand),
    #[cfg(feature = "emulators")]
    /// Answer like a controller on a wire, with the simulated bench behind it
    #[command(subcommand)]
    Emulate(emulate::EmulateCommand),
    /// Print what completes palpate's commands in a shell
    Completions(shell::CompletionsArgs),
    /// Print the manual page, or write one for every command
    Man(shell::ManArgs),
}

/// Why a command did not do what was asked.
#[derive(Debug)]
pub enum Failure {
    /// Wrong use: nothing was done. Exit code 2.
    Usage(String),
    /// It was tried and failed. Exit code 1.
    Failed(String),
}

impl Failure {
    fn usage(reason: impl ToString) -> Self {
        Self::Usage(reason.to_string())
    }

    fn failed(reason: impl ToString) -> Self {
        Self::Failed(reason.to_string())
    }

    fn code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Failed(_) => 1,
        }
    }

    fn sentence(&self) -> &str {
        match self {
            Self::Usage(sentence) | Self::Failed(sentence) => sentence,
        }
    }
}

/// Parses the arguments; a mistake gets one sentence, and one object with `--json`.
fn parse() -> Result<Cli, ExitCode> {
    Cli::try_parse().map_err(|err| {
        if !err.use_stderr() || err.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            // Help and version print themselves; a closed pipe is the reader's choice.
            let _ = err.print();
            return ExitCode::from(err.exit_code().clamp(0, 2) as u8);
        }
        let is_json = std::env::args_os().any(|argument| argument == "--json");
        let output = if is_json {
            Output::json()
        } else {
            Output::text()
        };
        let text = err.to_string();
        // What is missing stands in lines of its own under the first.
        let lines = text.lines().take_while(|line| !line.trim().is_empty());
        let sentence = lines.map(str::trim).collect::<Vec<_>>().join(" ");
        let sentence = sentence.strip_prefix("error: ").unwrap_or(&sentence);
        output.error(&format!("{sentence}; see 'palpate --help'"), 2);
        ExitCode::from(2)
    })
}

/// A file that reaches the limit of its size (`ulimit -f`) ends a program by a signal, in the middle of a run. Where
/// the signal is taken the write fails instead, and the log knows how to go on from there.
fn outlive_file_limits() {
    // If it cannot be taken the signal ends the program as ever.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// That this program was built without a window.
const NO_WINDOW: &str =
    "this palpate was built without its window; see 'palpate --help' for what it does without";

/// Runs what the arguments ask for; `windows` is what opens a window, if this program has one.
#[must_use]
pub fn main(windows: Option<&dyn Windows>) -> ExitCode {
    outlive_file_limits();
    let cli = match parse() {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    let log = log::begin(cli.verbose);
    log::stop_rigs_on_panic(log.clone());
    let (output, result) = run(cli.command, windows);
    let code = match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if let Failure::Failed(sentence) = &failure {
                tracing::error!("{sentence}");
            }
            output.error(failure.sentence(), failure.code());
            ExitCode::from(failure.code())
        }
    };
    if let Some(log) = log {
        log.flush();
    }
    code
}

/// Does what a command asks, and says where its results go.
fn run(command: Option<Command>, windows: Option<&dyn Windows>) -> (Output, Result<(), Failure>) {
    match command {
        None => (
            Output::text(),
            rig::window(&rig::RigArgs::default(), windows),
        ),
        Some(Command::Window(args)) => (Output::text(), rig::window(&args, windows)),
        Some(Command::Run(args)) => with(args.json, |out| run::run(&args, out)),
        Some(Command::Protocol(command)) => match command {
            ProtocolCommand::List(args) => with(args.json, protocol::list),
            ProtocolCommand::Check(args) => with(args.json, |out| protocol::run_check(&args, out)),
            ProtocolCommand::Show(args) => with(args.json, |out| protocol::show(&args, out)),
            ProtocolCommand::Preview(args) => with(args.json, |out| protocol::preview(&args, out)),
            ProtocolCommand::Words => with(false, protocol::words),
        },
        Some(Command::DailyCheck(args)) => with(args.json, |out| daily_check::run(&args, out)),
        Some(Command::Fit(args)) => with(args.json, |out| fit::run(&args, out)),
        Some(Command::Analyse(args)) => with(args.json, |out| analyse::run(&args, out)),
        Some(Command::Select(args)) => with(args.json, |out| select::run(&args, out)),
        Some(Command::Plan(args)) => with(args.json, |out| plan::run(&args, out)),
        Some(Command::Trade(args)) => with(args.json, |out| trade::run(&args, out)),
        Some(Command::Replay(args)) => with(args.json, |out| replay::run(&args, windows, out)),
        #[cfg(feature = "extremes")]
        Some(Command::Extremes(args)) => with(args.json, |out| extremes::run(&args, out)),
        Some(Command::Calibration(command)) => {
            with(command.is_json(), |out| calibration::run(&command, out))
        }
        Some(Command::Doctor(args)) => with(args.json, |out| doctor::doctor(&args, out)),
        Some(Command::Recover(args)) => with(args.json, |out| doctor::run_recover(&args, out)),
        Some(Command::SupportBundle(args)) => with(args.json, |out| {
            support_bundle::run(&args, windows.is_some(), out)
        }),
        Some(Command::Compliance(args)) => with(args.json, |out| compliance::run(&args, out)),
        Some(Command::Import(args)) => with(args.json, |out| import::run(&args, out)),
        Some(Command::Export(args)) => with(args.json, |out| export::run(&args, out)),
        Some(Command::Find(args)) => with(args.json, |out| find::run(&args, out)),
        Some(Command::History(args)) => with(args.json, |out| history::run(&args, out)),
        Some(Command::Catalog(command)) => {
            with(command.is_json(), |out| catalog::run(&command, out))
        }
        Some(Command::Info(args)) => with(args.json, |out| info::run(&args, out)),
        Some(Command::Report(args)) => with(args.json, |out| report::run(&args, out)),
        Some(Command::Verdict(args)) => with(args.json, |out| verdict::verdict(&args, out)),
        Some(Command::CorrectContact(args)) => with(args.json, |out| verdict::correct(&args, out)),
        Some(Command::Tag(args)) => with(args.is_json(), |out| review::tag(&args, out)),
        Some(Command::Note(args)) => with(args.json, |out| review::note(&args, out)),
        Some(Command::Review(args)) => with(args.json, |out| review::review(&args, out)),
        Some(Command::Recalibrate(args)) => {
            with(args.json, |out| analysis::recalibrate(&args, out))
        }
        Some(Command::Mask(args)) => with(args.json, |out| analysis::mask(&args, out)),
        Some(Command::Withdraw(args)) => with(args.json, |out| analysis::withdraw(&args, out)),
        Some(Command::Rig(command)) => with(command.is_json(), |out| wired::run(&command, out)),
        #[cfg(feature = "haptics")]
        Some(Command::Haptics(command)) => {
            with(command.is_json(), |out| haptics::run(&command, out))
        }
        #[cfg(feature = "haptics")]
        Some(Command::Scene(command)) => with(command.is_json(), |out| scene::run(&command, out)),
        #[cfg(feature = "emulators")]
        Some(Command::Emulate(command)) => {
            with(command.is_json(), |out| emulate::run(&command, out))
        }
        Some(Command::Completions(args)) => with(args.json, |out| {
            shell::completions(&args, out);
            Ok(())
        }),
        Some(Command::Man(args)) => with(args.json, |out| shell::man(&args, out)),
    }
}

fn with(
    is_json: bool,
    run: impl FnOnce(&Output) -> Result<(), Failure>,
) -> (Output, Result<(), Failure>) {
    let output = if is_json {
        Output::json()
    } else {
        Output::text()
    };
    let result = run(&output);
    (output, result)
}

/// Adds what `--about` tells and checks that all of it can stand together.
fn tell(labels: &mut Labels, about: &[String]) -> Result<(), Failure> {
    for pair in about {
        labels
            .tell_pair(pair)
            .map_err(|err| Failure::usage(format!("--about: {err}")))?;
    }
    labels.check().map_err(Failure::usage)
}

/// A session that cannot be read: not being one, or being newer, is wrong use; damage is a failure.
fn read_failure(err: ReadError) -> Failure {
    match err {
        ReadError::Damaged { .. } | ReadError::Io { .. } => Failure::failed(err),
        _ => Failure::usage(err),
    }
}

fn source_failure(err: SourceError) -> Failure {
    match err {
        SourceError::Session(err) => read_failure(err),
        SourceError::Analysis(err) => analysis::failure(err),
        SourceError::Table(_)
        | SourceError::TableAnalysis { .. }
        | SourceError::Rejected { .. }
        | SourceError::Correction(_)
        | SourceError::NoSignal { .. }
        | SourceError::Imported { .. } => Failure::usage(err),
        SourceError::Edits(_)
        | SourceError::Plan { .. }
        | SourceError::Empty
        | SourceError::NoCycles
        | SourceError::Calibration { .. }
        | SourceError::Decision { .. } => Failure::failed(err),
    }
}
