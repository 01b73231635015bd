//! What is shown of a run, gathered from what goes into its engine and what comes out: the same for a run in
//! progress and for one that is replayed.

use super::snapshot::{ContactTrigger, Lateness, LogLine, PlannedWeight, PromptView, RunView};
use crate::base::FoundBase;
use palpate_model::Nanos;
use palpate_model::rig::Phase;
use palpate_model::signal::LiveTrace;
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_protocols::engine::{
    ContactPosition, EndingKind, EngineConfig, EngineInput, EngineState, Record, RunOutcome,
};
use palpate_protocols::plans::Step;
use palpate_protocols::preview::StepPreview;
use palpate_protocols::weight_readings::{WeightReading, WeightReadings};
use palpate_sessions::edits::DataQuality;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;

/// Buckets of the live plots: two points a bucket, two buckets a pixel on a wide screen.
const TRACE_BUCKETS: usize = 2048;

#[derive(Clone, Debug)]
pub(crate) struct Board {
    steps: Arc<Vec<StepPreview>>,
    folder: PathBuf,
    now: Nanos,
    samples: u64,
    trace: Arc<LiveTrace>,
    force_peak: Option<Newtons>,
    /// Contact position of the tissue, also when depths count from a base.
    tissue: Option<ContactPosition>,
    base: FoundBase,
    events: VecDeque<LogLine>,
    phases: Arc<Vec<(f64, Phase)>>,
    cycle_starts: Arc<Vec<(f64, u32)>>,
    cycles: u32,
    to_weigh: Arc<Vec<PlannedWeight>>,
    readings: WeightReadings,
    weighed: Arc<Vec<WeightReading>>,
    /// Force over position while the surface is searched.
    approach: Arc<LiveTrace>,
    touches: Arc<Vec<ContactTrigger>>,
    outcome: Option<RunOutcome>,
}

/// What is known of a run's log and of its pace.
#[derive(Clone, Debug, Default)]
pub(crate) struct LogState {
    /// Session time through which everything is on disk.
    pub saved_through: Nanos,
    pub lateness: Option<Lateness>,
    pub verdict: Option<(DataQuality, String)>,
    pub error: Option<String>,
    pub verdict_error: Option<String>,
}

impl Board {
    pub fn new(config: &EngineConfig, steps: Vec<StepPreview>, folder: PathBuf) -> Self {
        let cycles = config.plan.steps.iter().map(|planned| planned.cycle).max();
        Self {
            steps: Arc::new(steps),
            folder,
            now: Nanos::ZERO,
            samples: 0,
            trace: Arc::new(LiveTrace::new(TRACE_BUCKETS)),
            force_peak: None,
            tissue: None,
            base: FoundBase::default(),
            events: VecDeque::new(),
            phases: Arc::new(Vec::new()),
            cycle_starts: Arc::new(Vec::new()),
            cycles: cycles.unwrap_or(0),
            to_weigh: Arc::new(to_weigh(config)),
            readings: WeightReadings::default(),
            weighed: Arc::default(),
            approach: Arc::new(LiveTrace::new(TRACE_BUCKETS)),
            touches: Arc::default(),
            outcome: None,
        }
    }

    /// Session time of the newest input.
    pub fn now(&self) -> Nanos {
        self.now
    }

    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// How it ended, once it has.
    pub fn outcome(&self) -> Option<&RunOutcome> {
        self.outcome.as_ref()
    }

    /// Samples come through [`Self::push_sample`], after the engine has taken them.
    pub fn push_input(&mut self, now: Nanos, input: &EngineInput) {
        self.now = now;
        match input {
            EngineInput::Operator { choice } => self.note(format!("operator: {choice}"), false),
            EngineInput::Fault(fault) => self.note(fault.to_string(), true),
            _ => {}
        }
    }

    pub fn push_sample(&mut self, state: &EngineState) {
        self.samples += 1;
        let (cycle, last) = (state.cycle(), self.cycle_starts.last());
        if cycle > 0 && last.is_none_or(|(_, last)| *last != cycle) {
            Arc::make_mut(&mut self.cycle_starts).push((self.now.seconds().0, cycle));
        }
        let derived = state.derived();
        if let Some(force) = derived.force {
            if self.force_peak.is_none_or(|peak| force > peak) {
                self.force_peak = Some(force);
            }
            let depth = derived.depth.unwrap_or(Depth(f64::NAN));
            Arc::make_mut(&mut self.trace).push(self.now.seconds(), depth, force);
            if state.phase() == Phase::Contact {
                let position = Depth(derived.position.0);
                Arc::make_mut(&mut self.approach).push(self.now.seconds(), position, force);
            }
        }
    }

    pub fn push_record(&mut self, record: &Record) {
        if let Record::PhaseStarted { phase, .. } = record {
            Arc::make_mut(&mut self.phases).push((self.now.seconds().0, *phase));
            if *phase == Phase::Contact {
                self.approach = Arc::new(LiveTrace::new(TRACE_BUCKETS));
                self.touches = Arc::default();
            }
        }
        if let Record::ContactTriggered { pass, position, force, .. } = record {
            let (pass, position, force) = (*pass, *position, *force);
            Arc::make_mut(&mut self.touches).push(ContactTrigger { pass, position, force });
        }
        self.readings.record(record);
        if self.readings.all() != self.weighed.as_slice() {
            self.weighed = Arc::new(self.readings.all().to_vec());
        }
        if let Record::ContactFound { position, std_error_mm } = record {
            self.tissue =
                Some(ContactPosition { position: *position, std_error_mm: *std_error_mm });
        }
        if let Some(base) = FoundBase::of(record) {
            // Without a thickness no tissue is known in front of it.
            self.tissue = self.tissue.filter(|_| base.thickness_mm.is_some());
            self.base = base;
        }
        let is_alarm = match record {
            Record::InterlockTripped { .. } => true,
            Record::EndingStarted { ending, .. } => is_alarming(*ending),
            _ => false,
        };
        self.note(record.to_string(), is_alarm);
    }

    pub fn push_outcome(&mut self, outcome: &RunOutcome) {
        let text = format!("{}: {}", outcome.ending, outcome.reason);
        self.note(text, is_alarming(outcome.ending));
        self.outcome = Some(outcome.clone());
    }

    pub fn note(&mut self, text: String, is_alarm: bool) {
        if self.events.len() == RunView::EVENTS_MAX {
            self.events.pop_front();
        }
        let at = self.now;
        self.events.push_back(LogLine { at, text, is_alarm });
    }

    pub fn view(&self, state: &EngineState, log: LogState) -> RunView {
        let (step_index, step_started) = state.step_progress();
        let (time_left, fraction) = self.progress(step_index, step_started);
        RunView {
            plan_name: state.config().plan.name.clone(),
            plan_crc32: state.config().plan.source.as_ref().map(|source| source.crc32.clone()),
            folder: self.folder.clone(),
            phase: state.phase(),
            power: state.power(),
            steps: Arc::clone(&self.steps),
            step_index,
            now: self.now,
            time_left,
            fraction,
            derived: *state.derived(),
            tare: state.tare(),
            contact: self.contact(state),
            base: self.base,
            force_peak: self.force_peak,
            live: state.live().cloned(),
            trace: Arc::clone(&self.trace),
            phases: Arc::clone(&self.phases),
            samples: self.samples,
            saved_through: log.saved_through,
            lateness: log.lateness,
            is_motion_possible: state.is_motion_possible(),
            pause: state.pause(),
            prompt: state.prompt().map(|(prompt, until)| PromptView {
                message: prompt.message.clone(),
                time_left: until.since(self.now).seconds(),
            }),
            next_checkpoint: next_checkpoint(state, step_index),
            cycle: state.cycle(),
            cycles: self.cycles,
            cycle_starts: Arc::clone(&self.cycle_starts),
            planned_weights: Arc::clone(&self.to_weigh),
            weight_readings: Arc::clone(&self.weighed),
            settling: state.settling(),
            can_redo: state.can_redo().map_err(String::from),
            approach: Arc::clone(&self.approach),
            contact_triggers: Arc::clone(&self.touches),
            holding: state.holding().cloned(),
            can_retract: state.can_retract().map_err(String::from),
            outcome: self.outcome.clone(),
            data_quality: log.verdict,
            log_error: log.error,
            data_quality_error: log.verdict_error,
            events: Arc::new(self.events.iter().cloned().collect()),
        }
    }

    /// Contact position of the tissue, also when depths count from the base behind it.
    fn contact(&self, state: &EngineState) -> Option<ContactPosition> {
        let counted = state.contact()?;
        match self.base.base_mm == Some(counted.position.0) {
            true => self.tissue,
            false => Some(counted),
        }
    }

    /// Expected time left and share done, from the preview and the step in progress.
    fn progress(&self, step_index: usize, step_started: Nanos) -> (Seconds, f64) {
        if self.outcome.is_some() {
            return (Seconds(0.0), 1.0);
        }
        let spent = self.now.since(step_started).seconds().0;
        let current = self.steps.get(step_index).map_or(0.0, |step| step.expected.0 - spent);
        let later = self.steps.iter().skip(step_index + 1).map(|step| step.expected.0);
        let remaining = current.max(0.0) + later.sum::<f64>();
        let done = self.now.seconds().0;
        (Seconds(remaining), done / (done + remaining).max(1e-9))
    }
}

/// The readings under known masses that a plan has.
fn to_weigh(config: &EngineConfig) -> Vec<PlannedWeight> {
    let steps = config.plan.steps.iter().enumerate();
    let weigh = steps.filter_map(|(step_index, planned)| match &planned.step {
        Step::Weigh(weigh) => Some(PlannedWeight {
            step_index,
            mass_g: weigh.mass_g,
            is_loading: weigh.is_loading,
            repeat: weigh.repeat,
        }),
        _ => None,
    });
    weigh.collect()
}

/// Index of the step before it, and its name.
fn next_checkpoint(state: &EngineState, step_index: usize) -> Option<(usize, String)> {
    let mut ahead = state.config().plan.checkpoints_from(step_index);
    ahead.next().map(|(index, name)| (index, name.to_owned()))
}

/// Whether an ending needs attention; a stop the operator asked for does not.
fn is_alarming(ending: EndingKind) -> bool {
    !matches!(ending, EndingKind::Finish | EndingKind::Stop)
}
