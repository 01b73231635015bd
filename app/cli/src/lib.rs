//! The command line: one headless subcommand per file, none with logic of its own.
//!
//! Arguments become requests to [`palpate_analysis`] and the runner; results become text or one JSON
//! object. This crate has no window: a program with one passes it to [`main`].
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod about;
mod agreement;
mod analyse;
mod arguments;
mod calibration;
mod catalog;
mod completions;
mod compliance;
mod correct_contact;
mod daily_check;
mod demo;
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
mod library;
mod log;
mod make_crate;
mod man;
mod mask;
mod material;
mod new_file;
mod note;
mod notices;
#[cfg(feature = "notifications")]
mod notify;
mod output;
mod plan;
mod population;
mod programme;
mod prompts;
mod protocol;
mod quality;
mod queue;
mod recalibrate;
mod recover;
mod replay;
mod report;
mod reproduce;
mod review;
mod rig;
mod rig_conform;
mod rig_new;
mod run;
#[cfg(feature = "haptics")]
mod scene;
mod select;
#[cfg(feature = "haptics")]
mod slave;
#[cfg(feature = "station")]
mod station;
mod steps;
mod study;
mod support_bundle;
mod tag;
mod terminal;
mod trade;
mod truth;
mod verdict;
mod window;
mod wired;
mod withdraw;

pub use find::find_query;
pub use run::{HostedReport, HostedRun};

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use output::Output;
use palpate_analysis::build_description::BuildDescription;
use palpate_analysis::compliance::ComplianceCorrectionError;
use palpate_analysis::fit::KnownFitError;
use palpate_analysis::recordings::RecordingsError;
use palpate_analysis::source::SourceError;
use palpate_analysis::window_requests::WindowOpener;
use palpate_model::metadata::SessionLabels;
use palpate_sessions::log::ReadError;
use std::ffi::OsString;
use std::process::ExitCode;

/// Workbench for soft-tissue indentation. Without a command it opens the window on the simulated rig.
#[derive(Debug, Parser)]
#[command(name = "palpate", version, propagate_version = true)]
struct Cli {
    /// Show log lines on standard error; RUST_LOG selects them
    #[arg(long, global = true)]
    verbose: bool,
    #[command(subcommand)]
    command: Option<Command>,
    /// Print one JSON object, or one a line where there are several answers
    #[arg(long, global = true)]
    json: bool,
}

/// Makes the commands of a table: each its arguments, which hold its help, and what carries it out.
macro_rules! commands {
    ($windows:ident; $($(#[cfg($($part:tt)*)])? $(#[command($($clap:tt)*)])? $name:ident($args:ty) => $run:path $([$more:ident])?;)*) => {
        #[derive(Debug, Subcommand)]
        enum Command {
            $($(#[cfg($($part)*)])? $(#[command($($clap)*)])? $name(Box<$args>),)*
        }

        impl Command {
            fn run(&self, $windows: Option<&dyn WindowOpener>, output: &Output) -> Result<(), Failure> {
                match self {
                    $($(#[cfg($($part)*)])? Self::$name(args) => $run(args, $($more,)? output),)*
                }
            }
        }
    };
}

commands! { windows;
    Window(window::WindowArgs) => window::run [windows];
    Run(run::RunArgs) => run::run;
    #[cfg(feature = "station")] Serve(station::serve::ServeArgs) => station::serve::run;
    #[cfg(feature = "station")] #[command(subcommand)] Token(station::token::TokenCommand) => station::token::run;
    #[command(subcommand)] Queue(queue::QueueCommand) => queue::run;
    #[command(subcommand)] Protocol(protocol::ProtocolCommand) => protocol::run;
    DailyCheck(daily_check::DailyCheckArgs) => daily_check::run;
    Demo(demo::DemoArgs) => demo::run;
    Fit(fit::FitArgs) => fit::run;
    #[command(alias = "analyze")] Analyse(analyse::AnalyseArgs) => analyse::run;
    Select(select::SelectArgs) => select::run;
    Material(material::MaterialArgs) => material::run;
    Plan(plan::PlanArgs) => plan::run;
    Trade(trade::TradeArgs) => trade::run;
    Replay(replay::ReplayArgs) => replay::run [windows];
    #[cfg(feature = "extremes")] Extremes(extremes::ExtremesArgs) => extremes::run;
    #[command(subcommand)] Calibration(calibration::CalibrationCommand) => calibration::run;
    Doctor(doctor::DoctorArgs) => doctor::run;
    Recover(recover::RecoverArgs) => recover::run;
    SupportBundle(support_bundle::SupportBundleArgs) => support_bundle::run [windows];
    Compliance(compliance::ComplianceArgs) => compliance::run;
    Import(import::ImportArgs) => import::run;
    Export(export::ExportArgs) => export::run;
    Find(find::FindArgs) => find::run;
    History(history::HistoryArgs) => history::run;
    Study(study::StudyArgs) => study::run;
    Population(population::PopulationArgs) => population::run;
    Agreement(agreement::AgreementArgs) => agreement::run;
    #[command(subcommand)] Library(library::LibraryCommand) => library::run;
    Crate(make_crate::CrateArgs) => make_crate::run;
    Reproduce(reproduce::ReproduceArgs) => reproduce::run;
    #[command(subcommand)] Catalog(catalog::CatalogCommand) => catalog::run;
    Info(info::InfoArgs) => info::run;
    Report(report::ReportArgs) => report::run;
    Quality(quality::QualityArgs) => quality::run;
    Verdict(verdict::VerdictArgs) => verdict::run;
    CorrectContact(correct_contact::CorrectArgs) => correct_contact::run;
    About(about::AboutArgs) => about::run;
    Tag(tag::TagArgs) => tag::run;
    Note(note::NoteArgs) => note::run;
    Review(review::ReviewArgs) => review::run;
    Recalibrate(recalibrate::RecalibrateArgs) => recalibrate::run;
    Mask(mask::MaskArgs) => mask::run;
    Withdraw(withdraw::WithdrawArgs) => withdraw::run;
    #[command(subcommand)] Rig(wired::RigSubcommand) => wired::run;
    #[cfg(feature = "haptics")] #[command(subcommand)] Haptics(haptics::HapticsCommand) => haptics::run;
    #[cfg(feature = "haptics")] #[command(subcommand)] Scene(scene::SceneCommand) => scene::run;
    #[cfg(feature = "emulators")] #[command(subcommand)] Emulate(emulate::EmulateCommand) => emulate::run;
    #[cfg(feature = "notifications")] Notify(notify::NotifyArgs) => notify::run;
    Completions(completions::CompletionsArgs) => completions::run;
    Man(man::ManArgs) => man::run;
}

/// Why a command failed.
#[derive(Debug)]
pub enum Failure {
    /// Wrong use: nothing was done. Exit code 2.
    Usage(String),
    /// It began and failed. Exit code 1.
    Failed(String),
}

impl Failure {
    fn usage(reason: impl ToString) -> Self {
        Self::Usage(reason.to_string())
    }

    fn failed(reason: impl ToString) -> Self {
        Self::Failed(reason.to_string())
    }

    /// The same sentence after a name.
    fn prefixed(self, name: &str) -> Self {
        match self {
            Self::Usage(sentence) => Self::Usage(format!("{name}: {sentence}")),
            Self::Failed(sentence) => Self::Failed(format!("{name}: {sentence}")),
        }
    }

    fn code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Failed(_) => 1,
        }
    }

    /// What went wrong and what to do.
    #[must_use]
    pub fn sentence(&self) -> &str {
        match self {
            Self::Usage(sentence) | Self::Failed(sentence) => sentence,
        }
    }
}

/// Whether `--json` is given anywhere: among tags, or where the other arguments are wrong.
fn asks_for_json(arguments: &[OsString]) -> bool {
    let mut named = arguments.iter().take_while(|argument| *argument != "--");
    named.any(|argument| argument == "--json")
}

/// Whether `--version --verbose` asks what the program was built from.
fn asks_for_build(arguments: &[OsString]) -> bool {
    let has =
        |name: &str| arguments.iter().skip(1).take_while(|one| *one != "--").any(|one| one == name);
    (has("--version") || has("-V")) && has("--verbose")
}

/// Parses the arguments; a mistake gets one sentence, and one object with `--json`.
fn parse(arguments: &[OsString]) -> Result<Cli, u8> {
    Cli::try_parse_from(arguments).map_err(|err| {
        if !err.use_stderr() || err.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            // Help and version print themselves; a closed pipe is the reader's choice.
            let _ = err.print();
            return err.exit_code().clamp(0, 2) as u8;
        }
        let output = Output::new(asks_for_json(arguments));
        output.error(&format!("{}; see 'palpate --help'", mistake(&err)), 2);
        2
    })
}

/// Options of a command, from a front end in the same process that is not a command line.
fn parse_options(command: &str, options: &[String]) -> Result<Command, Failure> {
    let words = ["palpate", command].into_iter().chain(options.iter().map(String::as_str));
    let cli = Cli::try_parse_from(words).map_err(|err| Failure::usage(mistake(&err)))?;
    cli.command.ok_or_else(|| Failure::usage(format!("'{command}' is not a command")))
}

/// A mistake in the arguments as one sentence.
fn mistake(err: &clap::Error) -> String {
    let text = err.to_string();
    // Missing arguments follow on lines of their own.
    let lines = text.lines().take_while(|line| !line.trim().is_empty());
    let sentence = lines.map(str::trim).collect::<Vec<_>>().join(" ");
    sentence.strip_prefix("error: ").unwrap_or(&sentence).to_owned()
}

/// A file that reaches the limit of its size (`ulimit -f`) ends a program by a signal, in the middle of a run. Where
/// the signal is handled, the write fails instead, which the log survives.
#[cfg(unix)]
fn outlive_file_limits() {
    // Without a handler the signal ends the program, as by default.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default());
}

const NO_WINDOW: &str = "this palpate was built without its window; 'palpate --help' lists the commands that need no window";

/// Runs the command of the program's arguments; `windows` opens windows, if this program has any.
pub fn main(windows: Option<&dyn WindowOpener>) -> ExitCode {
    let arguments: Vec<OsString> = std::env::args_os().collect();
    ExitCode::from(run_command(&arguments, windows))
}

/// Runs the command of these arguments, the first of which is the name of the program; its exit code.
pub fn run_command(arguments: &[OsString], windows: Option<&dyn WindowOpener>) -> u8 {
    #[cfg(unix)]
    outlive_file_limits();
    if asks_for_build(arguments) {
        let build = BuildDescription::of(support_bundle::features(windows.is_some()));
        Output::new(asks_for_json(arguments)).answer("version", &build, || build.to_string());
        return 0;
    }
    let cli = match parse(arguments) {
        Ok(cli) => cli,
        Err(code) => return code,
    };
    let output = Output::new(cli.json || asks_for_json(arguments));
    let log = log::begin(cli.verbose);
    log::stop_rigs_on_panic(log.clone());
    let result = match cli.command {
        None => window::run(&window::WindowArgs::default(), windows, &output),
        Some(command) => command.run(windows, &output),
    };
    let code = match result {
        Ok(()) => 0,
        Err(failure) => {
            if let Failure::Failed(sentence) = &failure {
                tracing::error!("{sentence}");
            }
            output.error(failure.sentence(), failure.code());
            failure.code()
        }
    };
    if let Some(log) = log {
        log.flush();
    }
    code
}

/// Adds the pairs of `--about` and checks that the labels are consistent.
fn add_labels(labels: &mut SessionLabels, about: &[String]) -> Result<(), Failure> {
    for pair in about {
        labels.set_pair(pair).map_err(|err| Failure::usage(format!("--about: {err}")))?;
    }
    labels.check().map_err(Failure::usage)
}

/// A session that cannot be read: another kind of folder or a newer format is wrong use, damage is a failure.
fn read_failure(err: ReadError) -> Failure {
    match err {
        ReadError::Damaged { .. } => Failure::failed(format!("{err} with 'palpate recover'")),
        ReadError::Io { .. } => Failure::failed(err),
        _ => Failure::usage(err),
    }
}

/// Recordings that cannot be read together: a wrong path is wrong use, an unreadable folder or damage is a failure.
fn sources_failure(err: RecordingsError) -> Failure {
    match err {
        RecordingsError::Folder { .. } => Failure::failed(err),
        RecordingsError::Source { reason, .. } => source_failure(*reason),
        RecordingsError::Rejected(_) => {
            Failure::usage(format!("{err}; add --include-rejected to include them"))
        }
        RecordingsError::Table(_) => {
            Failure::usage(format!("{err}; 'palpate import' makes a session from a table"))
        }
        err => Failure::usage(err),
    }
}

/// A fit that cannot be used: a wrong file is wrong use, a changed record is a failure.
fn known_fit_failure(err: KnownFitError) -> Failure {
    match err {
        KnownFitError::NotAFit { .. } => {
            Failure::usage(format!("{err}; 'palpate fit --json' writes a fit"))
        }
        KnownFitError::Changed(_) => {
            Failure::failed(format!("{err}, or give another record with --like"))
        }
        KnownFitError::Source(err) => source_failure(err),
        KnownFitError::Fit { .. } => Failure::failed(err),
        err => Failure::usage(err),
    }
}

fn source_failure(err: SourceError) -> Failure {
    let with = |way_out: &str| Failure::Usage(format!("{err}; {way_out}"));
    match err {
        SourceError::Rejected { .. } => with(
            "add --include-rejected to 'palpate fit', 'palpate select' or 'palpate material', or change the verdict with 'palpate verdict'",
        ),
        SourceError::Imported { .. } => with("'palpate info' shows the content of the session"),
        // The error of tables has no variant for it.
        SourceError::Table(_) if err.to_string().contains("no header") => {
            with("--columns names the columns")
        }
        SourceError::NoCycles => {
            Failure::Failed(format!("{err}; 'palpate report' shows what happened in the session"))
        }
        SourceError::Correction(ComplianceCorrectionError::NoneInForce { .. }) => {
            with("'palpate compliance SESSION --save' stores the compliance")
        }
        SourceError::Session(err) => read_failure(err),
        SourceError::Analysis(err) => recalibrate::analysis_failure(err),
        SourceError::Table(_)
        | SourceError::TableAnalysis { .. }
        | SourceError::Correction(_)
        | SourceError::NoSignal { .. } => Failure::usage(err),
        SourceError::Edits(_)
        | SourceError::Plan { .. }
        | SourceError::Empty
        | SourceError::Calibration { .. }
        | SourceError::Decision { .. } => Failure::failed(err),
    }
}
