//! A run for another front end in the same process, such as the Python package: started with the options of
//! `palpate run`, watched and ended there.

use super::super::notices::Notices;
use super::super::output::{KeptOutput, Output};
use super::super::{Command, Failure, log, parse_options, programme};
use super::report::report;
use super::{check_start, read, request, start_failure};
use palpate_protocols::engine::Operator;
use palpate_runner::{AfterStop, RunRequest, RunView, RunnerRequest, RunnerSnapshot, StartedRun};
use palpate_sessions::folder::HolderLock;
use serde_json::Value;
use std::sync::{Arc, Once};
use std::time::Duration;

/// A run in progress. Dropped, it stops the rig and closes the session.
pub struct HostedRun {
    started: StartedRun,
    /// Remarks made before the start.
    pub notes: Vec<String>,
    /// Lock a named rig against other programs.
    _locks: Vec<HolderLock>,
    /// Dropped last: what is not sent yet may take a moment.
    notices: Notices,
}

/// The report of an ended run.
#[derive(Debug)]
pub struct HostedReport {
    /// What `palpate run --json` prints.
    pub object: Value,
    pub notes: Vec<String>,
    /// Why the command would have failed.
    pub failure: Option<Failure>,
}

/// The program's log, and rigs that stop where any thread panics: what the command line begins with.
fn prepare_process() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| log::stop_rigs_on_panic(log::begin(false)));
}

impl HostedRun {
    /// Starts what `palpate run` with these arguments would start. After a stop the
    /// probe stays where it is, without a question.
    pub fn start(arguments: &[String]) -> Result<Self, Failure> {
        let Command::Run(args) = parse_options("run", arguments)? else {
            return Err(Failure::usage("these are not options of 'palpate run'"));
        };
        let (options, values) = (&args.session, args.values()?);
        let name = args.protocol.as_deref().ok_or_else(|| Failure::usage(super::NO_PROTOCOL))?;
        if programme::is_programme(name) {
            return Err(Failure::usage(format!(
                "{name} is a programme, not a protocol; run it with 'palpate run {name}'"
            )));
        }
        if options.preview {
            return Err(Failure::usage(format!(
                "a preview is not a run; 'palpate protocol preview {name}' shows it"
            )));
        }
        prepare_process();
        let output = Output::kept();
        let (plan, bench, labels) = read(name, &values, options, &output)?;
        let (request, preview, gate) = request(plan, &bench, options, labels, &output)?;
        check_start(&preview, &gate, options.acknowledge, &output)?;
        let request = RunRequest { after_stop: AfterStop::Close, ..request };
        let notices = Notices::open(&request.calibration, &output);
        let started = StartedRun::start(bench.rig, options.rig.time_scale, request);
        let started = started.map_err(start_failure)?;
        started.wait_for_start().map_err(start_failure)?;
        Ok(Self { started, notes: output.take().notes, _locks: bench.locks, notices })
    }

    /// The next snapshot, or `None` if there is none within `patience`.
    pub fn next(&self, patience: Duration) -> Result<Option<Arc<RunnerSnapshot>>, Failure> {
        let newest = self.started.next(patience).map_err(Failure::failed)?;
        newest.iter().for_each(|snapshot| self.notices.see(snapshot));
        Ok(newest)
    }

    /// Passes on the operator's choice.
    pub fn choose(&self, choice: Operator) -> Result<(), Failure> {
        self.started.runner.request(RunnerRequest::Operator(choice)).map_err(Failure::Failed)
    }

    /// The report of the run, once its view has an outcome.
    #[must_use]
    pub fn report(&self, view: &RunView) -> HostedReport {
        let output = Output::kept();
        let failure = report(view, None, &output).err();
        let KeptOutput { mut objects, mut notes } = output.take();
        notes.extend(self.notices.problems());
        HostedReport { object: objects.pop().unwrap_or_default(), notes, failure }
    }
}
