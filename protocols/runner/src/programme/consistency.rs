//! Contradictions in a programme whose parts are all valid by themselves, found before anything moves.

use super::document::ProgrammeTask;
use palpate_protocols::plans::{Plan, Step};
use std::collections::BTreeSet;

/// Why a task cannot do what it declares; `before` are the tasks ahead of it.
pub(super) fn find_contradictions(task: &ProgrammeTask, before: &[ProgrammeTask]) -> Vec<String> {
    let mut find_contradictions = Vec::new();
    let plan = task.plan(1, None);
    if task.calibrates && !plan.as_ref().is_some_and(has_weighing) {
        find_contradictions.push(format!(
            "calibrates = true needs readings under known masses, but protocol {} takes none; remove 'calibrates', or use the protocol load-cell-calibration",
            task.protocol.name
        ));
    }
    if let Some(model) = &task.validates {
        let fitted = before.iter().find(|one| one.name == model.task);
        if let Some(reason) = fitted.and_then(reason_unfitted) {
            find_contradictions.push(format!(
                "task '{}' under 'validates' has no fitted model, because {reason}; name a task with one ramp and hold",
                model.task
            ));
        }
        if let Some(reason) = reason_unfitted(task) {
            find_contradictions.push(format!(
                "this task cannot be compared with the model of task '{}', because {reason}; remove 'validates', or use a protocol with one ramp and hold",
                model.task
            ));
        }
    }
    find_contradictions
}

fn has_weighing(plan: &Plan) -> bool {
    let is_loaded = |step: &Step| matches!(step, Step::Weigh(weigh) if weigh.mass_g > 0.0);
    plan.steps.iter().any(|planned| is_loaded(&planned.step))
}

/// Why no session of a task is fitted, if so: the report fits sessions with one loading and no sine.
fn reason_unfitted(task: &ProgrammeTask) -> Option<String> {
    let name = &task.protocol.name;
    if task.calibrates {
        return Some(format!("task '{}' calibrates", task.name));
    }
    let plan = task.plan(1, None)?;
    let is_sine = |step: &Step| matches!(step, Step::Sine(_));
    let is_way_in = |step: &Step| matches!(step, Step::Ramp(_) | Step::LoadTo(_));
    if plan.steps.iter().any(|planned| is_sine(&planned.step)) {
        return Some(format!("its protocol {name} applies a sine"));
    }
    let ways_in = plan.steps.iter().filter(|one| is_way_in(&one.step));
    // Steps outside any loop belong to the first cycle.
    let cycles: BTreeSet<u32> = ways_in.map(|planned| planned.cycle.max(1)).collect();
    match cycles.len() {
        0 => Some(format!("its protocol {name} does not indent")),
        1 => None,
        count => Some(format!("its protocol {name} has {count} cycles instead of one")),
    }
}
