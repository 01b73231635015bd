//! What a watcher sees of a rig: the runner's snapshot as JSON, bounded in size.

use palpate_model::signal::{LiveTrace, TracePoint};
use palpate_protocols::engine::PauseView;
use palpate_runner::{LogLine, RigView, RunView, RunnerSnapshot};
use serde::Serialize;

/// Version of everything under `/api/v1`; a new key does not raise it.
pub const API_VERSION: u32 = 1;

/// Groups of points in the live curve, each with its lowest and its highest force: two for every pixel of a phone.
const CURVE_GROUPS: usize = 300;

/// Lines of the event log in a live message; `/api/v1/events` has more.
const EVENTS_SHOWN: usize = 20;

#[derive(Debug, Serialize)]
pub struct RigState {
    pub name: String,
    pub identity: String,
    /// From home, once the axis is homed.
    pub position_mm: Option<f64>,
    /// The load cell's signal.
    pub signal_v: Option<f64>,
    pub is_homed: bool,
    /// Whether the link to the rig was lost, and why.
    pub link_error: Option<String>,
    /// Newest value of every sensor beside load cell and axis.
    pub sensors: Vec<SensorState>,
}

#[derive(Debug, Serialize)]
pub struct SensorState {
    pub name: String,
    /// In `unit`; of a digital input 1 is high and 0 is low.
    pub value: f64,
    /// `1` where it has none.
    pub unit: String,
    /// As it is read.
    pub words: String,
}

impl RigState {
    fn of(rig: &RigView) -> Self {
        let mm = rig.description.mm_per_pulse;
        Self {
            name: rig.description.name.clone(),
            identity: rig.description.identity.clone(),
            position_mm: rig.reading.map(|reading| rounded(reading.pulses as f64 * mm, 1e4)),
            signal_v: rig.reading.map(|reading| rounded(reading.volts.0, 1e6)),
            is_homed: rig.is_homed,
            link_error: rig.link_error.clone(),
            sensors: rig
                .sensor_facts()
                .into_iter()
                .map(|one| SensorState {
                    words: one.words(),
                    name: one.name,
                    value: rounded(one.value, 1e6),
                    unit: one.unit,
                })
                .collect(),
        }
    }
}

#[derive(Debug, Serialize)]
pub struct StepState {
    /// From 0.
    pub index: usize,
    pub count: usize,
    pub phase: String,
}

#[derive(Debug, Serialize)]
pub struct OutcomeState {
    /// `finish`, `stop`, `abort`, `halt` or `interlock`.
    pub ending: String,
    pub reason: String,
}

#[derive(Debug, Serialize)]
pub struct ParameterState {
    pub name: String,
    pub value: f64,
    pub unit: String,
    /// Absent until the record identifies the parameter.
    pub std_error: Option<f64>,
}

#[derive(Debug, Serialize)]
pub struct RunState {
    pub protocol: String,
    /// Name of the session's folder.
    pub session: String,
    pub phase: String,
    pub step: StepState,
    pub elapsed_s: f64,
    pub time_left_s: f64,
    /// Share done, 0 to 1.
    pub fraction: f64,
    pub cycle: u32,
    pub cycles: u32,
    pub force_n: Option<f64>,
    pub force_peak_n: Option<f64>,
    pub depth_mm: Option<f64>,
    pub position_mm: f64,
    pub speed_mm_s: f64,
    pub samples: u64,
    /// Session time through which everything is on disk.
    pub saved_through_s: f64,
    pub is_motion_possible: bool,
    pub is_paused: bool,
    /// What the operator at the rig must do, and how long the run waits for it.
    pub prompt: Option<(String, f64)>,
    /// Parameters of the live fit.
    pub estimate: Vec<ParameterState>,
    /// Why the run stopped, while it waits for the operator at the rig.
    pub stopped: Option<OutcomeState>,
    /// How it ended; absent while it is in progress.
    pub outcome: Option<OutcomeState>,
    pub data_quality: Option<String>,
    pub log_error: Option<String>,
}

impl RunState {
    fn of(run: &RunView) -> Self {
        let outcome = |one: &palpate_protocols::engine::RunOutcome| OutcomeState {
            ending: one.ending.name().to_owned(),
            reason: one.reason.clone(),
        };
        let estimate = run.live.iter().flat_map(|live| &live.parameters);
        Self {
            protocol: run.plan_name.clone(),
            session: session_name(run),
            phase: run.phase.to_string(),
            step: StepState {
                index: run.step_index,
                count: run.steps.len(),
                phase: run
                    .steps
                    .get(run.step_index)
                    .map_or_else(String::new, |step| step.phase.to_string()),
            },
            elapsed_s: rounded(run.now.seconds().0, 1e3),
            time_left_s: rounded(run.time_left.0, 1e1),
            fraction: rounded(run.fraction, 1e4),
            cycle: run.cycle,
            cycles: run.cycles,
            force_n: run.derived.force.map(|force| rounded(force.0, 1e4)),
            force_peak_n: run.force_peak.map(|force| rounded(force.0, 1e4)),
            depth_mm: run.derived.depth.map(|depth| rounded(depth.0, 1e4)),
            position_mm: rounded(run.derived.position.0, 1e4),
            speed_mm_s: rounded(run.derived.velocity.0, 1e3),
            samples: run.samples,
            saved_through_s: rounded(run.saved_through.seconds().0, 1e3),
            is_motion_possible: run.is_motion_possible,
            is_paused: matches!(run.pause, PauseView::Paused { .. }),
            prompt: run.prompt.as_ref().map(|one| (one.message.clone(), one.time_left.0)),
            estimate: estimate
                .map(|one| ParameterState {
                    name: one.name.clone(),
                    value: one.value,
                    unit: one.unit.clone(),
                    std_error: one.std_error,
                })
                .collect(),
            stopped: run.holding.as_ref().map(outcome),
            outcome: run.outcome.as_ref().map(outcome),
            data_quality: run.data_quality.as_ref().map(|(quality, _)| quality.to_string()),
            log_error: run.log_error.clone(),
        }
    }
}

/// The name of a session's folder, which says nothing of the computer's other folders.
pub(crate) fn session_name(run: &RunView) -> String {
    run.folder.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// State of rig and run without curves and events.
#[derive(Debug, Serialize)]
pub struct StationState {
    pub format: u32,
    pub sequence: u64,
    /// Whether the thread that controls the rig lives.
    pub is_alive: bool,
    pub rig: RigState,
    /// The run in progress, or the last one.
    pub run: Option<RunState>,
    /// Why the last request to run was refused.
    pub refusal: Option<String>,
}

impl StationState {
    #[must_use]
    pub fn of(snapshot: &RunnerSnapshot, is_alive: bool) -> Self {
        Self {
            format: API_VERSION,
            sequence: snapshot.sequence,
            is_alive,
            rig: RigState::of(&snapshot.rig),
            run: snapshot.run.as_ref().map(RunState::of),
            refusal: snapshot.refusal.clone(),
        }
    }
}

/// The live curve, thinned for the eye: the lowest and the highest force of every stretch. Saved samples are never thinned.
#[derive(Debug, Default, Serialize)]
pub struct Curve {
    pub t_s: Vec<f64>,
    pub depth_mm: Vec<f64>,
    pub force_n: Vec<f64>,
}

impl Curve {
    #[must_use]
    pub fn of(trace: &LiveTrace) -> Self {
        let points = trace.points();
        let size = points.len().div_ceil(CURVE_GROUPS).max(1);
        let mut curve = Self::default();
        for group in points.chunks(size) {
            let finite = || group.iter().filter(|point| point.force.is_finite());
            let low = finite().min_by(|a, b| a.force.total_cmp(&b.force));
            let high = finite().max_by(|a, b| a.force.total_cmp(&b.force));
            let (Some(low), Some(high)) = (low, high) else { continue };
            let (first, second) = if low.t <= high.t { (low, high) } else { (high, low) };
            curve.push(first);
            if second.t > first.t {
                curve.push(second);
            }
        }
        curve
    }

    fn push(&mut self, point: &TracePoint) {
        self.t_s.push(rounded(point.t, 1e3));
        // Before contact there is no depth: JSON has null for it.
        self.depth_mm.push(rounded(point.depth, 1e4));
        self.force_n.push(rounded(point.force, 1e4));
    }
}

#[derive(Debug, Serialize)]
pub struct EventLine {
    /// Session time.
    pub at_s: f64,
    pub text: String,
    pub is_alarm: bool,
}

impl EventLine {
    fn of(line: &LogLine) -> Self {
        let at_s = rounded(line.at.seconds().0, 1e3);
        Self { at_s, text: line.text.clone(), is_alarm: line.is_alarm }
    }
}

/// Newest last, at most so many.
#[must_use]
pub fn events(snapshot: &RunnerSnapshot, most: usize) -> Vec<EventLine> {
    let lines = snapshot.run.iter().flat_map(|run| run.events.iter());
    let skipped = lines.clone().count().saturating_sub(most);
    lines.skip(skipped).map(EventLine::of).collect()
}

/// The parts of a live message that change only with the run.
#[derive(Debug, Serialize)]
pub struct RunPictures {
    pub curve: Curve,
    pub events: Vec<EventLine>,
    /// Phase of every step, in order.
    pub steps: Vec<String>,
}

impl RunPictures {
    #[must_use]
    pub fn of(snapshot: &RunnerSnapshot) -> Self {
        let run = snapshot.run.as_ref();
        Self {
            curve: run.map_or_else(Curve::default, |run| Curve::of(&run.trace)),
            events: events(snapshot, EVENTS_SHOWN),
            steps: run.map_or_else(Vec::new, |run| {
                run.steps.iter().map(|step| step.phase.to_string()).collect()
            }),
        }
    }
}

/// Digits beyond what a screen shows only make messages longer.
fn rounded(value: f64, scale: f64) -> f64 {
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::{Depth, Newtons, Seconds};

    #[test]
    fn a_curve_keeps_every_peak_and_stays_small() {
        let mut trace = LiveTrace::new(2048);
        for index in 0..500_000 {
            let force = if index == 123_456 { 9.5 } else { (f64::from(index) * 1e-3).sin() };
            let depth = if index < 1000 { f64::NAN } else { 1.0 };
            trace.push(Seconds(f64::from(index) * 1e-3), Depth(depth), Newtons(force));
        }
        let curve = Curve::of(&trace);
        assert!(curve.t_s.len() <= 2 * CURVE_GROUPS, "{}", curve.t_s.len());
        assert!(curve.t_s.is_sorted());
        assert_eq!(curve.force_n.iter().copied().fold(0.0, f64::max), 9.5);
        let text = serde_json::to_string(&curve).unwrap();
        assert!(text.len() < 20_000 && text.contains("null"), "{}", text.len());
    }
}
