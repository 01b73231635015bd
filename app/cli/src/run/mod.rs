//! `palpate run`: a protocol without a window, on the same runner.

mod hosted;
mod report;

pub use hosted::{HostedReport, HostedRun};

use super::Failure;
use super::arguments::parse_number;
use super::notices::Notices;
use super::output::Output;
use super::programme;
use super::prompts::OperatorPrompts;
use super::protocol::ValueArgs;
use super::rig::{OpenRig, RigArgs};
use super::terminal::on_ctrl_c;
use clap::Args;
use palpate_analysis::daily::{DAILY_CHECK, DAILY_CHECK_COMMAND, DailyCheckGate};
use palpate_drivers::Rig;
use palpate_model::metadata::SessionLabels;
use palpate_model::metadata::SessionMetadata;
use palpate_protocols::engine::Operator;
use palpate_protocols::plans::Plan;
use palpate_protocols::preview::{Preview, preview};
use palpate_runner::study::complete_labels;
use palpate_runner::{
    AfterStop, PromptResponder, RunRequest, RunView, Runner, RunnerRequest, RunnerSnapshot,
    SharedLeadSource, StartError, StartedRun, TimeScale, wall_now,
};
use palpate_sessions::library_folder;
use report::{preview_text, report};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// The indenter where none is given.
pub(super) const USUAL_INDENTER: &str = "blunt 12 mm probe";

const NO_PROTOCOL: &str = "give the name of a protocol; 'palpate protocol list' lists the names";

/// Run a protocol without a window
#[derive(Debug, Args)]
pub struct RunArgs {
    /// A built-in protocol ('palpate protocol list'), a protocol file, or a programme file
    #[arg(value_name = "NAME|FILE")]
    protocol: Option<String>,
    #[command(flatten)]
    values: ValueArgs,
    #[command(flatten)]
    short: ShortArgs,
    #[command(flatten)]
    session: SessionArgs,
}

const SHORT: &str = "Short forms of --set, for protocols with the same parameters as 'ramp-hold'";

/// The parameters most often set, short: `--depth 20` for `--set depth="20 mm"`.
#[derive(Debug, Args)]
#[command(
    next_help_heading = "Short forms of --set, for protocols with the same parameters as 'ramp-hold'"
)]
struct ShortArgs {
    /// Indentation speed in mm/s
    #[arg(long, help_heading = SHORT, value_parser = parse_number, allow_negative_numbers = true)]
    speed: Option<f64>,
    /// Depth from contact in mm
    #[arg(long, help_heading = SHORT, value_parser = parse_number, allow_negative_numbers = true)]
    depth: Option<f64>,
    /// Time at depth in s
    #[arg(long, help_heading = SHORT, value_parser = parse_number, allow_negative_numbers = true)]
    hold: Option<f64>,
    /// End the hold once a parameter is known this well, such as tau=1%; --hold is then the maximum
    #[arg(long, help_heading = SHORT, value_name = "PARAMETER=SHARE")]
    hold_until: Option<String>,
    /// After the hold unload to the surface at this speed in mm/s, recorded for a fit of unloading
    #[arg(long, help_heading = SHORT, value_name = "SPEED", value_parser = parse_number, allow_negative_numbers = true)]
    unload: Option<f64>,
}

impl RunArgs {
    /// Values of parameters by name, from --set and its short forms.
    fn values(&self) -> Result<BTreeMap<String, String>, Failure> {
        let with = |value: Option<f64>, unit| value.map(|value| format!("{value} {unit}"));
        let short = &self.short;
        let shorts = [
            ("speed", "speed", with(short.speed, "mm/s")),
            ("depth", "depth", with(short.depth, "mm")),
            ("hold", "hold", with(short.hold, "s")),
            ("hold-until", "until", short.hold_until.clone()),
            ("unload", "unload", with(short.unload, "mm/s")),
        ];
        let mut values = self.values.values();
        for (flag, name, value) in shorts {
            let Some(value) = value else { continue };
            if values.insert(name.to_owned(), value).is_some() {
                return Err(Failure::usage(format!(
                    "--{flag} and --set {name}=... set the same parameter; give only one of them"
                )));
            }
        }
        Ok(values)
    }
}

#[derive(Clone, Debug, Args)]
pub struct SessionArgs {
    #[command(flatten)]
    pub(super) rig: RigArgs,
    /// Session folder, new or empty; without it a new one in the library (~/palpate or PALPATE_HOME)
    #[arg(long)]
    pub(super) out: Option<PathBuf>,
    /// Operator
    #[arg(long, default_value = "")]
    pub(super) operator: String,
    /// Specimen; on a simulated rig population:NAME#NUMBER is one of a population of the library
    #[arg(long, default_value = "")]
    pub(super) specimen: String,
    /// Indenter; without it the blunt 12 mm probe
    #[arg(long)]
    pub(super) indenter: Option<String>,
    /// Details of specimen, probe or series, such as specimen.thickness_mm=12; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub(super) about: Vec<String>,
    /// Accept what the preview asks to acknowledge; it is recorded
    #[arg(long)]
    pub(super) acknowledge: bool,
    /// Only preview the run
    #[arg(long)]
    pub(super) preview: bool,
    #[cfg(feature = "station")]
    #[command(flatten)]
    pub(super) serve: super::station::ServeBesideArgs,
}

pub(super) fn run(args: &RunArgs, output: &Output) -> Result<(), Failure> {
    let Some(name) = &args.protocol else {
        return Err(Failure::usage(NO_PROTOCOL));
    };
    let (options, values) = (&args.session, args.values()?);
    if programme::is_programme(name) {
        return programme::run(Path::new(name), options, &values, output);
    }
    let (plan, bench, labels) = read(name, &values, options, output)?;
    run_plan(plan, bench, options, labels, RunCompanions::default(), output)
}

/// Runs a protocol for the queue; `begun` is called once the run has begun.
pub(super) fn run_queued(
    protocol: &str,
    options: &SessionArgs,
    begun: &dyn Fn(),
    output: &Output,
) -> Result<(), Failure> {
    let (plan, bench, labels) = read(protocol, &BTreeMap::new(), options, output)?;
    run_plan(plan, bench, options, labels, RunCompanions { begun, leader: None }, output)
}

/// The plan of a protocol, the rig that it was checked for, and the labels of its session.
pub(super) fn read(
    name: &str,
    values: &BTreeMap<String, String>,
    options: &SessionArgs,
    output: &Output,
) -> Result<(Plan, OpenRig, SessionLabels), Failure> {
    if let Ok(library) = library_folder() {
        super::recover::recover_unfinished(&library, output);
    }
    let mut labels = labels(options)?;
    // Wherever the specimen was named, its tissue is that of the name.
    let bench = super::rig::open(&options.rig.with_specimen(&labels.specimen)?)?;
    let (protocol, written, _) = super::protocol::load_checked(name, values, &bench, output)?;
    if let Ok(library) = library_folder() {
        // Whoever measures may be blinded, so what is added is not shown.
        complete_labels(&mut labels, &library).map_err(Failure::usage)?;
    }
    if written.plan.name == DAILY_CHECK {
        output.note(&format!(
            "this run does not count as the daily check; only '{DAILY_CHECK_COMMAND}' evaluates and saves a daily check"
        ));
    }
    if !options.preview {
        protocol.check_labels(&labels).map_err(|reason| {
            Failure::usage(format!(
                "{reason}; add --operator, --specimen or --about KEY=VALUE for each label"
            ))
        })?;
    }
    Ok((written.plan, bench, labels))
}

pub(super) struct RunLeader {
    pub command: &'static str,
    /// Gives a lead for every sample.
    pub leader: SharedLeadSource,
    pub report: LeaderReport,
}

/// What takes part in a run beside rig and operator.
pub(super) struct RunCompanions<'a> {
    /// Called once the run has begun.
    pub begun: &'a dyn Fn(),
    pub leader: Option<RunLeader>,
}

impl Default for RunCompanions<'_> {
    fn default() -> Self {
        Self { begun: &|| (), leader: None }
    }
}

/// Reports on the leader after the run, as an object and as text.
type LeaderReport = Box<dyn Fn(&Output) -> Option<(serde_json::Value, String)>>;

pub(super) fn run_plan(
    plan: Plan,
    bench: OpenRig,
    options: &SessionArgs,
    labels: SessionLabels,
    RunCompanions { begun, leader }: RunCompanions<'_>,
    output: &Output,
) -> Result<(), Failure> {
    let (request, preview, gate) = request(plan, &bench, options, labels, output)?;
    let request = RunRequest { leader: leader.as_ref().map(|one| one.leader.clone()), ..request };
    if options.preview {
        output.result(&preview, || preview_text(&preview));
        return match preview.refusals.first() {
            Some(refusal) => Err(Failure::usage(refusal)),
            None => Ok(()),
        };
    }
    check_start(&preview, &gate, options.acknowledge, output)?;
    #[cfg(feature = "station")]
    let (mut bound, mut station) = (options.serve.bind()?, None);
    let mut begin = |_runner: &Runner| {
        #[cfg(feature = "station")]
        {
            station = super::station::serve_run(bound.take(), _runner, output)?;
        }
        begun();
        Ok(())
    };
    let snapshot = execute(bench.rig, options.rig.time_scale, request, &mut begin, output)?;
    #[cfg(feature = "station")]
    drop(station);
    let Some(view) = &snapshot.run else {
        return Err(Failure::failed(
            "the thread that runs protocols ended without a run; start the run again",
        ));
    };
    report(view, leader.as_ref(), output)
}

/// The request of a plan, its preview, and what the daily check says of it.
fn request(
    plan: Plan,
    bench: &OpenRig,
    options: &SessionArgs,
    labels: SessionLabels,
    output: &Output,
) -> Result<(RunRequest, Preview, DailyCheckGate), Failure> {
    let gate = gate(&plan, bench)?;
    bench.from_library.iter().chain(&bench.doubts).for_each(|words| output.note(words));
    let (answers, after_stop) = match bench.rig.is_virtual() {
        true => (PromptResponder::Confirm, AfterStop::Close),
        false => (PromptResponder::Operator, AfterStop::Ask),
    };
    let request = RunRequest {
        plan,
        calibration: bench.calibration.clone(),
        limits: bench.limits,
        out: options.out.clone(),
        labels,
        is_acknowledged: options.acknowledge,
        to_acknowledge: gate.to_acknowledge(),
        after_stop,
        answers,
        leader: None,
    };
    let curve = request.calibration.curve().map_err(Failure::usage)?;
    let preview = preview(&request.plan, bench.rig.description(), &request.limits, &curve, false);
    Ok((request, preview, gate))
}

/// Refuses a run that the preview or the daily check does not allow.
fn check_start(
    preview: &Preview,
    gate: &DailyCheckGate,
    is_acknowledged: bool,
    output: &Output,
) -> Result<(), Failure> {
    if let Err(reason) = preview.check_start(is_acknowledged) {
        let hint =
            if preview.refusals.is_empty() { "; add --acknowledge to accept this" } else { "" };
        return Err(Failure::usage(format!("{reason}{hint}")));
    }
    match gate {
        DailyCheckGate::Acknowledge(reason) if !is_acknowledged => {
            return Err(Failure::usage(format!(
                "{reason}, or add --acknowledge to run anyway; the session records the acknowledgement"
            )));
        }
        DailyCheckGate::Note(note) => output.note(note),
        _ => {}
    }
    preview.notes.iter().for_each(|note| output.note(note));
    Ok(())
}

/// Whether the daily check of the rig allows a plan.
pub(super) fn gate(plan: &Plan, bench: &OpenRig) -> Result<DailyCheckGate, Failure> {
    let name = &bench.rig.description().name;
    gate_of(plan, name, bench.rig.is_virtual()).map_err(Failure::failed)
}

/// The same for a rig by its name.
pub(super) fn gate_of(plan: &Plan, rig: &str, is_virtual: bool) -> Result<DailyCheckGate, String> {
    let library = library_folder().ok();
    DailyCheckGate::of(plan, library.as_deref(), rig, is_virtual, wall_now())
        .map_err(|err| err.to_string())
}

/// Runs a request with progress; `begun` is called once it has begun. The snapshot is that of the ended run.
pub(super) fn execute(
    rig: Box<dyn Rig>,
    scale: TimeScale,
    request: RunRequest,
    begun: &mut dyn FnMut(&Runner) -> Result<(), Failure>,
    output: &Output,
) -> Result<Arc<RunnerSnapshot>, Failure> {
    let has_operator = request.answers == PromptResponder::Operator;
    let notices = Notices::open(&request.calibration, output);
    let started = StartedRun::start(rig, scale, request).map_err(start_failure)?;
    let is_question_open = stop_on_signals(&started.runner)?;
    started.wait_for_start().map_err(start_failure)?;
    begun(&started.runner)?;
    let requests = started.runner.requests();
    let prompts = has_operator.then(|| OperatorPrompts::start(requests, is_question_open));
    let mut prompts = prompts.transpose()?;
    let bar = output.bar(1000);
    let ended = started.wait_for_end(|view| {
        notices.see(&started.runner.snapshot());
        bar.set_position((view.fraction * 1000.0) as u64);
        bar.set_message(progress_text(view));
        if let Some(prompts) = &mut prompts {
            bar.suspend(|| prompts.update(view, output));
        }
    });
    drop(bar);
    // The rig is free again before a network keeps the end waiting.
    drop(started);
    notices.finish(output);
    ended.map_err(Failure::failed)
}

/// A request that is not possible is wrong use; one that could not be begun has failed.
fn start_failure(err: StartError) -> Failure {
    match err {
        StartError::Refused(reason) => Failure::Usage(reason),
        StartError::Failed(reason) => Failure::Failed(reason),
    }
}

pub(super) fn labels(args: &SessionArgs) -> Result<SessionLabels, Failure> {
    let mut labels = SessionLabels {
        operator: args.operator.clone(),
        specimen: args.specimen.clone(),
        indenter: args.indenter.clone().unwrap_or_else(|| USUAL_INDENTER.to_owned()),
        about: SessionMetadata::default(),
    };
    super::add_labels(&mut labels, &args.about)?;
    Ok(labels)
}

/// The first signal stops, the second halts; one while the question after a stop is open leaves the probe where it is.
/// Returns the flag of that question.
pub(super) fn stop_on_signals(runner: &Runner) -> Result<Arc<AtomicBool>, Failure> {
    let requests = runner.requests();
    let count = AtomicU32::new(0);
    let is_question_open = Arc::new(AtomicBool::new(false));
    let question = Arc::clone(&is_question_open);
    on_ctrl_c(move || {
        let choice = match count.fetch_add(1, Ordering::Relaxed) {
            _ if question.load(Ordering::Relaxed) => Operator::Close,
            0 => Operator::Stop,
            _ => Operator::Halt,
        };
        let _ = requests.try_send(RunnerRequest::Operator(choice));
    })?;
    Ok(is_question_open)
}

fn progress_text(view: &RunView) -> String {
    let left = view.time_left.0.round() as u64;
    let force = view.derived.force.map_or(String::new(), |force| format!("  {force:.3}"));
    let depth = view.derived.depth.map_or(String::new(), |depth| format!("  {depth:.2}"));
    format!("{}{force}{depth}  {:02}:{:02} left", view.phase, left / 60, left % 60)
}
