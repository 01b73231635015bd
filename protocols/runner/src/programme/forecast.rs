//! What a programme will do, task by task, before anything moves.

use super::document::{Programme, ProgrammeError};
use palpate_model::calibration::CalibrationCurve;
use palpate_model::rig::{Limits, RigDescription};
use palpate_model::units::{Newtons, Seconds};
use palpate_protocols::file::ProtocolProblem;
use palpate_protocols::preview::preview;

#[derive(Clone, Debug, PartialEq)]
pub struct TaskForecast {
    pub task: String,
    pub expected: Seconds,
    /// Longest duration of all its repeats.
    pub longest: Seconds,
    /// Lowest and highest peak force expected over specimens.
    pub force_band: [Newtons; 2],
}

#[derive(Clone, Debug, PartialEq)]
pub struct ProgrammeForecast {
    pub tasks: Vec<TaskForecast>,
    /// What to look at before the start: nothing that forbids it.
    pub notes: Vec<ProtocolProblem>,
    /// What must be acknowledged and is not yet.
    pub to_acknowledge: Vec<ProtocolProblem>,
}

impl ProgrammeForecast {
    pub fn expected(&self) -> Seconds {
        Seconds(self.tasks.iter().map(|task| task.expected.0).sum())
    }
}

/// Previews every task on a rig; every reason why one cannot run, with its line.
pub fn forecast_programme(
    programme: &Programme,
    rig: &RigDescription,
    limits: &Limits,
    curve: &CalibrationCurve,
) -> Result<ProgrammeForecast, ProgrammeError> {
    let mut refusals = Vec::new();
    let (mut notes, mut to_acknowledge) = (Vec::new(), Vec::new());
    let mut tasks = Vec::new();
    for task in &programme.tasks {
        let for_task = |reason: &String| format!("task '{}': {reason}", task.name);
        let mut ahead = TaskForecast {
            task: task.name.clone(),
            expected: Seconds(0.0),
            longest: Seconds(0.0),
            force_band: [Newtons(0.0); 2],
        };
        let mut count = |repeat: u32, times: u32| {
            // The protocol was written out with these values when the programme was read.
            let Some(plan) = task.plan(repeat, None) else {
                return;
            };
            let own = preview(&plan, rig, limits, curve, false);
            let no_master = plan.refusal_without_master();
            let refused = own.refusals.iter().chain(&no_master).map(for_task);
            let refused = refused.map(|reason| ProtocolProblem::error(task.line, reason));
            refusals.extend(refused);
            let warned = |reason| ProtocolProblem::warning(task.line, for_task(reason));
            notes.extend(plan.limits.unused(limits).iter().map(warned));
            if !programme.is_acknowledged {
                to_acknowledge.extend(own.acknowledgements.iter().map(|reason| {
                    let message = format!(
                        "{}; to accept this, write acknowledge = true in the file",
                        for_task(reason)
                    );
                    ProtocolProblem::warning(task.line, message)
                }));
            }
            ahead.expected.0 += own.expected.0 * f64::from(times);
            ahead.longest.0 += own.longest.0 * f64::from(times);
            ahead.force_band = own.force_band;
        };
        // Every repeat but the first is the same.
        count(1, 1);
        if task.repeats > 1 {
            count(2, task.repeats - 1);
        }
        tasks.push(ahead);
    }
    for list in [&mut refusals, &mut notes, &mut to_acknowledge] {
        list.dedup();
    }
    if refusals.is_empty() {
        Ok(ProgrammeForecast { tasks, notes, to_acknowledge })
    } else {
        Err(ProgrammeError(refusals))
    }
}
