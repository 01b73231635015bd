//! One run in progress: the engine's state with its log, its live fit and its plot history.

use super::board::{Board, LogState};
use super::clock::wall_now;
use super::leading::LeadFeed;
use super::live_feed::LiveFeed;
use super::run_log::RunLog;
use super::snapshot::{Lateness, RunView};
use super::start::{AfterStop, PromptResponder, RigContext, RunRequest};
use super::watch::HostWatch;
use crate::fidelity::{FidelityMeter, assess_data_quality};
use palpate_model::Nanos;
use palpate_model::rig::{Fault, HandAction, RawBytes, Reading, RigCommand};
use palpate_model::units::Seconds;
use palpate_protocols::engine::{
    self, Effect, EngineConfig, EngineInput, EngineState, Operator, PauseView, RunOutcome,
};
use palpate_protocols::preview::Preview;
use palpate_sessions::edits::{DataQuality, Edit, EditChange, add_edit};
use palpate_sessions::health::HealthContent;
use palpate_sessions::record::{EndRecord, EntryKind, LogEntry, SampleRow};
use palpate_sessions::{HealthMessage, LogError, SessionWriter};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// How long an unattended run waits for the cause of a pause to pass: longer than any rest of a protocol.
const PAUSE_ALONE_MAX: Seconds = Seconds(3600.0);

pub(super) struct ActiveRun {
    /// `None` only while `engine::step` has it.
    engine: Option<EngineState>,
    writer: Option<SessionWriter>,
    folder: PathBuf,
    session_id: String,
    board: Board,
    run_log: RunLog,
    fidelity: FidelityMeter,
    verdict: Option<(DataQuality, String)>,
    origin: Nanos,
    after_stop: AfterStop,
    answers: PromptResponder,
    paused_since: Option<Nanos>,
    lateness: Option<Lateness>,
    reported_given_up: Seconds,
    order: u64,
    pub(super) live: LiveFeed,
    lead: LeadFeed,
    /// `None` at full pace, where the computer cannot be late.
    watch: Option<HostWatch>,
    time_use: BTreeMap<&'static str, u64>,
    /// Why the log failed, and whether the engine knows.
    log_failure: Option<Fault>,
    is_log_failure_reported: bool,
    log_error: Option<String>,
    verdict_error: Option<String>,
}

impl ActiveRun {
    pub fn new(
        config: EngineConfig,
        preview: Preview,
        (writer, session_id): (SessionWriter, String),
        folder: PathBuf,
        request: &RunRequest,
        RigContext { origin, watch, .. }: RigContext<'_>,
    ) -> Self {
        let live = LiveFeed::new(&config);
        let fidelity = FidelityMeter::new(&config.plan, &config.rig);
        let run_log = RunLog::new(&session_id, &folder, &config.plan);
        let board = Board::new(&config, preview.steps, folder.clone());
        let begin = watch.as_ref().map(HostWatch::begin);
        let mut run = Self {
            engine: Some(EngineState::new(Arc::new(config))),
            writer: Some(writer),
            folder,
            session_id,
            board,
            run_log,
            fidelity,
            verdict: None,
            origin,
            after_stop: request.after_stop,
            answers: request.answers,
            paused_since: None,
            lateness: None,
            reported_given_up: Seconds(0.0),
            order: 0,
            live,
            lead: LeadFeed::new(request.leader.clone()),
            watch,
            time_use: BTreeMap::new(),
            log_failure: None,
            is_log_failure_reported: false,
            log_error: None,
            verdict_error: None,
        };
        if let Some(begin) = begin {
            run.log_health(begin);
        }
        run
    }

    /// The engine's state, except inside [`Self::feed`].
    pub fn engine(&self) -> Option<&EngineState> {
        self.engine.as_ref()
    }

    pub fn is_over(&self) -> bool {
        self.board.outcome().is_some()
    }

    /// Session time of a time on the rig's clock.
    pub fn session_time(&self, at: Nanos) -> Nanos {
        at.since(self.origin)
    }

    /// Time given up is reported each time it has doubled, so that a slow computer does not fill the log.
    pub fn record_lateness(&mut self, lateness: Option<Lateness>) {
        self.lateness = lateness;
        let given_up = lateness.unwrap_or_default().given_up;
        if given_up.0 > 0.0 && given_up.0 >= 2.0 * self.reported_given_up.0 {
            self.reported_given_up = given_up;
            self.report_trouble(&format!(
                "the computer is too slow: the run is {:.1} s behind the clock and does not catch up; close other programs",
                given_up.0
            ));
        }
    }

    /// Feeds one input to the engine and does what it asks: a stop leaves before anything is
    /// written down, other commands after. Commands keep the engine's order.
    pub fn feed(&mut self, now: Nanos, input: EngineInput, send: &mut dyn FnMut(RigAction)) {
        let Some(state) = self.engine.take() else {
            return;
        };
        *self.time_use.entry(state.phase().name()).or_default() += now.since(self.board.now()).0;
        self.board.push_input(now, &input);
        let (reading, logged) = match &input {
            EngineInput::Reading(reading) => (Some(*reading), None),
            other => (None, Some((kind_of(other), to_json(other)))),
        };
        let is_reported = matches!(input, EngineInput::Fault(_) | EngineInput::Operator { .. });
        let reported = is_reported.then(|| input.clone());
        let (state, effects) = engine::step(state, now, input);
        let commands: Vec<RigAction> = effects.iter().filter_map(to_rig).collect();
        let is_urgent = commands.iter().any(RigAction::is_stopping);
        if is_urgent {
            commands.iter().copied().for_each(&mut *send);
        }
        effects.iter().for_each(|effect| self.fidelity.push_effect(effect));
        if let Some(input) = &reported {
            self.run_log.log_input(now, input);
        }
        if let Some((kind, body)) = logged {
            self.log(now, kind, body);
        }
        if let Some(reading) = reading {
            self.log_row(now, &reading, &state);
        }
        let estimate = reading.and_then(|reading| self.live.push(&reading, &state));
        let lead = reading.and_then(|reading| self.lead.push(now, &reading, &state));
        if let Some(text) = self.live.take_failure() {
            self.report_trouble(&text);
            self.log_health(HealthMessage { now, content: HealthContent::Event { text } });
        }
        self.engine = Some(state);
        for effect in effects {
            self.log(now, EntryKind::Decision, to_json(&effect));
            match effect {
                Effect::Command(_) | Effect::ByHand(_) => {}
                Effect::Record(record) => {
                    self.run_log.log_record(&record);
                    self.board.push_record(&record);
                }
                Effect::Finished(outcome) => self.close(outcome),
            }
        }
        if !is_urgent {
            commands.iter().copied().for_each(&mut *send);
        }
        if let Some(estimate) = estimate {
            self.feed(now, EngineInput::LiveFit(estimate), send);
        }
        if let Some(depth) = lead {
            self.feed(now, EngineInput::Lead { depth }, send);
        }
        self.after_feed(now, send);
    }

    /// Feeds the engine the failure of the log, and the choices of an absent operator.
    fn after_feed(&mut self, now: Nanos, send: &mut dyn FnMut(RigAction)) {
        self.handle_log_notices();
        if let (Some(fault), false) = (&self.log_failure, self.is_log_failure_reported) {
            self.is_log_failure_reported = true;
            let fault = EngineInput::Fault(fault.clone());
            self.feed(now, fault, send);
        }
        let mut choose =
            |run: &mut Self, choice| run.feed(now, EngineInput::Operator { choice }, send);
        if self.after_stop == AfterStop::Close && self.is_in(|state| state.holding().is_some()) {
            choose(self, Operator::Close);
        }
        if self.after_stop != AfterStop::Wait && self.is_left_alone(now) {
            choose(self, Operator::Leave);
        }
        if self.answers == PromptResponder::Confirm && self.is_in(|state| state.prompt().is_some())
        {
            choose(self, Operator::Confirm);
        }
    }

    fn is_in(&self, is_so: impl FnOnce(&EngineState) -> bool) -> bool {
        self.engine.as_ref().is_some_and(is_so)
    }

    /// Reports notices of the log; a disk that will soon fail ends the run.
    fn handle_log_notices(&mut self) {
        let notices = self.writer.as_mut().map(SessionWriter::take_notices);
        for notice in notices.into_iter().flatten() {
            let detail = notice.to_string();
            self.report_trouble(&detail);
            if notice.is_reason_to_end() {
                self.log_failure.get_or_insert(Fault::LogAtRisk { detail });
            }
        }
    }

    fn report_trouble(&mut self, text: &str) {
        self.run_log.log_trouble(text);
        self.board.note(text.to_owned(), true);
    }

    /// Takes what went over the wires, at times of the rig's clock.
    pub fn take_raw(&mut self, mut raw: Vec<RawBytes>) {
        for piece in &mut raw {
            piece.at = self.session_time(piece.at);
        }
        let now = self.board.now();
        self.write(|writer| writer.push_raw(now, raw));
    }

    /// Looks at the computer once a turn of the loop, which is `lateness` late at session time `now`.
    pub fn watch(&mut self, now: Nanos, lateness: Duration, send: &mut dyn FnMut(RigAction)) {
        let Some(watch) = &mut self.watch else {
            return;
        };
        let (jump, stood) = watch.turn(now, lateness);
        if watch.is_due() {
            self.log_state(now);
        }
        if let Some(jump) = jump {
            self.log_health(jump);
        }
        if let Some(missed) = stood {
            let fault = Fault::HostPaused { missed };
            self.feed(now, EngineInput::Fault(fault), send);
        }
    }

    fn log_state(&mut self, now: Nanos) {
        let missed = self.fidelity.found().dropped;
        if let (Some(watch), Some(writer)) = (&mut self.watch, &self.writer) {
            let state = watch.state(now, writer.disk_state(), missed);
            self.log_health(state);
        }
    }

    fn log_health(&mut self, health: HealthMessage) {
        self.write(|writer| writer.push_health(health));
    }

    /// Whether a paused run cannot go on by itself, or has not for too long.
    fn is_left_alone(&mut self, now: Nanos) -> bool {
        let pause = self.engine.as_ref().map(EngineState::pause);
        let Some(PauseView::Paused { no_resume }) = pause else {
            self.paused_since = None;
            return false;
        };
        let since = *self.paused_since.get_or_insert(now);
        no_resume.is_some() || now.since(since).seconds() > PAUSE_ALONE_MAX
    }

    fn log_row(&mut self, now: Nanos, reading: &Reading, state: &EngineState) {
        let (derived, cycle) = (state.derived(), state.cycle());
        self.board.push_sample(state);
        let row = SampleRow {
            tick: reading.tick,
            host: now,
            age: reading.age,
            counts: reading.counts,
            volts: Some(reading.volts.0),
            pulses: Some(reading.pulses),
            status: reading.status.0,
            force: derived.force.map(|force| force.0),
            depth: derived.depth.map(|depth| depth.0),
            phase: state.phase(),
            cycle,
        };
        self.fidelity.push_row(&row);
        self.write(|writer| writer.push_row(row));
    }

    fn log(&mut self, now: Nanos, kind: EntryKind, body: serde_json::Value) {
        let after_sample = self.board.samples();
        let entry = LogEntry { kind, order: self.order, after_sample, now, body };
        self.order += 1;
        self.write(|writer| writer.push_entry(entry));
    }

    /// Writes to the log while it is open. The first error ends the run.
    fn write(&mut self, push: impl FnOnce(&mut SessionWriter) -> Result<(), LogError>) {
        if let Some(Err(err)) = self.writer.as_mut().map(push) {
            let detail = err.to_string();
            self.log_failure.get_or_insert(Fault::LogFailed { detail });
        }
    }

    fn close(&mut self, outcome: RunOutcome) {
        self.board.push_outcome(&outcome);
        let now = self.board.now();
        self.log_state(now);
        if let Some(end) = self.watch.as_ref().map(|watch| watch.end(now)) {
            self.log_health(end);
        }
        let end = EndRecord {
            outcome: outcome.ending.name().into(),
            reason: outcome.reason.clone(),
            samples: self.board.samples(),
            entries: self.order,
            raw_bytes: 0,
            ended_at: self.board.now(),
            time_use: self
                .time_use
                .iter()
                .map(|(phase, nanos)| ((*phase).to_string(), Nanos(*nanos).seconds().0))
                .collect(),
        };
        if let Some(writer) = self.writer.take()
            && let Err(err) = writer.close(end)
        {
            self.log_error = Some(err.to_string());
        }
        self.run_log.log_end(&outcome, self.log_error.as_deref());
        let (mut verdict, mut reason) = assess_data_quality(&outcome, self.fidelity.found());
        if let Some(err) = &self.log_error {
            // A measurement with an incomplete log is not valid.
            if verdict == DataQuality::Valid {
                verdict = DataQuality::Suspect;
            }
            reason = format!("the log may be incomplete: {err}; {reason}");
        }
        self.record_verdict(verdict, &reason);
        self.verdict = Some((verdict, reason));
    }

    /// The automatic assessment is an entry of the edits, as those of reviewers are.
    fn record_verdict(&mut self, verdict: DataQuality, reason: &str) {
        let edit = Edit {
            at: wall_now().into(),
            by: "palpate".into(),
            reason: reason.to_owned(),
            change: EditChange::Verdict { verdict },
        };
        if let Err(err) = add_edit(&self.folder, &self.session_id, &edit) {
            self.verdict_error = Some(err.to_string());
        }
    }

    pub fn view(&self) -> Option<RunView> {
        let state = self.engine.as_ref()?;
        let writer = self.writer.as_ref();
        let log = LogState {
            saved_through: writer.map_or(self.board.now(), SessionWriter::saved_through),
            lateness: self.lateness,
            verdict: self.verdict.clone(),
            error: self.log_error.clone(),
            verdict_error: self.verdict_error.clone(),
        };
        Some(self.board.view(state, log))
    }
}

/// What a run asks of the rig or of the hand beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RigAction {
    Command(RigCommand),
    Hand(HandAction),
}

impl RigAction {
    fn is_stopping(&self) -> bool {
        matches!(self, Self::Command(command) if command.is_stopping())
    }
}

fn to_rig(effect: &Effect) -> Option<RigAction> {
    match effect {
        Effect::Command(command) => Some(RigAction::Command(*command)),
        Effect::ByHand(action) => Some(RigAction::Hand(*action)),
        Effect::Record(_) | Effect::Finished(_) => None,
    }
}

fn kind_of(input: &EngineInput) -> EntryKind {
    if matches!(input, EngineInput::LiveFit(_)) { EntryKind::Fit } else { EntryKind::Input }
}

/// The on-disk form of an input or effect. The types have no map keys but strings and reject
/// non-finite numbers before they get here, so this cannot fail; if it ever does, the log says so.
pub(crate) fn to_json<T: serde::Serialize>(value: &T) -> serde_json::Value {
    serde_json::to_value(value)
        .unwrap_or_else(|err| serde_json::json!({ "unwritable": err.to_string() }))
}
